"""`Operators`: the matrices of a domain, its triangles and their elements, and the few numbers beside."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import require_choice
from heat_igl.intrinsic import IntrinsicTriangulation, Merged, apex
from heat_igl.kernels.mesh import checking
from heat_igl.mesh import connectivity
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.mesh import PolygonFans
    from heat_igl.operators.metric_derivatives import MetricSides
    from heat_igl.operators.metric_simplices import MetricSimplices

# Which triangulation of a triangle mesh the operators belong to.
Laplacian = Literal["auto", "intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan"]
# Called with L, or a multiple of it, as soon as it is known: the order of elimination needs no more than the pattern.
OnLaplacian = Callable[[sp.csc_matrix], None]


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles along which distance is measured on a domain.

    Attributes
    ----------
    triangulation : IntrinsicTriangulation
        The triangles that the operators belong to: their edges are straight lines from sources.
    faces : IntrinsicTriangulation
        The triangles before any flip, but each once: points and curves are carried to them.
    uncovered : IntrinsicTriangulation or None
        The surface itself, each face once and without added vertices, if `triangulation` is the tufted cover, which
        has each face twice, or a refinement.
    V : (n, 3) float64 or None
        Positions of the vertices; None if not known.
    """

    triangulation: IntrinsicTriangulation
    faces: IntrinsicTriangulation
    uncovered: IntrinsicTriangulation | None = None
    V: FloatArray | None = None

    @property
    def unfolding(self) -> IntrinsicTriangulation:
        """The triangles to unfold paths in: on the cover a path over an edge of five faces goes on in one face only."""
        return self.triangulation if self.uncovered is None else self.uncovered

    @cached_property
    def paths(self) -> Any:
        """The `edge_paths` of the triangles before and after flips."""
        return edge_paths(self.unfolding, self.faces)

    @cached_property
    def given_faces(self) -> IntArray:
        """Vertices (m, 3) of the triangles that points and curves refer to."""
        F = self.faces.F
        for move in self.faces.history:
            if isinstance(move, Merged):
                F = move.before(F)
        return F


def edge_paths(*triangulations: IntrinsicTriangulation) -> Any:
    """Paths along the edges of triangulations of the same vertices, each edge once."""
    kernel: Any = checking.EdgePaths
    paths = kernel(np.empty((0, 2), np.int32), np.empty(0), max(each.n for each in triangulations))
    for each in triangulations:
        paths = paths.joined(np.ascontiguousarray(each.F), np.ascontiguousarray(each.l).ravel(), each.twin)
    return paths


