"""Meshes of triangles or tetrahedra, validated on construction and read-only afterwards.

libigl trusts the input: a face index out of range corrupts memory. So every array is validated before libigl sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import combinations
from typing import TypeVar

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning, MeshError, as_array, raise_at_first
from heat_igl.mesh import connectivity
from heat_igl.mesh.report import MeshReport, mesh_report
from heat_igl.mesh.triangulation import triangulated
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# Heron's formula multiplies four lengths, and the product must stay inside the double range.
_LARGEST_EXTENT = 1e60
_SMALLEST_EXTENT = 1e-60

# Cached properties of a mesh that do not depend on positions.
_OF_THE_FACES = {"facets", "edges", "components", "referenced", "boundary", "crossed_polygons", "originals"}

ArrayT = TypeVar("ArrayT", bound=AnyArray)

# Elements whose neighbours are looked at: with 4 to 128, 81 grids of quadrilaterals and 102 sets of tetrahedra are told
# apart. And the corners of the sides and diagonals of a quadrilateral.
_SAMPLE = 32
_SIDES_AND_DIAGONALS = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [0, 2], [1, 3]])
# Volume over that of a regular tetrahedron with the same longest edge. A square that is folded along its diagonal, by
# any angle, has at most 0.354, the corner of a cube 0.5.
_THIN = 0.4
# The same for elements that are planar but for rounding.
_FLAT = 1e-10


def _frozen(array: ArrayT) -> ArrayT:
    array.setflags(write=False)
    return array


def checked_positions(V: ArrayLike) -> FloatArray:
    """`V`, of shape (n, 3), or (n, 2) in the plane z = 0, as a new (n, 3) float64 array; errors are those of `Mesh`."""
    array = as_array("V", V, MeshError)
    if array.dtype.kind not in "iuf":
        raise MeshError(f"V must hold real numbers, not {array.dtype}: pass an (n, 3) array of positions")
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise MeshError(f"V must have shape (n, 3), or (n, 2) in the plane, but it has shape {array.shape}")
    if not len(array):
        raise MeshError("V is empty: a mesh needs vertices")
    with np.errstate(over="ignore"):
        positions = np.zeros((len(array), 3))
        positions[:, : array.shape[1]] = array
    remedy = "remove or repair these vertices"
    raise_at_first(~np.isfinite(positions), "V", positions, "must be finite", remedy, MeshError)
    return positions


def checked_faces(F: ArrayLike, n: int | None, *, may_repeat: bool = False) -> IntArray:
    """`F` as a new (m, 3) or (m, 4) int64 array of indices below `n`; without `n`, of any indices.

    With `may_repeat`, a face may have the same vertex at two corners. Errors are those of `Mesh`.
    """
    try:
        array = np.asarray(F)
    except ValueError:
        raise MeshError(
            "F must be an array of shape (m, 3) or (m, 4), but rows differ in length: PolygonMesh takes polygons"
        ) from None
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
    faces = np.array(array, dtype=np.int64, order="C", copy=True)
    if faces.min() < 0 or faces.max() >= n:
        outside = (array < 0) | (array >= n)
        row, column = (int(i) for i in np.argwhere(outside)[0])
        hint = "; the indices look 1-based, subtract 1" if array.min() == 1 and array.max() == n else ""
        raise MeshError(
            f"F[{row}, {column}] = {array[row, column]} is no vertex ({int(outside.any(axis=1).sum())} of {len(array)} "
            f"faces are affected): there are {n} vertices, so indices run from 0 to {n - 1}{hint}"
        )
    repeats = reduce(np.logical_or, (one == other for one, other in combinations(faces.T, 2)))
    if repeats.any() and not may_repeat:
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
    V : (n, 3) or (n, 2) array_like of real numbers
        Vertex positions, in any unit of length; copied to float64. Two columns are x and y in the plane z = 0.
    F : (m, 3) or (m, 4) array_like of integers
        Vertex indices of each triangle or tetrahedron, counted from 0; copied to int64. "Face" stands for
        both kinds throughout the package.

    Raises
    ------
    MeshError
        If an array has the wrong shape or type or is empty, if a position is not finite, an index is out of range or a
        face repeats a vertex. The message names the first offender and counts them. Also if faces of four vertices are
        quadrilaterals rather than tetrahedra, which `PolygonMesh` takes.

    Notes
    -----
    Both arrays are read-only, so a solver made from the mesh always agrees with it. Meshes with defects (not manifold,
    slivers, zero areas, duplicate faces, unreferenced vertices) are accepted; `report` lists the defects.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.Mesh([[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> mesh
    Mesh(4 vertices, 2 triangles)
    >>> float(mesh.measures.sum())  # the area
    12.0
    >>> float(mesh.edge_lengths.max())
    5.0
    """

    V: FloatArray
    F: IntArray

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        positions = checked_positions(V)
        faces = checked_faces(F, len(positions))
        faces.setflags(write=False)
        self._hold(positions, faces)
        quadrilateral = first_quadrilateral(positions, faces) if faces.shape[1] == 4 else None
        if quadrilateral is not None:
            raise MeshError(
                f"F has 4 columns, which stands for tetrahedra, but F[{quadrilateral}] = "
                f"{faces[quadrilateral].tolist()} is a quadrilateral: pass PolygonMesh(V, F), or triangles"
            )

    def _hold(self, positions: FloatArray, faces: IntArray) -> None:
        positions.setflags(write=False)
        vars(self).update(V=positions, F=faces)
        used = positions if self.referenced.all() else positions[self.referenced]
        # By columns, which takes a tenth of the time.
        with np.errstate(over="ignore"):
            extent = float(np.linalg.norm([np.ptp(column) for column in used.T]))
        if extent == 0:
            raise MeshError("all vertices in V that F uses lie in one point: there is no distance to measure")
        if not _SMALLEST_EXTENT < extent < _LARGEST_EXTENT:
            raise MeshError(f"V spans {extent:.3g} units, outside what areas in double precision allow: rescale V")

    def with_vertices(self, V: ArrayLike) -> Mesh:
        """The same faces on other positions; properties of the faces alone are shared, not computed again.

        Parameters
        ----------
        V : (n, 3) or (n, 2) array_like
            New positions of all vertices, as for `Mesh`; copied to float64.

        Raises
        ------
        MeshError
            If V is no array of positions, or has another length than the mesh has vertices.
        """
        positions = checked_positions(V)
        if len(positions) != self.n_vertices:
            raise MeshError(f"V has {len(positions)} rows, but the mesh has {self.n_vertices} vertices")
        moved = object.__new__(Mesh)
        for name in _OF_THE_FACES & self.__dict__.keys():
            moved.__dict__[name] = self.__dict__[name]
        moved._hold(positions, self.F)
        return moved

    def halved(self) -> Mesh:
        """The mesh with four triangles or eight tetrahedra for each, cut at the middles of edges.

        Vertices keep their numbers, the middles follow. Face f has the parts f, f + m, f + 2 m, and so on.

        Examples
        --------
        >>> import heat_igl
        >>> heat_igl.shapes.box(1).halved()
        Mesh(27 vertices, 48 tetrahedra)
        """
        ends, middle = connectivity.edge_middles(self.F, self.n_vertices)
        corners = np.concatenate([self.F, self.n_vertices + middle.reshape(self.n_faces, -1)], axis=1)
        V = np.concatenate([self.V, self.V[ends].mean(axis=1)])
        finer = Mesh(V, np.concatenate([corners[:, part] for part in connectivity.PARTS[self.F.shape[1]]]))
        return finer.with_originals(np.append(self.originals, np.arange(self.n_vertices, len(V))))

    def __repr__(self) -> str:
        kind = "tetrahedra" if self.is_tetrahedral else "triangles"
        return f"Mesh({self.n_vertices} vertices, {self.n_faces} {kind})"

    def __reduce__(self) -> tuple[type[Mesh], tuple[FloatArray, IntArray], dict[str, IntArray]]:
        return Mesh, (self.V, self.F), {"crossed_polygons": self.crossed_polygons, "originals": self.originals}

    def with_originals(self, originals: IntArray) -> Mesh:
        """The mesh itself, just made, with `originals`: faces hold no vertex that is a copy of another."""
        self.__dict__["originals"] = _frozen(originals)
        return self

    @property
    def vertices(self) -> FloatArray:
        """A copy of `V` that may be written to, for libraries that take no read-only arrays."""
        return self.V.copy()

    @property
    def faces(self) -> IntArray:
        """A copy of `F` that may be written to, for libraries that take no read-only arrays."""
        return self.F.copy()

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

    @classmethod
    def of_polygons(cls, V: ArrayLike, corners: IntArray, degree: IntArray, shown: Callable[[int], str]) -> Mesh:
        """A mesh of the triangles into which `triangulated` cuts polygons with the positions V (n, 3).

        `corners` (sum of degree,) int64 are the vertices of all polygons, one polygon after the other, and `degree`
        (m,) int64 is the number of corners of each. Warns if sides of a polygon cross each other, with the name that
        `shown` has for the first of these polygons; all are in `crossed_polygons`.
        """
        positions = np.asarray(V, np.float64)
        with np.errstate(over="ignore", invalid="ignore"):  # `Mesh` refuses such positions by name
            F, crossed = triangulated(positions, corners, degree)
        mesh = cls(positions, F)
        mesh.__dict__["crossed_polygons"] = _frozen(crossed)
        if len(crossed):
            warn_caller(
                f"{shown(int(crossed[0]))}: sides of this polygon cross each other ({len(crossed)} of {len(degree)} "
                "polygons are like this), so it has no inside, and distance is measured on the triangles around its "
                "first corner: give its corners in order around it, or split it",
                AccuracyWarning,
            )
        return mesh

    @cached_property
    def crossed_polygons(self) -> IntArray:
        """Polygons (k,) that the triangles were cut from and whose sides cross each other; see `PolygonMesh`."""
        return _frozen(np.empty(0, np.int64))

    @cached_property
    def originals(self) -> IntArray:
        """The vertex (n,) whose values each takes: its own number, or, of merged seams and equal points, the first.

        Faces hold first ones only. Sources may be any.
        """
        return _frozen(np.arange(self.n_vertices))

    @property
    def has_copies(self) -> bool:
        """Whether some vertices take the values of others: seams that were merged, or equal points of a cloud."""
        return bool((self.originals != np.arange(self.n_vertices)).any())

    @cached_property
    def facets(self) -> connectivity.Facets:
        """The distinct edges of triangles, or triangles of tetrahedra, and the faces that hold them."""
        return connectivity.facets(self.F, self.n_vertices)

    @cached_property
    def edges(self) -> IntArray:
        """The distinct edges (k, 2), each ascending."""
        if not self.is_tetrahedral:
            return self.facets.vertices
        return _frozen(connectivity.edge_middles(self.F, self.n_vertices)[0])

    @cached_property
    def edge_lengths(self) -> FloatArray:
        """The length (k,) of each of `edges`, in the mesh's unit."""
        along = self.V[self.edges[:, 0]] - self.V[self.edges[:, 1]]
        return _frozen(np.sqrt(np.einsum("kx,kx->k", along, along)))

    @property
    def edge_graph(self) -> sp.csr_array:
        """The edge lengths as a graph (n, n), each edge once, from the smaller vertex to the larger; not cached."""
        return sp.csr_array((self.edge_lengths, tuple(self.edges.T)), shape=(self.n_vertices, self.n_vertices))

    @cached_property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex; a vertex that no face uses is a component of its own."""
        return _frozen(connectivity.connected_components(self.F, self.n_vertices))

    @cached_property
    def referenced(self) -> BoolArray:
        """Which vertices (n,) belong to a face."""
        return _frozen(connectivity.mask_of(self.F, self.n_vertices))

    @cached_property
    def boundary(self) -> BoolArray:
        """Which vertices (n,) lie on the boundary: on an edge (a triangle, for tetrahedra) of only one face."""
        outer = self.facets.vertices[self.facets.n_faces == 1]
        return _frozen(connectivity.mask_of(outer, self.n_vertices))

    @property
    def measures(self) -> FloatArray:
        """The area of each triangle or volume of each tetrahedron (m,), never negative."""
        if self.is_tetrahedral:
            return _frozen(np.abs(igl.volume(self.V, self.F)))
        return _frozen(igl.doublearea(self.V, self.F) / 2)

    @cached_property
    def longest_distance(self) -> float:
        """Length of a longest shortest path along edges, over all components: the largest of `longest_distances`."""
        return float(self.longest_distances.max())

    @cached_property
    def longest_distances(self) -> FloatArray:
        """Length of a longest shortest path along edges in each component (see `connectivity.longest_paths`)."""
        return _frozen(connectivity.longest_paths(self.edge_graph, self.components))

    def report(self) -> MeshReport:
        """Counts, defects and sizes that bear on a distance computed on the mesh.

        Returns
        -------
        MeshReport
            Prints as a table; lists of defects hold indices.
        """
        return mesh_report(self)


def first_quadrilateral(V: FloatArray, F: IntArray) -> int | None:
    """The first of the elements (m, 4) that look like quadrilaterals with their corners in order; None if they do not.

    Quadrilaterals have sides in common and no diagonals, and are thin as tetrahedra. A triangle between two tetrahedra
    is a diagonal of both: of three corners out of four, two are opposite. Elements without neighbours are
    quadrilaterals if all are planar. Linear time: the neighbours of some elements are looked up, evenly spaced.
    """
    chosen = np.unique(np.linspace(0, len(F) - 1, _SAMPLE).astype(np.int64))
    thickness = _thickness(V, F[chosen])
    if (thickness <= _FLAT).all() and (_thickness(V, F) <= _FLAT).all():
        return 0
    if np.median(thickness) >= _THIN:
        return None
    is_near = connectivity.mask_of(F[chosen], len(V))
    # Elements that may have a side or diagonal in common with one of these.
    near = np.flatnonzero(is_near[F].sum(axis=1) > 1)
    pairs = np.sort(F[near][:, _SIDES_AND_DIAGONALS].reshape(-1, 2), axis=1)
    _, pair, count = connectivity.unique_rows(pairs, len(V))
    shared = (count[pair] > 1).reshape(-1, 6)[np.searchsorted(near, chosen)]
    across, beside = shared[:, 4:].any(axis=1), shared[:, :4].any(axis=1)
    # A few quadrilaterals may share two sides, or lie there twice.
    is_quadrilateral = beside & ~across
    return int(chosen[np.argmax(is_quadrilateral)]) if is_quadrilateral.sum() > 4 * across.sum() else None


def _thickness(V: FloatArray, F: IntArray) -> FloatArray:
    longest = igl.edge_lengths(V, F).max(axis=1)
    regular = longest**3 / np.sqrt(72)
    return np.asarray(np.abs(igl.volume(V, F)) / np.where(regular > 0, regular, 1))
