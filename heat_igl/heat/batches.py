"""Distances from many sets of sources: in blocks, on all processors, into an array or one after the other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from heat_igl.errors import AccuracyWarning, SourceError, checked_cutoff, errors_at, names_guessed, shown, truth
from heat_igl.mesh import Mesh, MeshPart, PointCloud, as_simplices
from heat_igl.operators import Operators
from heat_igl.runtime import (
    block_size,
    float_type,
    held_warnings,
    in_blocks,
    in_order,
    n_threads,
    progress_bar,
    row_writer,
    warn_caller,
)
from heat_igl.sources import Sources, SourceSet
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.heat.checking import AnswerCheck  # loads the sweep


class LabelledDistance(NamedTuple):
    """Distance and the source that it is measured from.

    Attributes
    ----------
    distance : (n,) float64
        As `HeatMethodSolver.distance` returns it.
    labels : (n,) int64
        The nearest source of each vertex; -1 if none reaches it, or none within the cutoff.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(6, 1)
    >>> found = heat_igl.HeatMethodSolver(mesh).voronoi([1, 6])
    >>> found.labels[:7].tolist()
    [0, 0, 0, 0, 1, 1, 1]
    """

    distance: FloatArray
    labels: IntArray


class BatchedSolver(ABC):
    """A solver for k sets of sources at a time, asked for any number of them."""

    _domain: Mesh | PointCloud | Operators
    _part: MeshPart | None = None

    @property
    def n_vertices(self) -> int:
        """Length of a distance array: the vertices of the mesh. The operators of a solver by heat may have more."""
        domain = self._domain
        return domain.n_given if isinstance(domain, Operators) else domain.n_vertices

    @property
    def referenced(self) -> BoolArray:
        """Mask (n,) of the vertices that a face uses."""
        domain = self._domain
        return (domain if isinstance(domain, Operators) else as_simplices(domain)).referenced[: self.n_vertices]

    @property
    def _n_faces(self) -> int:
        """Faces of the domain, by which the memory of a block is estimated."""
        return len(self._domain.weights) if isinstance(self._domain, Operators) else self._domain.n_faces

    @abstractmethod
    def _moved(self, V: ArrayLike) -> Self:
        """The solver on the same faces at other positions; errors are those of `with_vertices`."""

    @abstractmethod
    def _source_set(self, sources: Sources) -> SourceSet:
        """`sources`, checked."""

    @abstractmethod
    def _answers(
        self, source_sets: list[SourceSet], cutoff: float = np.inf, threads: int = 1
    ) -> tuple[FloatArray, Sequence[AnswerCheck | str | None]]:
        """Distances (k, n) from k sets of sources, and by how much each violates bounds or a text; on any thread.

        What is beyond the cutoff may be left ``inf``. A search may use `threads` threads.
        """

    @cached_property
    def _originals(self) -> IntArray | None:
        """The vertex (n,) whose values each takes, where seams were merged or points are equal."""
        return self._domain.originals if self._domain.has_copies else None

    def _with_copies(self, values: AnyArray) -> AnyArray:
        """Values (..., n) in which copies have those of their originals."""
        return values if self._originals is None else values[..., self._originals]

    def _complaint(self, distance: FloatArray, sources: SourceSet, check: Any) -> str | None:  # noqa: ARG002
        """The text of a warning about an answer (n,), if one is due; in the order of the sets, on one thread."""
        return check if isinstance(check, str) else None

    def with_vertices(self, V: ArrayLike) -> Self:
        """A new solver after the vertices have moved; this one stays as it is.

        Parameters
        ----------
        V : (n, 3) array_like
            New positions of all vertices.

        Returns
        -------
        GeodesicSolver or HeatMethodSolver
            With the same faces and options, and the same results as one made anew. By heat, the time step follows
            `t_coef`, unless `t` was given, and what depends on the faces alone is shared: they are not validated, and
            edges, boundary and components not found again; nor is the order of elimination, unless other edges are
            flipped.

        Raises
        ------
        MeshError
            If `V` cannot be used; the message names the first offender.
        ValueError
            If the solver was made from operators.
        """
        solver = self._moved(V)
        if self._part is not None and isinstance(solver._domain, Mesh):
            solver._part = replace(self._part, mesh=solver._domain)
        return solver

    @names_guessed
    def distance(self, sources: Sources, *, cutoff: float | None = None) -> FloatArray:
        """Distance from the nearest source.

        Parameters
        ----------
        sources : sources
            A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources`
            where distance begins at other values than 0, or a list of such.
        cutoff : float, optional
            Distances beyond this are ``inf``; a search by windows ends there.

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
            By heat, if it underflowed on the way, so that distances beyond are too short; if the answer is off by more
            than 3.5 % in the mean or 12.5 % of the largest distance at a vertex, compared with another engine, as the
            first three from such sources are; from points and curves on polygons, if it leaves bounds that need no
            reference by so much that it is wrong (see `AnswerCheck`). By the Hopf-Lax formula, where it shows
            that the mesh does not resolve the metric.
        """
        limit, chosen = checked_cutoff(cutoff), self._source_set(sources)
        (distance,), (check,) = self._answers([chosen], limit, n_threads())
        warn_of(self._complaint(distance, chosen, check))
        if limit < np.inf:
            distance[distance > limit] = np.inf
        return np.asarray(distance)

    @names_guessed
    def distances(
        self,
        source_sets: Sequence[Sources],
        *,
        out: AnyArray | None = None,
        progress: bool = False,
        dtype: npt.DTypeLike | None = None,
        cutoff: float | None = None,
    ) -> AnyArray:
        """Distance from each of several sets of sources, solved in blocks, on all processors.

        Parameters
        ----------
        source_sets : sequence of sources
            k entries, each as for `distance`.
        out : (k, n) array of float, optional
            Destination: an array, a `numpy.memmap`, a zarr array, or whatever has a shape and a dtype and takes
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
        Beside the result and one row of chunks of `out`, it holds at most 2 GiB, or the memory of one query if that is
        more: 40 bytes per face. For sources inside faces it may be three times as much. The number of threads is that
        of the processors, or ``HEAT_IGL_NUM_THREADS``.
        """
        if not _is_list(source_sets) or not isinstance(source_sets, Sized):
            raise SourceError(
                f"source_sets must be a sequence of sets of sources, not {shown(source_sets)}: try distance"
            )
        limit = checked_cutoff(cutoff)
        chosen = list(self._named(source_sets))
        shape = (len(chosen), self.n_vertices)
        if out is None:
            out = np.empty(shape, float_type(dtype))
        else:
            _check_destination(out, shape, dtype)
        write = row_writer(out)
        with progress_bar("distances", len(chosen), truth("progress", progress)) as advance:
            for rows in self._blocks(chosen, len(chosen), limit):
                rows[rows > limit] = np.inf
                write(rows.astype(out.dtype, copy=False))
                advance(len(rows))
        return out

    def iter_distances(self, source_sets: Iterable[Sources], dtype: npt.DTypeLike | None = None) -> Iterator[AnyArray]:
        """Distance from each of several sets of sources, a row as soon as the block is solved.

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
        if not _is_list(source_sets):
            raise SourceError(
                f"source_sets must be an iterable of sets of sources, not {shown(source_sets)}: try distance"
            )
        n_sets = len(source_sets) if isinstance(source_sets, Sized) else None
        blocks = self._blocks(self._named(source_sets), n_sets)
        return (row.astype(row_type) for rows in blocks for row in rows)

    def _named(self, source_sets: Iterable[Sources]) -> Iterator[SourceSet]:
        """The sources of each set; errors say which set they are in."""
        for i, sources in enumerate(source_sets):
            with errors_at(f"source_sets[{i}]"):
                chosen = self._source_set(sources)
            yield chosen

    def _blocks(
        self, source_sets: Iterable[SourceSet], n_sets: int | None, cutoff: float = np.inf
    ) -> Iterator[FloatArray]:
        """Distances of a block of sets after the other."""

        def solved(block: list[SourceSet]) -> tuple[list[SourceSet], FloatArray, Any, list[tuple[str, type[Warning]]]]:
            with held_warnings() as held:
                return block, *self._answers(block, cutoff), held

        size, threads = block_size(self._n_faces, n_sets, n_threads())
        solved_before, has_complained = 0, False
        for block, rows, checks, held in in_order(solved, in_blocks(source_sets, size), threads):
            # The caller's line is on this thread.
            for warning in held:
                warn_caller(*warning)
            for i, answer in enumerate(zip(rows, block, checks, strict=True)):
                # Once for the batch: if one answer is wrong, many are.
                complaint = None if has_complained else self._complaint(*answer)
                if complaint is not None:
                    has_complained = True
                    warn_of(f"source_sets[{solved_before + i}]: {complaint}")
            solved_before += len(rows)
            yield rows


def warn_of(complaint: str | None) -> None:
    """Warn the caller of an answer, if there is a complaint."""
    if complaint is not None:
        warn_caller(complaint, AccuracyWarning)


def _is_list(source_sets: object) -> bool:
    """Whether these are several entries, and neither a text nor a single number in an array."""
    single = isinstance(source_sets, (str, bytes)) or getattr(source_sets, "ndim", 1) == 0
    return isinstance(source_sets, Iterable) and not single


def _check_destination(out: AnyArray, shape: tuple[int, int], dtype: npt.DTypeLike | None) -> None:
    """Refuse an array `out` that distances of this shape and type cannot be written to."""
    if not hasattr(out, "shape") or not hasattr(out, "dtype"):
        raise ValueError(f"out must be an array of float64 or float32 of shape {shape}, not {shown(out)}")
    if tuple(out.shape) != shape or np.dtype(out.dtype).kind != "f" or np.dtype(out.dtype).itemsize < 4:
        # Half precision ends at 65504: larger distances would read inf, like vertices that no source reaches.
        raise ValueError(
            f"out must be an array of float64 or float32 of shape {shape}, not {out.dtype} of shape {out.shape}"
        )
    if dtype is not None and float_type(dtype) != out.dtype:
        raise ValueError(f"dtype is {np.dtype(dtype)}, but out holds {out.dtype}: leave one of them away")
    if isinstance(out, np.ndarray) and not out.flags.writeable:
        raise ValueError("out is read-only: open a memmap with mode='r+'")
