"""Generated domains, most with a known distance, for tests, benchmarks and notebooks.

Every function returns a `Mesh`, except `flat_torus`: the triangles are known by their edge lengths only.

Examples
--------
>>> import heat_igl
>>> heat_igl.shapes.torus(48, 32).report().euler_characteristic
0
>>> heat_igl.shapes.strip(4, 3).V[-1].tolist()
[4.0, 3.0, 0.0]
"""

from __future__ import annotations

import importlib.util
from itertools import permutations
from pathlib import Path

import igl
import numpy as np

from heat_igl.errors import is_number, shown
from heat_igl.intrinsic import IntrinsicTriangulation, from_edge_lengths
from heat_igl.mesh import Mesh, as_simplices
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = [
    "blob",
    "book",
    "box",
    "cone",
    "cylinder",
    "disk",
    "flat_torus",
    "grid",
    "icosphere",
    "lattice_faces",
    "strip",
    "torus",
    "with_slivers",
]

# An icosphere of more subdivisions has more half-edges than indices of 32 bits can count.
_MOST_SUBDIVISIONS = 12


def _at_least(name: str, value: int, least: int) -> int:
    if not is_number(value) or not np.isfinite(value) or value != int(value) or value < least:
        raise ValueError(f"{name} must be an integer of at least {least}, not {shown(value)}")
    return int(value)


def lattice_faces(rows: int, columns: int, wrap_rows: bool = False, wrap_columns: bool = False) -> IntArray:
    """Triangles of a lattice of vertices ``row * columns + column``; the diagonal of a cell joins (0, 1) to (1, 0).

    A lattice that wraps has a row (column) of cells between the last and the first row (column) of vertices.
    """
    i = np.arange(rows if wrap_rows else rows - 1)[:, None]
    j = np.arange(columns if wrap_columns else columns - 1)[None, :]
    below, right = (i + 1) % rows, (j + 1) % columns
    a, b = i * columns + j, i * columns + right
    c, d = below * columns + j, below * columns + right
    lower = np.stack([a, b, c], axis=-1).reshape(-1, 3)
    upper = np.stack([b, d, c], axis=-1).reshape(-1, 3)
    return np.concatenate([lower, upper])


def lattice_mesh(x: AnyArray, y: AnyArray, z: AnyArray | float = 0.0, **wraps: bool) -> Mesh:
    """The triangles of `lattice_faces` on coordinates (rows, columns), or on arrays that broadcast to these."""
    x, y, z = np.broadcast_arrays(x, y, z)
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), lattice_faces(*x.shape, **wraps))


def grid(n: int) -> Mesh:
    """The unit square with n by n cells of side 1 / n, the mesh of the paper's section 4.2.

    Vertex ``row * (n + 1) + column`` lies at (column / n, row / n, 0). Diagonals run from (0, 1) to (1, 0) of each
    cell, as in the paper. Distance is Euclidean.
    """
    steps = np.arange(_at_least("n", n, 1) + 1) / n
    return lattice_mesh(steps, steps[:, None])


def strip(length: int, width: int) -> Mesh:
    """A flat strip of unit cells, `length` long and `width` wide.

    Vertex ``row * (length + 1) + column`` lies at (column, row, 0). Distance is Euclidean.
    """
    length, width = _at_least("length", length, 1), _at_least("width", width, 1)
    return lattice_mesh(np.arange(length + 1), np.arange(width + 1)[:, None])


