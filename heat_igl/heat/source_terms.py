"""One set of sources as the heat method takes it: initial heat, right-hand sides, and distances near the sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from heat_igl.sources import SourceSet, nearest_first
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Seeds", "SourceTerm", "right_hand_side"]


@dataclass(frozen=True, eq=False)
class Seeds:
    """Exactly known distances: `value` (k,) at distinct vertices `vertex` (k,), from the source `label` (k,)."""

    vertex: IntArray
    value: FloatArray
    label: IntArray

    @classmethod
    def nearest(cls, several: Seeds) -> Seeds:
        """The smallest of several values at each vertex."""
        kept = nearest_first(several.vertex, several.value, several.label)
        return cls(several.vertex[kept], several.value[kept], several.label[kept])

    def at(self, chosen: BoolArray) -> Seeds:
        """Some of the seeds, by a mask (k,)."""
        return Seeds(self.vertex[chosen], self.value[chosen], self.label[chosen])


@dataclass(frozen=True, eq=False)
class SourceTerm:
    """One set of sources on a domain: a right-hand side of step 1, and the distances that are known beside it.

    Attributes
    ----------
    sources : SourceSet
        As the user gave it.
    vertex, label : (e,) int64
        Vertices that initial heat is put on, and the source that it belongs to.
    share, delay : (e,) float64
        How much of it: ``unit * share * exp(-delay)``.
    mass : (e,) float64
        Mass of those vertices, in units of the mean mass.
    largest_heat : float
        Largest value that heat may reach.
    anchors : Seeds
        Known distances that fix the level of the integrated phi.
    near : Seeds
        Known distances that the result takes over: at the sources and around them.
    seen : (g,) bool
        Which of `near` have their distance by windows. On faces with such corners, the field of step 2 is the gradient
        of these distances.
    far : Seeds
        Known distances of corners of the sources' own faces that are too far away to be among `near`.
    """

    sources: SourceSet
    vertex: IntArray
    label: IntArray
    share: FloatArray
    delay: FloatArray
    mass: FloatArray
    largest_heat: float
    anchors: Seeds
    near: Seeds
    seen: BoolArray
    far: Seeds

    @cached_property
    def unit(self) -> float:
        """The heat that a share of 1 stands for: as much as cannot exceed `largest_heat`.

        Rows of L sum to zero, so the maximum principle bounds the heat by the largest initial heat over mass.
        """
        at_vertex = self.share
        if len(at_vertex) > 1:
            _, which = np.unique(self.vertex, return_inverse=True)
            at_vertex = np.asarray(np.bincount(which, self.share), np.float64)[which]
        held = (self.mass > 0) & (at_vertex > 0)
        return self.largest_heat * float((self.mass[held] / at_vertex[held]).min(initial=1.0))

    def heat_of(self, share: FloatArray) -> FloatArray:
        """The initial heat (e,) of shares (e,) of the unit."""
        # The unit is inside the exponential, since exp(-delay) alone would underflow.
        with np.errstate(under="ignore"):
            return np.asarray(share * np.exp(np.log(self.unit) - self.delay))

    def restricted(self, labels: IntArray, anchors: Seeds, kept: BoolArray) -> SourceTerm:
        """The term of the sources in `labels` alone, with other anchors and those of `near` that are `kept` (g,)."""
        alive = np.isin(self.label, labels)
        return replace(
            self,
            vertex=self.vertex[alive],
            label=self.label[alive],
            share=self.share[alive],
            delay=self.delay[alive],
            mass=self.mass[alive],
            anchors=anchors,
            near=self.near.at(kept),
            seen=self.seen[kept],
        )


def right_hand_side(n: int, terms: Sequence[SourceTerm], shares: Sequence[FloatArray] | None = None) -> FloatArray:
    """Right-hand sides (n, k) of `HeatFlow.solve` for k terms, or for other `shares` of their units."""
    heat = np.zeros((n, len(terms)))
    shares = [term.share for term in terms] if shares is None else shares
    for column, term, share in zip(heat.T, terms, shares, strict=True):
        np.add.at(column, term.vertex, term.heat_of(share))
    return heat
