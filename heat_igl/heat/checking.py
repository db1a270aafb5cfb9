"""Checks of answers by heat: bounds that need no reference, and comparisons with another engine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from heat_igl.errors import FactorizationError
from heat_igl.kernels.mesh import checking
from heat_igl.operators import Operators, Surface
from heat_igl.plan import Plan, sweep_plan
from heat_igl.sources import SourceSet
from heat_igl.sweep import SweepEngine, engine_through
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows import Engine, OperatorTriangles, WindowEngine
from heat_igl.windows.invariants import raise_to_lines, source_places

# Mean shortfall from which on all distances are raised to straight lines. On 95 shapes 0.002 and 0.01 give the same.
_RAISED = 0.005
# Values from which on a warning is issued: mean shortfall before distances are raised, largest shortfall if they are
# not, and steepness. With the defaults, scans and most models stay below 0.002, 0.02 and 0.012.
_SHORT_ON_AVERAGE, _SHORT_AT_WORST, _TOO_STEEP = 0.05, 0.06, 0.025
# Of tetrahedra, on which heat is less accurate: good ones of a box reach 0.05.
_SHORT_IN_VOLUMES, _WORST_IN_VOLUMES = 0.1, 0.2
# Vertices and edges to check. Of 33 answers on 11 meshes six are warned of, as by all vertices and edges, which take 4
# to 11 % of a query more; with a quarter of both one warning is missed.
_MOST_VERTICES, _MOST_EDGES = 2000, 1000
# Lines from many sources to fewer vertices.
_MOST_LINES = 16000
# From so many, lines to all vertices take a few percent of a query.
_VERY_FEW_SOURCES = 4
# Mean difference from a sweep from which on a warning is issued. A sweep is itself wrong by up to 3 %, mostly by less
# than 1. On 1262 answers over the zoo, heat was wrong by more than 5 % without a warning on none with this threshold
# (on 92 without the comparison), and by less than 2 % with one on 6; with 3 % on 11, with 4.5 % one was missed.
_DIFFERENT = 0.035
# Or largest difference, as a share of the largest distance: single vertices.
_DIFFERENT_AT_WORST = 0.125
# So many answers of a kind have to be nearer than this, in the mean and at worst, before others are trusted. On 3100
# random members of the kinds of the zoo, six answers each in eight orders, answers wrong by more than 5 % came after
# three near ones never, after two in 6 of 100 000, and after one in 40.
_ENOUGH, _NEAR_IN_MEAN, _NEAR_AT_WORST = 3, 0.02, 0.06
# Distances are kept from so many vertices: three on each of three components.
_MOST_KNOWN = 9
# A comparison of vertices with known distances alone says nothing of others.
_ROUNDING = 1e-9
_BY_SWEEP = Plan("sweep", None, "heat is compared with a sweep")
# Where distances along an edge differ by more than its length and this share of it, the difference is reduced to the
# length. On scans few edges are, which takes 3 to 20 % of a query; with a share of 0 it takes 9 to 28 %.
_STEEP = 0.04


class Comparison(NamedTuple):
    """How far an answer is from that of an independent engine.

    Attributes
    ----------
    mean : float
        Mean of ``|distance - other|`` over the vertices, as a share of the mean distance.
    largest : float
        Largest ``|distance - other|``, as a share of the largest distance.
    vertex : int
        Vertex where it is; -1 if no vertex but the sources is reached.
    """

    mean: float
    largest: float
    vertex: int

    @classmethod
    def of(cls, distance: FloatArray, other: FloatArray, start: float) -> Comparison:
        """Compare two answers (n,) that begin at `start`."""
        reached = np.flatnonzero(np.isfinite(distance) & np.isfinite(other) & (other > start))
        if not len(reached):
            return cls(0.0, 0.0, -1)
        length = other[reached] - start
        off = np.abs(distance[reached] - other[reached])
        worst = int(np.argmax(off))
        return cls(float(off.mean() / length.mean()), float(off[worst] / length.max()), int(reached[worst]))

    @property
    def is_near(self) -> bool:
        """Whether other sources of this kind may be expected not to be far off."""
        return self.mean < _NEAR_IN_MEAN and self.largest < _NEAR_AT_WORST

    def complaint(self) -> str | None:
        """The text of a warning, None if none is due: the size of the error, the place, and a remedy."""
        if self.mean <= _DIFFERENT and self.largest <= _DIFFERENT_AT_WORST:
            return None
        return (
            f"heat is off by {100 * self.mean:.1f} % on average and by {100 * self.largest:.1f} % of the largest "
            f"distance at vertex {self.vertex}, compared with another engine: use heat_igl.GeodesicSolver"
        )


class AnswerCheck(NamedTuple):
    """How far an answer violated the bounds that need no reference, at some thousand vertices and edges.

    Attributes
    ----------
    shortfall : float
        Mean of ``(line - distance) / line`` where distance is below the straight line from the nearest source, 0 at the
        other vertices: the answer is at least so much too short on average. NaN where no positions are known.
    largest_shortfall : float
        Largest ``line - distance``, as a share of the largest distance.
    shortest_vertex : int
        Vertex where it is; -1 if there is none.
    steepness : float
        Sum over edges of the excess of ``|phi_i - phi_j|`` over the length, as a share of the sum of lengths.
    steepest_vertex : int
        Vertex at the end of the edge with the largest excess; -1 if there is none.
    raised : bool
        Whether the answer was raised to straight lines after that.
    compared : Comparison or None
        How far the answer is from that of another engine; None if it was not compared, see `Comparisons`: never if the
        field has length 1 or a time step was asked for, and from points and curves on polygons.
    """

    shortfall: float
    largest_shortfall: float
    shortest_vertex: int
    steepness: float
    steepest_vertex: int
    raised: bool = False
    compared: Comparison | None = None

    def complaint(self, is_surface: bool) -> str | None:
        """The text of a warning, None if none is due: the size of the error or violation, the place, and a remedy."""
        if self.compared is not None:
            return self.compared.complaint()
        if is_surface:
            problem = self._problem(_SHORT_ON_AVERAGE, _SHORT_AT_WORST)
            remedy = "use GeodesicSolver, or heat_igl.geodesic_distance"
        else:
            problem = self._problem(_SHORT_IN_VOLUMES, _WORST_IN_VOLUMES)
            remedy = "take smaller or rounder tetrahedra"
        return None if problem is None else f"{problem}; {remedy}"

    def _problem(self, on_average: float, at_worst: float) -> str | None:
        if self.shortfall > on_average:
            lines = "straight lines, to which they were raised" if self.raised else "straight lines"
            return (
                f"heat gave distances at least {100 * self.shortfall:.1f} % too short on average, below {lines}, most "
                f"at vertex {self.shortest_vertex}"
            )
        if self.largest_shortfall > at_worst and not self.raised:
            return (
                f"heat gave distances up to {100 * self.largest_shortfall:.1f} % of the largest too short, below "
                f"straight lines, most at vertex {self.shortest_vertex}"
            )
        if self.steepness > _TOO_STEEP:
            return (
                f"distances differ by more than the lengths of edges, {100 * self.steepness:.1f} % on average, most at "
                f"vertex {self.steepest_vertex}"
            )
        return None


class Comparisons:
    """Compares answers of the heat method with those of another engine, which is independent of heat.

    The first three answers are compared for every kind of sources and each component. If all three are near, later
    ones are trusted; if one is not, all later ones are compared. An answer from a vertex is compared in any case if it
    is asymmetric: its distances to vertices compared earlier differ from their distances to it. The domain has
    triangles, or simplices.
    """

    def __init__(self, domain: Operators) -> None:
        self._domain = domain
        # By kind and component: how many answers were near; -1 after one that was not.
        self._near: dict[tuple[bool, ...], IntArray] = {}
        self._engine: Engine | None = None
        # Vertices that gave near answers, and the distances (n,) from them by the other engine.
        self._known: dict[int, FloatArray] = {}
        #: Of all comparisons, the one that is farthest off on average; None before the first.
        self.worst: Comparison | None = None

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_engine": None}

    def compare(self, distance: FloatArray, sources: SourceSet, is_doubtful: bool) -> Comparison | None:
        """Compare an answer (n,) if it `is_doubtful`, or others of its kind may be wrong; else None."""
        if self._domain.fans is not None and not sources.on_vertices_alone:
            return None  # the other engine's triangles are those of the fans
        # Heat treats sources on vertices, in faces, on curves, several of them, and those with offsets differently.
        has_places = (len(each) > 0 for each in (sources.vertices, sources.points.faces, sources.segments.faces))
        kind = (*has_places, sources.n_labels > 1, bool(sources.offsets.any()))
        near = self._near.setdefault(kind, np.zeros(self._domain.n_components, np.int64))
        components = self._components(sources)
        is_vertex = len(sources.vertices) == 1 and sources.on_vertices_alone and sources.vertex_offset[0] == 0
        is_trusted = not is_doubtful and near[components].min() >= _ENOUGH
        if is_trusted and not (is_vertex and self._is_asymmetric(distance, int(sources.vertices[0]))):
            return None
        engine = self._engine or self._made()
        other = engine.distance(sources)[: len(distance)]
        found = Comparison.of(distance, other, float(sources.offsets.min()))
        self.worst = found if self.worst is None else max(found, self.worst)
        if not found.is_near:
            near[components] = -1
        elif found.largest > _ROUNDING:
            near[components] += near[components] >= 0
            if is_vertex and len(self._known) < _MOST_KNOWN:
                self._known[int(sources.vertices[0])] = other
        # Tables that no later answer needs are not kept.
        self._engine = engine if (near < _ENOUGH).any() else None
        return found

    def _is_asymmetric(self, distance: FloatArray, vertex: int) -> bool:
        """Whether distances (n,) from a vertex differ in the median from those known in the other direction.

        By a share of the mean distance: beside a vertex, where others may be known, a small error is a large share.
        """
        off = sorted(abs(distance[v] - other[vertex]) for v, other in self._known.items() if 0 < other[vertex] < np.inf)
        reached = distance if self._domain.n_components == 1 else distance[np.isfinite(distance)]
        return len(off) > 0 and bool(off[len(off) // 2] > _DIFFERENT * reached.mean())

    def _made(self) -> Engine:
        domain, surface = self._domain, self._domain.surface
        if surface is None and domain.simplices is not None:
            return engine_through(domain.simplices)
        triangles = OperatorTriangles(domain)
        sweep = SweepEngine(triangles)
        if sweep_plan(sweep.measures, _BY_SWEEP).engine == "sweep":
            return sweep
        if surface is not None and domain.n > domain.n_given and (surface.unfolding.twin > -2).all():
            # On the added vertices a sweep is accurate, and windows would multiply on fans of many narrow triangles.
            # Where more than two faces meet, the cover that has these vertices is another surface.
            return SweepEngine(OperatorTriangles(domain, replace(surface, uncovered=None, V=None)))
        return WindowEngine(triangles)

    def _components(self, sources: SourceSet) -> IntArray:
        """The components (c,) that sources lie in."""
        if self._domain.n_components == 1:
            return np.zeros(1, np.int64)
        surface, vertices = self._domain.source_surface, [sources.vertices]
        if surface is not None:
            vertices += [surface.given_faces[places.faces, 0] for places in (sources.points, sources.segments)]
        return np.unique(self._domain.components[np.concatenate(vertices)])


class Checker:
    """Checks answers on one domain.

    Straight lines need positions V (n, 3) of the given vertices, or `Operators.simplices`. If it `holds` answers, those
    that violate bounds are moved inside. A field of length 1 is the paper's method, and a time step or a boundary that
    was asked for has a purpose: their answers are left as they are.
    """

    def __init__(self, domain: Operators, V: FloatArray | None, holds: bool) -> None:
        surface, simplices, referenced = domain.source_surface, domain.simplices, domain.referenced[: domain.n_given]
        if V is None and simplices is not None:
            V = simplices.lines
        self._V, self._holds = None if V is None else np.ascontiguousarray(V, np.float64), holds
        self._surface, self._F = surface, None if surface is None else surface.given_faces
        self._referenced, self._uses_all = referenced, bool(referenced.all())
        self._vertices = _sample(np.flatnonzero(referenced), _MOST_VERTICES)
        ends, length = np.empty((0, 2)), np.empty(0)
        if surface is not None:
            faces = surface.faces
            edges = _sample(faces.edges, _MOST_EDGES)
            ends, length = np.column_stack([faces.tail(edges), faces.head(edges)]), faces.l.ravel()[edges]
        elif simplices is not None:
            pairs, lengths = simplices.edges
            ends, length = _sample(pairs, _MOST_EDGES), _sample(lengths, _MOST_EDGES)
        self._edges = checking.EdgePaths(ends.astype(np.int32), length, domain.n)

    def check(self, distance: FloatArray, sources: SourceSet) -> AnswerCheck:
        """Check one answer (n,). A FactorizationError where it is no number.

        If answers are held, this one is moved in place: the mean error falls by a third on shapes on which heat is
        poor. Of many sources, straight lines are only taken where the answer is far below them:
        it takes a while to find the nearest source of every vertex.
        """
        if np.isnan(distance.max(initial=0.0)):
            raise FactorizationError(f"heat gives nan at vertex {np.isnan(distance).argmax()}{thinnest(self._surface)}")
        steepness, steepest = self._edges.steepness(distance)
        shortfall, largest, shortest = np.nan, np.nan, -1
        places = source_places(self._V, self._F, sources)
        if places is not None and not self._uses_all:
            # From a vertex that no face uses there is no distance.
            used = np.append(self._referenced[sources.vertices], np.ones(len(sources.points.faces), bool))
            places = (places[0][used], places[1][used]) if used.any() else None
        if places is not None:
            step = len(self._vertices) * len(places[0]) // _MOST_LINES + 1
            shortfall, most, shortest, farthest = checking.shortfall(distance, self._vertices, step, self._V, *places)
            largest = most / farthest if farthest > 0 else 0.0
        if self._holds and self._surface is not None:
            self._surface.paths.shorten(distance, share=_STEEP)
        is_worth_it = shortfall > _RAISED or len(sources.offsets) <= _VERY_FEW_SOURCES
        raised = self._holds and is_worth_it and raise_to_lines(distance, self._V, self._F, sources)
        return AnswerCheck(shortfall, largest, shortest, steepness, steepest, raised)


@contextmanager
def naming_thinnest(surface: Surface | None) -> Iterator[None]:
    """Let a `FactorizationError` name the thinnest face."""
    try:
        yield
    except FactorizationError as error:
        raise FactorizationError(f"{error}{thinnest(surface)}") from None


def thinnest(surface: Surface | None) -> str:
    """The first face with the least area for its size, and what to do; "" without a surface."""
    if surface is None:
        return ""
    F, longest = surface.given_faces, surface.faces.l.max(axis=1)
    share = np.divide(surface.faces.areas, longest**2, out=np.zeros(len(longest)), where=longest > 0)
    first = int(share[: len(F)].argmin())
    return f"; the thinnest face is F[{first}] = {F[first].tolist()}: repair it, and leave laplacian at 'auto'"


def _sample(items: AnyArray, most: int) -> AnyArray:
    """Every item, or some of more than `most`, evenly."""
    return np.ascontiguousarray(items[:: -(-len(items) // most)]) if len(items) else items
