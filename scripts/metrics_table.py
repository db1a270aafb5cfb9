"""Distance in a metric per face, where metrics jump, and through bodies: errors, and times beside heat alone.

    python scripts/metrics_table.py metrics [--rows 48]        # tensors, speeds and two speeds, closed forms
    python scripts/metrics_table.py bodies [--points 20000]    # tetrahedra with closed forms
    python scripts/metrics_table.py walls [octopus.mesh ...]   # bodies with concave walls, or these files
    python scripts/metrics_table.py asymmetry [--sources 60]   # the way there and back in these bodies
    python scripts/metrics_table.py layers [--border 24]       # layers of metrics
    python scripts/metrics_table.py faces [--edge 20]          # a metric per face
    python scripts/metrics_table.py images [--edge 20]         # a speed per pixel
    python scripts/metrics_table.py grids [--pixels 192] [--voxels 24]  # beside fast marching; several sides, or 0
    python scripts/metrics_table.py smooth [--rows 48]         # tensors that change smoothly in bodies
    python scripts/metrics_table.py several [--rows 24]        # several sources beside single ones
    python scripts/metrics_table.py choice [cow.obj ...]       # windows beside the Hopf-Lax formula
    python scripts/metrics_table.py warnings [--rows 48]       # of how many answers, right or wrong
    python scripts/metrics_table.py polygons cow.obj --sources 8   # on the duals of these meshes, or their polygons

metrics and bodies: mean of |d - exact| / exact over ``--sources`` in percent, "-" where a method does not apply; "heat"
is the paper's method. Of bodies also how much too long the worst value is and how much below the straight line, and
seconds to make the solver and for a query.
walls: bodies cut out of even or random tetrahedra, against the same solver on tetrahedra halved twice, or once on more
than 3000 vertices: "finer" is an upper bound. Edges around which paths bend; the mean of |d - finer| / finer, the
largest differences, and how much the worst is below the straight line; milliseconds of a query, over heat in turn.
asymmetry: the same bodies, and distances between ``--sources`` vertices: how much longer one way is than back, at most,
in percent, and of how many pairs by more than .3 %.
layers, faces and images: Delaunay triangles of random points, or pixels, rotated, against shortest ways through
``--border`` points on each edge of a border, or ``--edge`` on all; mean and largest error, also with half as many
points, and per face of fim-python; ``--count`` meshes each.
grids: images and blocks with so many ``--pixels`` and ``--voxels`` a side, at their centres, from one of them, beside
scikit-fmm, whose front begins as a circle of 2.5 pixels, and pykonal, if they are installed. Mean and largest error in
percent, seconds of one query with its preparation, and memory; of ``--fields`` 0 to 3 alone, in their order.
smooth: a twisted cylinder and discs, and a cube with a speed that grows linearly, with tensors per simplex and at the
vertices, times over those of fim-python, which takes those per simplex; errors and time on halved edges over the last.
several: in the metrics of smooth, at the vertices, the mean and largest difference from the least of the distances from
single sources, and time over that from one, from 3 and 30 vertices and the 30 vertices nearest to one.
choice: what `hopf_lax_is_nearer` compares, and mean errors in closed form or against triangles cut into 4 or 16.
warnings: answers on smooth and ``--count`` random fields, wrong by 5 % in the mean or 20 at a vertex, which of them are
silent, and right within 2 and 10 %, which of them warn.
polygons: mean errors of heat on triangles of the polygons and around virtual vertices, from exact distance there.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

import heat_igl
from heat_igl import GeodesicSolver, Mesh, metric_operators, read_polygon_mesh, shapes, speed_operators
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.mesh import PolygonFans
from heat_igl.operators import MetricSimplices, Operators
from heat_igl.operators.suitability import mean_angle_defects
from heat_igl.runtime.memory import PeakMemory
from heat_igl.sources import source_set
from heat_igl.sweep import HopfLaxEngine
from heat_igl.sweep.bodies import OrderedBody
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.validation.closed_forms import around_the_edge, by_fermat, straight
from heat_igl.validation.construction import carved, compact, dual, tetrahedra

from harness import (
    Query,
    Row,
    Table,
    collected,
    mean_error,
    moved_inside,
    named,
    ours,
    parsed,
    publish,
    seconds,
    warned,
)

Random = np.random.Generator
Cut = Callable[[FloatArray], BoolArray]
Faces = tuple[Mesh, FloatArray]
Samples = Iterator[tuple[str, FloatArray]]
METHODS = {"default": ours(), "heat": ours("heat", magnitude="unit")} | {m: ours(m) for m in ("sweep", "windows")}
Field = tuple[str, Mesh, Callable[[FloatArray], FloatArray], int, Query]
# Cells across layers, and across a mesh with a metric per face.
ACROSS, FINE = 30, 18
# A body of more vertices is halved once for its reference.
MANY = 3000


# Closed forms in the plane.


def plane(rows: int, rng: Random, border: float = np.nan) -> Mesh:
    """The unit square, with vertices inside moved by a quarter of an edge; those at x = `border` stay there."""
    mesh = shapes.grid(rows)
    return moved_inside(mesh, rng, 0.25 / rows, mesh.V[:, 0] == border)


def metrics(rows: int, rng: Random) -> Iterator[tuple[str, Operators, Query]]:
    for ratio in (1.0, 10.0, 100.0):
        mesh = plane(rows, rng)
        A = np.diag([ratio, 1, 1]) @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]])
        domain = metric_operators(mesh, np.tile(A.T @ A, (mesh.n_faces, 1, 1)))
        yield f"one tensor, 1 : {ratio:g}", domain, lambda i, V=mesh.V @ A.T: straight(V, i)
    for contrast in (1e1, 1e3, 1e6):
        mesh = moved_inside(shapes.strip(8 * rows // 2, rows // 2), rng, 0.25)
        V = mesh.V
        k = np.log(contrast) / np.ptp(V[:, 0])
        unrolled = np.exp(-k * (V[:, 0] + 1j * (V[:, 1] - V[:, 1].mean()))) / k
        domain = speed_operators(mesh, np.exp(k * V[mesh.F][:, :, 0].mean(axis=1)))
        yield f"speed growing exponentially, 1 : {contrast:g}", domain, lambda i, z=unrolled: np.abs(z - z[i])
    for left, right in ((1.0, 2.0), (1.0, 1e3), (1e3, 1.0), (1.0, 1e6), (1e6, 1.0)):
        mesh = plane(rows, rng, border=0.5)
        domain = speed_operators(mesh, np.where(mesh.V[mesh.F][:, :, 0].mean(axis=1) < 0.5, left, right))
        truth = lambda i, V=mesh.V, two=(left, right): by_fermat(V, i, *two)  # noqa: E731
        yield f"two speeds, {left:g} beside {right:g}", domain, truth


def on_metrics(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    for name, domain, truth in metrics(options.rows, rng):
        sources = rng.choice(domain.n_given, options.sources, replace=False).tolist()
        chosen = [method for method in METHODS if method != "windows" or domain.surface is not None]
        yield {"metric": name} | {m: mean_error(METHODS[m](domain), sources, truth) for m in chosen}


# Closed forms in bodies.


def bodies(points: int, rng: Random) -> Iterator[tuple[str, Mesh, Query]]:
    """Boxes of even tetrahedra, Delaunay tetrahedra of random points, a cube without a quarter, and a hand."""
    ball = rng.random((2 * points, 3)) - 0.5
    convex = {
        "cube, even tetrahedra": shapes.box(round(points ** (1 / 3)) - 1),
        "cube, Delaunay tetrahedra": tetrahedra(rng.random((points, 3))),
        "ball, Delaunay tetrahedra": tetrahedra(ball[np.linalg.norm(ball, axis=1) < 0.5][:points]),
    }
    for name, mesh in convex.items():
        yield name, mesh, lambda i, V=mesh.V: straight(V, i)
    # A cube without the quarter x, y > 1/2, as many vertices.
    quarter = carved(2 * round((points / 6) ** (1 / 3)), lambda centre: (centre[:, :2] > 0.5).all(axis=1))
    yield "three quarters of a cube", quarter, lambda i: around_the_edge(quarter.V, i)
    cells = 9 * round((5 * points) ** (1 / 3) / 9)
    hand = carved(cells, lambda centre: ~in_hand(centre) | (np.abs(centre[:, 2] - 0.5) > 1 / 6))
    yield "palm and five fingers", hand, lambda i: across_hand(hand.V, i, cells)


def in_hand(centre: FloatArray) -> BoolArray:
    """A palm below y = 4/9, and above it five fingers, one ninth wide."""
    return (centre[:, 1] < 4 / 9) | (np.floor(9 * centre[:, 0]).astype(int) % 2 == 0)


def across_hand(V: FloatArray, i: int, cells: int) -> FloatArray:
    """Distance in the hand, which is as thick everywhere: exact distance on its plan, and the height beside it."""
    plan = shapes.grid(cells)
    plan = Mesh(plan.V, plan.F[in_hand(plan.V[plan.F].mean(axis=1))])
    number = {place: k for k, place in enumerate(map(tuple, np.rint(cells * plan.V[:, :2]).astype(int).tolist()))}
    on_plan = np.array([number[x, y] for x, y in np.rint(cells * V[:, :2]).astype(int).tolist()])
    flat = heat_igl.geodesic_distance(plan, int(on_plan[i]), method="exact")[on_plan]
    return np.asarray(np.hypot(flat, V[:, 2] - V[i, 2]))


def excess(found: FloatArray, other: FloatArray) -> FloatArray:
    """By how much distances are longer than others that are neither 0 nor infinite, in percent of these."""
    away = (other > 0) & np.isfinite(other)
    return 100 * (found[away] / other[away] - 1)


def below_lines(V: FloatArray, sources: Sequence[int], found: Sequence[FloatArray]) -> float:
    """By how much the worst distance is below the straight line, in percent."""
    return max(0.0, *(-excess(d, straight(V, i)).min() for i, d in zip(sources, found, strict=True)))


def in_bodies(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    for name, mesh, truth in bodies(options.points, rng):
        sources = rng.choice(mesh.n_vertices, options.sources, replace=False).tolist()
        row: Row = {"body": name, "n": mesh.n_vertices}
        for method in ("default", "heat"):
            start = time.perf_counter()
            query = METHODS[method](mesh)
            made = time.perf_counter()
            found = [query(i) for i in sources]
            row[method] = {"made": made - start, "asked": (time.perf_counter() - made) / len(sources)}
            over = [excess(d, truth(i)) for i, d in zip(sources, found, strict=True)]
            row[method] |= {"error": np.mean(np.abs(over)), "above": max(np.max(over), 0)}
            row[method]["below"] = below_lines(mesh.V, sources, found)
        yield row


# Bodies with concave walls.


def cut_out(n: int, cut: Cut, rng: Random) -> Mesh:
    """`carved`, but of Delaunay tetrahedra whose vertices are moved by up to 0.4 cells along each axis."""
    cube = tetrahedra(moved(shapes.box(n).V, 0.4 / n, rng))
    return compact(cube.V, cube.F[~cut(cube.V[cube.F].mean(axis=1))])


def moved(V: FloatArray, most: float, rng: Random) -> FloatArray:
    """Points away from a grid or a sphere, where Delaunay tetrahedra are not unique and Qhull leaves slits."""
    return V + rng.uniform(-most, most, V.shape)


def shell(hollow: float, points: int, rng: Random) -> Mesh:
    """A ball of radius 1 with a concentric hollow, 642 vertices on each wall, and random points between."""
    sphere = shapes.icosphere(3).V
    P = rng.uniform(-1, 1, (20 * points, 3))
    radius = np.linalg.norm(P, axis=1)
    between = P[(radius > hollow + 0.05) & (radius < 0.95)][:points]
    walls = moved(np.concatenate([hollow * sphere, sphere]), 1e-3, rng)
    ball = tetrahedra(np.concatenate([walls, between]))
    return compact(ball.V, ball.F[ball.F.max(axis=1) >= len(sphere)])


def ring(around: int, along: int, points: int, rng: Random) -> Mesh:
    """The inside of a torus of these vertices, and random points in it."""

    def in_tube(P: FloatArray, radius: float) -> BoolArray:
        return np.asarray(np.hypot(np.hypot(P[:, 0], P[:, 1]) - 1, P[:, 2]) < radius)

    P = rng.uniform(-1.4, 1.4, (20 * points, 3)) * [1, 1, 2 / 7]
    wall = moved(shapes.torus(around, along, 0.4).V, 1e-3, rng)
    hull = tetrahedra(np.concatenate([wall, P[in_tube(P, 0.34)][:points]]))
    return compact(hull.V, hull.F[in_tube(hull.V[hull.F].mean(axis=1), 0.4)])


def in_box(P: FloatArray, low: float | list[float], high: float | list[float]) -> BoolArray:
    return np.asarray(((np.asarray(low) < P) & (np.asarray(high) > P)).all(axis=1))


def in_ball(P: FloatArray, middle: list[float], radius: float) -> BoolArray:
    return np.asarray(np.linalg.norm(P - np.asarray(middle), axis=1) < radius)


def holes(P: FloatArray) -> BoolArray:
    return np.asarray((np.floor(5 * P[:, :2]).astype(int) % 2 == 1).all(axis=1))


def beyond_union(P: FloatArray) -> BoolArray:
    two = in_ball(P, [0.25, 0.25, 0.25], 0.25) | in_ball(P, [0.7, 0.4, 0.65], 0.3)
    return ~(two | in_box(P, [0.2, 0.2, 0.15], [0.8, 0.4, 0.4]))


def two_balls(P: FloatArray) -> BoolArray:
    return in_ball(P, [0.3, 0.3, 0.5], 0.3) | in_ball(P, [0.9, 0.8, 0.5], 0.4)


WALLS: dict[str, Callable[[Random], Mesh]] = {
    "cube, even": lambda _: shapes.box(15),
    "U, random": lambda rng: cut_out(9, lambda P: in_box(P, [1 / 3, 1 / 3, -1], [2 / 3, 2, 2]), rng),
    "block with a cavity, even": lambda _: carved(8, lambda P: in_box(P, 0.25, 0.75)),
    "block with a cavity, random": lambda rng: cut_out(10, lambda P: in_box(P, 0.25, 0.75), rng),
    "block with four holes, even": lambda _: carved(25, holes),
    "block with four holes, random": lambda rng: cut_out(15, holes, rng),
    "frame of rods, even": lambda _: carved(10, lambda P: (np.abs(P - 0.5) < 0.3).sum(axis=1) > 1),
    "shell": lambda rng: shell(0.5, 9000, rng),
    "thin shell without a vertex inside": lambda rng: shell(0.8, 0, rng),
    "torus": lambda rng: ring(16, 40, 400, rng),
    "torus without a vertex inside": lambda rng: ring(10, 25, 0, rng),
    "union of balls and a box, random": lambda rng: cut_out(14, beyond_union, rng),
    "cube without two balls, random": lambda rng: cut_out(10, two_balls, rng),
    "cube without two balls, fine": lambda rng: cut_out(24, two_balls, rng),
    "U, random, fine": lambda rng: cut_out(24, lambda P: in_box(P, [1 / 3, 1 / 3, -1], [2 / 3, 2, 2]), rng),
    "block with a cavity, even, fine": lambda _: carved(24, lambda P: in_box(P, 0.25, 0.75)),
    "block with a cavity, random, fine": lambda rng: cut_out(24, lambda P: in_box(P, 0.25, 0.75), rng),
    "block with four holes, random, fine": lambda rng: cut_out(25, holes, rng),
    "frame of rods, even, fine": lambda _: carved(30, lambda P: (np.abs(P - 0.5) < 0.3).sum(axis=1) > 1),
    "torus, fine": lambda rng: ring(32, 80, 9000, rng),
    "union of balls and a box, random, fine": lambda rng: cut_out(40, beyond_union, rng),
}


def finer(mesh: Mesh) -> Mesh:
    """The mesh, halved twice, or once."""
    fine = mesh.halved()
    return fine.halved() if mesh.n_vertices <= MANY else fine


def in_finer(mesh: Mesh) -> Query:
    """Distance at the vertices on tetrahedra that are halved."""
    fine = finer(mesh)
    # Of two sources, each vertex first looks for the nearer in space: the other is far away, in no tetrahedron.
    far = mesh.V.max(axis=0) + 10 * np.ptp(mesh.V, axis=0)
    solver = GeodesicSolver(Mesh(np.vstack([fine.V, far]), fine.F))
    return lambda i: solver.distance([i, fine.n_vertices])[: mesh.n_vertices]


def in_walls(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    given = {name: lambda _, mesh=mesh: mesh for name, mesh in named(options.meshes).items()}
    for name, make in (given or WALLS).items():
        mesh = make(rng)
        sources = rng.choice(np.unique(mesh.F), options.sources, replace=False).tolist()
        edges = OrderedBody(MetricSimplices.in_space(mesh)).reflex_edges[0]
        row: Row = {"body": name, "n": mesh.n_vertices, "edges": len(edges)}
        ours, heat = (METHODS[method](mesh) for method in ("default", "heat"))
        found = [(ours(i), heat(i))[0] for i in sources]  # the first prepares
        took = [[seconds(lambda i=i, q=q: q(i), time.process_time) for q in (ours, heat)] for i in 5 * sources]
        ratio = np.median([one / other for one, other in took])
        truth = in_finer(mesh)
        error = np.concatenate([excess(d, truth(i)) for i, d in zip(sources, found, strict=True)])
        row |= {"mean": np.abs(error).mean(), "longer": max(error.max(), 0), "shorter": max(-error.min(), 0)}
        row |= {"ms": 1e3 * np.median(took, axis=0)[0], "ratio": ratio}
        yield row | {"below": below_lines(mesh.V, sources, found)}


def both_ways(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    for name, make in WALLS.items():
        mesh = make(rng)
        ends, query = rng.choice(np.unique(mesh.F), options.sources, replace=False), METHODS["default"](mesh)
        there = np.array([query(i)[ends] for i in ends.tolist()])
        longer = 100 * (there - there.T) / np.maximum(there.T, np.finfo(float).tiny)
        yield {"body": name, "n": mesh.n_vertices, "most": longer.max(), "count": (longer > 0.3).sum()}


# Layers, and a metric for each face.


def strip(left: float, right: float, cells: int, across: int, rng: Random) -> FloatArray:
    """Corners (m, 3, 2) of Delaunay triangles; points are random inside, and evenly spaced along the sides."""
    V = np.stack(np.meshgrid(np.linspace(left, right, cells + 1), np.linspace(0, 1, across + 1)), axis=2)
    V[1:-1, 1:-1] = rng.uniform(V[0, 0] + 0.3 / across, V[-1, -1] - 0.3 / across, (across - 1, cells - 1, 2))
    V = V.reshape(-1, 2)
    F = Delaunay(V).simplices
    return V[F[np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]])) > 1e-12]]


def layered(n_layers: int, across: int, rng: Random) -> tuple[Mesh, IntArray]:
    """The unit square of strips, and the layer of each face."""
    borders = np.linspace(0, 1, n_layers + 1)
    strips = [strip(left, right, across // n_layers, across, rng) for left, right in pairwise(borders)]
    V, F = np.unique(np.concatenate(strips).reshape(-1, 2), axis=0, return_inverse=True)
    layer = np.repeat(np.arange(n_layers), [len(triangles) for triangles in strips])
    return Mesh(np.pad(V, ((0, 0), (0, 1))), F.reshape(-1, 3)), layer


def length(w: FloatArray, g: FloatArray) -> FloatArray:
    """Of vectors (..., 2) in metrics (..., 2, 2)."""
    return np.asarray(np.sqrt(np.einsum("...i,...ij,...j->...", w, g, w)))


def through_borders(V: FloatArray, source: int, g: FloatArray, n_points: int) -> FloatArray:
    """Distance (n,) in layers with metrics `g`: ways through points on the borders, until none is shorter."""
    edges = np.linspace(0, 1, len(g) + 1)
    x, y = np.meshgrid(edges[1:-1], np.append(np.linspace(0, 1, n_points), V[source, 1]))
    P = np.concatenate([V[[source]], np.column_stack([x.ravel(), y.ravel()])])
    legs = np.full((len(P), len(P)), np.inf)
    in_layer = [[np.flatnonzero((a <= X[:, 0]) & (X[:, 0] <= b)) for X in (P, V)] for a, b in pairwise(edges)]
    for metric, (k, _) in zip(g, in_layer, strict=True):
        legs[np.ix_(k, k)] = np.minimum(legs[np.ix_(k, k)], length(P[k] - P[k][:, None], metric))
    t = legs[0]
    while ((shorter := (t[:, None] + legs).min(axis=0)) < t * (1 - 1e-12)).any():
        t = shorter
    found = np.full(len(V), np.inf)
    for metric, (k, v) in zip(g, in_layer, strict=True):
        found[v] = np.minimum(found[v], (t[k] + length(V[v][:, None] - P[k], metric)).min(axis=1))
    return found


def through_edges(mesh: Mesh, source: int, g: FloatArray, n_points: int) -> FloatArray:
    """Distance (n,) with a metric per face: ways straight from point to point on the sides of a face."""
    V, F = mesh.V[:, :2], mesh.F
    E, number = np.unique(np.sort(F[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    s = np.arange(1, n_points + 1)[:, None] / (n_points + 1)
    P = np.concatenate([V, (V[E[:, :1]] * (1 - s) + V[E[:, 1:]] * s).reshape(-1, 2)])
    on_sides = len(V) + number.reshape(-1, 3, 1) * n_points + np.arange(n_points)
    nodes = np.sort(np.concatenate([F, on_sides.reshape(len(F), -1)], axis=1), axis=1)
    a, b = (nodes[:, k] for k in np.triu_indices(nodes.shape[1], 1))
    legs = length(P[b] - P[a], g[:, None]).ravel()
    # Two faces see an edge: the shorter length counts.
    key = (a * len(P) + b).ravel()
    order = np.lexsort([legs, key])
    key, first = np.unique(key[order], return_index=True)
    graph = csr_array((legs[order][first], np.divmod(key, len(P))), shape=(len(P), len(P)))
    return np.asarray(dijkstra(graph, directed=False, indices=source)[: len(V)])


def off(mesh: Mesh, source: int, g: FloatArray, truth: FloatArray, angle: float) -> FloatArray:
    """Errors of the default, in percent, on the mesh rotated by `angle`, with the metric of each face."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    in_space = np.pad(g, ((0, 0), (0, 1), (0, 1))) + np.diag([0, 0, 1])
    domain = metric_operators(Mesh(mesh.V @ turn.T, mesh.F), turn @ in_space @ turn.T)
    return np.abs(excess(GeodesicSolver(domain).distance(source), truth))


