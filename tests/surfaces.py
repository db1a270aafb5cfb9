"""Meshes that several tests measure on, besides those of `heat_igl.shapes`, and distances on any of them."""

from itertools import pairwise

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph
from conftest import perturbed

from heat_igl import Mesh, PolygonMesh, SurfaceCurve, shapes
from heat_igl.sources import Sources, SourceSet, source_set
from heat_igl.typing import ArrayLike, FloatArray
from heat_igl.validation.construction import dual, hull, joined, merged, on_sphere, planar, ring


def twice(mesh: Mesh, apart: float | np.ndarray = 5.0) -> Mesh:
    """A mesh and its copy so far away, as components of one."""
    return joined(mesh, Mesh(mesh.V + apart, mesh.F))


def on(mesh: Mesh, sources: Sources) -> SourceSet:
    """Sources, checked, on the triangles of a mesh."""
    return source_set(sources, mesh.n_vertices, mesh.F)


def nearest_vertex(mesh: Mesh, place: ArrayLike) -> int:
    return int(np.linalg.norm(mesh.V - place, axis=1).argmin())


def arcs(V: np.ndarray, source: int) -> np.ndarray:
    """Distance on the unit sphere (n,) between points of it."""
    return 2 * np.arcsin(np.clip(np.linalg.norm(V - V[source], axis=1) / 2, 0, 1))


def on_pages(V: np.ndarray, source: int) -> np.ndarray:
    """Distance (n,) on flat pages at the z axis, any two of which unfold to a convex domain."""
    r, angle = np.hypot(V[:, 0], V[:, 1]), np.arctan2(V[:, 1], V[:, 0])
    is_same = (np.abs(np.exp(1j * angle) - np.exp(1j * angle[source])) < 1e-5) | (r < 1e-9) | (r[source] < 1e-9)
    return np.hypot(np.where(is_same, r - r[source], r + r[source]), V[:, 2] - V[source, 2])


def bumpy(subdivisions: int = 3) -> Mesh:
    """A sphere with curvature of both signs, and no symmetry."""
    return perturbed(shapes.icosphere(subdivisions), 0.3, 1)


def pressed(height: float) -> Mesh:
    """An ellipsoid whose triangles are far from Delaunay."""
    return Mesh(perturbed(shapes.icosphere(3), 0.3).V * [1.0, 0.6, height], shapes.icosphere(3).F)


def points_of_sphere(n: int, seed: int = 0) -> np.ndarray:
    return on_sphere(n, np.random.default_rng(seed))


def points_of_moebius_strip(turn: np.ndarray, side: np.ndarray) -> np.ndarray:
    """At the angle `turn` around the axis, by `side` across."""
    out = 1 + side * np.cos(turn / 2)
    return np.stack([out * np.cos(turn), out * np.sin(turn), side * np.sin(turn / 2)], axis=-1)


def angle_between(a: np.ndarray, b: np.ndarray | float = 0.0) -> np.ndarray:
    """How far angles are from others, or from 0, up to whole turns."""
    return np.abs(np.angle(np.exp(1j * (a - b))))


def square(n: int = 20) -> tuple[Mesh, np.ndarray]:
    """The unit square and the distance from its left side."""
    mesh = shapes.grid(n)
    return mesh, mesh.V[:, 0]


def skin(V: np.ndarray, T: np.ndarray) -> Mesh:
    """The surface of tetrahedra, counter-clockwise seen from outside if they are."""
    used, F = np.unique(igl.boundary_facets(T)[0], return_inverse=True)
    return Mesh(V[used], F.reshape(-1, 3))


def box_surface(n: int, size: tuple[float, float, float] = (1, 1, 1)) -> Mesh:
    """The surface of a box, each side a grid of squares, counter-clockwise seen from outside."""
    solid = shapes.box(n, size)
    return skin(solid.V, solid.F)


