"""`HeatMethodSolver`: the three steps put together, factored once, asked many times."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from concurrent.futures import Future
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning, SourceError
from heat_igl.heat_method.solution import Diagnostics, HeatSolution, LabelledDistance
from heat_igl.linear import Analysis, Backend
from heat_igl.mesh import RANGE_LIMIT, Mesh
from heat_igl.operators.triangles import Laplacian, Operators, edge_length_operators, operators
from heat_igl.runtime import block_size, float_type, in_blocks, in_order, n_threads, pool, progress_bar, row_writer
from heat_igl.sources import Sources, SourceSet, source_set
from heat_igl.sources.emission import Emission, Emitter
from heat_igl.steps import Boundary, Descent, HeatFlow, PoissonProblem, analysis, damping, normalize
from heat_igl.typing import AnyArray, ArrayLike, FloatArray
from heat_igl.unfolding import Refine
from heat_igl.unfolding.solver import HeatOrder

__all__ = ["HeatMethodSolver", "Magnitude", "heat_method_distance", "smallest_time_step"]

Magnitude = Literal["auto", "unit", "damped"]

# Between two aims, see the tables of docs/heat_path.md: on scans the error falls further with t, on a regular grid of
# squares, where heat prefers diagonals, it grows.
_T_COEF_FITTED = 0.5
# Below this the heat has lost digits to gradual underflow.
_LOWEST_HEAT = 1e-300


def _positive(name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not (np.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be a positive number, not {value!r}")
    return number


def smallest_time_step(domain: Operators, fitted: bool = False) -> float:
    """The smallest time step whose heat crosses `domain` without underflow in double precision.

    Along a line of edges of length h, one backward Euler step falls by acosh(1 + h^2 / (2 t)) e-foldings per edge, and
    by h / sqrt(t) where the flow is `fitted`. The result makes that, times the number of edges across, `RANGE_LIMIT`.
    """
    if fitted:
        return (domain.longest_distance / RANGE_LIMIT) ** 2
    h = domain.mean_edge_length
    per_edge = RANGE_LIMIT / (domain.longest_distance / h)
    return h**2 / (2 * (float(np.cosh(per_edge)) - 1)) if per_edge < 700 else 0.0


class HeatMethodSolver:
    """Geodesic distance by the heat method (Crane, Weischedel, Wardetzky 2013): factor once, ask many times.

    Parameters
    ----------
    mesh : Mesh or (n, 3) array_like
        A mesh, or the positions V of one whose faces are `F`.
    F : (m, 3) or (m, 4) array_like, optional
        Faces, when `mesh` is V.
    t_coef : float, optional
        Scale-free time step, t = t_coef h^2 with h the mean edge length of the triangulation that is solved on. Larger
        values smooth the distance across the cut locus. 0.5 where heat is fitted to the lengths of edges (see
        `magnitude`), else the paper's 1.
    t : float, optional
        Time step as a squared length; overrides `t_coef`.
    laplacian : {"intrinsic-delaunay", "cotan"}
        Triangulation to solve on, see `operators`; "cotan" is the paper's. Tetrahedra always keep their own.
    boundary : {"neumann", "dirichlet", "average"}
        What the heat does at the boundary, see `HeatFlow`.
    magnitude : {"auto", "unit", "damped"}
        Length of the field X that is integrated: 1 as in the paper, or less where heat arrives from several sides, see
        `damping`. "auto" damps on surfaces, where it was measured to pay, but not for "cotan", where heat may be
        negative and the paper's method is wanted. "unit" is the paper's method throughout: otherwise the heat flow is
        fitted to the lengths of edges (`fitted_laplacian`), X follows the gradient of log u, and the vertices next to a
        source vertex get the lengths of the edges.
    refine : {"sweep", "unfold"}, optional
        Integrate nothing, and find the distance in the order of the heat by unfolding triangles, two at a time or in
        strips: 0.06 to 0.3 % and 0.0005 to 0.003 % mean error on common meshes, see `Refinement`. Needs triangles, and
        numba (extra ``fast``); no Poisson problem is factored.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        Linear solver, see `factorize`.

    Raises
    ------
    MeshError
        If the mesh cannot be used; the message names the first offender.
    FactorizationError
        If a matrix is not positive definite.
    MissingExtraError
        If a library asked for is not installed.
    ValueError
        If an option has no meaning.

    Warns
    -----
    AccuracyWarning
        If an explicit `t` had to be raised for the heat to cross the mesh.

    Notes
    -----
    A time step too small for the heat to cross the mesh in double precision is raised, and `t` and `diagnostics` say
    so. The solver is immutable; threads may share it, and a pickled copy gives the same bits.
    """

    _mesh: Mesh | None
    _options: dict[str, Any]

    def __init__(
        self,
        mesh: Mesh | ArrayLike,
        F: ArrayLike | None = None,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "intrinsic-delaunay",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> None:
        options = {
            "t_coef": t_coef,
            "t": t,
            "laplacian": laplacian,
            "boundary": boundary,
            "magnitude": magnitude,
            "refine": refine,
            "backend": backend,
        }
        self._set_up_mesh(_as_mesh(mesh, F), options)

    def _set_up_mesh(self, mesh: Mesh, options: dict[str, Any], known: Analysis | None = None) -> None:
        start = time.perf_counter()
        self._mesh = mesh
        self._options = options
        rest = dict(options)
        laplacian = rest.pop("laplacian")
        if rest["magnitude"] == "auto" and laplacian == "cotan":
            rest["magnitude"] = "unit"
        begun: list[Future[Analysis]] = []
        with pool(1) as beside:

            def analyse(L: sp.csc_matrix) -> None:
                begun.append(beside.submit(analysis, L, rest["backend"]))

            # The order of elimination takes a third of the time and needs no more than the pattern of L.
            domain = operators(mesh, laplacian, analyse if known is None and n_threads() > 1 else None)
            seconds = time.perf_counter() - start
            known = begun[0].result() if begun else known
        waited = time.perf_counter() - start - seconds
        self._set_up(domain, **rest, seconds_operators=seconds, seconds_analysis=waited, known=known)

    @classmethod
    def from_operators(
        cls,
        domain: Operators,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> HeatMethodSolver:
        """A solver on any domain that has operators; parameters as for the class."""
        solver = cls.__new__(cls)
        solver._mesh = None
        solver._set_up(domain, t_coef, t, boundary, magnitude, refine, backend)
        return solver

    @classmethod
    def from_edge_lengths(
        cls,
        F: ArrayLike,
        lengths: ArrayLike,
        *,
        n: int | None = None,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "intrinsic-delaunay",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> HeatMethodSolver:
        """A solver on triangles that are known by their edge lengths alone; positions are not needed.

        Parameters
        ----------
        F : (m, 3) array_like of int
            Vertices of each triangle.
        lengths : (m, 3) array_like
            ``lengths[f, c]`` is that of the side of triangle f opposite its corner c, as `igl.edge_lengths` gives it;
            both triangles at an edge give it the same length.
        n : int, optional
            Number of vertices; one more than the largest in `F` if not given.
        **options
            As for the class. Where more than two triangles meet at an edge no tufted cover is made, which takes
            positions: such edges are not flipped.

        Raises
        ------
        MeshError
            If `F` or `lengths` cannot be used; the message names the first offender.
        """
        start = time.perf_counter()
        domain = edge_length_operators(F, lengths, n, laplacian)
        if magnitude == "auto" and laplacian == "cotan":
            magnitude = "unit"
        solver = cls.__new__(cls)
        solver._mesh = None
        solver._set_up(domain, t_coef, t, boundary, magnitude, refine, backend, time.perf_counter() - start)
        return solver

    def with_vertices(self, V: ArrayLike) -> HeatMethodSolver:
        """A new solver after the vertices have moved; this one stays as it is.

        Parameters
        ----------
        V : (n, 3) array_like
            New positions of all vertices.

        Returns
        -------
        HeatMethodSolver
            With the same faces and options, and the same results as one made anew. The time step follows `t_coef`,
            unless `t` was given. What the faces alone say is shared: they are not validated, and edges, boundary and
            components not found again; nor is the order of elimination, unless other edges are flipped.

        Raises
        ------
        MeshError
            If `V` cannot be used; the message names the first offender.
        ValueError
            If the solver was made from operators.
        """
        if self._mesh is None:
            raise ValueError(
                "this solver was made from operators and has no vertices to move: use from_operators again"
            )
        solver = HeatMethodSolver.__new__(HeatMethodSolver)
        solver._set_up_mesh(self._mesh.with_vertices(V), self._options, self._analysis)
        return solver

    def _set_up(
        self,
        domain: Operators,
        t_coef: float | None,
        t: float | None,
        boundary: Boundary,
        magnitude: Magnitude,
        refine: Refine | None,
        backend: Backend,
        seconds_operators: float = 0.0,
        seconds_analysis: float = 0.0,
        known: Analysis | None = None,
    ) -> None:
        start = time.perf_counter()
        if magnitude not in ("auto", "unit", "damped"):
            raise ValueError(f"magnitude must be 'auto', 'unit' or 'damped', not {magnitude!r}")
        if refine not in (None, "sweep", "unfold"):
            raise ValueError(f"refine must be None, 'sweep' or 'unfold', not {refine!r}")
        self._damped = magnitude == "damped" or (magnitude == "auto" and domain.is_surface)
        fitted = self._fitted = self._damped and domain.has_lengths
        coefficient = (_T_COEF_FITTED if fitted else 1.0) if t_coef is None else _positive("t_coef", t_coef)
        requested = coefficient * domain.mean_edge_length**2 if t is None else _positive("t", t)
        step = max(requested, smallest_time_step(domain, fitted))
        if t is not None and step > requested:
            warnings.warn(
                f"t = {requested:.4g} is too small for heat to cross the mesh in double precision; using {step:.4g}",
                AccuracyWarning,
                stacklevel=3,
            )
        self._operators = domain
        self._analysis = analysis(domain.L, backend, known)
        analysed = time.perf_counter()
        makers: list[Callable[[], Any]] = [lambda: HeatFlow(domain, step, boundary, backend, self._analysis, fitted)]
        if refine is None:
            makers.append(lambda: PoissonProblem(domain, backend, self._analysis))
        # Both matrices at once: the backends run without the interpreter's lock.
        self._heat_flow, *poisson = in_order(lambda make: make(), makers, min(len(makers), n_threads()))
        self._poisson: PoissonProblem | None = poisson[0] if poisson else None
        factored = time.perf_counter()
        self._emitter = Emitter(domain, self._heat_flow, plain=not self._damped, unfolds=refine is not None)
        self._given_faces = domain.given_faces
        self._heat_order = None if refine is None else HeatOrder(domain, refine)
        self._descent = None
        if refine is None:
            self._descent = Descent(domain, step if self._damped else None, self._analysis.order, fitted)
        triangulation = domain.triangulation
        factors = self._heat_flow.factors + ([] if self._poisson is None else [self._poisson.factor])
        self._diagnostics = Diagnostics(
            t=step,
            t_requested=requested,
            mean_edge_length=domain.mean_edge_length,
            edges_across=domain.longest_distance / domain.mean_edge_length,
            n_flips=triangulation.n_flips if triangulation else 0,
            lengthening=triangulation.lengthening if triangulation else 0.0,
            backend=self._heat_flow.backend,
            seconds_operators=seconds_operators,
            factor_nonzeros=sum(factor.nonzeros for factor in factors),
            factor_bytes=sum(factor.n_bytes for factor in factors),
            seconds_analysis=seconds_analysis + analysed - start,
            seconds_factorization=factored - analysed,
        )

    @property
    def operators(self) -> Operators:
        """L, M, G and D of the triangulation that is solved on."""
        return self._operators

    @property
    def t(self) -> float:
        """The time step in use, a squared length."""
        return self._diagnostics.t

    @property
    def diagnostics(self) -> Diagnostics:
        """What the solver did and rests on."""
        return self._diagnostics

    @property
    def n_vertices(self) -> int:
        """Length of a distance array."""
        return self._operators.n

    def distance(self, sources: Sources, *, cutoff: float | None = None) -> FloatArray:
        """Distance from the nearest source.

        Parameters
        ----------
        sources : sources
            A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources`
            where distance begins at other values than 0, or a list of such.
        cutoff : float, optional
            Distances beyond this are ``inf``.

        Returns
        -------
        (n,) float64
            In the mesh's unit: 0 at the sources (their offset where they have one, unless another source is nearer),
            ``inf`` at vertices that no source reaches, never negative or NaN.

        Raises
        ------
        SourceError
            If `sources` does not describe places on the mesh.
        ValueError
            If `cutoff` is not positive.

        Warns
        -----
        AccuracyWarning
            If heat underflowed on the way, so that distances beyond are too short.
        """
        beyond = _cutoff(cutoff)
        return np.asarray(_within(beyond, self._distances([self._set(sources)]))[0])

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
            Without `refine`, labels say from which source most of the heat comes: a solve for each source, and right
            but for vertices less than an edge from the border of two cells. With it, they come with the distance.
        """
        beyond = _cutoff(cutoff)
        emissions, u = self._diffuse([self._set(sources)])
        if self._heat_order is not None:
            distance, labels = self._heat_order.labelled(emissions[0], u[:, 0])
        else:
            distance = self._integrated(emissions, u)[0]
            labels = self._emitter.labels(emissions[0])
        distance = _within(beyond, distance)
        labels[np.isinf(distance)] = -1
        return LabelledDistance(distance, labels)

    def distances(
        self,
        source_sets: Sequence[Sources],
        out: AnyArray | None = None,
        progress: bool = False,
        dtype: npt.DTypeLike | None = None,
        *,
        cutoff: float | None = None,
    ) -> AnyArray:
        """Distance from each of several sets of sources, solved in blocks, on all processors.

        Parameters
        ----------
        source_sets : sequence of sources
            k entries, each as for `distance`.
        out : (k, n) array of float, optional
            Where to write: an array, a `numpy.memmap`, a zarr array, or whatever has a shape and a dtype and takes
            ``out[start:stop] = rows``. A chunked array is written a whole row of chunks at a time.
        progress : bool
            Show a progress bar on standard error (extra ``cli``).
        dtype : float64 or float32, optional
            Of the result; float64, or that of `out`.
        cutoff : float, optional
            Distances beyond this are ``inf``.

        Returns
        -------
        (k, n) array of `dtype`, or `out`
            Row i is the distance from ``source_sets[i]``; the same as one by one to rounding, whatever the number of
            threads.

        Raises
        ------
        SourceError
            Before anything is solved, if an entry does not name sources; the message says which.
        ValueError
            If `out` has the wrong shape, cannot hold floats or cannot be written, if `dtype` is none for distances, or
            if `cutoff` is not positive.

        Notes
        -----
        Beside the result and one row of chunks of `out`, it holds at most 2 GiB, or what one query takes where that is
        more: 40 bytes per face. For sources inside faces it may be three times as much. The number of threads is that
        of the processors, or ``HEAT_IGL_NUM_THREADS``.
        """
        if not hasattr(source_sets, "__len__"):
            raise SourceError(f"source_sets must be a sequence of sets of sources, not {source_sets!r}: try distance")
        beyond = _cutoff(cutoff)
        chosen = list(self._named(source_sets))
        shape = (len(chosen), self.n_vertices)
        if out is None:
            out = np.empty(shape, float_type(dtype))
        elif tuple(out.shape) != shape or np.dtype(out.dtype).kind != "f":
            raise ValueError(f"out must be an array of floats of shape {shape}, not {out.dtype} of shape {out.shape}")
        elif dtype is not None and float_type(dtype) != out.dtype:
            raise ValueError(f"dtype is {np.dtype(dtype)}, but out holds {out.dtype}: leave one of them away")
        elif isinstance(out, np.ndarray) and not out.flags.writeable:
            raise ValueError("out is read-only: open a memmap with mode='r+'")
        write = row_writer(out)
        with progress_bar("distances", len(chosen), progress) as advance:
            for rows in self._blocks(chosen, len(chosen)):
                write(_within(beyond, rows).astype(out.dtype, copy=False))
                advance(len(rows))
        return out

    def iter_distances(self, source_sets: Iterable[Sources], dtype: npt.DTypeLike | None = None) -> Iterator[AnyArray]:
        """Distance from each of several sets of sources, a row as soon as its block is solved.

        Parameters
        ----------
        source_sets : iterable of sources
            Each as for `distance`; drawn from as the rows are taken, so it may be a generator without an end.
        dtype : float64 or float32, optional
            Of the rows.

        Yields
        ------
        (n,) array of `dtype`
            In the order of `source_sets`; no view of anything else.

        Raises
        ------
        SourceError
            When the row of an entry that does not name sources would be next; the message says which.
        ValueError
            At once, if `dtype` is none for distances.

        Notes
        -----
        Memory is bounded as for `distances`, whatever the number of sets; blocks are solved ahead on all processors
        while rows are being used.
        """
        row_type = float_type(dtype)
        if not isinstance(source_sets, Iterable):
            raise SourceError(f"source_sets must be an iterable of sets of sources, not {source_sets!r}: try distance")
        n_sets = len(source_sets) if isinstance(source_sets, Sized) else None
        blocks = self._blocks(self._named(source_sets), n_sets)
        return (row.astype(row_type) for rows in blocks for row in rows)

    def _named(self, source_sets: Iterable[Sources]) -> Iterator[SourceSet]:
        """The sources of each set; errors say which set they are in."""
        for i, sources in enumerate(source_sets):
            try:
                yield self._set(sources)
            except SourceError as error:
                raise SourceError(f"source_sets[{i}]: {error}") from None

    def _blocks(self, source_sets: Iterable[SourceSet], n_sets: int | None) -> Iterator[FloatArray]:
        """Distances of a block of sets after the other."""
        size, threads = block_size(len(self._operators.weights), n_sets, n_threads())
        return in_order(self._distances, in_blocks(source_sets, size), threads)

    def solve(self, sources: Sources) -> HeatSolution:
        """All three steps from `sources`, for a closer look; arguments and errors as for `distance`."""
        chosen = [self._set(sources)]
        emissions, u = self._diffuse(chosen)
        X, magnitude = self._field(emissions, u)
        if self._heat_order is not None:
            distance = self._heat_order.distances(emissions, u)
        else:
            distance = self._integrated(emissions, u)
        with np.errstate(under="ignore"):
            heat = u[:, 0] / self._emitter.unit(emissions[0]) / self._heat_flow.mean_mass
        direction = np.ascontiguousarray(X[:, 0].reshape(self._operators.dimension, -1).T)
        return HeatSolution(
            heat=heat,
            direction=direction,
            magnitude=np.ascontiguousarray(magnitude[:, 0]),
            distance=distance[0],
            t=self.t,
            diagnostics=self.diagnostics,
        )

    def _set(self, sources: Sources) -> SourceSet:
        return source_set(sources, self.n_vertices, self._given_faces)

    def _distances(self, source_sets: list[SourceSet]) -> FloatArray:
        """Distances (k, n) from k sets of sources."""
        emissions, u = self._diffuse(source_sets)
        if self._heat_order is not None:
            return self._heat_order.distances(emissions, u)
        return self._integrated(emissions, u)

    def _diffuse(self, source_sets: list[SourceSet]) -> tuple[list[Emission], FloatArray]:
        """Heat (n, k) from k sets of sources."""
        emissions = [self._emitter.emission(sources) for sources in source_sets]
        if self._heat_order is None:
            emissions = [self._emitter.on_time(emission) for emission in emissions]
        return emissions, self._heat_flow.solve(self._emitter.heat(emissions))

    def _field(self, emissions: list[Emission], u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Directions (d m, k) and their magnitude (m, k)."""
        domain = self._operators
        X = normalize(domain, u, self._fitted)
        magnitude = np.ones((len(domain.weights), u.shape[1]))
        if self._damped:
            magnitude = damping(domain, u, self.t, fitted=self._fitted)
        for column, emission in enumerate(emissions):
            self._emitter.guide(emission, X[:, column], magnitude[:, column])
        return X, magnitude

    def _integrated(self, emissions: list[Emission], u: FloatArray) -> FloatArray:
        """Distances (k, n) by step 3."""
        if self._poisson is None or self._descent is None:
            raise RuntimeError("this solver unfolds and has no Poisson problem")
        if any(emission.guides.any() for emission in emissions):
            X, magnitude = self._field(emissions, u)
            domain = self._operators
            divergence = domain.D @ (X * np.tile(magnitude, (domain.dimension, 1)))
        else:
            divergence = self._descent.divergence(u)
        phi = self._poisson.solve(divergence)
        if u.min() < _LOWEST_HEAT:
            for emission, its_u in zip(emissions, u.T, strict=True):
                self._warn_if_cold(its_u, emission)
        rows = zip(emissions, np.ascontiguousarray(phi.T), u.T, strict=True)
        return np.stack([self._emitter.settle(emission, its_phi, its_u) for emission, its_phi, its_u in rows])

    def _warn_if_cold(self, u: FloatArray, emission: Emission) -> None:
        """Heat that has underflowed has no gradient, and distance does not grow where X is 0: say so."""
        domain = self._operators
        components = domain.components
        cold = (np.abs(u) < _LOWEST_HEAT) & np.isin(components, components[emission.near.vertex])
        cold[emission.near.vertex] = False
        remedy = "raise t_coef"
        if self._heat_flow.boundary == "dirichlet":
            cold &= ~domain.boundary
            remedy += ", or let heat pass the boundary with boundary='average'"
        if cold.any():
            warnings.warn(
                f"no heat arrives at {int(cold.sum())} of {domain.n} vertices, where distances are too short: {remedy}",
                AccuracyWarning,
                stacklevel=4,
            )


def _cutoff(value: float | None) -> float | None:
    return None if value is None else _positive("cutoff", value)


def _within(cutoff: float | None, distances: FloatArray) -> FloatArray:
    if cutoff is not None:
        distances[distances > cutoff] = np.inf
    return distances


def _as_mesh(mesh: Mesh | ArrayLike, F: ArrayLike | None) -> Mesh:
    if isinstance(mesh, Mesh):
        if F is not None:
            raise TypeError("pass a Mesh alone, or positions V and faces F")
        return mesh
    if F is None:
        raise TypeError("faces F are missing: pass a Mesh, or positions V and faces F")
    return Mesh(mesh, F)


def heat_method_distance(V: ArrayLike, F: ArrayLike, sources: Sources, **options: Any) -> FloatArray:
    """Geodesic distance from `sources` in one call; to ask more than once, keep a `HeatMethodSolver`.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) or (m, 4) array_like
        Triangles or tetrahedra.
    sources : sources
        As for `HeatMethodSolver.distance`.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    (n,) float64
        See `HeatMethodSolver.distance`, for errors too.
    """
    return HeatMethodSolver(V, F, **options).distance(sources)


MODE = 1
