"""Derivatives by the sides of triangles of what steps 1 and 2 make of them: the flow's matrix and the mean length."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.operators import Elements, Operators
from heat_igl.steps.fitted import fit, fit_slope
from heat_igl.steps.normalization import lowest_full_rate
from heat_igl.typing import FloatArray

__all__ = ["ElementSlopes"]


class ElementSlopes:
    """The triangles that are solved on, and derivatives by the lengths of their sides, each computed on first use.

    Parameters
    ----------
    domain : Operators
        Triangles.
    time_steps : (n_components,) float64
        Time step of each component.
    t_damping : float, (n_components,) float64 or None
        Time step for `damping`; None for a field of length 1.
    fitted : bool
        Whether the heat flow is fitted to the lengths of edges.
    """

    def __init__(
        self, domain: Operators, time_steps: FloatArray, t_damping: float | FloatArray | None, fitted: bool
    ) -> None:
        self._domain, self._time_steps, self._t_damping, self._fitted = domain, time_steps, t_damping, fitted

    @cached_property
    def elements(self) -> Elements:
        """The triangles that are solved on, to differentiate by their sides."""
        return Elements(self._domain)

    @cached_property
    def flow(self) -> FloatArray:
        """How the entry t L of each side changes (3, m, 3): with its weight, its length and the time step.

        In a fitted L there is one entry for all sides between the same two vertices: the sum of their weights, not
        below 0, times the factor of the shortest.
        """
        elements = self.elements
        t = self._domain.expand_to_faces(self._time_steps)[:, None]
        if not self._fitted:
            return np.stack([t + np.zeros_like(elements.l), np.zeros_like(elements.l), elements.weight])
        pair, first = elements.pairs
        t_of_pair = t[first // 3, 0]
        x = elements.l.ravel()[first] / np.sqrt(t_of_pair)
        weight, factor = np.maximum(np.bincount(pair, elements.weight.ravel()), 0.0), fit(x)
        by_x = weight * fit_slope(x)
        slopes = np.zeros((3, elements.l.size))
        slopes[0] = np.where(weight > 0, t_of_pair * factor, 0.0)[pair]
        slopes[1, first] = by_x * np.sqrt(t_of_pair)
        slopes[2, first] = weight * factor - by_x * x / 2
        return slopes.reshape(3, -1, 3)

    @cached_property
    def full_rate(self) -> FloatArray:
        """The rate (m,) of `lowest_full_rate`; 0 for a field of length 1."""
        if self._t_damping is None:
            return np.zeros(len(self.elements.area))
        return lowest_full_rate(self._domain, self._t_damping, self._fitted)

    @cached_property
    def mean_length(self) -> FloatArray:
        """The derivative (m, 3) of the mean edge length of each component by the sides."""
        domain, elements = self._domain, self.elements
        edges = elements.edges
        mean = elements.l.ravel()[edges].mean()
        if domain.n_components == 1 and not np.isclose(mean, domain.mean_edge_length, rtol=1e-12):
            # On the mesh's own faces an edge of more than two faces counts once.
            edges = elements.pairs[1]
        component = domain.components[elements.i.ravel()[edges]]
        slopes = np.zeros(elements.l.size)
        slopes[edges] = 1 / np.bincount(component, minlength=domain.n_components)[component]
        return slopes.reshape(-1, 3)
