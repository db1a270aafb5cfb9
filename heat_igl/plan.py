"""Which engine, triangulation or fallback answers: every threshold that decides, with the measurement behind it.

Engines and operators measure; the decisions are made here, so that an engine does what it is asked for. Shares and
angles below were measured on scans and models, and on the shapes of `heat_igl.validation`, of which some are held out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from heat_igl.errors import MeshError, is_number, require_choice, shown
from heat_igl.typing import AnyArray, BoolArray

Engine = Literal["windows", "sweep", "lines", "hopf-lax", "heat"]
Method = Literal["auto", "windows", "exact", "sweep"]
DistanceMethod = Literal["auto", "windows", "exact", "sweep", "heat"]
DomainKind = Literal["triangles", "points", "tetrahedra", "varying metric", "separate simplices"]

#: How far around points and curves distance is taken from windows, in mean edge lengths: the cost grows with the
#: square. Mean error from points inside faces of the cow, the fandisk and the camel's head: 1.63, 0.75 and 0.77 % at 2;
#: 1.46, 0.72 and 0.72 % at 6; 1.62, 0.66 and 0.66 % at 12. From a curve 2.56, 3.86 and 4.26 %; 1.86, 2.79 and 3.29 %;
#: 1.53, 1.73 and 2.37 %.
NEAR_RADIUS = 6.0


@dataclass(frozen=True)
class Plan:
    """How a solver answers.

    Attributes
    ----------
    engine : {"windows", "sweep", "lines", "hopf-lax", "heat"}
        What finds the distance.
    tolerance : float or None
        The largest error over the distance; 0 for exact, None for engines without a bound.
    reason : str
        Why, in one sentence.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.GeodesicSolver(heat_igl.shapes.grid(8), tolerance=0).plan.engine
    'windows'
    """

    engine: Engine
    tolerance: float | None
    reason: str

    def __str__(self) -> str:
        accuracy = "" if self.tolerance is None else ", exact" if self.tolerance == 0 else f" to {self.tolerance:g}"
        return f"{self.engine}{accuracy}: {self.reason}"


# --- The engine of a distance ---

# A sweep is replaced by windows in four cases, in which both take about the same time. On up to so many vertices a
# query by windows takes a few milliseconds.
_FEW = 1000
# With more curvature than this at a vertex, in radians and in the mean, a sweep passes vertices on the wrong side. On
# plates, beams, voxels and terrain, most with 0.5 to 3 radians, it is wrong by up to 3.4 % of the largest distance;
# scans have 0.005 to 0.05, and a coarse cow 0.14.
_ROUGH_FOR_SWEEP = 0.25
# With this share of flat vertices and holes, windows stay few: they are not split by curvature.
_FLAT = 0.5
# Where large triangles (`LARGE_SHARE` below) cover the surface, a sweep is wrong by up to 3 % in the mean, and by 17 %
# of the largest distance at single vertices (CAD cylinders, thin plates, extruded polygons); elsewhere by at most 1.4
# and 5 %, over 10 members each of 15 kinds of shapes.


@dataclass(frozen=True)
class SurfaceMeasures:
    """What decides whether a surface is swept.

    Attributes
    ----------
    n : int
        Vertices.
    curvature : float
        Mean over the vertices of how far their angles are from those of a plane, in radians.
    flatness : float
        Share of the vertices without curvature, those on the boundary included.
    has_holes : bool
        Whether a component is neither a disk nor a sphere.
    large : float
        Share of the faces in components of large triangles: more than `LARGE_SHARE` of the area in triangles with a
        circumradius above `LARGE_RADIUS`.
    """

    n: int
    curvature: float
    flatness: float
    has_holes: bool
    large: float = 0.0


def distance_plan(kind: DomainKind, method: Method, tolerance: float) -> Plan:
    """The engine that measures distance on a domain.

    Raises
    ------
    ValueError
        If there is no such method, or the tolerance is not a number from 0 up to 1.
    MeshError
        If the method is not there for the domain.
    """
    require_choice("method", method, get_args(Method))
    if not (is_number(tolerance) and 0 <= tolerance < 1):
        raise ValueError(f"tolerance must be at least 0 and less than 1, not {shown(tolerance)}: 0 is exact")
    if kind in ("tetrahedra", "separate simplices"):
        if method in ("windows", "exact"):
            what = "the mesh holds tetrahedra" if kind == "tetrahedra" else "those of this metric do not fit together"
            raise MeshError(f"method={method!r} needs triangles that fit together, and {what}: take method='auto'")
        if kind == "tetrahedra":
            return Plan("lines", None, "shortest paths through tetrahedra are straight lines that bend around edges")
        return Plan("hopf-lax", None, "the metric changes between simplices, and the Hopf-Lax formula converges there")
    if kind == "varying metric" and method == "auto" and tolerance > 0:
        reason = "the metric varies within triangles, where the Hopf-Lax formula is nearer; windows answer from points "
        reason += "and curves, and distance_vjp for a metric or speed per face"
        return Plan("hopf-lax", None, reason)
    if method == "sweep":
        return Plan("sweep", None, "a sweep was asked for")
    if method == "auto" and kind == "points":
        return Plan("sweep", None, "between points the triangles are an estimate themselves")
    if method == "exact" or tolerance == 0:
        return Plan("windows", 0.0, "exact distance was asked for")
    return Plan("windows", float(tolerance), "windows are exact, which holds every tolerance, and need no factor")


def hopf_lax_is_nearer(variation: AnyArray, curvature: AnyArray) -> BoolArray:
    """Whether in components (k,) the Hopf-Lax formula is nearer than windows on triangles with one length an edge.

    The error of windows, to which the metric of a triangle is the same everywhere, grows with its variation: the mean
    square of how far lengths differ from corner to corner, as a share. That of the Hopf-Lax formula, to which fronts
    are those of the plane, grows with the mean curvature at vertices, in radians (docs/metrics_theory.md). A metric of
    single precision varies by rounding; at its unit both have errors of 0.002 % on flat grids.
    """
    return np.asarray(variation > curvature + np.finfo(np.float32).eps)


def sweep_plan(measures: SurfaceMeasures, plan: Plan) -> Plan:
    """The plan for a surface on which a sweep is due: windows where these cost little and a sweep is inaccurate."""
    reason = None
    if measures.n <= _FEW:
        reason = f"on {measures.n} vertices windows take as long as a sweep, and are exact"
    elif measures.curvature > _ROUGH_FOR_SWEEP:
        reason = f"the surface is rough, with {measures.curvature:.2g} radians of curvature at each vertex"
    elif measures.flatness > _FLAT and measures.has_holes:
        reason = "the surface is flat with holes, on which windows are few"
    elif measures.large > UNEVEN_SHARE:
        reason = "triangles are large, as in CAD parts, which a sweep from their corners does not resolve"
    return plan if reason is None else replace(plan, engine="windows", tolerance=0.0, reason=reason)


# With more of the faces within a cutoff, leaving out the others saves nothing.
MOST_WITHIN_REACH = 0.5

# --- The triangulation that heat is solved on ---

# A boundary edge opposite an obtuse angle keeps a negative weight, the cotangent of the angle. A few small ones do no
# harm: on scans their sum is at most 0.0012 of the number of vertices and none is below -1; on the shapes of the zoo
# (those that are not held out) with worse answers than on the cover, one is below -1.5 or the sum above 0.03.
STEEPEST_WEIGHT = -1.5
NEGATIVE_SHARE = 0.006
# Thin triangles are those with an angle below 20 degrees; they do harm where they cover the surface. Shares of the area
# are at most 0.27 on scans and models, and at least 0.37 on shapes of the zoo on which heat is wrong because of them.
THIN_SINE = float(np.sin(np.radians(20.0)))
THIN_SHARE = 0.3
# Large triangles are those with a circumradius of more than 1.5 square roots of the area per vertex; equilateral ones
# have 0.62. Shares of the area are at most 0.43 on scans and models, and at least 0.67 on such shapes of the zoo.
LARGE_RADIUS = 1.5
LARGE_SHARE = 0.55
# Share of triangles in components with many of these kinds, from which on the components are refined: a scan with a few
# stray triangles stays as it is.
UNEVEN_SHARE = 0.01
# With so few vertices a triangle of a component is large beside the distances that are asked for, and a thousand for
# each of some components cost nothing.
FEW_FOR_HEAT = 64
ENOUGH_FOR_HEAT = 1000
# Up to so many vertices, a body around whose edges ways bend is measured on halved tetrahedra as well: of a long edge,
# a part may see the source although neither end does, and then such an edge is too coarse a source itself. Also, every
# vertex looks for the only source, and for several again after bends, since a vertex may see a source that no vertex
# around it sees. On finer bodies both are rare, and take time.
SMALL_BODY = 1000
# Edges around which ways bend are cut if they are so many times as long as the sides of tetrahedra at their ends. Of
# 120 random bodies of 300 to 1300 vertices, 17 have ways that are more than 1 % longer there than back; 14 with 2, six
# with 1.5, five with 1.25, which takes 1.08 times as long.
LONG_EDGE = 1.5
# By how many percent distances in a varying metric may be wrong in the mean, and at a vertex, as slopes say. Of 235
# random fields, most of them held out, 77 are wrong by 5 % in the mean or 20 % at a vertex, of which three are missed;
# of 105 with less than 2 and 10 %, seven are named.
MOST_DOUBT, MOST_DOUBT_AT_WORST = 4.0, 10.0
# What circumradii of coarse meshes are refined to, in square roots of the area per vertex.
LARGEST_RADIUS = 1.4
# Growth by refinement: at most so many times the vertices, and some thousands more.
GROWTH, MORE = 4, 4000

# --- The time step of heat ---

# Mean angle by which the angles around a vertex differ from a full turn, from which on a surface is rough: scans and
# models have at most 0.5, voxels and noise at least 1.
ROUGH_FOR_HEAT = 0.7
# Share of vertices on the boundary from which on a surface is narrow: at most 0.28 on scans and models, 0.4 in a maze.
NARROW = 0.33
# Two rows on the boundary and one inside make 2/3. Above that a surface is one cell wide, heat goes along one line, and
# the larger time step follows it better: 1 % too short instead of 5 on a stroke of pixels.
ONE_CELL_WIDE = 0.7
# Between two aims, see docs/cost.md: on scans the error falls further with t, on a regular grid of squares, on which
# heat prefers diagonals, it grows.
T_COEF_FITTED = 0.5
# On rough and on narrow surfaces fronts bend at every vertex, and the less heat spreads the less it cuts corners: on
# voxels, noise and a maze the error at 0.15 is 0.2 to 0.8 of that at 0.5.
T_COEF_ROUGH = 0.15
# The paper's: t = h^2.
T_COEF = 1.0
# The sides of random points' triangles differ so much that heat needs a larger step, see docs/clouds_theory.md.
T_COEF_EVEN_POINTS, T_COEF_RANDOM_POINTS = 0.5, 1.0
# Median ratio of the longest to the shortest side above which points count as random: these have 1.9, the vertices of
# meshes 1.2 to 1.8.
RANDOM_SIDES = 1.82
# Heat that spreads over more than this many of the longest distances is level to 1e-10.
FARTHEST_SPREAD = 1e5

# --- The linear solver ---

# Below, SuperLU takes less time for both factors and ten queries (scripts/benchmark.py with both).
SMALLEST_MULTIFRONTAL = 1000
# With more entries of a factor than this many times n log2 n, SuperLU takes less time. Nested dissection by sweeps
# leaves at most 4.3 times as many on the zoo and scans, but 5.4, 10.4 and 10.8 times on capped cylinders of two rings
# of 4000, 6000 and 8000 vertices: their triangles grow away from the rings, so that most vertices are about as far from
# either end. Preparation for heat takes .4 to .5 of the time there.
MOST_FILL = 5.0


def heat_plan(n_given: int, n_solved: int, is_surface: bool, t: float, h: float) -> Plan:
    """The plan of the heat method: on which triangulation, and with which time step."""
    where = "on the given tetrahedra" if not is_surface else "on triangles between the given vertices"
    if n_solved > n_given:
        where = f"on triangles that are refined to {n_solved} vertices"
    return Plan("heat", None, f"heat was asked for, {where}, with t = {t / h**2:.3g} h^2")
