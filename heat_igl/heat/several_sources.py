"""Several sources, told apart by more heat solves: which others overtake, and which is nearest to each vertex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.heat.source_terms import SourceTerm, right_hand_side
from heat_igl.steps import HeatFlow
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["drop_overtaken", "warmest_sources"]

# A source is overtaken if heat there is more than so many times the heat there if all began as late as this one. A
# front that has come before the source by a time x, as long as its way of x, is exp(x / sqrt(t)) times as warm as one
# that comes with it: 5 times after 1.1 mean edge lengths at the default t = h^2 / 2, and 2 or so since heat also falls
# as it spreads. Up to there the distance from either source is the same to within the error of the method.
_OVERTAKEN = 5.0
# Right-hand sides of labels solved together, as in a block of distances: more read the factors no more quickly.
_BLOCK = 8


def drop_overtaken(term: SourceTerm, heat_flow: HeatFlow, n: int) -> SourceTerm:
    """`term` without the sources that others overtake before they begin, and the values that others come before.

    Two solves tell: there the heat is many times the heat there if all began as late as this source does.
    """
    offsets = term.sources.offsets
    if offsets.min() == offsets.max():
        return term
    at_once = replace(term, delay=np.zeros_like(term.delay))
    u, u_at_once = heat_flow.solve(right_hand_side(n, [term, at_once])).T
    delay = np.zeros(term.sources.n_labels)
    delay[term.label] = term.delay

    def is_on_time(vertex: IntArray, label: IntArray) -> BoolArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            late = np.log(u[vertex]) >= np.log(u_at_once[vertex]) - delay[label] + np.log(_OVERTAKEN)
        # No heat comes to a vertex that no face uses. On the triangles of the mesh heat may be negative, and then says
        # nothing; the first source is never overtaken.
        return np.asarray(~late | (u_at_once[vertex] == 0) | (delay[label] == 0))

    anchors = term.anchors.at(is_on_time(term.anchors.vertex, term.anchors.label))
    return term.restricted(anchors.label, anchors, kept=is_on_time(term.near.vertex, term.near.label))


def warmest_sources(term: SourceTerm, heat_flow: HeatFlow, n: int) -> IntArray:
    """The source (n,) from which each vertex gets most heat, -1 if it gets none; a solve for each source."""
    labels = np.full(n, -1)
    most = np.zeros(n)
    present = np.unique(term.label)
    for block in np.split(present, range(_BLOCK, len(present), _BLOCK)):
        shares: list[FloatArray] = [term.share * (term.label == label) for label in block]
        parts = heat_flow.solve(right_hand_side(n, [term] * len(block), shares))
        warmest = parts.argmax(axis=1)
        heat = np.take_along_axis(parts, warmest[:, None], axis=1)[:, 0]
        labels = np.where(heat > most, block[warmest], labels)
        np.maximum(most, heat, out=most)
    labels[term.near.vertex] = term.near.label
    return labels
