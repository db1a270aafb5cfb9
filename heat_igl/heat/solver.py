"""`HeatMethodSolver`: the three steps put together, factored once, asked many times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.errors import AccuracyWarning, checked_cutoff, names_guessed
from heat_igl.heat.batches import BatchedSolver, LabelledDistance, warn_of
from heat_igl.heat.checking import AnswerCheck
from heat_igl.heat.parts import Diagnostics, HeatSolution, Magnitude, SolverOptions, SolverParts, prepare, prepare_mesh
from heat_igl.heat.source_terms import SourceTerm, drop_overtaken, right_hand_side, warmest_sources
from heat_igl.heat.steps import Boundary, damping, normalize
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, MeshLike, MeshPart, PointCloud, PolygonMesh, as_mesh
from heat_igl.operators import Laplacian, Operators
from heat_igl.plan import Plan
from heat_igl.runtime import LOWEST_HEAT, warn_caller
from heat_igl.sources import Sources, SourceSet, require_resolved, source_set
from heat_igl.typing import ArrayLike, FloatArray

# A known distance that is longer than the integrated distance by more than this share of it comes from a source that is
# not the nearest: integrated distance is wrong by less, by 1 to 4 % in the mean. It decides on the far corners of faces
# much larger than the mean alone; from 0 to 1, errors on the cow, the fandisk and the camel's head are the same.
_HEAT_ERROR = 0.2


class HeatMethodSolver(BatchedSolver):
    """Geodesic distance by the heat method (Crane, Weischedel, Wardetzky 2013): factor once, ask many times.

    Parameters
    ----------
    mesh : mesh, Operators or (n, 3) array_like
        Whatever `as_mesh` takes, or the positions V of a mesh whose faces are `F`. Polygons are solved on the triangles
        around a virtual vertex in each, points on the triangles between them. Or the operators of a metric, a speed or
        edge lengths alone, as `metric_operators` or `edge_length_operators` return them.
    F : (m, 3) or (m, 4) array_like, optional
        Faces, when `mesh` is V.
    t_coef : float, optional
        Scale-free time step, t = t_coef h^2 with h the mean edge length of the triangulation that is solved on. Larger
        values smooth the distance across the cut locus. 0.5 where heat is fitted to the lengths of edges (see
        `magnitude`), else the paper's 1.
    t : float, optional
        Time step as a squared length; overrides `t_coef`.
    laplacian : {"auto", "intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan"}
        Triangulation to solve on, see `operators`; "cotan" is the paper's. "auto" is the intrinsic Delaunay one where
        triangles are even, and has more vertices where they are not: `operators` then has more rows than there are
        answers, the first ones for the vertices of the mesh. Tetrahedra always keep their own.
    boundary : {"neumann", "dirichlet", "average"}
        What the heat does at the boundary, see `HeatFlow`.
    magnitude : {"auto", "unit", "damped"}
        Length of the field X that is integrated: 1 as in the paper, or less where heat arrives from several sides, see
        `damping`. "auto" damps on surfaces, where it was measured to pay, but not for "cotan", where heat may be
        negative and the paper's method is wanted. "unit" is the paper's method throughout: otherwise the heat flow is
        fitted to the lengths of edges (`fitted_laplacian`), X follows the gradient of log u, and the vertices next to a
        source vertex get the lengths of the edges.
    backend : {"auto", "scipy", "multifrontal"}
        Linear solver, see `factorize`.
    region : (n,) or (m,) array_like of bool, optional
        What heat may enter, of a mesh: faces all of whose vertices are selected, or selected faces. Elsewhere distance
        is ``inf``, and sources are an error. Fields per face, as of `solve`, are of the part. If n is m: vertices.

    Raises
    ------
    MeshError
        If the mesh cannot be used; the message names the first offender.
    FactorizationError
        If a matrix is not positive definite, or an answer is no number; it names the thinnest triangle.
    ValueError
        If an option has no meaning.

    Warns
    -----
    AccuracyWarning
        If an explicit `t` had to be raised for the heat to cross the mesh, or is so large that heat is nearly level.

    Notes
    -----
    A time step too small for the heat to cross the mesh in double precision is raised, and `t` and `diagnostics` say
    so. The solver is immutable; threads may share it, and a pickled copy gives the same bits.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(4)  # the unit sphere, on which distance is an angle
    >>> solver = heat_igl.HeatMethodSolver(mesh)
    >>> angle = np.arccos(np.clip(mesh.V @ mesh.V[7], -1, 1))
    >>> bool(abs(solver.distance(7) - angle).mean() < 0.01 * np.pi)
    True
    >>> solver.distances([[0, 1], [2]]).shape  # of two sets of sources
    (2, 2562)
    """

    _parts: SolverParts

    @names_guessed
    def __init__(
        self,
        mesh: MeshLike | Operators,
        F: ArrayLike | None = None,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "auto",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        backend: Backend = "auto",
        region: ArrayLike | None = None,
    ) -> None:
        options = SolverOptions(t_coef, t, laplacian, boundary, magnitude, backend)
        domain = mesh if isinstance(mesh, Operators) and F is None else as_mesh(mesh, F)
        if region is not None:
            self._part = MeshPart.of(domain, region)
            domain = self._part.mesh
        if isinstance(domain, Operators):
            if options.laplacian != "auto":
                raise ValueError(f"laplacian={options.laplacian!r} is for meshes: operators have a Laplacian already")
            # Whoever made the operators chose the triangulation.
            chosen = replace(options, laplacian="intrinsic-delaunay")
            self._parts = prepare(domain, chosen)
        else:
            self._parts = prepare_mesh(domain, options)
        self._domain = self.operators if isinstance(domain, PolygonMesh) else domain

    def _moved(self, V: ArrayLike) -> HeatMethodSolver:
        options, fans = self._parts.options, self.operators.fans
        if not isinstance(self._domain, Operators):
            moved = self._domain.with_vertices(V)
            return self._of(prepare_mesh(moved, options, self._parts.analysis), moved)
        if fans is None:
            raise ValueError("this solver was made from operators and has no vertices to move: make it again")
        positions = fans.polygons.triangles.with_vertices(V).V
        return self._of(prepare_mesh(PolygonMesh(positions, fans.polygons.polygons), options))

    @classmethod
    def _of(cls, parts: SolverParts, mesh: Mesh | PointCloud | None = None) -> HeatMethodSolver:
        solver = cls.__new__(cls)
        solver._domain, solver._parts = parts.operators if mesh is None else mesh, parts
        return solver

    def __repr__(self) -> str:
        backend = self.diagnostics.backend
        return f"HeatMethodSolver({self.n_vertices} vertices, t={self.t:.4g}, backend={backend!r})"

    @property
    def plan(self) -> Plan:
        """The engine, which is heat, and what it runs on."""
        return self._parts.plan

    @property
    def operators(self) -> Operators:
        """L, M, G and D of the triangulation that is solved on."""
        return self._parts.operators

    @property
    def t(self) -> float:
        """The time step in use, a squared length; of several (`time_steps`), that of the largest component."""
        return self.diagnostics.t

    @property
    def time_steps(self) -> FloatArray:
        """The time step of each component, by their labels in ``operators.components``."""
        return self._parts.time_steps

    @property
    def diagnostics(self) -> Diagnostics:
        """What the solver did and rests on."""
        comparisons = self._parts.comparisons
        return replace(self._parts.diagnostics, compared=None if comparisons is None else comparisons.worst)

    @property
    def _n_faces(self) -> int:
        return len(self._parts.operators.weights)

    def _source_set(self, sources: Sources) -> SourceSet:
        surface = self.operators.source_surface
        faces = None if surface is None else surface.given_faces
        part = self._part
        if part is not None and faces is not None:
            faces = part.whole
        mesh = self._domain if isinstance(self._domain, Mesh) and part is None and faces is not None else None
        chosen = source_set(sources, self.operators.n_given, faces, mesh, part=part, originals=self._originals)
        return require_resolved(chosen, self._parts.operators.mean_edge_length)

    def _answers(
        self,
        source_sets: list[SourceSet],
        cutoff: float = np.inf,  # noqa: ARG002
        threads: int = 1,  # noqa: ARG002 - the linear solver's
    ) -> tuple[FloatArray, list[AnswerCheck]]:
        """Distances (k, n) from k sets of sources, and by how much they left bounds: the method from end to end."""
        *_, distances, checks = self._solved(source_sets)
        return self._with_copies(distances), checks

    def _compared(self, distance: FloatArray, sources: SourceSet, check: AnswerCheck) -> AnswerCheck:
        """The check of an answer (n,), which is compared with another engine where it may be wrong."""
        comparisons = self._parts.comparisons
        if comparisons is None:
            return check
        is_doubtful = check.complaint(self.operators.is_surface) is not None
        return check._replace(compared=comparisons.compare(distance, sources, is_doubtful))

    def _complaint(self, distance: FloatArray, sources: SourceSet, check: AnswerCheck | None) -> str | None:
        return check and self._compared(distance, sources, check).complaint(self.operators.is_surface)

    def _solved(
        self, source_sets: list[SourceSet]
    ) -> tuple[list[SourceTerm], FloatArray, FloatArray, list[AnswerCheck]]:
        """Of k sets, initial heat and what is known near it, heat (n, k), distances (k, n), and checks of these."""
        parts, domain = self._parts, self.operators
        terms = [drop_overtaken(parts.assembler.term(each), parts.heat_flow, domain.n) for each in source_sets]
        u = parts.heat_flow.solve(right_hand_side(domain.n, terms))
        if any(term.seen.any() for term in terms):
            X, magnitude = _damped_field(parts, terms, u)
            divergence = np.asarray(domain.D @ (X * np.tile(magnitude, (domain.dimension, 1))))
        else:
            divergence = parts.divergence.divergence(u)
        # Known up to a constant on each component.
        phi = parts.poisson.solve(divergence)
        if u.min() < LOWEST_HEAT:
            for term, of_term in zip(terms, u.T, strict=True):
                _warn_if_cold(parts, term, of_term)
        distances = np.ascontiguousarray(phi.T)
        for term, distance, of_term in zip(terms, distances, u.T, strict=True):
            _pin_level(parts, term, distance, of_term)
        distances = distances[:, : domain.n_given]
        return terms, u, distances, [parts.checker.check(*each) for each in zip(distances, source_sets, strict=True)]

    @names_guessed
    def voronoi(self, sources: Sources, *, cutoff: float | None = None) -> LabelledDistance:
        """Distance, and which source is nearest: as `GeodesicSolver.voronoi`, with a heat solve for each source.

        Labels say from which source most of the heat comes: right but for vertices less than an edge from the border of
        two cells.
        """
        limit = checked_cutoff(cutoff)
        chosen = self._source_set(sources)
        (term,), _, (distance,), (check,) = self._solved([chosen])
        labels = warmest_sources(term, self._parts.heat_flow, self.operators.n)[: self.n_vertices]
        warn_of(self._complaint(distance, chosen, check))
        distance = self._with_copies(distance)
        distance[distance > limit] = np.inf
        labels = self._with_copies(labels)
        labels[np.isinf(distance)] = -1
        return LabelledDistance(distance, labels)

    def solve(self, sources: Sources) -> HeatSolution:
        """All three steps from `sources`, for a closer look; arguments and errors as for `distance`."""
        chosen = self._source_set(sources)
        terms, u, (distance,), (check,) = self._solved([chosen])
        X, magnitude = _damped_field(self._parts, terms, u)
        check = self._compared(distance, chosen, check)
        warn_of(check.complaint(self.operators.is_surface))
        with np.errstate(under="ignore"):
            heat = (u[:, 0] / terms[0].unit / self._parts.heat_flow.mean_mass)[: self.n_vertices]
        return HeatSolution(
            heat=self._with_copies(heat),
            direction=np.ascontiguousarray(X[:, 0].reshape(self.operators.dimension, -1).T),
            magnitude=np.ascontiguousarray(magnitude[:, 0]),
            distance=self._with_copies(distance),
            t=self.t,
            diagnostics=replace(self.diagnostics, check=check),
        )


def _damped_field(parts: SolverParts, terms: list[SourceTerm], u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The field of step 2: directions X (d m, k) and their magnitude (m, k), for heat (n, k) from k terms.

    Near points and curves, the field is the gradient of the known distances.
    """
    domain = parts.operators
    X = normalize(domain, u, parts.fitted)
    magnitude = np.ones((len(domain.weights), u.shape[1]))
    if parts.t_damping is not None:
        magnitude = damping(domain, u, parts.t_damping, fitted=parts.fitted)
    for column, term in enumerate(terms):
        _impose_near_field(domain, term, X[:, column], magnitude[:, column])
    return X, magnitude


