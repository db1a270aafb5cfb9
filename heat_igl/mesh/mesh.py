"""The mesh: validated once at the border, read-only afterwards.

libigl trusts its input (a face index out of range corrupts memory), so everything that reaches it passes here first.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, reduce
from itertools import combinations
from typing import TypeVar

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.mesh import connectivity
from heat_igl.runtime import RANGE_LIMIT
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["DELAUNAY_TOLERANCE", "RANGE_LIMIT", "Mesh", "MeshReport", "checked_positions"]

# An edge is flipped when the cotangents opposite it sum to less than this. Cocircular corners (every quad of a grid, a
# cylinder or a torus) sum to zero up to rounding; flipping those would change nothing but the bits, and a larger
# tolerance keeps the choice of diagonal the same when such a mesh is moved far from the origin (rounding 1e-9).
DELAUNAY_TOLERANCE = -1e-7

# Products of four lengths (areas by Heron's formula) must stay inside the double range.
_LARGEST_EXTENT = 1e60
_SMALLEST_EXTENT = 1e-60


# Cached properties of a mesh that do not depend on its positions.
_OF_THE_FACES = {"facets", "edges", "components", "referenced", "boundary"}

ArrayT = TypeVar("ArrayT", bound=AnyArray)


def _frozen(array: ArrayT) -> ArrayT:
    array.setflags(write=False)
    return array


def checked_positions(V: ArrayLike) -> FloatArray:
    """`V` as a new (n, 3) float64 array, or a `MeshError` that names the first position that is none."""
    try:
        array = np.asarray(V)
    except ValueError as error:
        raise MeshError(f"V must be an array of shape (n, 3): {error}") from None
    if array.dtype.kind not in "iuf":
        raise MeshError(f"V must hold real numbers, not {array.dtype}: pass an (n, 3) array of positions")
    if array.ndim != 2 or array.shape[1] != 3:
        remedy = "; append a zero column to planar positions" if array.ndim == 2 and array.shape[1] == 2 else ""
        raise MeshError(f"V must have shape (n, 3), but it has shape {array.shape}{remedy}")
    if not len(array):
        raise MeshError("V is empty: a mesh needs vertices")
    with np.errstate(over="ignore"):
        positions = np.array(array, dtype=np.float64, order="C", copy=True)
    bad = ~np.isfinite(positions)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise MeshError(
            f"V[{row}, {column}] is {positions[row, column]} ({int(bad.any(axis=1).sum())} of {len(positions)} "
            "vertices are not finite): remove or repair these vertices"
        )
    return positions


def checked_faces(F: ArrayLike, n: int | None) -> IntArray:
    """`F` as an array of its own: indices of `n` vertices, of as many as it names if that is None.

    Raises
    ------
    MeshError
        As for `Mesh`.
    """
    try:
        array = np.asarray(F)
    except ValueError as error:
        raise MeshError(f"F must be an array of shape (m, 3) or (m, 4): {error}") from None
    if array.size == 0:
        raise MeshError("F is empty: a mesh needs triangles (m, 3) or tetrahedra (m, 4)")
    if array.dtype.kind not in "iu":
        raise MeshError(
            f"F must hold integers, not {array.dtype}: vertex indices are 0-based; convert with F.astype(int)"
        )
    if array.ndim != 2 or array.shape[1] not in (3, 4):
        raise MeshError(
            f"F must have shape (m, 3) for triangles or (m, 4) for tetrahedra, but it has shape {array.shape}"
        )
    n = int(array.max()) + 1 if n is None else n
    outside = (array < 0) | (array >= n)
    if outside.any():
        row, column = (int(i) for i in np.argwhere(outside)[0])
        hint = "; the indices look 1-based, subtract 1" if array.min() == 1 and array.max() == n else ""
        raise MeshError(
            f"F[{row}, {column}] = {array[row, column]} is no vertex ({int(outside.any(axis=1).sum())} of {len(array)} "
            f"faces are affected): there are {n} vertices, so indices run from 0 to {n - 1}{hint}"
        )
    faces = np.array(array, dtype=np.int64, order="C", copy=True)
    repeats = np.zeros(len(faces), bool)
    for one, other in combinations(faces.T, 2):
        repeats |= one == other
    if repeats.any():
        row = int(np.flatnonzero(repeats)[0])
        raise MeshError(
            f"F[{row}] = {faces[row].tolist()} repeats a vertex ({int(repeats.sum())} of {len(faces)} faces do): "
            "remove these faces, they have no area"
        )
    return faces


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """A triangle mesh in space, or a tetrahedral mesh.

    Parameters
    ----------
    V : (n, 3) array_like of real numbers
        Vertex positions, in any unit of length; copied to float64.
    F : (m, 3) or (m, 4) array_like of integers
        Vertex indices of each triangle or tetrahedron, counted from 0; copied to int64. "Face" stands for
        both kinds throughout the package.

    Raises
    ------
    MeshError
        If an array has the wrong shape or type, is empty, holds a position that is not finite, an index that is no
        vertex, or a face that repeats a vertex. The message names the first offender and how many there are.

    Notes
    -----
    Both arrays are read-only, so that a solver made from the mesh cannot come to disagree with it. Meshes that are
    merely bad (not manifold, slivers, zero areas, duplicated faces, unreferenced vertices) are accepted;
    `report` lists what is wrong with them.
    """

    V: FloatArray
    F: IntArray

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        positions = checked_positions(V)
        faces = checked_faces(F, len(positions))
        faces.setflags(write=False)
        self._hold(positions, faces)

    def _hold(self, positions: FloatArray, faces: IntArray) -> None:
        is_used = np.zeros(len(positions), bool)
        is_used[faces] = True
        used = positions[is_used]
        with np.errstate(over="ignore"):
            extent = float(np.linalg.norm(used.max(axis=0) - used.min(axis=0)))
        if extent == 0:
            raise MeshError("all vertices in V that F uses lie in one point: there is no distance to measure")
        if not _SMALLEST_EXTENT < extent < _LARGEST_EXTENT:
            raise MeshError(f"V spans {extent:.3g} units, outside what areas in double precision allow: rescale V")
        positions.setflags(write=False)
        object.__setattr__(self, "V", positions)
        object.__setattr__(self, "F", faces)

    def with_vertices(self, V: ArrayLike) -> Mesh:
        """The same faces on other positions; whatever the faces alone say is shared and not found again.

        Parameters
        ----------
        V : (n, 3) array_like
            New positions of all vertices; copied to float64.

        Raises
        ------
        MeshError
            If V cannot be positions, or are not as many as the mesh has vertices.
        """
        positions = checked_positions(V)
        if len(positions) != self.n_vertices:
            raise MeshError(f"V has {len(positions)} rows, but the mesh has {self.n_vertices} vertices")
        moved = object.__new__(Mesh)
        moved._hold(positions, self.F)
        for name in _OF_THE_FACES & self.__dict__.keys():
            moved.__dict__[name] = self.__dict__[name]
        return moved

    def __repr__(self) -> str:
        kind = "tetrahedra" if self.is_tetrahedral else "triangles"
        return f"Mesh({self.n_vertices} vertices, {self.n_faces} {kind})"

    def __reduce__(self) -> tuple[type[Mesh], tuple[FloatArray, IntArray]]:
        return Mesh, (self.V, self.F)

    @property
    def n_vertices(self) -> int:
        """Number of vertices n."""
        return len(self.V)

    @property
    def n_faces(self) -> int:
        """Number of triangles or tetrahedra m."""
        return len(self.F)

    @property
    def is_tetrahedral(self) -> bool:
        """Whether the faces are tetrahedra."""
        return bool(self.F.shape[1] == 4)

    @cached_property
    def facets(self) -> connectivity.Facets:
        """The distinct edges of triangles, or triangles of tetrahedra, and the faces that hold them."""
        return connectivity.facets(self.F, self.n_vertices)

    @cached_property
    def edges(self) -> IntArray:
        """The distinct edges (k, 2), each ascending."""
        if not self.is_tetrahedral:
            return self.facets.vertices
        return _frozen(connectivity.edges(self.F, self.n_vertices))

    @cached_property
    def edge_lengths(self) -> FloatArray:
        """The length (k,) of each of `edges`, in the mesh's unit."""
        along = self.V[self.edges[:, 0]] - self.V[self.edges[:, 1]]
        return _frozen(np.sqrt(np.einsum("kx,kx->k", along, along)))

    @cached_property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex; a vertex that no face uses is a component of its own."""
        return _frozen(connectivity.connected_components(self.F, self.n_vertices))

    @cached_property
    def referenced(self) -> BoolArray:
        """Which vertices (n,) belong to a face."""
        mask = np.zeros(self.n_vertices, bool)
        mask[self.F] = True
        return _frozen(mask)

    @cached_property
    def boundary(self) -> BoolArray:
        """Which vertices (n,) lie on the boundary: on an edge (a triangle, for tetrahedra) of only one face."""
        mask = np.zeros(self.n_vertices, bool)
        mask[self.facets.vertices[self.facets.n_faces == 1]] = True
        return _frozen(mask)

    @cached_property
    def measures(self) -> FloatArray:
        """The area of each triangle or volume of each tetrahedron (m,), never negative."""
        if self.is_tetrahedral:
            return _frozen(np.abs(igl.volume(self.V, self.F)))
        return _frozen(igl.doublearea(self.V, self.F) / 2)

    @cached_property
    def longest_distance(self) -> float:
        """Length of a longest shortest path along edges, over all components; see `connectivity.longest_path`."""
        n = self.n_vertices
        graph = sp.csr_array((self.edge_lengths, tuple(self.edges.T)), shape=(n, n))
        return connectivity.longest_path(graph, self.components)

    def report(self) -> MeshReport:
        """Everything about the mesh that bears on a distance computed on it.

        Returns
        -------
        MeshReport
            Prints as a table; fields that list offenders hold their indices.
        """
        return _report(self)


@dataclass(frozen=True)
class MeshReport:
    """What `Mesh.report` finds. Lengths are in the mesh's unit; lists of offenders are index arrays.

    Attributes
    ----------
    n_vertices, n_faces, n_edges : int
        Counts; faces are triangles or tetrahedra.
    n_components : int
        Components that hold faces.
    n_boundary_loops : int
        Closed curves (patches, for tetrahedra) of boundary.
    euler_characteristic : int
        Alternating sum of the numbers of simplices, unreferenced vertices left out.
    nonmanifold_edges : (k, 2) int64
        Edges of more than two triangles (for tetrahedra: triangles (k, 3) of more than two tetrahedra).
    nonmanifold_vertices : (k,) int64
        Vertices whose faces are not one fan (triangle meshes; empty for tetrahedra).
    degenerate_faces : (k,) int64
        Faces whose area or volume is zero to rounding: at most 1e-12 of the square (cube) of their longest edge.
    duplicate_faces : (k,) int64
        Faces with the vertices of an earlier one.
    unreferenced_vertices : (k,) int64
        Vertices that no face uses; every distance there is ``inf``.
    shortest_edge, mean_edge, longest_edge : float
        Over the distinct edges.
    smallest_angle, largest_angle : float
        Of all triangles, in degrees.
    is_intrinsic_delaunay : bool or None
        Whether no edge would be flipped by the intrinsic Delaunay triangulation; None for tetrahedra.
    edges_across : float
        `Mesh.longest_distance` in mean edge lengths.
    range_limit : float
        The number of edges across up to which the heat of the default time step t = h^2 stays inside the double
        range; beyond it the solver raises t.
    """

    n_vertices: int
    n_faces: int
    n_edges: int
    n_components: int
    n_boundary_loops: int
    euler_characteristic: int
    nonmanifold_edges: IntArray
    nonmanifold_vertices: IntArray
    degenerate_faces: IntArray
    duplicate_faces: IntArray
    unreferenced_vertices: IntArray
    shortest_edge: float
    mean_edge: float
    longest_edge: float
    smallest_angle: float
    largest_angle: float
    is_intrinsic_delaunay: bool | None
    edges_across: float
    range_limit: float

    def rows(self) -> list[tuple[str, str]]:
        """The report as (name, value) pairs for printing; long lists of offenders are cut."""
        return [(field.name.replace("_", " "), _shown(getattr(self, field.name))) for field in fields(self)]

    def __str__(self) -> str:
        rows = self.rows()
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name:{width}}  {value}" for name, value in rows)


def _shown(value: object) -> str:
    if isinstance(value, np.ndarray):
        head = ", ".join(str(row.tolist()) for row in value[:5])
        return f"{len(value)}" + (f": {head}" if head else "") + (", ..." if len(value) > 5 else "")
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "-" if value is None else str(value)


def _cotangents_and_angles(V: FloatArray, F: IntArray) -> tuple[FloatArray, FloatArray]:
    """Cotangent and angle (3, m) at each corner of triangles; 0 is the angle at a corner without a side."""
    dot = np.zeros((3, len(F)))
    for x in V.T:
        a, b, c = x[F.T]
        ab, bc, ca = b - a, c - b, a - c
        dot -= ca * ab, ab * bc, bc * ca
    cross = igl.doublearea(V, F)
    with np.errstate(divide="ignore", invalid="ignore"):
        return dot / cross, np.arctan2(cross, dot)


def _is_delaunay(found: connectivity.Facets, cotangents: FloatArray) -> bool:
    total = np.bincount(found.of_face.T.ravel(), weights=cotangents.ravel())
    return not (total[found.n_faces == 2] < DELAUNAY_TOLERANCE).any()


def _report(mesh: Mesh) -> MeshReport:
    n, F = mesh.n_vertices, mesh.F
    found = mesh.facets
    triangles = found.vertices if mesh.is_tetrahedral else F
    cotangents, angles = _cotangents_and_angles(mesh.V, triangles)
    sides = igl.edge_lengths(mesh.V, F) if mesh.is_tetrahedral else mesh.edge_lengths[found.of_face]
    longest = reduce(np.maximum, sides.T)
    n_unreferenced = int((~mesh.referenced).sum())
    cells = len(found.vertices) - len(F) if mesh.is_tetrahedral else len(F)
    mean_edge = float(mesh.edge_lengths.mean())
    return MeshReport(
        n_vertices=n,
        n_faces=len(F),
        n_edges=len(mesh.edges),
        n_components=int(mesh.components.max()) + 1 - n_unreferenced,
        n_boundary_loops=connectivity.boundary_loops(found, n),
        euler_characteristic=n - n_unreferenced - len(mesh.edges) + cells,
        nonmanifold_edges=found.vertices[found.n_faces > 2],
        nonmanifold_vertices=np.empty(0, np.int64)
        if mesh.is_tetrahedral
        else connectivity.nonmanifold_vertices(F, found, n),
        degenerate_faces=np.flatnonzero(mesh.measures <= 1e-12 * longest ** (F.shape[1] - 1)),
        duplicate_faces=connectivity.duplicate_faces(F, n),
        unreferenced_vertices=np.flatnonzero(~mesh.referenced),
        shortest_edge=float(mesh.edge_lengths.min()),
        mean_edge=mean_edge,
        longest_edge=float(mesh.edge_lengths.max()),
        smallest_angle=float(np.degrees(angles.min())),
        largest_angle=float(np.degrees(angles.max())),
        is_intrinsic_delaunay=None if mesh.is_tetrahedral else _is_delaunay(found, cotangents),
        edges_across=mesh.longest_distance / mean_edge,
        range_limit=RANGE_LIMIT,
    )