def speeds(values: Sequence[float] | FloatArray) -> FloatArray:
    return np.asarray(np.eye(2) / np.square(values)[:, None, None])


def fibres(angle: FloatArray, ratio: FloatArray | float) -> FloatArray:
    """Lengths across fibres are `ratio` times those along them."""
    return heat_igl.fibre_metric(np.column_stack([np.cos(angle), np.sin(angle)]), 1.0, ratio)[:, :2, :2]


def on_layers(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    cases: dict[str, tuple[int, Callable[[], FloatArray]]] = {}
    for c in (2, 10, 1000):
        for values in ((1, c), (c, 1), (1, c, 1), (c, 1, c)):
            name = f"{'two' if len(values) == 2 else 'three'} layers, {' beside '.join(map(str, values))}"
            cases[name] = len(values), lambda values=values: speeds(values)
    for ratios in ((3.0, 10.0), (10.0, 3.0)):
        name = "two layers, fibres 1 : {:g} beside 1 : {:g}".format(*ratios)
        cases[name] = 2, lambda ratios=ratios: fibres(rng.uniform(0, np.pi, 2), np.array(ratios))
    for name, (n_layers, make) in cases.items():
        yield {"case": name} | summary(layer_samples(n_layers, make, options, rng))


def layer_samples(n_layers: int, make: Callable[[], FloatArray], options: argparse.Namespace, rng: Random) -> Samples:
    """Errors from three sources in the first layer, on each mesh."""
    for _ in range(options.count):
        mesh, layer = layered(n_layers, ACROSS, rng)
        V, g, border = mesh.V[:, :2], make(), 1 / n_layers
        for place, x in (("border", border), ("beside", border - 1.5 / ACROSS), ("middle", border / 2)):
            away = np.linalg.norm(V - [x, rng.uniform(0.3, 0.7)], axis=1)
            source = int(np.where((V[:, 0] == border) == (x == border), away, np.inf).argmin())
            half, whole = (through_borders(V, source, g, n * ACROSS + 1) for n in (options.border // 2, options.border))
            yield place, off(mesh, source, g[layer], whole, rng.uniform(0, np.pi))
            yield "half", np.abs(excess(half, whole))


def image(ratio: int, rng: Random) -> Faces:
    """Pixels `ratio` times as long as wide, and a random speed of 1 to 10 for each, as a metric per face."""
    domain = heat_igl.image_domain(np.ones((12, 12), bool), [ratio, 1])
    return domain.mesh, speeds(domain.per_face(10 ** rng.random((12, 12))))


def on_images(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    for ratio in (1, 2, 3, 5, 8, 20):
        yield {"case": f"{ratio} : 1"} | summary(face_samples(partial(image, ratio, rng), options, rng))


def on_faces(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    def centres(mesh: Mesh) -> FloatArray:
        return np.asarray(mesh.V[mesh.F][:, :, :2].mean(axis=1))

    cases: dict[str, Callable[[Mesh], FloatArray]] = {
        f"random speeds, 1 to {c:g}": lambda mesh, c=c: speeds(c ** rng.random(mesh.n_faces))
        for c in (1.15, 3.0, 100.0)
    }
    for c in (3.0, 100.0):
        name = f"checkerboard, three cells to a field, 1 beside {c:g}"
        cases[name] = lambda mesh, c=c: speeds(c ** (np.floor(centres(mesh) * FINE / 3).sum(axis=1) % 2))
    for r in (2.0, 10.0, 30.0):
        cases[f"random fibres, 1 : {r:g}"] = lambda mesh, r=r: fibres(rng.uniform(0, np.pi, mesh.n_faces), r)
    for r in (5.0, 20.0):
        cases[f"smooth fibres, 1 : {r:g}"] = lambda mesh, r=r: fibres(np.sin(3 * centres(mesh)).sum(axis=1), r)

    for name, make in cases.items():
        case = lambda make=make: ((mesh := layered(1, FINE, rng)[0]), make(mesh))  # noqa: E731
        yield {"case": name} | summary(face_samples(case, options, rng))


def face_samples(make: Callable[[], Faces], options: argparse.Namespace, rng: Random) -> Samples:
    """Errors from one source on each mesh."""
    for _ in range(options.count):
        mesh, g = make()
        source = int(rng.integers(mesh.n_vertices))
        half, whole = (through_edges(mesh, source, g, n) for n in (options.edge // 2, options.edge))
        yield "default", off(mesh, source, g, whole, rng.uniform(0, np.pi))
        g_3 = np.pad(g, ((0, 0), (0, 1), (0, 1))) + np.diag([0, 0, 1])
        with suppress(ImportError):
            yield "fim", np.abs(excess(by_fim(mesh, g_3, source), whole))
        yield "half", np.abs(excess(half, whole))


# Grids, beside fast marching.


def grids(options: argparse.Namespace) -> Iterator[tuple[str, BoolArray, FloatArray, Callable[..., FloatArray], bool]]:
    """Names, masks, speeds at centres, exact distances from one, and whether speeds are given per cell; a unit cube."""
    for shape in [(k,) * 2 for k in options.pixels if k] + [(k,) * 3 for k in options.voxels if k]:
        *_, y, x = places = centres(shape)
        name, full, even = "pixels" if len(shape) == 2 else "voxels", np.ones(shape, bool), np.ones(shape)
        growing, linear = f"{name}, speed growing linearly, 1 : 20", 1 + 19 * places[0]
        fields = [
            (f"{name}, one speed", full, even, straight, False),
            (f"{name}, without a quarter", (x < 0.5) | (y < 0.5), even, around_the_edge, False),
            (f"{growing}, at vertices", full, linear, hyperbolic, False),
            (f"{growing}, per cell", full, linear, hyperbolic, True),
        ]
        yield from (fields[k] for k in options.fields)


def centres(shape: tuple[int, ...]) -> list[FloatArray]:
    return list(np.meshgrid(*((np.arange(k) + 0.5) / k for k in shape), indexing="ij"))


def hyperbolic(V: FloatArray, source: int, most: float = 20) -> FloatArray:
    """Travel time (n,) at a speed that grows from 1 to `most` along z, or along y in the plane."""
    speed = 1 + (most - 1) * V[:, 2 if np.ptp(V[:, 2]) > 0 else 1]
    apart = ((V - V[source]) ** 2).sum(axis=1)
    return np.asarray(np.arccosh(1 + (most - 1) ** 2 * apart / (2 * speed * speed[source])) / (most - 1))


def on_simplices(per_cell: bool, mask: BoolArray, speed: FloatArray, source: tuple[int, ...]) -> FloatArray:
    domain = heat_igl.image_domain(mask, [1 / k for k in mask.shape])
    made: Mesh | Operators = domain.mesh
    if per_cell:
        made = speed_operators(domain.mesh, domain.per_face(speed))
    elif np.ptp(speed) > 0:
        height = domain.mesh.V[:, mask.ndim - 1] - domain.mesh.V[domain.index.flat[0], mask.ndim - 1]
        at_vertices = speed.flat[0] + 19 * height
        made = metric_operators(domain.mesh, np.eye(3) / np.maximum(at_vertices, 1)[:, None, None] ** 2)
    return np.asarray(domain.image(GeodesicSolver(made).distance(int(domain.index[source]))))


def by_fmm(mask: BoolArray, speed: FloatArray, source: tuple[int, ...]) -> FloatArray:
    import skfmm

    dx, place = 1 / mask.shape[0], centres(mask.shape)
    away = np.sqrt(sum((x - x[source]) ** 2 for x in place))
    # The exact circle of two and a half pixels: from the source alone, errors are larger.
    radius = 2.5 * dx
    found = skfmm.travel_time(np.ma.MaskedArray(away - radius, ~mask), speed, dx) + radius / speed[source]
    return np.where(away < radius, away / speed[source], np.where(mask, np.asarray(found), np.inf))


def by_pykonal(mask: BoolArray, speed: FloatArray, source: tuple[int, ...]) -> FloatArray:
    import pykonal

    solver = pykonal.EikonalSolver(coord_sys="cartesian")
    shape = mask.shape + (1,) * (3 - mask.ndim)
    solver.velocity.min_coords, solver.velocity.npts = (0, 0, 0), shape
    solver.velocity.node_intervals = (1 / mask.shape[0],) * 3
    solver.velocity.values = np.where(mask, speed, 0).reshape(shape)
    node = (*source, 0)[:3]
    solver.traveltime.values[node] = 0
    solver.unknown[node] = False
    solver.trial.push(*node)
    solver.solve()
    return np.asarray(solver.traveltime.values).reshape(mask.shape)


def on_grids(options: argparse.Namespace, _: Random) -> Iterator[Row]:
    for name, mask, speed, exact, per_cell in grids(options):
        source = tuple(k // 3 for k in mask.shape)
        V = np.stack(
            [x.ravel() for x in reversed(centres(mask.shape))] + [np.zeros(mask.size)] * (3 - mask.ndim), axis=1
        )
        truth = np.where(mask, exact(V, int(np.ravel_multi_index(source, mask.shape))).reshape(mask.shape), 0)
        row: Row = {"grid": f"{name}, {' x '.join(map(str, mask.shape))}"}
        methods = {"default": partial(on_simplices, per_cell), "fmm": by_fmm, "konal": by_pykonal}
        for method, query in methods.items():
            with PeakMemory() as peak:
                row[method] = timed(truth, query, mask, speed, source)
            row[method] |= {"kB": (peak.bytes or np.nan) / 1e3 / mask.sum(), "GiB": (peak.bytes or np.nan) / 2**30}
        yield row


# Tensors that change smoothly.


def twist(x: FloatArray, angle: FloatArray, by: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (..., 3) turned about the third axis by an angle with the gradient `by`, and the metric of the map."""
    c, s = np.cos(angle), np.sin(angle)
    image = np.stack([c * x[..., 0] - s * x[..., 1], s * x[..., 0] + c * x[..., 1], x[..., 2]], axis=-1)
    J = np.zeros((*x.shape, 3))
    J[..., 0, 0], J[..., 0, 1], J[..., 1, 0], J[..., 1, 1], J[..., 2, 2] = c, -s, s, c, 1
    J[..., 0, :] -= image[..., 1:2] * by
    J[..., 1, :] += image[..., 0:1] * by
    return image, np.swapaxes(J, -1, -2) @ J


def twisted_body(x: FloatArray, k: float) -> tuple[FloatArray, FloatArray]:
    return twist(x, k * x[..., 2], np.array([0, 0, k]))


def twisted_disk(x: FloatArray, k: float) -> tuple[FloatArray, FloatArray]:
    return twist(x, k * (x**2).sum(axis=-1), 2 * k * x)


def cylinder(rings: int, rng: Random) -> Mesh:
    """Delaunay tetrahedra of points on disks of radius 1, up to the height 1.5; points inside are moved."""
    disk, levels = shapes.disk(rings), np.linspace(0, 1.5, round(1.5 * rings) + 1)
    V = np.concatenate([disk.V + np.array([0, 0, z]) for z in levels])
    is_inside = (np.hypot(V[:, 0], V[:, 1]) < 1 - 0.5 / rings) & (V[:, 2] > 0) & (V[:, 2] < 1.5)
    V[is_inside] = moved(V[is_inside], 0.2 / rings, rng)
    return tetrahedra(V)


def smooth(rows: int, rng: Random) -> Iterator[Field]:
    """Names, meshes, metrics (k, 3, 3) at places (k, 3), a source, and exact distances from any."""
    for k, rings in product((2.0, 4.0), (rows // 12, rows // 6, rows // 4)):
        mesh = cylinder(rings, rng)
        source = int(np.linalg.norm(mesh.V - [0.4, 0.3, 0.5], axis=1).argmin())
        name = f"twisted, 1 : {((k + np.hypot(k, 2)) / 2) ** 2:.2g}"
        exact = partial(straight, twisted_body(mesh.V, k)[0])
        yield name, mesh, lambda x, k=k: twisted_body(x, k)[1], source, exact
    for k, (where, place) in product((3.0, 5.0), (("the centre", 0.0), ("beside", 0.4))):
        for rings in (rows // 6, rows // 3, 2 * rows // 3, 4 * rows // 3):
            mesh = shapes.disk(rings)
            source = int(np.linalg.norm(mesh.V - [place, 0.75 * place, 0], axis=1).argmin())
            name = f"disc, 1 : {(k + np.hypot(k, 1)) ** 2:.3g}, from {where}"
            exact = partial(straight, twisted_disk(mesh.V, k)[0])
            yield name, mesh, lambda x, k=k: twisted_disk(x, k)[1], source, exact
    for c, place in ((3, 0.5), (20, 0.5), (20, 0.0)):
        for cells in (rows // 6, rows // 4, 5 * rows // 12):
            mesh = moved_inside(shapes.box(cells), rng, 0.25 / cells)
            source = int(np.linalg.norm(mesh.V - place, axis=1).argmin())
            metric = isotropic(lambda x, c=c: 1 + (c - 1) * x[:, 2])
            name = f"speeds 1 : {c}, from {'the middle' if place else 'a slow corner'}"
            yield name, mesh, metric, source, partial(hyperbolic, mesh.V, most=c)


def by_fim(mesh: Mesh, g: FloatArray, source: int) -> FloatArray:
    from fimpy.solver import create_fim_solver

    solver = create_fim_solver(mesh.V, mesh.F, np.linalg.inv(g), device="cpu", precision=np.float64)
    return np.asarray(solver.comp_fim(np.array([source]), np.zeros(1)))


def on_smooth(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    default = lambda mesh, g, source: GeodesicSolver(metric_operators(mesh, g)).distance(source)  # noqa: E731
    for name, mesh, metric, source, exact in smooth(options.rows, rng):
        centres = metric(mesh.V[mesh.F].mean(axis=1))
        row: Row = {"body": name, "n": mesh.n_vertices, "m": mesh.n_faces}
        asked = {"fim": (by_fim, centres), "face": (default, centres), "vertex": (default, metric(mesh.V))}
        row |= {method: timed(exact(source), query, mesh, g, source) for method, (query, g) in asked.items()}
        fine = mesh.halved()
        at_given = lambda *of, n=mesh.n_vertices: default(*of)[:n]  # noqa: E731
        halved = timed(exact(source), at_given, fine, metric(fine.V), source)
        row["halved"] = {key: halved[key] / row["vertex"][key] for key in halved}
        yield row | {m: row[m] | {"s": row[m]["s"] / row["fim"]["s"]} for m in ("fim", "face", "vertex")}


def from_several(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    done = set()
    for name, mesh, metric, source, _ in smooth(options.rows, rng):
        body = name.split(", from")[0]
        if (body, mesh.n_vertices) in done:
            continue
        done.add((body, mesh.n_vertices))
        solver = GeodesicSolver(metric_operators(mesh, metric(mesh.V)))
        near = np.linalg.norm(mesh.V - mesh.V[source], axis=1).argsort()
        solver.distances([[source]] * 3)  # the first answers are compared with others
        row: Row = {"body": body, "n": mesh.n_vertices}
        random = [rng.choice(mesh.n_vertices, k, replace=False) for k in (3, 30)]
        for key, chosen in zip(("few", "many", "region"), (*random, near[:30]), strict=True):
            start = time.process_time()
            least = np.min([solver.distance(vertex) for vertex in chosen], axis=0)
            one = (time.process_time() - start) / len(chosen)
            row[key] = timed(least, solver.distance, chosen)
            row[key]["s"] /= one
        yield row


def choices(options: argparse.Namespace, rng: Random) -> Iterator[Field]:
    yield from (field for field in smooth(options.rows, rng) if not field[1].is_tetrahedral)
    for cells in (options.rows // 4, options.rows // 2, options.rows):
        mesh, source = plane(cells, rng), (cells // 2) * (cells + 2)
        for c in (1.5, 3.0, 20.0):
            metric = isotropic(lambda x, c=c: 1 + (c - 1) * x[:, 1])
            yield f"speeds growing linearly, 1 : {c:g}", mesh, metric, source, partial(hyperbolic, mesh.V, most=c)
        unrolled = 0.1 ** (mesh.V[:, 1] + 1j * mesh.V[:, 0]) / np.log(10)
        metric = isotropic(lambda x: 10 ** x[:, 1])
        yield "speeds growing exponentially, 1 : 10", mesh, metric, source, lambda i, z=unrolled: np.abs(z - z[i])
    surfaces = {"square": plane(24, rng), "sphere": shapes.icosphere(4), "torus": shapes.torus(24, 60, 0.4)}
    for (name, mesh), c in product((surfaces | named(options.meshes)).items(), (0.01, 0.1, 0.5)):
        mesh = Mesh(mesh.V / np.ptp(mesh.V, axis=0).max(), mesh.F)
        metric = isotropic(lambda x, c=c: 1 + c * np.sin(9 * x[:, 0] + 2) * np.cos(8 * x[:, 1]))
        yield f"{name}, speeds in waves, 1 : {(1 + c) / (1 - c):.3g}", mesh, metric, 7, on_finer(mesh, metric)


def on_finer(mesh: Mesh, metric: Callable[[FloatArray], FloatArray]) -> Query:
    """Distance at the vertices on halved simplices, whose vertices have metrics of their own."""
    fine = finer(mesh)
    solver = GeodesicSolver(metric_operators(fine, metric(fine.V)))
    return lambda i: solver.distance(i)[: mesh.n_vertices]


def rough(count: int, rows: int, rng: Random) -> Iterator[Field]:
    """Random waves of directions in which lengths are up to 7 times as long, on a disc and in a body."""
    for name, mesh in [("disc", shapes.disk(rows // 2)), ("body", shapes.box(rows // 6))] * count:
        waves, phases, most = rng.uniform(-8, 8, (3, 3)), rng.uniform(0, 2 * np.pi, 3), rng.uniform(0, 4)
        along = lambda x, a=waves, b=phases, c=most: c * np.sin(x @ a + b)  # noqa: E731
        metric = lambda x, v=along: np.eye(3) + v(x)[..., None] * v(x)[..., None, :]  # noqa: E731
        yield f"random, {name}", mesh, metric, 0, on_finer(mesh, metric)


def on_warnings(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    counts: dict[str, FloatArray] = {}
    for name, mesh, metric, _, exact in [*smooth(options.rows, rng), *rough(options.count, options.rows, rng)]:
        for source in rng.choice(mesh.n_vertices, options.sources, replace=False).tolist():
            solver = GeodesicSolver(metric_operators(mesh, metric(mesh.V)))
            found, said = warned(lambda solver=solver, source=source: solver.distance(source))
            error = np.abs(excess(found, exact(source)))
            wrong, right = error.mean() > 5 or error.max() > 20, error.mean() < 2 and error.max() < 10
            now = np.array([1, wrong, wrong and not said, right, right and said], int)
            counts[name] = counts.get(name, 0) + now
    for name, found in counts.items():
        yield {"domain": name} | dict(zip(("n", "wrong", "silent", "right", "said"), found.tolist(), strict=True))


def isotropic(speed: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray], FloatArray]:
    return lambda x: np.eye(3) / speed(x)[:, None, None] ** 2


def on_choice(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    for name, mesh, metric, source, exact in choices(options, rng):
        for where, g in (("vertex", metric(mesh.V)), ("face", metric(mesh.V[mesh.F].mean(axis=1)))):
            domain = metric_operators(mesh, g)
            if domain.surface is None:
                continue
            simplices = MetricSimplices.in_metric(mesh, g, 0.0, at_vertices=where == "vertex")
            one = GeodesicSolver(domain, method="exact").distance(source)
            other = HopfLaxEngine(simplices).distance(source_set(source, mesh.n_vertices, None))
            off = [np.abs(excess(d, exact(source))).mean() for d in (one, other)]
            row: Row = {"field": f"{name}, per {where}", "n": mesh.n_vertices, "windows": off[0], "hopf": off[1]}
            row |= {"variation": simplices.measured[-1].mean()}
            row |= {"curvature": mean_angle_defects(intrinsic_triangulation(mesh), mesh.components)[0]}
            yield row | {"chosen": "windows" if domain.simplices is None else "Hopf-Lax"}


# Polygons, on triangles of theirs and around virtual vertices.


def on_polygons(options: argparse.Namespace, rng: Random) -> Iterator[Row]:
    domains = {"sphere, 642 polygons": dual(shapes.icosphere(3))}
    for path in options.meshes:
        mesh = read_polygon_mesh(path)
        domains[path.stem] = dual(mesh.triangles) if (mesh.degree == 3).all() else mesh
    for name, mesh in domains.items():
        sources, row = rng.choice(mesh.n_vertices, options.sources, replace=False).tolist(), {"mesh": name}
        fans = PolygonFans.of(mesh).mesh
        for key, domain, surface in (("triangles", mesh.triangles, mesh.triangles), ("virtual", mesh, fans)):
            truth = GeodesicSolver(surface, method="exact").distance
            row[key] = mean_error(ours("heat")(domain), sources, lambda i, d=truth, n=mesh.n_vertices: d(i)[:n])
        yield row


def timed(exact: FloatArray, query: Callable[..., FloatArray], *arguments: Any) -> Row:
    """Mean and largest error in percent, and seconds; nan if what it needs, or memory, is not there."""
    try:
        start = time.process_time()
        found = query(*arguments)
    except (ImportError, MemoryError):
        return dict.fromkeys(("mean", "largest", "s"), np.nan)
    took, off = time.process_time() - start, np.abs(excess(found, exact))
    return {"mean": off.mean(), "largest": off.max(), "s": took}


def summary(samples: Samples) -> Row:
    """Mean and largest, by column."""
    columns: dict[str, list[FloatArray]] = {}
    for column, found in samples:
        columns.setdefault(column, []).append(found)
    return {column: (np.concatenate(e).mean(), np.concatenate(e).max()) for column, e in columns.items()}


def both(key: str) -> str:
    return f"{{default[{key}]:.2g}} and {{heat[{key}]:.2g}}"


def mean_and_largest(**heads: str) -> dict[str, str]:
    return {f"{head}, %": f"{{{key}[0]:.2g}} and {{{key}[1]:.2g}}" for key, head in heads.items()}


def errors_and(unit: str, **heads: str) -> dict[str, str]:
    return {
        f"{head}, % and {unit}": f"{{{key}[mean]:.2g}} and {{{key}[largest]:.2g}}, {{{key}[s]:.2g}}"
        for key, head in heads.items()
    }


HALF = {"half": "reference, half the points"}
PER_FACE = mean_and_largest(default="default", fim="fim-python", **HALF)
TABLES: dict[str, tuple[Callable[[argparse.Namespace, Random], Iterator[Row]], dict[str, str]]] = {
    "metrics": (on_metrics, {"metric": "{metric}"} | {f"{method}, %": f"{{{method}:.2g}}" for method in METHODS}),
    "bodies": (in_bodies, {
        "body": "{body}", "vertices": "{n}", "default, %": "{default[error]:.2g}", "heat, %": "{heat[error]:.2g}",
        "too long, % (default and heat)": both("above"), "below lines, % (default and heat)": both("below"),
        "default, s + s": "{default[made]:.2g} + {default[asked]:.2g}",
        "heat, s + s": "{heat[made]:.2g} + {heat[asked]:.2g}",
    }),
    "walls": (in_walls, {
        "body": "{body}", "vertices": "{n}", "edges": "{edges}", "mean, %": "{mean:.2g}", "longer, %": "{longer:.2g}",
        "shorter, %": "{shorter:.2g}", "below lines, %": "{below:.2g}", "ms": "{ms:.0f}",
        "ratio to heat": "{ratio:.2g}",
    }),
    "asymmetry": (both_ways, {
        "body": "{body}", "vertices": "{n}", "longer than back, %": "{most:.2g}", "pairs by more than .3 %": "{count}",
    }),
    "layers": (on_layers, {"layers": "{case}"} | mean_and_largest(
        border="source on the border", beside="1.5 edges away", middle="in the middle", **HALF
    )),
    "faces": (on_faces, {"metric per face": "{case}"} | PER_FACE),
    "images": (on_images, {"pixels": "{case}"} | PER_FACE),
    "grids": (on_grids, {"grid": "{grid}"} | errors_and("s", default="default", fmm="scikit-fmm", konal="pykonal")
        | {"kB per cell": "{default[kB]:.1f}, {fmm[kB]:.1f}, {konal[kB]:.1f}"}
        | {"GiB": "{default[GiB]:.2g}, {fmm[GiB]:.2g}, {konal[GiB]:.2g}"}),
    "smooth": (on_smooth, {"domain": "{body}", "vertices": "{n}", "simplices": "{m}",
        "fim-python, %": "{fim[mean]:.2g} and {fim[largest]:.2g}",
        **errors_and("time", face="per simplex", vertex="at the vertices"),
        "with halved edges over that": "{halved[mean]:.2g} and {halved[largest]:.2g}, {halved[s]:.2g}",
    }),
    "several": (from_several, {"domain": "{body}", "vertices": "{n}"}
        | errors_and("time", few="3 sources", many="30 sources", region="30 beside each other")),
    "choice": (on_choice, {
        "metric": "{field}", "vertices": "{n}", "variation": "{variation:.2g}", "curvature": "{curvature:.2g}",
        "windows, %": "{windows:.2g}", "Hopf-Lax, %": "{hopf:.2g}", "chosen": "{chosen}",
    }),
    "warnings": (on_warnings, {key: key for key in ("domain", "n", "wrong", "silent", "right", "said")}),
    "polygons": (on_polygons, {
        "": "{mesh}", "triangles without virtual vertices, %": "{triangles:.2g}",
        "with virtual vertices (default), %": "{virtual:.2g}",
    }),
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> None:
    more = {"rows": 48, "points": 20_000, "sources": 3, "border": 24, "edge": 20, "count": 3}
    lists = {"pixels": [192], "voxels": [24], "fields": [0, 1, 2, 3]}
    options = parsed(__doc__, argv, "*", TABLES, **more, **lists)
    warnings.simplefilter("ignore", heat_igl.AccuracyWarning)  # that heat is wrong here is what the tables show
    measured, columns = TABLES[options.table]
    rows = collected(measured(options, np.random.default_rng(options.seed)))
    publish(options, {options.table: Table(rows, columns)})


if __name__ == "__main__":
    main()
