"""Points that stand for curves, where only points are taken."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import grouping
from heat_igl.sources.source_sets import SourcePoints, SourceSegments
from heat_igl.typing import FloatArray


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
    which, piece = grouping.enumerate_runs(counts)
    share = (piece + 0.5) / counts[which]
    barycentric = (1 - share)[:, None] * segments.start[which] + share[:, None] * segments.end[which]
    points = SourcePoints(segments.faces[which], barycentric, segments.label[which], segments.offset[which])
    return points, lengths[which] / counts[which]