def disk(n: int) -> Mesh:
    """The unit disk: n rings of triangles around vertex 0, ring k with 6 k vertices. Distance is Euclidean."""
    n = _at_least("n", n, 1)
    points: list[FloatArray] = [np.zeros((1, 2))]
    faces: list[IntArray] = []
    inner = np.zeros(1, np.int64)
    for k in range(1, n + 1):
        angle = 2 * np.pi * np.arange(6 * k) / (6 * k)
        points.append(k / n * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        outer = inner[-1] + 1 + np.arange(6 * k)
        sector, step = np.divmod(np.arange(6 * k), k)
        # Each of the six sectors has k outer edges and k - 1 inner edges, with a zigzag between them.
        below = inner[(sector * (k - 1) + step) % len(inner)]
        faces.append(np.stack([below, outer, np.roll(outer, -1)], axis=1))
        zigzag = step < k - 1
        above = np.roll(outer, -1)[zigzag]
        following = inner[(sector * (k - 1) + step + 1)[zigzag] % len(inner)]
        faces.append(np.stack([below[zigzag], above, following], axis=1))
        inner = outer
    return Mesh(np.concatenate(points), np.concatenate(faces))


def icosphere(subdivisions: int) -> Mesh:
    """The unit sphere by subdivision of an icosahedron, with 10 * 4^subdivisions + 2 vertices.

    Distance on the sphere between positions p and q is the angle arccos(p . q); distance on the polyhedron is shorter
    by the order of h^2. For every vertex, the antipode is a vertex too.
    """
    V, F = igl.icosahedron()
    if _at_least("subdivisions", subdivisions, 0) > _MOST_SUBDIVISIONS:
        raise ValueError(
            f"subdivisions must be at most {_MOST_SUBDIVISIONS}, not {subdivisions}: each quadruples faces"
        )
    for _ in range(int(subdivisions)):
        V, F = igl.upsample(V, F, 1)
        V /= np.linalg.norm(V, axis=1, keepdims=True)
    return Mesh(V / np.linalg.norm(V, axis=1, keepdims=True), F)


def blob(subdivisions: int) -> Mesh:
    """A smooth closed surface with bumps and hollows: `icosphere` with each vertex moved along the radius.

    The radius in a direction (x, y, z) is 1 + 0.3 (sin 4x cos 3y + sin 3z).
    """
    sphere = icosphere(subdivisions)
    x, y, z = sphere.V.T
    return sphere.with_vertices((1 + 0.3 * (np.sin(4 * x) * np.cos(3 * y) + np.sin(3 * z)))[:, None] * sphere.V)


def cylinder(around: int, along: int, length: float = 2 * np.pi) -> Mesh:
    """An open cylinder of radius 1 about the z axis, `around` vertices per ring, `along` cells over the `length`.

    Vertex ``ring * around + k`` lies at the angle 2 pi k / around. Distance is Euclidean on the unrolled cylinder.
    """
    around, along = _at_least("around", around, 3), _at_least("along", along, 1)
    angle, height = 2 * np.pi * np.arange(around) / around, np.arange(along + 1) * (length / along)
    return lattice_mesh(np.cos(angle), np.sin(angle), height[:, None], wrap_columns=True)


def book(pages: int, n: int) -> Mesh:
    """Unit squares of n by n cells, the pages, that share an edge, the spine, on the z axis from 0 to 1.

    Vertex ``column * (n + 1) + row`` of page 0 lies at the height row / n and the distance column / n from the spine;
    the other pages follow with columns 1 to n. With three pages or more, more than two faces meet at the spine. Any two
    pages unfold to a rectangle: with r the distance from the spine and z the height, distance is
    ``hypot(r - r', z - z')`` on one page and ``hypot(r + r', z - z')`` between two.
    """
    pages, n = _at_least("pages", pages, 1), _at_least("n", n, 1)
    column, row = np.divmod(np.arange((n + 1) ** 2), n + 1)
    turned = 2 * np.pi * np.arange(pages)[:, None] / pages
    x, y = np.cos(turned) * column / n, np.sin(turned) * column / n
    V = np.stack([x, y, np.broadcast_to(row / n, x.shape)], axis=2)
    lattice, later = lattice_faces(n + 1, n + 1), np.arange(pages)[:, None, None] * n * (n + 1)
    F = np.where(lattice <= n, lattice, lattice + later)
    return Mesh(np.concatenate([V[0], V[1:, n + 1 :].reshape(-1, 3)]), F.reshape(-1, 3))


def cone(around: int, along: int, half_angle: float = np.pi / 6) -> Mesh:
    """A cone about the z axis, of slant height 1, with the apex, vertex 0, at the origin, open at the top.

    Vertex ``1 + ring * around + k`` lies at the slant height (ring + 1) / along and the angle 2 pi k / around. The
    unrolled cone is a sector of the angle 2 pi sin(half_angle). Distance is Euclidean in the sector, or the sum of the
    slant heights if the shortest path passes the apex.
    """
    around, along = _at_least("around", around, 3), _at_least("along", along, 1)
    ring, k = np.divmod(np.arange(around * along), around)
    slant, angle = (ring + 1) / along, 2 * np.pi * k / around
    radius = slant * np.sin(half_angle)
    V = np.stack([radius * np.cos(angle), radius * np.sin(angle), slant * np.cos(half_angle)], axis=1)
    first = np.arange(around)
    tip = np.stack([np.zeros(around, np.int64), 1 + first, 1 + (first + 1) % around], axis=1)
    side = 1 + lattice_faces(along, around, wrap_columns=True)[:, ::-1] if along > 1 else np.empty((0, 3), np.int64)
    return Mesh(np.concatenate([np.zeros((1, 3)), V]), np.concatenate([tip, side]))


def torus(around: int, along: int, tube: float = 0.4) -> Mesh:
    """A torus about the z axis: circles of radius `tube` (`around` vertices) along a circle of radius 1 (`along`)."""
    around, along = _at_least("around", around, 3), _at_least("along", along, 3)
    theta, psi = 2 * np.pi * np.arange(along)[:, None] / along, 2 * np.pi * np.arange(around) / around
    x, y = (1 + tube * np.cos(psi)) * [np.cos(theta), np.sin(theta)]
    mesh = lattice_mesh(x, y, tube * np.sin(psi), wrap_rows=True, wrap_columns=True)
    return Mesh(mesh.V, mesh.F[:, ::-1])


def flat_torus(n: int) -> IntrinsicTriangulation:
    """The unit square with opposite sides glued, n by n cells.

    Vertex ``row * n + column`` lies at (column / n, row / n). Distance is Euclidean, modulo 1 in each coordinate.
    """
    n = _at_least("n", n, 3)
    F = lattice_faces(n, n, wrap_rows=True, wrap_columns=True)
    lower = np.array([np.sqrt(2), 1, 1]) / n  # opposite the corners (0, 0), (0, 1), (1, 0) of a cell
    upper = np.array([1, np.sqrt(2), 1]) / n  # opposite (0, 1), (1, 1), (1, 0)
    lengths = np.concatenate([np.tile(lower, (n * n, 1)), np.tile(upper, (n * n, 1))])
    return from_edge_lengths(lengths, F, n * n)


def box(n: int, size: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    """A box of n by n by n cells, each cut into six tetrahedra around the diagonal (Kuhn). Distance is Euclidean.

    Vertex ``(layer * (n + 1) + row) * (n + 1) + column`` lies at (column, row, layer) * size / n.
    """
    n = _at_least("n", n, 1)
    side = n + 1
    corner = np.indices((side,) * 3)[::-1].reshape(3, -1).T * (np.asarray(size) / n)
    cell = np.indices((n,) * 3).reshape(3, -1).T
    stride = np.array([1, side, side**2])
    tetrahedra = []
    for order in permutations(range(3)):
        path = np.concatenate([[0], np.cumsum(stride[list(order)])])
        if np.linalg.det(np.eye(3)[list(order)]) < 0:
            path[[0, 1]] = path[[1, 0]]  # positive volume
        tetrahedra.append((cell @ stride)[:, None] + path)
    return Mesh(corner, np.concatenate(tetrahedra))


def with_slivers(mesh: Mesh, seed: int) -> Mesh:
    """The same surface with needles: up to a tenth of the edges split at 1e-4 of their length.

    The edges and their ends are drawn with `seed`. Vertices keep their numbers, and so their distances; those added
    follow them.
    """
    rng = np.random.default_rng(seed)
    around = np.split(np.argsort(mesh.facets.of_face, axis=None, kind="stable"), np.cumsum(mesh.facets.n_faces)[:-1])
    alive = np.ones(mesh.n_faces, bool)
    points: list[FloatArray] = []
    added: list[list[int]] = []
    for e in rng.permutation(len(mesh.edges))[: len(mesh.edges) // 10]:
        f, corner = np.divmod(around[e], 3)
        if alive[f].all():
            i, j = rng.permutation(mesh.edges[e])
            new = mesh.n_vertices + len(points)
            points.append(mesh.V[i] + 1e-4 * (mesh.V[j] - mesh.V[i]))
            alive[f] = False
            for w, a, b in mesh.F[f[:, None], (corner[:, None] + np.arange(3)) % 3]:
                added += [[w, a, new], [w, new, b]]
    return Mesh(np.concatenate([mesh.V, points]), np.concatenate([mesh.F[alive], added]))


def bunny_path() -> Path | None:
    """Path of the bunny in the pymeshlab wheel, or None without pymeshlab. pymeshlab is not imported."""
    found = importlib.util.find_spec("pymeshlab")
    for folder in (found.submodule_search_locations or []) if found else []:
        for path in (Path(folder, "tests/sample_meshes/bunny.obj"), Path(folder, "sample_meshes/bunny.obj")):
            if path.is_file():
                return path
    return None


def sample_mesh() -> Mesh:
    """A closed surface to try things on: the Stanford bunny, or without pymeshlab, which ships it, a generated shape.

    Returns
    -------
    Mesh
        Connected triangles, over 2500 vertices; without pymeshlab `blob`.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.sample_mesh()
    >>> report = mesh.report()
    >>> report.n_components, report.n_boundary_loops, mesh.n_vertices > 2500
    (1, 0, True)
    """
    path = bunny_path()
    return blob(4) if path is None else as_simplices(path)