@dataclass(frozen=True, eq=False)
class TriangleElements:
    """Linear elements on m triangles: all that the operators and the steps take of a triangulation.

    `in_space` makes the gradient in space (3 m, n).
    """

    triangulation: IntrinsicTriangulation
    in_space: Callable[[], sp.csc_matrix] | None = None

    def matrix(self) -> sp.csc_matrix:
        """The gradient G (d m, n), made anew: in space, or d = 2 in the plane of each triangle (paper, equation 5).

        Then row f is the component along the edge from corner 0 to corner 1 of triangle f, and row m + f the one
        across it, towards corner 2. Unit 1 / length.
        """
        if self.in_space is not None:
            return self.in_space()
        (per_base, foot, per_height), zero = self.frames(), np.zeros(len(self.corners))
        along = -per_base, per_base, zero
        across = (foot - 1) * per_height, -foot * per_height, per_height
        values = np.stack([np.stack(part, axis=1) for part in (along, across)])
        columns = np.tile(self.corners.astype(np.int32), (2, 1)).ravel()
        starts = np.arange(0, values.size + 1, 3, dtype=np.int32)
        rows = sp.csr_matrix((values.ravel(), columns, starts), shape=(len(starts) - 1, self.triangulation.n))
        if (self.corners[:, [1, 2, 0]] == self.corners).any():
            rows.sum_duplicates()  # an edge from a vertex to itself
        return rows.tocsc()

    @property
    def corners(self) -> IntArray:
        """Vertices (m, 3) whose values the gradient on each face depends on."""
        return self.triangulation.F

    def frames(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The gradient in the plane of each triangle, in three numbers (m,): `per_base`, `foot` and `per_height`.

        With corner 0 at the origin and corner 1 on the first axis, the gradient of u is ``x = per_base (u_1 - u_0)``,
        ``y = per_height (u_2 - u_0 - foot (u_1 - u_0))``: one over the length of the side from corner 0 to corner 1;
        the foot of corner 2 on that side, from 0 to 1 between the ends; one over the height of corner 2.
        """
        lengths = self.triangulation.l
        base = lengths[:, 2]
        x, y = apex(base, lengths[:, 1], lengths[:, 0])
        with np.errstate(divide="ignore"):
            return 1 / base, x / base, 1 / y

    def edge_lengths(self) -> tuple[IntArray, IntArray, FloatArray]:
        """The edges (k,) of the triangles: the vertices at their ends, which may be the same, and the lengths."""
        triangulation = self.triangulation
        edges = triangulation.edges
        return triangulation.tail(edges), triangulation.head(edges), triangulation.l.ravel()[edges]


@dataclass(frozen=True, eq=False)
class Operators:
    """The operators of a domain with n vertices and m faces (triangles, or tetrahedra).

    If refinement has added vertices, they come after those of the mesh, which are the first `n_given`.

    Lengths are in the domain's own unit, d is the number of gradient components per face: 3 if faces lie in space,
    2 if each has a plane of its own.

    Attributes
    ----------
    L : (n, n) csc_matrix
        Cotangent Laplacian, symmetric, negative semidefinite, integrated: rows sum to 0. Unit 1 for triangles, length
        for tetrahedra. L = D G.
    M : (n, n) csc_matrix
        Lumped mass, diagonal: the area (volume) of each vertex's cell. Sums to the area of the domain.
    gradient : (d m, n) csc_matrix, or TriangleElements
        G, or the elements that make it on first use: triangles are solved on without the matrix.
    G : (d m, n) csc_matrix
        Gradient of piecewise linear functions, constant per face, stacked by coordinate: row ``k * m + f`` is
        component k on face f. Unit 1 / length.
    D : (n, d m) csc_matrix
        Integrated divergence, D = -G^T W with W the face areas repeated d times.
    weights : (m,) float64
        Area (volume) of each face.
    face_sizes : (m,) float64
        Longest edge of each face: over it, a front of heat falls by the factor that `damping` expects.
    mean_edge_length : float
        h, over the distinct edges of the triangulation that the operators belong to.
    components : (n,) int64
        Component label of each vertex.
    boundary : (n,) bool
        Vertices on the boundary.
    referenced : (n,) bool
        Vertices that a face uses; on the others M is 0.
    longest_distance : float
        Length of a longest shortest path along edges; heat has to last that far.
    longest_distances : (n_components,) float64 or None
        The same in each component; None for `longest_distance` in all.
    is_surface : bool
        Whether the domain has two dimensions; tetrahedra have three.
    lengths : (n, n) csc_matrix, TriangleElements or None
        Distance of the vertices that an entry of L couples, symmetric, or the elements whose edges these are; None
        if it is not known, and heat is not fitted to it (`fitted_laplacian`).
    surface : Surface or None
        The triangles, for exact distance near sources and for unfolding; None if distance is not measured along
        triangles. The three steps never read it.
    simplices : MetricSimplices or None
        Tetrahedra, or triangles in metrics that do not fit together or vary within them, for the engines that pass
        through them; else None.
    metric : MetricSides or None
        The lengths of triangles in a metric per face, to be differentiated; None without one, and without a `surface`.
    drawn_on : Surface or None
        The triangles that points and curves refer to, where these are not `surface`, beside it: those of polygons.
    fans : PolygonFans or None
        Of polygons, the triangles of `surface` before any flip, to which points and curves are carried.
    originals : (n_given,) int64 or None
        The vertex whose distance each takes, see `Mesh.originals`; None if it is its own.
    parts : tuple of Operators
        Of components that distance without heat is measured on by different engines, those for each, on all vertices.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.grid(8)
    >>> domain = heat_igl.HeatMethodSolver(mesh).operators
    >>> round(float(domain.M.sum()), 12)  # the area
    1.0
    >>> bool(np.allclose((domain.D @ domain.G - domain.L).toarray(), 0))
    True
    >>> bool(np.allclose(domain.L @ np.ones(domain.n), 0))
    True
    """

    L: sp.csc_matrix
    M: sp.csc_matrix
    gradient: sp.csc_matrix | TriangleElements
    weights: FloatArray
    face_sizes: FloatArray
    mean_edge_length: float
    components: IntArray
    boundary: BoolArray
    referenced: BoolArray
    longest_distance: float
    is_surface: bool = True
    lengths: sp.csc_matrix | TriangleElements | None = None
    surface: Surface | None = None
    longest_distances: FloatArray | None = None
    simplices: MetricSimplices | None = None
    metric: MetricSides | None = None
    drawn_on: Surface | None = None
    fans: PolygonFans | None = None
    originals: IntArray | None = None
    parts: tuple[Operators, ...] = ()

    def __repr__(self) -> str:
        return f"Operators({self.n} vertices, {len(self.weights)} faces)"

    @property
    def n(self) -> int:
        """Number of vertices."""
        return int(self.L.shape[0])

    @property
    def n_vertices(self) -> int:
        """The same as n, as for a `Mesh`."""
        return self.n

    @property
    def source_surface(self) -> Surface | None:
        """The triangles that points and curves refer to as they are given: `drawn_on`, or `surface`."""
        return self.surface if self.drawn_on is None else self.drawn_on

    @property
    def has_surface(self) -> bool:
        """Whether there is a `surface`, which may not be made yet."""
        return self.surface is not None

    @property
    def n_given(self) -> int:
        """Number of vertices of the mesh; n if none were added by refinement or as virtual ones."""
        given = self.source_surface
        return self.n if given is None else given.faces.n

    @property
    def has_copies(self) -> bool:
        """Whether some vertices take the distance of others."""
        return self.originals is not None and bool((self.originals != np.arange(self.n_given)).any())

    @property
    def dimension(self) -> int:
        """Number d of gradient components per face."""
        return int(self.G.shape[0]) // len(self.weights)

    @cached_property
    def n_components(self) -> int:
        """Number of components, vertices without faces among them."""
        return int(self.components.max()) + 1

    def expand_to_vertices(self, of_component: AnyArray) -> AnyArray:
        """The value (n,) of each vertex's component, from one for each component."""
        return np.broadcast_to(of_component, self.n) if self.n_components == 1 else of_component[self.components]

    def expand_to_faces(self, of_component: AnyArray) -> AnyArray:
        """The value (m,) of each face's component, from one for each component."""
        m = len(self.weights)
        if self.n_components == 1:
            return np.broadcast_to(of_component, m)
        if isinstance(self.gradient, TriangleElements):
            return of_component[self.components[self.gradient.corners[:, 0]]]
        component = np.zeros(m, np.int64)
        component[self.G.indices % m] = np.repeat(self.components, np.diff(self.G.indptr))
        return of_component[component]

    @cached_property
    def mean_edge_lengths(self) -> FloatArray:
        """Mean edge length (n_components,); by the mean mass if edges are not known, and that of all without edges."""
        if self.n_components == 1:
            return np.full(1, self.mean_edge_length)
        edges = self.edge_lengths()
        if edges is None and self.simplices is not None:
            graph = connectivity.shortest_edge_graph(*self.simplices.edges, self.n).tocoo()
            edges = graph.row, graph.col, graph.data
        if edges is None:
            scale = np.asarray(self.mean_masses / self.mean_mass) ** (1 / (2 if self.is_surface else 3))
            return np.asarray(self.mean_edge_length * scale)
        ends, _, length = edges
        component = self.components[ends]
        count = np.bincount(component, minlength=self.n_components)
        total = np.bincount(component, length, self.n_components)
        return np.where(count > 0, total / np.maximum(count, 1), self.mean_edge_length)

    @cached_property
    def mean_masses(self) -> FloatArray:
        """Mean mass (n_components,) of the vertices that a face uses, in each component; that of all if it has none."""
        component = self.components[self.referenced]
        count = np.bincount(component, minlength=self.n_components)
        total = np.bincount(component, self.M.diagonal()[self.referenced], self.n_components)
        return np.where(count > 0, total / np.maximum(count, 1), self.mean_mass)

    @cached_property
    def mean_mass(self) -> float:
        """Mean mass of the vertices that a face uses."""
        return float(self.M.diagonal()[self.referenced].mean())

    @cached_property
    def G(self) -> sp.csc_matrix:
        """Gradient (d m, n)."""
        return self.gradient.matrix() if isinstance(self.gradient, TriangleElements) else self.gradient

    @cached_property
    def gradient_rows(self) -> sp.csr_matrix:
        """G by rows, to be multiplied with."""
        return self.G.tocsr()

    @cached_property
    def D(self) -> sp.csc_matrix:
        """Integrated divergence (n, d m)."""
        return divergence_matrix(self.gradient_rows, self.weights)

    @cached_property
    def boundary_faces(self) -> IntArray:
        """Faces (k,) with a vertex on the boundary."""
        if isinstance(self.gradient, TriangleElements):
            return np.flatnonzero(self.boundary[self.gradient.corners].any(axis=1))
        return np.asarray(np.unique(self.G[:, self.boundary].indices % len(self.weights)))

    def edge_lengths(self) -> tuple[IntArray, IntArray, FloatArray] | None:
        """Pairs of vertices that L couples and their distance, each edge once; None if `lengths` is."""
        if isinstance(self.lengths, TriangleElements):
            return self.lengths.edge_lengths()
        if self.lengths is None:
            return None
        above = sp.triu(self.lengths, 1, format="coo")
        return above.row, above.col, above.data


def check_laplacian(laplacian: str) -> None:
    """Raise a ValueError if there is no such `Laplacian`."""
    require_choice("laplacian", laplacian, get_args(Laplacian))


def divergence_matrix(gradient_rows: sp.csr_matrix, weights: FloatArray) -> sp.csc_matrix:
    """Integrated divergence D = -G^T W (n, d m), for G (d m, n) by rows and face areas `weights` (m,)."""
    dimension = gradient_rows.shape[0] // len(weights)
    scale = np.repeat(np.tile(-weights, dimension), np.diff(gradient_rows.indptr))
    entries = (scale * gradient_rows.data, gradient_rows.indices, gradient_rows.indptr)
    return sp.csc_matrix(entries, shape=gradient_rows.shape[::-1])


def laplacian_of_gradient(G: sp.csc_matrix, weights: FloatArray) -> sp.csc_matrix:
    """L = D G (n, n), for G (d m, n) and face areas `weights` (m,)."""
    L = (divergence_matrix(G.tocsr(), weights) @ G).tocsc()
    L.sort_indices()
    return L
