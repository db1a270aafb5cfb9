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
    (m,) float64
        For each face, the smallest ``e >= 0`` for which the triangle inequalities of ``l + e`` hold in that component
        by `margin` times the mean edge length there; exactly 0 if they already do, so that the lengths of a good mesh
        keep every bit.
    """
    least_slack = _MARGIN if margin is None else margin
    if not has_needles(np.ascontiguousarray(l).ravel(), least_slack):
        return np.zeros(len(l))
    # By columns: sums and maxima over rows of three take ten times as long.
    total = sum(l.T)
    slack = np.min([total - 2 * side for side in l.T], axis=0)
    component = connectivity.connected_components(F, int(F.max()) + 1)[F[:, 0]]
    n_faces = np.maximum(np.bincount(component), 1)
    least = np.full(len(n_faces), np.inf)
    np.minimum.at(least, component, slack)
    mean = np.bincount(component, total) / (3 * n_faces)
    return np.asarray(np.maximum(0.0, least_slack * mean - least)[component])