def quads(n: int, bend: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A sheet of n by n quadrilaterals of side 1, flat or bent so that none of them is planar."""
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    first = np.flatnonzero((x < n) & (y < n))
    V = np.stack([x, y, bend * np.sin(x * y)], axis=1)
    return V, np.stack([first, first + 1, first + n + 2, first + n + 1], axis=1)


def two_arms(n: int) -> Mesh:
    """A flat square without one quadrant: paths from its one arm into the other bend at the inner corner, (0, 0)."""
    mesh = shapes.grid(2 * n)
    V = mesh.V - 0.5 * mesh.V.max(axis=0)
    x, y, _ = V[mesh.F].mean(axis=1).T
    return Mesh(V, mesh.F[(x < 0) | (y < 0)])


def folded_torus(n: int) -> Mesh:
    """The flat torus of circumference 1, folded flat twice: lengths along the surface are not changed by folds."""
    along = np.minimum(np.arange(n), n - np.arange(n)) / n
    x, y = np.meshgrid(along, along, indexing="ij")
    return Mesh(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), shapes.lattice_faces(n, n, True, True))


def rough_field(seed: int) -> Mesh:
    rng = np.random.default_rng(seed)
    P = rng.random((rng.integers(8, 60), 2))
    return planar(P, rng.normal(size=len(P)) * 0.3)


def rough_star(seed: int) -> Mesh:
    rng = np.random.default_rng(seed)
    ball = hull(on_sphere(int(rng.integers(8, 50)), rng))
    return Mesh(ball.V * np.exp(rng.normal(size=(ball.n_vertices, 1)) * 0.4), ball.F)


def random_disk(n: int, seed: int) -> Mesh:
    """A Delaunay triangulation of random points in the unit disk, boundary points on the circle."""
    rng = np.random.default_rng(seed)
    radius, angle = 0.97 * np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return planar(np.concatenate([points, ring(int(4 * np.sqrt(n)))]))


def sheared(mesh: Mesh, shear: float) -> Mesh:
    """Still flat and convex, but most faces are not those of its Delaunay triangulation."""
    return Mesh(mesh.V + shear * mesh.V[:, 1:2] * [1, 0, 0], mesh.F)


def with_point(mesh: Mesh, face: int, barycentric: np.ndarray) -> Mesh:
    """The same surface with a vertex, the last one, inside a face."""
    corners, n = mesh.F[face], mesh.n_vertices
    fan = [[corners[c], corners[(c + 1) % 3], n] for c in range(3)]
    return Mesh(
        np.concatenate([mesh.V, [barycentric @ mesh.V[corners]]]), np.concatenate([np.delete(mesh.F, face, 0), fan])
    )


def moebius_strip(around: int, across: int, half_width: float = 0.4) -> Mesh:
    """A strip that cannot be oriented, of `around` by `across` cells."""
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    s = np.linspace(-half_width, half_width, across + 1)
    V = points_of_moebius_strip(t[:, None], s)
    F, n = shapes.lattice_faces(around + 1, across + 1)[:, ::-1], around * (across + 1)
    return Mesh(V.reshape(-1, 3), np.where(n > F, F, n + across - F))


def bent_pages() -> Mesh:
    """Three pages at one edge, each of them bent."""
    page = shapes.grid(6)
    x, y, _ = page.V.T
    turned = (np.column_stack([x * np.cos(a), x * np.sin(a), y]) for a in (0.0, 2.0, 4.0))
    return merged(joined(*(Mesh(V, page.F) for V in turned)))


def dual_of_sphere(subdivisions: int) -> PolygonMesh:
    """Hexagons and twelve pentagons, their vertices on the unit sphere."""
    mesh = dual(shapes.icosphere(subdivisions))
    return PolygonMesh(mesh.V / np.linalg.norm(mesh.V, axis=1, keepdims=True), mesh.polygons)


def assert_connected(mesh: Mesh, *curves: SurfaceCurve, within: float = 1e-12) -> None:
    """Each segment begins where the one before it ends, the first of a closed curve at its end."""
    for curve in curves:
        starts = np.einsum("kc,kcx->kx", curve.start, mesh.V[mesh.F[curve.faces]])
        before = np.roll(curve.positions(mesh)[1:], 1, axis=0)
        first = 0 if curve.is_closed else 1
        np.testing.assert_allclose(before[first:], starts[first:], atol=within * np.ptp(mesh.V))


def to_polyline(P: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Distance of points from a polyline in their plane."""
    nearest = np.full(len(P), np.inf)
    for start, end in pairwise(corners):
        along = end - start
        share = np.clip((P - start) @ along / max(along @ along, 1e-300), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(P - start - share[:, None] * along, axis=1))
    return nearest


# Places in a face, for points as sources and targets.
COORDINATES = {
    "inside": (0.2, 0.5, 0.3),
    "on a side": (0.3, 0.0, 0.7),
    "nearly on a side": (1e-13, 0.4, 0.6 - 1e-13),
    "at a corner": (0.0, 1.0, 0.0),
}


def graph_distance(mesh: Mesh, sources: ArrayLike, points: int, speed: FloatArray | None = None) -> FloatArray:
    """Lengths (k, n) of shortest paths in the graph whose edges hold `points` points each, evenly spaced.

    With a speed on each face, travel times; an edge has the larger speed of its faces.
    """
    # Of faces with the same vertices one will do; of an arc that is listed twice, the lengths would be summed.
    once = np.delete(np.arange(mesh.n_faces), mesh.report().duplicate_faces)
    tail, head = mesh.edges.T
    share = np.arange(1, points + 1)[:, None] / (points + 1)
    inside = (1 - share) * mesh.V[tail, None] + share * mesh.V[head, None]
    nodes = np.concatenate([mesh.V, inside.reshape(-1, 3)])
    # Node numbers: vertices, then the points of edge 0 from the lower to the higher vertex, of edge 1, and so on.
    on_edge = mesh.n_vertices + np.arange(len(tail) * points).reshape(-1, points)

    along = np.column_stack([tail, on_edge, head])
    ends = [along[:, :-1].ravel()], [along[:, 1:].ravel()]
    speed = np.ones(mesh.n_faces) if speed is None else speed
    of_edge = np.zeros(len(tail))
    np.maximum.at(of_edge, mesh.facets.of_face, speed[:, None])
    speeds = [np.repeat(of_edge, points + 1)]
    for corner in range(3):
        opposite, following = (on_edge[mesh.facets.of_face[once, (corner + k) % 3]] for k in (0, 1))
        across = np.column_stack([mesh.F[once, corner], following])
        ends[0].append(np.repeat(across, points, axis=1).ravel())
        ends[1].append(np.tile(opposite, points + 1).ravel())
        speeds.append(np.repeat(speed[once], points * (points + 1)))
    i, j = (np.concatenate(end) for end in ends)
    # Vertices in one place are joined all the same; an arc of length 0 would be none.
    lengths = np.maximum(np.linalg.norm(nodes[i] - nodes[j], axis=1), 1e-300) / np.concatenate(speeds)
    graph = sp.csr_array((lengths, (i, j)), shape=(len(nodes), len(nodes)))
    distance: FloatArray = csgraph.dijkstra(graph, directed=False, indices=np.atleast_1d(sources))
    return distance[:, : mesh.n_vertices]
