"""`GeodesicSolver`: distance without heat, prepared once, asked many times; `geodesic_distance`: one question."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, cast, get_args

import igl
import numpy as np

from heat_igl.errors import MeshError, checked_cutoff, names_guessed, require_choice
from heat_igl.heat.batches import BatchedSolver, LabelledDistance, warn_of
from heat_igl.mesh import Mesh, MeshLike, MeshPart, PointCloud, PolygonMesh, SurfacePoints, as_mesh
from heat_igl.mesh.connectivity import mask_of
from heat_igl.mesh.objects import as_simplices, tangent_surface
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.operators import Operators
from heat_igl.plan import MOST_WITHIN_REACH, DistanceMethod, Method, Plan, SurfaceMeasures, distance_plan, sweep_plan
from heat_igl.runtime import n_threads
from heat_igl.sources import OffsetSources, Sources, SourceSet, named_vertices, require_resolved, source_set
from heat_igl.typing import ArrayLike, FloatArray
from heat_igl.windows import Engine, GuardedEngine, MeshTriangles, OperatorTriangles, Triangles, guarded_windows
from heat_igl.windows.engine import ComponentEngine

if TYPE_CHECKING:
    from heat_igl.geodesic.derivatives import DistanceDerivative
    from heat_igl.intrinsic import TangentFrames
    from heat_igl.sweep import SweepEngine
    from heat_igl.sweep.simplex_derivative import SimplexDerivative
    from heat_igl.windows.directions import Directions


@names_guessed
def geodesic_distance(
    mesh: MeshLike,
    sources: Sources,
    *,
    method: DistanceMethod = "auto",
    tolerance: float = 1e-5,
    cutoff: float | None = None,
    targets: Sources | None = None,
    region: ArrayLike | None = None,
) -> FloatArray:
    """Geodesic distance from the nearest source, in one call; for several queries, keep a `GeodesicSolver`.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes: `Mesh`, `PolygonMesh`, `PointCloud`, a pair (V, F), a path, or a mesh or point cloud
        of trimesh, pyvista, open3d, meshio and others.
    sources : sources
        A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources` if
        distance begins at other values than 0, positions beside the triangles, floats (3,) or (k, 3), or a list of
        such. Faces of points on polygons are counted as those of ``PolygonMesh.triangles``.
    method : {"auto", "windows", "exact", "sweep", "heat"}
        As for `GeodesicSolver`; "heat" is the heat method as `HeatMethodSolver` has it by default.
    tolerance : float
        Largest relative error. Windows are exact, whatever the tolerance.
    cutoff : float, optional
        Distances beyond this are ``inf``, and a search by windows ends there.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints, optional
        Vertices or points: only their distances are returned, and a search by windows ends once they are known.
    region : (n,) or (m,) array_like of bool, optional
        The vertices or faces that paths may enter, as for `GeodesicSolver`; elsewhere distance is ``inf``.

    Returns
    -------
    (n,) or (t,) float64
        In the mesh's unit: 0 at source vertices (the offset of those that have one, unless another source is nearer),
        ``inf`` at vertices that no source reaches, never negative or NaN.

    Raises
    ------
    MeshError
        If the mesh cannot be used or is not understood, or not with this method.
    SourceError
        If `sources` does not describe places on the mesh.
    ValueError
        If there is no such `method`, `cutoff` is not positive, or targets are points and the method is not windows.

    Warns
    -----
    AccuracyWarning
        As for `HeatMethodSolver`, with ``method="heat"``.

    Examples
    --------
    >>> from heat_igl import geodesic_distance
    >>> V = [[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]]
    >>> F = [[0, 1, 3], [1, 2, 3]]
    >>> geodesic_distance((V, F), 0).tolist()
    [0.0, 3.0, 5.0, 4.0]
    """
    require_choice("method", method, get_args(DistanceMethod))
    limit = checked_cutoff(cutoff)
    given = as_mesh(mesh)
    if method == "heat":
        from heat_igl.heat import HeatMethodSolver  # what follows needs none of its modules

        distance = HeatMethodSolver(given, region=region).distance(sources, cutoff=limit)
        return distance if targets is None else distance[named_vertices(targets, len(distance), "targets")]
    if isinstance(given, PolygonMesh):
        given = given.triangles
    is_plain = targets is None and region is None and method != "sweep"
    if limit < np.inf and is_plain and isinstance(given, Mesh) and not given.has_copies:
        near = _within_reach(given, sources, tolerance, limit)
        if near is not None:
            return near
    solver = GeodesicSolver(given, method=method, tolerance=tolerance, region=region)
    if targets is None:
        return solver.distance(sources, cutoff=limit)
    found = solver._to_targets(sources, targets)
    found[found > limit] = np.inf
    return found


def _within_reach(mesh: Mesh, sources: Sources, tolerance: float, cutoff: float) -> FloatArray | None:
    """Distance (n,) up to the cutoff, on the faces that come nearer to a source vertex than that along straight lines.

    None if most faces do, or if the sources are not vertices.
    """
    if mesh.is_tetrahedral:
        return None
    chosen = source_set(sources, mesh.n_vertices, mesh.F, mesh)
    if not chosen.on_vertices_alone:
        return None
    starts = mesh.V[chosen.vertices]
    if len(starts) == 1:
        apart = np.linalg.norm(mesh.V - starts, axis=1)
    else:
        from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

        apart = cKDTree(starts).query(mesh.V)[0]
    # No point of a triangle is farther from the nearest corner than the longest side over the square root of 3.
    longest = reduce(np.maximum, igl.edge_lengths(mesh.V, mesh.F).T)  # three times as fast as along an axis
    nearest = reduce(np.minimum, (apart[corner] for corner in mesh.F.T))
    # By more than rounding adds up to.
    near = nearest - longest / np.sqrt(3) <= (cutoff - chosen.vertex_offset.min()) * (1 + 1e-9)
    if near.mean() > MOST_WITHIN_REACH:
        return None
    distance = np.full(mesh.n_vertices, np.inf)
    distance[chosen.vertices] = chosen.vertex_offset
    used, numbers = np.unique(mesh.F[near], return_inverse=True)
    is_there = np.isin(chosen.vertices, used)
    if is_there.any():
        solver = GeodesicSolver(Mesh(mesh.V[used], numbers.reshape(-1, 3)), tolerance=tolerance)
        there = OffsetSources(np.searchsorted(used, chosen.vertices[is_there]), chosen.vertex_offset[is_there])
        distance[used] = solver.distance(there, cutoff=cutoff)
    distance[distance > cutoff] = np.inf
    return distance


class GeodesicSolver(BatchedSolver):
    """Geodesic distance, exact on triangles: prepare once, ask many times. Nothing is factored.

    Parameters
    ----------
    mesh : mesh or Operators
        Whatever `as_mesh` takes, polygons by their triangles; or the operators of a metric, a speed or edge lengths.
    method : {"auto", "windows", "exact", "sweep"}
        "windows" and "exact" find the polyhedral distance. "sweep" unfolds two triangles at a time: 0.06 to 0.3 % mean
        error on scans, without a bound, in a fraction of the time on large meshes. "auto" is windows on triangles, and
        a sweep on a `PointCloud`. Tetrahedra are passed by straight lines, and metrics that vary by the Hopf-Lax
        formula. `plan` says what was taken, and why.
    tolerance : float
        Largest error over the distance. Windows are exact, which holds every tolerance.
    region : (n,) or (m,) array_like of bool, optional
        What paths may enter, of a mesh: faces all of whose vertices are selected, or selected faces. Elsewhere distance
        is ``inf``, and sources are an error; all numbers stay those of the whole mesh. Angles of `directions` are those
        of `tangent_frames` of the part alone. A mask of n = m entries is of vertices.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or not with this method.
    ValueError
        If an option has no meaning.

    Notes
    -----
    The solver is immutable; threads may share it, and a pickled copy gives the same bits. A single query may use
    several threads, and `distances` uses all of them.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> solver = heat_igl.GeodesicSolver(mesh)
    >>> solver.distance(0)[[4, 15, 19]].round(6).tolist()  # the diagonal of 3 by 4
    [4.0, 3.0, 5.0]
    >>> solver.plan.engine, solver.plan.tolerance
    ('windows', 1e-05)
    """

    @names_guessed
    def __init__(
        self,
        mesh: MeshLike | Operators,
        *,
        method: Method = "auto",
        tolerance: float = 1e-5,
        region: ArrayLike | None = None,
    ) -> None:
        self._method, self._tolerance = method, tolerance
        given = mesh if isinstance(mesh, Operators) else as_mesh(mesh)
        self._domain = given.triangles if isinstance(given, PolygonMesh) else given
        self._part = None if region is None else MeshPart.of(self._domain, region)
        if self._part is not None:
            self._domain = self._part.mesh
        self._triangles: Triangles | None = None
        self._plan, self._engine = self._prepared()

    def _prepared(self) -> tuple[Plan, Engine]:
        """The plan for the domain, and the engine that it names."""
        domain, method, tolerance = self._domain, self._method, self._tolerance
        if isinstance(domain, Mesh) and domain.is_tetrahedral:
            from heat_igl.operators import MetricSimplices, check_measures
            from heat_igl.sweep import LineEngine

            check_measures(domain)
            return distance_plan("tetrahedra", method, tolerance), LineEngine(MetricSimplices.in_space(domain))
        if isinstance(domain, Operators):
            if domain.parts:
                return self._of_parts(domain)
            if domain.simplices is not None:
                from heat_igl.sweep import engine_through

                engine = engine_through(domain.simplices)
                if domain.simplices.is_in_space:
                    return distance_plan("tetrahedra", method, tolerance), engine
                fits = domain.has_surface
                chosen = distance_plan("varying metric" if fits else "separate simplices", method, tolerance)
                if any(part.is_in_space for part in domain.simplices.parts):
                    chosen = replace(chosen, reason=f"{chosen.reason}; in a component with one metric, paths are lines")
                if chosen.engine == "hopf-lax":
                    self._triangles = OperatorTriangles(domain) if fits else None
                    if fits and len(domain.simplices.corners) < len(cast(Triangles, self._triangles).given_faces):
                        chosen = replace(chosen, reason=f"{chosen.reason}, and in components where it varies less")
                        which = mask_of(domain.simplices.corners, domain.simplices.n)
                        engine = ComponentEngine([self._unfolded, engine], which)
                    return chosen, engine
            if not domain.has_surface:
                raise MeshError("distance is measured along simplices, and these operators know none: give the mesh")
        chosen = distance_plan("points" if isinstance(domain, PointCloud) else "triangles", method, tolerance)
        if isinstance(domain, Operators):
            return self._on_triangles(OperatorTriangles(domain), chosen)
        if isinstance(domain, PointCloud):
            # For a sweep, as for heat, slivers between points are lengthened a little.
            return self._on_triangles(MeshTriangles(domain.triangles, None, orients=False), chosen)
        return self._on_triangles(MeshTriangles(domain), chosen)

    def _of_parts(self, domain: Operators) -> tuple[Plan, Engine]:
        """The plan and the engine where components have different ones."""
        solvers = [GeodesicSolver(part, method=self._method, tolerance=self._tolerance) for part in domain.parts]
        which = np.zeros(domain.n, np.int64)
        for number, part in enumerate(domain.parts):
            which[getattr(part, "mesh", part).referenced[: len(which)]] = number
        last = max((solver.plan for solver in solvers), key=lambda plan: plan.engine == "hopf-lax")
        reason = f"{last.reason}; components whose triangles fit together have the engine that they have alone"
        return replace(last, reason=reason), ComponentEngine([solver._engine for solver in solvers], which)

    def _on_triangles(self, triangles: Triangles, chosen: Plan) -> tuple[Plan, Engine]:
        self._triangles = triangles
        if chosen.engine == "sweep":
            # Whatever the triangles between points are, their own error is a multiple of what a sweep adds.
            sweep = None if isinstance(self._domain, PointCloud) else _sweep_engine(triangles)
            n_used = int(np.count_nonzero(np.bincount(triangles.given_faces.ravel())))
            measures = sweep.measures if sweep else SurfaceMeasures(n_used, 0.0, 0.0, False)
            chosen = sweep_plan(measures, chosen)
            if chosen.engine == "sweep":
                return chosen, sweep or _sweep_engine(triangles)
        # All other engines are held to bounds where they are made.
        # Noisy points are measured where they were moved to.
        V = None if isinstance(self._domain, Operators) else as_simplices(self._domain).V
        return chosen, guarded_windows(triangles, V, _sweep_engine)

    def __repr__(self) -> str:
        tolerance = "" if self._plan.tolerance is None else f", tolerance={self._plan.tolerance:g}"
        return f"GeodesicSolver({self.n_vertices} vertices, {self._plan.engine}{tolerance})"

    @property
    def plan(self) -> Plan:
        """The engine, its tolerance and the reason."""
        return self._plan

    def _nearer(self, vertex: int, than: FloatArray) -> FloatArray:
        """Distance (n,) from a vertex where it is smaller than `than` (n,), the distance from others; else ``inf``."""
        if not isinstance(self._engine, GuardedEngine):
            return self.distance(vertex, cutoff=float(than.max()))
        return np.asarray(self._with_copies(self._engine.nearer(self._source_set(vertex), than, n_threads())))

    @names_guessed
    def voronoi(self, sources: Sources, *, cutoff: float | None = None) -> LabelledDistance:
        """Distance, and which source is nearest: a geodesic Voronoi diagram.

        Parameters
        ----------
        sources, cutoff
            As for `distance`, with its errors. Sources are counted as they are given: each vertex of a sequence, each
            set entry of a mask, each point, a curve as one; over the entries of a list one after another.

        Returns
        -------
        LabelledDistance
            `distance` (n,) and `labels` (n,).
        """
        limit, chosen = checked_cutoff(cutoff), self._source_set(sources)
        *found, complaint = self._asked(chosen).answer(chosen, limit, n_threads())
        distance, labels = map(self._with_copies, found)
        warn_of(complaint)
        distance[distance > limit] = np.inf
        labels[np.isinf(distance)] = -1
        return LabelledDistance(distance, labels)

    def directions(self, sources: Sources) -> Directions:
        """Distance, and the directions in which the shortest paths leave the sources and arrive; all exact.

        Parameters
        ----------
        sources : sources
            As for `distance`, with its errors.

        Returns
        -------
        Directions
            Distances and labels as those of `voronoi`, angles in the frames of `tangent_frames`, and the gradient.

        Raises
        ------
        MeshError
            If the mesh has no tangent frames.
        ValueError
            If the engine is not windows, or the solver was made from operators.
        """
        from heat_igl.windows.directions import directions

        chosen = self._source_set(sources)
        engine, frames = self._directed
        found = directions(*engine.directed(chosen), frames)
        if isinstance(self._domain, PointCloud) and self._domain.cover is not None:
            from heat_igl.windows.directions import directions_from_one_side

            found = directions_from_one_side(found, frames, self.n_vertices, self._domain.n_faces)
        if self._originals is not None:
            found = found.of(self._originals)
        if self._part is None:
            return found
        start = unchecked_points(self._part.faces[found.start.faces], found.start.barycentric)
        return replace(found, start=start)

    @cached_property
    def _directed(self) -> tuple[GuardedEngine, TangentFrames]:
        """The engine and the tangent frames of `directions`; frames of a cloud include copies, and both sides."""
        from heat_igl.intrinsic import tangent_frames

        domain, engine = self._domain, self._windows("directions follow")
        if isinstance(domain, Operators):
            raise ValueError("directions need the positions of a mesh, which this solver does not have")
        surface = tangent_surface(domain)
        if isinstance(domain, PointCloud) and surface is not domain.triangles:
            engine = guarded_windows(MeshTriangles(surface), surface.V, _sweep_engine)
        return engine, tangent_frames(surface)

    def distance_vjp(self, sources: Sources) -> tuple[FloatArray, DistanceDerivative | SimplexDerivative]:
        """Distance ``phi`` and its derivative: ``pull_back(g)`` for g (n,) is dV (n, 3), see `DistanceDerivative`.

        Arguments and errors as for `distance`; a ValueError also if the engine is a sweep, and for what has no
        derivative, see `require_differentiable`. Of windows, the derivative is that of exact paths; of lines and the
        Hopf-Lax formula, it is a `SimplexDerivative`. ``phi`` is what `distance` returns, but for a metric or speed per
        face on triangles where `plan` names the Hopf-Lax formula: value and derivative are those of windows there, and
        ``phi`` may differ from `distance` by the difference of both engines. ``method="exact"`` makes both the same. In
        tetrahedra with one tensor in a component, both are of the formula. ``pull_back.distance`` is what is
        differentiated: of the formula its fixed point, which ``phi`` is near.
        """
        from heat_igl.geodesic.derivatives import DistanceDerivative, require_differentiable
        from heat_igl.sweep import HopfLaxEngine
        from heat_igl.sweep.simplex_engine import SimplexEngine

        chosen, domain = self._source_set(sources), self._domain
        require_differentiable(domain, chosen)
        # The formula interpolates tensors per face before it uses them: it has no derivatives by those given.
        asked = self._asked(chosen)
        given = None if isinstance(asked, HopfLaxEngine) else getattr(domain, "in_tensors", None)
        asked = asked if given is None else HopfLaxEngine(given)
        if isinstance(asked, SimplexEngine) and not getattr(domain, "metric", None):
            distance, _, complaint = asked.answer(chosen)
            warn_of(complaint)
            return distance, asked.derivative(chosen)
        from heat_igl.operators import SideLengths

        engine = self._windows("derivatives are those of")
        surface = cast(Triangles, self._triangles).surface
        sides = domain.metric if isinstance(domain, Operators) else SideLengths(cast(Mesh, domain))
        distance = engine.distance(chosen, np.inf, n_threads())
        return distance, DistanceDerivative(distance, chosen, surface, sides, engine.windows.on_faces, self._part)

    def _asked(self, sources: SourceSet) -> Engine:
        """The engine for these sources: points and curves in a varying metric are those of windows."""
        if self._plan.engine == "hopf-lax" and not sources.on_vertices_alone:
            return self._unfolded
        return self._engine.of(sources) if isinstance(self._engine, ComponentEngine) else self._engine

    @cached_property
    def _unfolded(self) -> GuardedEngine:
        return guarded_windows(cast(Triangles, self._triangles), None, _sweep_engine)

    def _windows(self, what: str) -> GuardedEngine:
        """The engine that finds paths, if there is one."""
        if isinstance(self._engine, GuardedEngine):
            return self._engine
        if self._plan.engine == "hopf-lax" and self._triangles is not None:
            return self._unfolded
        if self._triangles is None:
            raise MeshError(f"{what} paths on triangles that fit together, and the engine here is {self._plan.engine}")
        raise ValueError(f"{what} paths, which a sweep does not find: make the solver with method='windows'")

    def _to_targets(self, sources: Sources, targets: Sources) -> FloatArray:
        """Distance (t,) of some vertices or points; a search by windows ends once all are known."""
        chosen = self._source_set(sources)
        places = targets if isinstance(targets, SurfacePoints) else named_vertices(targets, self.n_vertices, "targets")
        if not isinstance(places, SurfacePoints) and self._originals is not None:
            places = self._originals[places]
        if isinstance(places, SurfacePoints) and self._part is not None:
            places = SurfacePoints(self._part.numbers_of(places.faces, "targets"), places.barycentric)
        if isinstance(self._engine, GuardedEngine):
            if isinstance(places, SurfacePoints) and isinstance(self._domain, Mesh):
                places.positions(self._domain)  # which checks the faces
            return self._engine.to_targets(chosen, places)
        if isinstance(places, SurfacePoints):
            raise ValueError("targets inside faces need windows: leave method away, or name vertices")
        distance, _, complaint = self._engine.answer(chosen)
        warn_of(complaint)
        return distance[places]

    def _moved(self, V: ArrayLike) -> GeodesicSolver:
        if isinstance(self._domain, Operators):
            raise ValueError("this solver was made from operators and has no vertices to move: make it again")
        return GeodesicSolver(self._domain.with_vertices(V), method=self._method, tolerance=self._tolerance)

    def _source_set(self, sources: Sources) -> SourceSet:
        part, domain, faces = self._part, self._domain, None
        if self._triangles is not None:
            faces = self._triangles.given_faces if part is None else part.whole
        surface = domain if part is None and isinstance(domain, Mesh) and not domain.is_tetrahedral else None
        chosen = source_set(sources, self.n_vertices, faces, surface, part=part, originals=self._originals)
        if chosen.offsets.any():
            h = domain.mean_edge_length if isinstance(domain, Operators) else as_simplices(domain).edge_lengths.mean()
            require_resolved(chosen, float(h))
        return chosen

    def _answers(
        self, source_sets: list[SourceSet], cutoff: float = np.inf, threads: int = 1
    ) -> tuple[FloatArray, Sequence[str | None]]:
        if self._plan.engine != "hopf-lax":
            rows = [self._engine.distance(each, cutoff, threads) for each in source_sets]
            return self._with_copies(np.stack(rows)), [None] * len(rows)
        answers = [self._asked(each).answer(each, cutoff, threads) for each in source_sets]
        return self._with_copies(np.stack([answer[0] for answer in answers])), [answer[2] for answer in answers]


def _sweep_engine(triangles: Triangles) -> SweepEngine:
    from heat_igl.sweep import SweepEngine

    return SweepEngine(triangles)
