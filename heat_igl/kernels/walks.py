"""The data of one query of the unfolding, and paths that end at sources inside faces."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.half_edges import HalfEdges
from cython.cimports.heat_igl.kernels.walks import REAL_BEND, View, seen_from_point, take
from cython.cimports.libc.math import sqrt

__all__ = ["Query"]

# Cones that may wait in a search.
_MAX_CONES = 256
_ADVICE = np.dtype([("saving", "f8"), ("promise", "f8"), ("side", "i4")], align=True)
_VIEW = np.dtype([(name, "f8") for name in "ax ay bx by rx ry lx ly".split()] + [("h", "i4"), ("spoke", "i4")])
_CONE = np.dtype([("view", _VIEW), ("forecast", "f8"), ("a", "i4"), ("b", "i4")])


@cython.final
@cython.cclass
class Query:
    """The tables, the known path of each vertex, and working memory.

    Parameters
    ----------
    tables : Tables
        The triangulation.
    walk : (n + p,) structures
        The known paths of n vertices and p sources inside faces; changed in place.
    points, rules, barrier
        As `heat_igl.unfolding.walks.unfold` has them.
    """

    def __init__(self, tables, walk, points, rules, barrier):
        self.t = HalfEdges(tables)
        self.walk, self.first_inside, self.inside = walk, points.first, points.inside
        self.tolerance, self.shortfall, self.max_steps = rules.tolerance, rules.shortfall, rules.max_steps
        self.has_holes, self.barrier, self.roughness = rules.has_holes, barrier, rules.roughness
        self.advice = np.zeros(np.diff(tables.first).max(), _ADVICE)
        self.cone = np.zeros(_MAX_CONES, _CONE)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def arrive(q: Query, view: View, wx: cython.double, wy: cython.double) -> cython.bint:
    """Try the straight paths to the sources inside the face behind a view; true if one is the shortest so far.

    The face is a, w, b. Only sources in the cone are seen in a straight line.
    """
    # From w, its face runs first to b and then to a.
    at_w: cython.int = view.h % 3
    at_b: cython.int = (at_w + 1) % 3
    at_a: cython.int = (at_w + 2) % 3
    entry: cython.int = q.first_inside[view.h // 3]
    arrived: cython.bint = False
    first = cython.address(q.t.spoke[view.spoke])
    while entry >= 0:
        point = cython.address(q.inside[entry])
        a: cython.double = point.barycentric[at_a]
        b: cython.double = point.barycentric[at_b]
        w: cython.double = point.barycentric[at_w]
        x: cython.double = w * wx + a * view.ax + b * view.bx
        y: cython.double = w * wy + a * view.ay + b * view.by
        slack: cython.double = 1e-12 * (x * x + y * y)
        distance: cython.double = q.walk[point.row].distance + sqrt(x * x + y * y)
        is_seen: cython.bint = view.rx * y - view.ry * x >= -slack and x * view.ly - y * view.lx >= -slack
        if is_seen and distance < q.found.distance:
            take(
                q,
                distance,
                point.row,
                x,
                y,
                REAL_BEND,
                view.spoke,
                -first.along,
                -first.height,
                seen_from_point(view, wx, wy, x, y) + point.turn,
            )
            arrived = True
        entry = point.following
    return arrived
