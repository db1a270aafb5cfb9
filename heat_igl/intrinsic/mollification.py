"""Mollification: longer edges, so that every triangle fulfils the triangle inequality (Sharp and Crane 2020)."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.mesh.gluing import has_needles
from heat_igl.mesh import connectivity
from heat_igl.typing import FloatArray, IntArray

__all__ = ["mollify"]

# The triangle inequality holds with this margin, in mean edge lengths.
_MARGIN = 1e-8


def mollify(l: FloatArray, F: IntArray, margin: float | None = None) -> FloatArray:
    """The length to add to the edges so that no triangle is degenerate (Sharp and Crane 2020, section 4.5).

    Parameters
    ----------
    l : (m, 3) float64
        Edge lengths, opposite each corner.
    F : (m, 3) int64
        Faces: each component has a mean edge length and an added length of its own.
    margin : float, optional
        1e-8 if not given.

    Returns
    -------
    (m, 3) float64
        The smallest ``e >= 0``, one for each component, for which the triangle inequalities of ``l + e`` hold there by
        `margin` times the mean edge length; exactly 0 if they already do, so that the lengths of a good mesh keep
        every bit. In components with faces whose corners all coincide, by that margin, ``max(l, 1e-8 mean)`` takes the
        place of l, which keeps every triangle inequality.

    Notes
    -----
    A triangle with a base b between sides of length 1 knows its angles at the base to 1e-16 / b, and the base lengthens
    paths by b at most: both are small with b = 1e-8. With b = 1e-12 around three corners in one place, exact windows
    left out vertices.
    """
    least_slack = _MARGIN if margin is None else margin
    if not has_needles(np.ascontiguousarray(l).ravel(), least_slack):
        return np.zeros_like(l)
    # By columns: sums and maxima over rows of three take ten times as long.
    total = sum(l.T)
    component = connectivity.connected_components(F, int(F.max()) + 1)[F[:, 0]]
    n_faces = np.maximum(np.bincount(component), 1)
    mean = np.bincount(component, total) / (3 * n_faces)
    floor = np.zeros(len(mean))
    point = component[np.max([*l.T], axis=0) <= least_slack * mean[component]]
    floor[point] = _MARGIN * mean[point]
    raised = np.maximum(l, floor[component, None])
    total = sum(raised.T)
    least = np.full(len(n_faces), np.inf)
    np.minimum.at(least, component, np.min([total - 2 * side for side in raised.T], axis=0))
    return np.asarray(raised - l + np.maximum(0.0, least_slack * mean - least)[component, None])