def _impose_near_field(domain: Operators, term: SourceTerm, X: FloatArray, magnitude: FloatArray) -> None:
    """Near points and curves, replace the field X (d m,) of length `magnitude` (m,) by that of the known distances."""
    if domain.surface is None or not term.seen.any():
        return
    m, known = len(magnitude), np.zeros(domain.n, np.int8)
    known[term.near.vertex] = 1
    known[term.near.vertex[term.seen]] = 2
    corners = known[domain.surface.triangulation.F]
    faces = np.flatnonzero((corners > 0).all(axis=1) & (corners == 2).any(axis=1))
    gradient = (domain.G[:, term.near.vertex] @ term.near.value).reshape(-1, m)[:, faces]
    length = np.linalg.norm(gradient, axis=0)
    X.reshape(-1, m)[:, faces] = gradient / np.where(length > 0, length, 1)
    magnitude[faces] = length


def _pin_level(parts: SolverParts, term: SourceTerm, phi: FloatArray, u: FloatArray) -> None:
    """Make distance of phi (n,) in place, from heat (n,): at the right level, and equal to known distances.

    The level of a component is the mean by which phi exceeds the known distances there. A component without a
    source gets ``inf``.
    """
    domain, components, anchors, far = parts.operators, parts.operators.components, term.anchors, term.far
    excess = phi[anchors.vertex] - anchors.value
    n_anchors = np.bincount(components[anchors.vertex], minlength=domain.n_components)
    if n_anchors.max() > 1:
        of_source = _level_of_source(parts, term, excess, u)
        phi -= of_source
        excess -= of_source[anchors.vertex] if isinstance(of_source, np.ndarray) else of_source
    total = np.bincount(components[anchors.vertex], weights=excess, minlength=len(n_anchors))
    level = np.where(n_anchors > 0, total / np.maximum(n_anchors, 1), -np.inf)
    lowest = np.full(len(n_anchors), np.inf)
    np.minimum.at(lowest, components[term.near.vertex], term.near.value)
    distance, is_one = phi, domain.n_components == 1
    distance -= level if is_one else level[components]
    np.maximum(distance, lowest if is_one else lowest[components], out=distance)
    if len(far.vertex):
        begin = lowest[components[far.vertex]]
        taken = far.value - begin < (distance[far.vertex] - begin) * (1 + _HEAT_ERROR)
        distance[far.vertex[taken]] = far.value[taken]
    is_bounded = parts.t_damping is not None or not term.sources.on_vertices_alone
    if is_bounded and domain.surface is not None:
        # Across an edge from a known value, distance changes by no more than the length of the edge.
        which, ends, lengths = parts.assembler.edges.around(term.near.vertex)
        value = term.near.value[which]
        np.maximum.at(distance, ends, value - lengths)
        np.minimum.at(distance, ends, value + lengths)
    distance[term.near.vertex] = term.near.value


