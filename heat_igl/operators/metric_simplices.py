"""`MetricSimplices`: triangles or tetrahedra with edge lengths of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.mesh import incidence
from heat_igl.kernels.sweep.simplex_metrics import fits_around, lengths_in_velocity, velocities_at_corners
from heat_igl.kernels.sweep.simplex_updates import SimplexUpdate
from heat_igl.mesh import Mesh
from heat_igl.mesh.connectivity import PARTS, connected_components, edge_middles, group_by_label, mask_of
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

# Differences between tensors that are taken for rounding.
_ROUNDING, _TINY = 1e-9, np.finfo(float).tiny
# Rows and columns of the entries of a symmetric matrix on and above the diagonal.
_ABOVE = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class MetricSimplices:
    """Simplices that need not fit together: two of them may see the edge between them at different lengths.

    Attributes
    ----------
    corners : (m, p + 1) int64 or int32
        Vertices of each triangle (p = 2) or tetrahedron (p = 3).
    n : int
        Number of vertices.
    place : (n, 3) float64
        Positions in the space in which the metric is given.
    least : float or (n,) float64
        Smallest length in any metric, or any of the component of each vertex, per length in that space: no path is
        shorter than a straight line times this.
    lengths : (m, pairs) float64 or None
        Distances between the corners, pairs in the order of `np.tril_indices`, if not those in `tensors`.
    tensors, group : (k, 3, 3) float64, (m,) int32, or None
        Metrics, and which of them each simplex has; lengths are distances in space if there are neither these nor
        velocities.
    velocity : (k, 6) float64 or None
        Inverse roots of metrics; across a triangle it is the mean in its plane. Of the symmetric matrix the entries on
        and above the diagonal, row by row.
    rows : (m, p + 1) int32 or None
        The row of `velocity` at each corner; it is linear in between.
    is_given : bool
        Whether tensors, or positions without tensors, are those that the user gave in space: then distance has
        derivatives by them.
    incident : (n + 1,) and (m (p + 1),) int32, or None
        The corners at each vertex, as of `corners_by_vertex`, if they are known.
    labels : (n,) int64 or None
        The component of each vertex, if it is known.
    parts : tuple of MetricSimplices
        If components are of several kinds (in one metric, with `tensors`, with `velocity`), those of each kind.
    """

    corners: AnyArray
    n: int
    place: FloatArray
    least: float | FloatArray = 1.0
    lengths: FloatArray | None = None
    tensors: FloatArray | None = None
    group: AnyArray | None = None
    velocity: FloatArray | None = None
    rows: AnyArray | None = None
    is_given: bool = False
    incident: tuple[AnyArray, AnyArray] | None = None
    labels: IntArray | None = None
    parts: tuple[MetricSimplices, ...] = ()

    @classmethod
    def in_space(cls, mesh: Mesh) -> MetricSimplices:
        """The faces of a mesh, by the positions of its vertices."""
        return cls(mesh.F, mesh.n_vertices, mesh.V, is_given=True)

    @classmethod
    def in_metric(
        cls, mesh: Mesh, g: Any, least: Any, at_vertices: bool = False, root: Any = None, group: Any = None
    ) -> MetricSimplices:
        """The faces of a mesh with a metric (m, 3, 3) on each, or (n, 3, 3) at each vertex, and its `least` length.

        Where it is the same on a component, distance is that in space after a linear map. What `inverse_root` returns
        may be given, of triangles alone. Tetrahedra may have metrics (k, 3, 3) by `group`.
        """
        p, corners = mesh.F.shape[1] - 1, mesh.F.astype(np.int32)
        component = mesh.components
        space = cls(corners, mesh.n_vertices, mesh.V, least, is_given=p == 3, labels=component)
        unfolded, is_same = space, np.zeros(1, bool)
        if p == 3:
            unfolded, is_same = space._in_one_metric(g, corners if at_vertices else group)
        if is_same.all():
            return unfolded
        velocity, rows, _ = inverse_root(g, mesh, at_vertices) if root is None else root
        if at_vertices:
            made = replace(space, velocity=velocity, rows=corners if p == 3 else rows, is_given=True)
            return made._with_kinds(np.where(is_same, 0, 2), unfolded, made, made)
        # The velocities are taken for samples of a smooth field. Those at the corners of a simplex are fitted if at
        # each this explains all of the variance and is positive definite, and are those of the simplex if it leaves a
        # quarter or more at one, as it leaves of a step: jumps stay where they are.
        group = np.arange(len(corners), dtype=np.int32) if group is None else group
        incident = incidence.corners_by_vertex(corners, mesh.n_vertices)
        fit: Any = fits_around
        middle = _middles(component, corners, mesh.V, velocity, group)
        at_vertex, share = fit(corners, mesh.V, velocity, group, component.astype(np.int32), middle, *incident)
        is_smooth = mask_of(component[share > _ROUNDING], component.max() + 1)
        apart = smooth = replace(space, incident=incident)
        if not is_smooth.all():
            g = np.linalg.matrix_power(symmetric(velocity), -2) if g is None else g
            apart = replace(apart, tensors=g, group=group)
        if is_smooth.any():
            smallest, largest = inverse_root(at_vertex)[2].T
            share[smallest <= 0] = 0
            share[share >= 1 - _ROUNDING] = 1
            faces = corners if p == 2 else np.empty((0, 3), np.int32)
            velocity, rows, _ = velocities_at_corners(corners, at_vertex, velocity, group, share, faces, mesh.V, False)
            fitted = least_of_components(1 / np.maximum(largest, _TINY), component, component)
            least = np.minimum(least, fitted if is_smooth.all() else np.where(is_smooth[component], fitted, np.inf))
            smooth = replace(smooth, least=least, velocity=velocity, rows=rows, is_given=False)
        return space._with_kinds(np.where(is_same, 0, 1 + is_smooth), unfolded, apart, smooth)

    def _in_one_metric(self, g: FloatArray, rows: Any) -> tuple[MetricSimplices, BoolArray]:
        """The simplices after a linear map of each component, and whether that has one metric (k,).

        `rows` (m,) or (m, p + 1) are those of the metrics g of simplices, or at their corners; None if all in order.
        """
        component, corners = self.components, self.corners
        k = int(component.max()) + 1
        first, is_same = np.zeros(k, np.int64), np.ones(k, bool)
        if k == 1 and any(np.abs(some - g[0]).max() > _ROUNDING * np.abs(g[0]).max() for some in (g[-9:], g)):
            return self, ~is_same
        rows = np.arange(len(corners)) if rows is None else rows
        if k > 1:
            of = component[corners[:, 0]]
            first[of[::-1]] = np.arange(len(of))[::-1]
        own = g[rows[first] if rows.ndim == 1 else rows[first, 0]]
        if k > 1:
            apart = np.abs(g[rows] - (own[of] if rows.ndim == 1 else own[of][:, None])).reshape(len(of), -1)
            is_same[of[apart.max(axis=1) > _ROUNDING * np.abs(own).max(axis=(1, 2))[of]]] = False
        # |e|^2 = e^T g e = |C^T e|^2 with g = C C^T; relative to a vertex, as digits are lost far from the origin.
        place = self.place - self.place[corners[first, 0]][component]
        place = np.einsum("ni,nij->nj", place, np.linalg.cholesky(own)[component])
        return MetricSimplices(corners, self.n, place, labels=component), is_same

    def _with_kinds(self, kind: IntArray, *found: MetricSimplices) -> MetricSimplices:
        """The simplices of the one `kind` (k,) of the components, or the last of them with those of each as `parts`."""
        of = kind[self.components if len(kind) > 1 else 0 * self.components]
        kinds = np.flatnonzero(np.bincount(of[self.corners[:, 0]])).tolist()
        parts = (found[i].part(of == i) for i in kinds)
        whole: MetricSimplices = found[kinds[-1]]
        return replace(whole, parts=tuple(parts)) if len(kinds) > 1 else whole

    @classmethod
    def of_sides(cls, V: FloatArray, F: IntArray, sides: FloatArray, least: float) -> MetricSimplices:
        """Triangles (m, 3) whose sides (m, 3), opposite each corner, have lengths of their own."""
        # The tensor E^+ P E^+^T for edges E from the first corner with scalar products P.
        across = np.linalg.pinv(V[F[:, 1:]] - V[F[:, :1]])
        a, b, c = sides.T**2
        products = np.stack([c, (b + c - a) / 2, (b + c - a) / 2, b], axis=1).reshape(-1, 2, 2)
        tensors = across @ products @ np.swapaxes(across, 1, 2)
        return cls(F, len(V), V, least, sides[:, ::-1], tensors, np.arange(len(F)))

    @cached_property
    def measured(self) -> tuple[Any, ...]:
        """What `lengths_in_velocity` returns, or the same of one metric for each simplex."""
        if self.velocity is not None:
            corners = np.ascontiguousarray(self.corners, np.int32)
            return tuple(lengths_in_velocity(corners, self.place, self.velocity, self.rows))
        lengths = self.lengths
        if lengths is None:
            one, other = np.tril_indices(self.corners.shape[1], -1)
            lengths = np.empty((len(self.corners), len(one)))
            for begin in range(0, len(lengths), 2**14):  # tensors take several times the memory of lengths
                some = slice(begin, begin + 2**14)
                e = self.place[self.corners[some][:, one]] - self.place[self.corners[some][:, other]]
                by = e if self.tensors is None or self.group is None else e @ self.tensors[self.group[some]]
                lengths[some] = np.sqrt((by * e).sum(axis=2))
        mean, one_each = np.ascontiguousarray(lengths**2), np.ones(len(lengths))
        return None, mean, mean.max(axis=1), one_each, 0 * one_each, 0 * one_each

    @cached_property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex."""
        return connected_components(self.corners, self.n) if self.labels is None else self.labels

    @cached_property
    def sizes(self) -> IntArray:
        """Number of vertices in the component of each vertex (n,)."""
        return np.bincount(self.components)[self.components]

    def metric(self, chosen: IntArray, corner: IntArray | int) -> FloatArray:
        """The tensors (..., 3, 3) of chosen simplices (...) at corners (...)."""
        if self.tensors is not None and self.group is not None:
            return np.asarray(self.tensors[self.group[chosen]])
        if self.velocity is None or self.rows is None:
            raise ValueError("these simplices have lengths, and no tensors")
        root = symmetric(self.measured[0][self.rows[chosen, corner]])
        return np.asarray(root @ root)

    @property
    def is_in_space(self) -> bool:
        """Whether lengths are distances between the positions."""
        return self.tensors is None and self.velocity is None

    @property
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Edges (e, 2) of each simplex one after the other, and their lengths (e,) there."""
        ends = self.corners[:, np.stack(np.tril_indices(self.corners.shape[1], -1), axis=1)]
        kernel: Any = SimplexUpdate
        corners = np.ascontiguousarray(self.corners, np.int32)
        lengths = kernel(corners, self.velocity, self.rows, *self.measured[:-1], self.place).edge_lengths()
        return ends.reshape(-1, 2), lengths.ravel()

    @cached_property
    def lines(self) -> FloatArray:
        """Positions (n, 3) between which no path within a component is shorter than a straight line."""
        found = np.reshape(self.least, (-1, 1)) * self.place
        for part in self.parts:
            at = part.corners if part.is_in_space else part.corners[:0]
            found[at] = part.place[at]
        return found

    def part(self, is_there: BoolArray) -> MetricSimplices:
        """The simplices at some of the vertices (n,), which are those of components, with all vertices."""
        chosen = np.flatnonzero(is_there[self.corners[:, 0]])
        parts = [part for each in self.parts if len((part := each.part(is_there)).corners)]
        if len(parts) == 1:
            return parts[0]
        lengths, group, rows = (None if of is None else of[chosen] for of in (self.lengths, self.group, self.rows))
        own: Any = {"lengths": lengths, "group": group, "rows": rows, "incident": None, "parts": tuple(parts)}
        return replace(self, corners=self.corners[chosen], **own)

    def halved(self) -> MetricSimplices:
        """The simplices in their metric with all edges halved; the vertices keep their numbers."""
        corners, size, velocity = self.corners, self.corners.shape[1], None
        lengths, group, rows = self.lengths, self.group, self.rows
        cut: Any = lambda x: np.concatenate([x.take(part, axis=1) for part in PARTS[size]])  # noqa: E731
        ends, middle = edge_middles(corners, self.n)
        place = np.concatenate([self.place, self.place[ends].mean(axis=1)])
        corners = cut(np.concatenate([corners, self.n + middle.reshape(len(corners), -1)], axis=1))
        lengths = None if lengths is None else np.tile(lengths / 2, (len(PARTS[size]), 1))
        group = None if group is None else np.tile(group, len(PARTS[size]))
        if self.velocity is not None and rows is not None:
            one, other = np.tril_indices(size, -1)
            here = self.velocity[rows]
            velocity = np.concatenate([here, (here[:, one] + here[:, other]) / 2], axis=1).reshape(-1, 6)
            rows = cut(np.arange(len(velocity), dtype=np.int32).reshape(len(here), -1))
        return MetricSimplices(corners, len(place), place, self.least, lengths, self.tensors, group, velocity, rows)

    def halfway(self) -> sp.csr_array:
        """The weights (n + e, n) of the vertices in those of `halved`."""
        ends, _ = edge_middles(self.corners, self.n)
        e, column = len(ends), np.concatenate([np.arange(self.n), ends.ravel()])
        row = np.concatenate([np.arange(self.n), self.n + np.repeat(np.arange(e), 2)])
        return sp.csr_array((np.repeat([1, 0.5], [self.n, 2 * e]), (row, column)), shape=(self.n + e, self.n))


def _middles(component: IntArray, corners: AnyArray, V: FloatArray, W: FloatArray, group: AnyArray) -> FloatArray:
    """The mean position and velocity (k, 9) in each component (n,), of vertices at V and velocities W by `group`."""
    k = component.max() + 1
    middle, members = np.zeros((k, 9)), (group_by_label(of, k) for of in (component, component[corners[:, 0]]))
    for value, at, some in zip(middle, *(np.split(each.members, each.first[1:-1]) for each in members), strict=True):
        if len(some):
            count = np.bincount(group[some] - group[some].min())
            value[:] = *V[at].mean(axis=0), *(count @ W[group[some].min() :][: len(count)] / len(some))
    return middle


def least_of_components(values: FloatArray, of: IntArray, component: IntArray) -> FloatArray | float:
    """The least value (n,) in the `component` (n,) of each vertex, of values (r,) in components `of` (r,).

    One number if there is one component; 1 where there is no finite value.
    """
    if not component.any():
        return float(values.min())
    least = np.full(component.max() + 1, np.inf)
    np.minimum.at(least, of, values)
    least[np.isinf(least)] = 1
    return np.asarray(least[component])


def inverse_root(
    g: FloatArray, mesh: Mesh | None = None, at_vertices: bool = False
) -> tuple[FloatArray, AnyArray, FloatArray]:
    """Velocities, rows and eigenvalues as of `velocities_at_corners`, from metrics (k, 3, 3) or their entries (k, 6).

    Of triangles, those of each in its plane, or at each of its corners; else one for each metric. The roots are those
    of |g| where g is not positive definite.
    """
    above = g.reshape(-1, 9).take(np.ravel_multi_index(_ABOVE, (3, 3)), axis=1) if g.ndim == 3 else g
    corners, faces, V = np.arange(len(g), dtype=np.int32)[:, None], np.empty((0, 3), np.int32), np.empty((0, 3))
    if mesh is not None and not mesh.is_tetrahedral:
        faces, V = mesh.F.astype(np.int32), mesh.V
        corners = faces if at_vertices else corners
    group, share = np.zeros(len(corners), np.int32), np.ones(len(above))
    found: Any = velocities_at_corners(corners, above, above, group, share, faces, V, True)
    return tuple(found)


def symmetric(above: FloatArray) -> FloatArray:
    """Symmetric matrices (..., 3, 3) by their entries (..., 6) on and above the diagonal."""
    full = np.empty((*above.shape[:-1], 3, 3))
    full[..., *_ABOVE] = full[..., *_ABOVE[::-1]] = above
    return full


def equal_runs(values: FloatArray) -> tuple[FloatArray, AnyArray]:
    """The value (k, ...) of each run of equal rows (m, ...), as of the simplices of a voxel, and the run (m,) int32."""
    is_new = np.ones(len(values), bool)
    is_new[1:] = reduce(np.logical_or, (values[1:] != values[:-1]).reshape(len(values) - 1, values[0].size).T)
    each = values if is_new.all() else values[is_new]
    return each, np.cumsum(is_new, dtype=np.int32) - np.int32(1)
