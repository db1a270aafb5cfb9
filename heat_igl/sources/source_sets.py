"""What a source is: all that a user may pass, checked once, as one set of vertices, points and segments of curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeGuard, cast

import numpy as np

from heat_igl.errors import SourceError, errors_at, raise_at_first, real_numbers, refuse_masked
from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import ON_SIDE, Mesh, MeshPart, SurfaceCurve, SurfacePoints, connectivity
from heat_igl.mesh.surface_points import points_beside, require_faces
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

_NOWHERE = np.empty(0, np.int64)
_ACCEPTED = "a vertex index, a sequence of vertex indices, or a boolean mask with one entry per vertex"
# At an offset, doubles may be so far apart in mean edge lengths: all distances beyond it are rounded by half of that.
_COARSEST = 1e-3


class SourcePoints(NamedTuple):
    """Points (k,) in faces, the label of the source that each belongs to, and the value at which distance begins."""

    faces: IntArray
    barycentric: FloatArray
    label: IntArray
    offset: FloatArray

    def joined(self, other: SourcePoints) -> SourcePoints:
        """These points and others."""
        return SourcePoints(*concatenated([self, other]))


class SourceSegments(NamedTuple):
    """Segments (s,) of curves, as `SourcePoints`."""

    faces: IntArray
    start: FloatArray
    end: FloatArray
    label: IntArray
    offset: FloatArray

    def ends(self) -> SourcePoints:
        """Starts and ends of segments."""
        places = [(self.faces, place, self.label, self.offset) for place in (self.start, self.end)]
        return SourcePoints(*concatenated(places))


NO_POINTS = SourcePoints(_NOWHERE, np.empty((0, 3)), _NOWHERE, np.empty(0))
NO_SEGMENTS = SourceSegments(_NOWHERE, np.empty((0, 3)), np.empty((0, 3)), _NOWHERE, np.empty(0))


@dataclass(frozen=True, eq=False)
class SourceSet:
    """One set of sources, checked: vertices (k,), ascending, each once, and points and segments of curves in faces.

    The label says which of `n_labels` sources each is, as the user counts them, and the offset at which value distance
    begins. The ends of segments are not among the points.
    """

    vertices: IntArray
    vertex_label: IntArray
    vertex_offset: FloatArray
    points: SourcePoints
    segments: SourceSegments
    n_labels: int

    @property
    def on_vertices_alone(self) -> bool:
        """Whether all sources are vertices."""
        return not len(self.points.faces) and not len(self.segments.faces)

    @property
    def offsets(self) -> FloatArray:
        """The offset of every vertex, point and segment."""
        if self.on_vertices_alone:
            return self.vertex_offset
        return np.concatenate([self.vertex_offset, self.points.offset, self.segments.offset])

    @property
    def labels(self) -> IntArray:
        """The label of every vertex, point and segment; then -1 for nothing, at which the index -1 looks."""
        return np.concatenate([self.vertex_label, self.points.label, self.segments.label, [-1]])

    def among(self, is_chosen: AnyArray) -> SourceSet:
        """Those of the source vertices that are chosen (n,)."""
        kept = is_chosen[self.vertices]
        own = {name: getattr(self, name)[kept] for name in ("vertices", "vertex_label", "vertex_offset")}
        return replace(self, **own)

    def with_offsets(self, offsets: FloatArray) -> SourceSet:
        """The same sources with other offsets, of every vertex, point and segment."""
        k = len(self.vertices)
        of_points, of_segments = np.split(offsets[k:], [len(self.points.offset)])
        points, segments = self.points._replace(offset=of_points), self.segments._replace(offset=of_segments)
        return replace(self, vertex_offset=offsets[:k], points=points, segments=segments)


def nearest_first(vertex: IntArray, value: FloatArray, label: IntArray) -> IntArray:
    """Indices of the smallest value at each vertex, vertices ascending; of equal values, that of the lowest label."""
    if len(vertex) < 2:
        return np.arange(len(vertex))
    order = np.lexsort((label, value, vertex))
    ordered = vertex[order]
    first = np.ones(len(order), bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(order[first])


@dataclass(frozen=True, eq=False)
class OffsetSources:
    """Sources at which distance begins at a value of their own.

    Parameters
    ----------
    sources : sources
        Vertices, `SurfacePoints`, a `SurfaceCurve`, or a list of such.
    offsets : float or (k,) array_like
        The value at each: one for all, or one for each vertex, point and curve in the order in which they are given.

    Raises
    ------
    SourceError
        If an offset is negative or not finite. That their number fits, and that distances can be told from them, is
        checked when the sources are used.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(10, 1)
    >>> starts = heat_igl.OffsetSources([0, 10], [0.0, 4.0])  # the right one begins at 4
    >>> heat_igl.geodesic_distance(mesh, starts)[:11].round(6).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 6.0, 5.0, 4.0]
    """

    sources: Sources
    offsets: FloatArray

    def __repr__(self) -> str:
        return f"OffsetSources({np.size(self.offsets)} offsets)"

    def __post_init__(self) -> None:
        offsets = real_numbers("offsets", self.offsets, SourceError)
        if offsets.ndim > 1:
            raise SourceError(f"offsets must be one number or one for each source, not of shape {offsets.shape}")
        wrong = ~(np.isfinite(offsets) & (offsets >= 0))
        raise_at_first(wrong, "offsets", offsets, "must be finite and not negative", error=SourceError)
        object.__setattr__(self, "offsets", offsets)


_PLACES = (SurfacePoints, SurfaceCurve, OffsetSources)
# A list may hold several kinds.
Sources = int | np.integer[Any] | Sequence[Any] | AnyArray | SurfacePoints | SurfaceCurve | OffsetSources


def source_set(
    sources: Sources,
    n: int,
    F: IntArray | None,
    mesh: Mesh | None = None,
    *,
    part: MeshPart | None = None,
    originals: IntArray | None = None,
    name: str = "sources",
) -> SourceSet:
    """All that a user may pass as sources, as one checked object; a `SourceError` names the first that is none.

    The error calls them `name`.

    Sources are counted as they are given: the i-th vertex of a sequence, the i-th set entry of a mask, the i-th of
    `SurfacePoints`, a curve as one; over the entries of a list, which may be nested, one after another. The domain has
    n vertices, and points and curves lie on the triangles F, None if there are none. Positions in space stand for the
    closest points of `mesh`, which has these triangles; without it they are an error. Of a `part` of a mesh, F are all
    triangles; the result has the faces of the part. A vertex stands for the one of which it is a copy in `originals`.
    """
    if isinstance(sources, (int, np.integer)) and not isinstance(sources, bool) and 0 <= sources < n:
        # Most queries, at a tenth of the cost.
        chosen = SourceSet(np.array([int(sources)]), np.zeros(1, np.int64), np.zeros(1), NO_POINTS, NO_SEGMENTS, 1)
    else:
        builder = _Builder(n, F, mesh, name)
        builder.add(sources)
        chosen = builder.finish()
    if originals is not None:
        vertices, label = originals[chosen.vertices], chosen.vertex_label
        kept = nearest_first(vertices, chosen.vertex_offset, label)
        chosen = replace(
            chosen, vertices=vertices[kept], vertex_label=label[kept], vertex_offset=chosen.vertex_offset[kept]
        )
    if part is not None:
        part.require_vertices(chosen.vertices, position=chosen.vertex_label)
        points, segments = chosen.points, chosen.segments
        points = points._replace(faces=part.numbers_of(points.faces, position=points.label))
        segments = segments._replace(faces=part.numbers_of(segments.faces, position=segments.label))
        chosen = replace(chosen, points=points, segments=segments)
    return chosen


def require_resolved(sources: SourceSet, mean_edge_length: float) -> SourceSet:
    """The same sources, if distances can be told from their offsets in double precision; else a `SourceError`."""
    offsets = sources.offsets
    if not offsets.any():
        return sources
    wrong = np.spacing(offsets) > _COARSEST * mean_edge_length
    if wrong.any():
        offset = float(offsets[np.argmax(wrong)])
        raise SourceError(
            f"an offset of {offset:.4g} is too large for a mesh with edges of {mean_edge_length:.4g} in the mean: "
            f"doubles are {np.spacing(offset):.2g} apart there, and distances would be lost; subtract the least offset "
            "from all, and leave out sources that begin after all others have arrived"
        )
    return sources


def vertex_sources(sources: Sources, n: int, name: str = "sources") -> IntArray:
    """The vertices (k,) that `sources` names, ascending, each once; else a `SourceError` that calls them `name`."""
    return np.asarray(np.unique(named_vertices(sources, n, name)), dtype=np.int64)


def named_vertices(sources: Sources, n: int, name: str = "sources") -> IntArray:
    """The vertices of n that `sources` names, in the order in which they are named; errors as for `vertex_sources`."""
    if isinstance(sources, _PLACES):
        raise SourceError(f"{name} must be {_ACCEPTED} here, not {type(sources).__name__}")
    refuse_masked(name, sources, SourceError)
    try:
        array = np.atleast_1d(np.asarray(sources))
    except ValueError:
        raise SourceError(f"{name} must be {_ACCEPTED}, not a ragged sequence") from None
    if are_positions(array):
        raise SourceError(
            f"{name} holds floats of shape {array.shape}: for vertices, convert with astype(int); for positions in "
            f"space, pass the nearest vertices, or of a surface the nearest places, closest_points(mesh, {name}).points"
        )
    if array.ndim != 1:
        raise SourceError(f"{name} must be {_ACCEPTED}, but it has shape {array.shape}")
    if not len(array):
        raise SourceError(f"{name} is empty: name at least one vertex")
    if array.dtype.kind == "b":
        if len(array) != n:
            raise SourceError(f"the mask {name} has {len(array)} entries, but the mesh has {n} vertices")
        if not array.any():
            raise SourceError(f"the mask {name} selects no vertex: set at least one entry")
        return np.flatnonzero(array)
    if array.dtype.kind not in "iu":
        is_float = array.dtype.kind == "f"
        found = f"floats such as {array[0]}; convert with int()" if is_float else f"{array.dtype} such as {array[0]!r}"
        raise SourceError(f"{name} must be {_ACCEPTED}, not {found}")
    remedy = f"the mesh has {n} vertices, so indices run from 0 to {n - 1}"
    raise_at_first((array < 0) | (array >= n), name, array, "is no vertex", remedy, SourceError)
    return np.asarray(array, dtype=np.int64)


def distinct_vertices(vertices: Any, n: int, name: str, originals: IntArray | None = None) -> IntArray:
    """As `named_vertices`, or the `originals` (n,) of these; a `SourceError` also if one of them is named twice."""
    named = named_vertices(vertices, n, name)
    named = named if originals is None else originals[named]
    values, counts = np.unique(named, return_counts=True)
    if len(values) < len(named):
        raise SourceError(f"{name} must be distinct, but vertex {values[counts > 1][0]} is there twice")
    return named


def are_positions(places: object) -> bool:
    """Whether `places` are positions in space, floats (3,) or (k, 3): no vertices, which are whole numbers."""
    try:
        array = np.asarray(places)
    except ValueError:
        return False
    return array.dtype.kind == "f" and array.ndim in (1, 2) and array.shape[-1] == 3


def _holds_places(sources: object) -> TypeGuard[Sequence[Any]]:
    """Whether a list, or a list nested in it, holds points or curves."""
    if not isinstance(sources, Sequence) or isinstance(sources, (str, bytes, range)):
        return False
    return any(isinstance(part, _PLACES) or _holds_places(part) for part in sources)


class _Builder:
    """Collects the parts of a set and counts the sources."""

    def __init__(self, n: int, F: IntArray | None, mesh: Mesh | None, name: str) -> None:
        self._n, self._F, self._mesh, self._name = n, F, mesh, name
        self._offset = np.empty(0)  # of each source so far
        self._vertices = [(_NOWHERE, _NOWHERE)]
        self._points: list[tuple[SurfacePoints, IntArray]] = []
        self._curves: list[tuple[SurfaceCurve, int]] = []

    def add(self, sources: Sources) -> None:
        start = len(self._offset)
        if isinstance(sources, OffsetSources):
            self.add(sources.sources)
            k = len(self._offset) - start
            if sources.offsets.ndim and len(sources.offsets) != k:
                raise SourceError(
                    f"offsets has {len(sources.offsets)} entries for {k} sources: give one for each, or one number"
                )
            self._offset[start:] += sources.offsets
        elif isinstance(sources, SurfacePoints):
            self._check_faces(sources)
            self._points.append((sources, self._counted(len(sources))))
        elif isinstance(sources, SurfaceCurve):
            self._check_faces(sources)
            label = self._counted(1)
            if (sources.start == sources.end).all():
                # A curve without length, such as the path from a vertex to itself, gives no heat. It is a point.
                self._points.append((SurfacePoints(sources.faces[:1], sources.start[:1]), label))
            else:
                self._curves.append((sources, int(label[0])))
        elif _holds_places(sources):
            for i, part in enumerate(sources):
                with errors_at(f"{self._name}[{i}]"):
                    self.add(part)
        elif self._mesh is not None and are_positions(sources):
            self.add(points_beside(self._mesh, cast(ArrayLike, sources), self._name))
        else:
            vertices = named_vertices(sources, self._n, self._name)
            if len(vertices) == self._n > 2 and vertices.max() <= 1:
                raise SourceError(f"{self._name} are {self._n} integers 0 and 1: a mask must be boolean: astype(bool)")
            self._vertices.append((vertices, self._counted(len(vertices))))

    def _counted(self, k: int) -> IntArray:
        start = len(self._offset)
        self._offset = np.concatenate([self._offset, np.zeros(k)])
        return np.arange(start, start + k)

    def _check_faces(self, places: SurfacePoints | SurfaceCurve) -> None:
        if self._F is None:
            raise SourceError("points and curves lie on triangles, and this domain has none: name vertices")
        require_faces(places, self._F, None if self._mesh is None else self._mesh.V)

    def finish(self) -> SourceSet:
        points, segments = self._points_in_faces() if self._points else NO_POINTS, NO_SEGMENTS
        if self._curves:
            rows = [(c.faces, c.start, c.end, np.full(len(c), label)) for c, label in self._curves]
            faces, start, end, label = concatenated(rows)
            segments = SourceSegments(faces, on_simplex(start), on_simplex(end), label, self._offset[label])
        vertices, label = concatenated(self._vertices)
        # A vertex that is named twice is the one with the smallest offset; of equal ones, the first.
        kept = nearest_first(vertices, self._offset[label], label)
        label = label[kept]
        return SourceSet(
            vertices=vertices[kept],
            vertex_label=label,
            vertex_offset=self._offset[label],
            points=points,
            segments=segments,
            n_labels=len(self._offset),
        )

    def _points_in_faces(self) -> SourcePoints:
        """All points but those in a vertex, which are counted among the vertices."""
        faces, barycentric, label = concatenated([(p.faces, p.barycentric, label) for p, label in self._points])
        barycentric = on_simplex(barycentric)
        in_vertex = barycentric.max(axis=1) == 1
        if self._F is not None and in_vertex.any():
            corner = barycentric[in_vertex].argmax(axis=1)
            self._vertices.append((self._F[faces[in_vertex], corner], label[in_vertex]))
        inside = ~in_vertex
        label = label[inside]
        return SourcePoints(faces[inside], barycentric[inside], label, self._offset[label])


def on_simplex(barycentric: FloatArray) -> FloatArray:
    """The same, with places that are as good as an edge or a vertex put there."""
    kept = np.where(barycentric < ON_SIDE, 0.0, barycentric)
    return np.asarray(kept / kept.sum(axis=1, keepdims=True))


def concatenated(rows: Sequence[tuple[Any, ...]]) -> list[AnyArray]:
    """The arrays of all rows, column by column."""
    return [np.concatenate(column) for column in zip(*rows, strict=True)]


def samples(
    triangulation: IntrinsicTriangulation, segments: SourceSegments, spacing: float | FloatArray
) -> tuple[SourcePoints, FloatArray]:
    """Points along segments, at most `spacing` apart on a triangulation, and the length of the piece around each.

    A point lies in the middle of its piece: there a linear function takes the mean over the piece.
    """
    faces, start = triangulation.locate(segments.faces, segments.start)
    _, end = triangulation.locate(segments.faces, segments.end)
    along = np.einsum("kc,kcx->kx", end - start, lay_out(triangulation.l[faces]))
    lengths = np.linalg.norm(along, axis=1)
    counts = np.ceil(lengths / spacing).astype(np.int64)
    which, piece = connectivity.enumerate_runs(counts)
    share = (piece + 0.5) / counts[which]
    barycentric = (1 - share)[:, None] * segments.start[which] + share[:, None] * segments.end[which]
    points = SourcePoints(segments.faces[which], barycentric, segments.label[which], segments.offset[which])
    return points, lengths[which] / counts[which]