def _level_of_source(parts: SolverParts, term: SourceTerm, excess: FloatArray, u: FloatArray) -> FloatArray | float:
    """The value (n,) that phi has at the source from which a vertex got heat, less that source's offset; one for all
    if it is the same.

    It is a little different at each source: the error of a path between them. Shifting by the mean would move
    the whole cell of each source by the difference. Here every vertex is shifted by the values of the sources
    weighted by the heat from each, one more solve; the weights change from 0 to 1 within sqrt(t) of the border
    between two cells.
    """
    n_labels = term.sources.n_labels
    count = np.bincount(term.anchors.label, minlength=n_labels)
    level = np.bincount(term.anchors.label, excess, minlength=n_labels) / np.maximum(count, 1)
    low, high = float(level[count > 0].min()), float(level[count > 0].max())
    if low == high:
        return low
    relative = np.where(count > 0, (level - low) / (high - low), 0.0)
    weighted = right_hand_side(parts.operators.n, [term], [term.share * relative[term.label]])
    part = parts.heat_flow.solve(weighted)[:, 0]
    warm = u > 0  # always, but for noise under "cotan" and a cold boundary
    return low + (high - low) * np.clip(np.divide(part, u, out=np.zeros_like(u), where=warm), 0.0, 1.0)


def _warn_if_cold(parts: SolverParts, term: SourceTerm, u: FloatArray) -> None:
    """Heat that has underflowed has no gradient, and distance does not grow on faces with X = 0: warn."""
    domain = parts.operators
    components = domain.components
    cold = (np.abs(u) < LOWEST_HEAT) & np.isin(components, components[term.near.vertex])
    cold[term.near.vertex] = False
    remedy = "raise t_coef"
    if parts.heat_flow.boundary == "dirichlet":
        cold &= ~domain.boundary
        remedy += ", or let heat pass the boundary with boundary='average'"
    if cold.any():
        warn_caller(
            f"no heat arrives at {int(cold.sum())} of {domain.n} vertices, where distances are too short: {remedy}",
            AccuracyWarning,
        )
