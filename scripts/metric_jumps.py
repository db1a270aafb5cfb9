"""Distance where the metric jumps between layers, or changes at every edge: errors against ways through points.

    python scripts/metric_jumps.py [--border 24] [--edge 20] [--meshes 3] [--seed 0] [--json FILE]

Meshes are Delaunay triangles of random points in the unit square, rotated. Layers are strips of equal width, with the
source in the first. The reference is the shortest way through points on the borders, or on all edges with a metric per
face. Prints, as Markdown tables, the mean and the largest of |d - reference| / reference in percent for the default of
`GeodesicSolver`, and those of the reference with half as many points. docs/metrics.md shows the tables.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay

from heat_igl import GeodesicSolver, Mesh, fibre_metric, metric_operators
from heat_igl.typing import FloatArray, IntArray

from scaffold import add_json, add_seed, environment, option_parser, publish, table

# Metrics (k, 2, 2) in the plane: one per layer, or one per face of the mesh.
Layers = Callable[[np.random.Generator], FloatArray]
Faces = Callable[[Mesh, np.random.Generator], FloatArray]
Samples = Iterator[tuple[str, FloatArray]]
PLACES = ("source on the border, %", "1.5 edges away, %", "in the middle, %")
DEFAULT, HALF = "default, %", "reference, half the points, %"
# Cells across layers, and across a mesh with a metric per face.
ACROSS, FINE = 30, 18


def strip(left: float, right: float, cells: int, across: int, rng: np.random.Generator) -> FloatArray:
    """Corners (m, 3, 2) of Delaunay triangles; points are random inside, and evenly spaced along the sides."""
    V = np.stack(np.meshgrid(np.linspace(left, right, cells + 1), np.linspace(0, 1, across + 1)), axis=2)
    V[1:-1, 1:-1] = rng.uniform(V[0, 0] + 0.3 / across, V[-1, -1] - 0.3 / across, (across - 1, cells - 1, 2))
    V = V.reshape(-1, 2)
    F = Delaunay(V).simplices
    return V[F[np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]])) > 1e-12]]


def layered(n_layers: int, across: int, rng: np.random.Generator) -> tuple[Mesh, IntArray]:
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


def relative(found: FloatArray, reference: FloatArray) -> FloatArray:
    away = reference > 0
    return np.asarray(100 * np.abs(found - reference)[away] / reference[away])


def errors(mesh: Mesh, source: int, g: FloatArray, reference: FloatArray, angle: float) -> FloatArray:
    """Of the default, in percent, on the mesh rotated by `angle`, with the metric of each face."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    in_space = np.pad(g, ((0, 0), (0, 1), (0, 1))) + np.diag([0, 0, 1])
    domain = metric_operators(Mesh(mesh.V @ turn.T, mesh.F), turn @ in_space @ turn.T)
    return relative(GeodesicSolver(domain).distance(source), reference)


def speeds(values: Sequence[float] | FloatArray) -> FloatArray:
    return np.asarray(np.eye(2) / np.square(values)[:, None, None])


def fibres(angle: FloatArray, ratio: FloatArray | float) -> FloatArray:
    """Lengths across fibres are `ratio` times those along them."""
    return fibre_metric(np.column_stack([np.cos(angle), np.sin(angle)]), 1.0, ratio)[:, :2, :2]


def layer_cases() -> Iterator[tuple[str, int, Layers]]:
    for c in (2, 10, 1000):
        for values in ((1, c), (c, 1), (1, c, 1), (c, 1, c)):
            name = f"{'two' if len(values) == 2 else 'three'} layers, {' beside '.join(map(str, values))}"
            yield name, len(values), lambda _, values=values: speeds(values)
    for ratios in ((3.0, 10.0), (10.0, 3.0)):
        name = "two layers, fibres 1 : {:g} beside 1 : {:g}".format(*ratios)
        yield name, 2, lambda rng, ratios=ratios: fibres(rng.uniform(0, np.pi, 2), np.array(ratios))


def face_cases() -> Iterator[tuple[str, Faces]]:
    def centres(mesh: Mesh) -> FloatArray:
        return np.asarray(mesh.V[mesh.F][:, :, :2].mean(axis=1))

    for c in (1.15, 3.0, 100.0):
        yield f"random speeds, 1 to {c:g}", lambda mesh, rng, c=c: speeds(c ** rng.random(mesh.n_faces))
    for c in (3.0, 100.0):
        name = f"checkerboard, three cells to a field, 1 beside {c:g}"
        yield name, lambda mesh, _, c=c: speeds(c ** (np.floor(centres(mesh) * FINE / 3).sum(axis=1) % 2))
    yield "random fibres, 1 : 2", lambda mesh, rng: fibres(rng.uniform(0, np.pi, mesh.n_faces), 2.0)
    for ratio in (5.0, 20.0):
        name = f"smooth fibres, 1 : {ratio:g}"
        yield name, lambda mesh, _, ratio=ratio: fibres(np.sin(3 * centres(mesh)).sum(axis=1), ratio)


def on_layers(n_layers: int, metrics: Layers, options: Namespace, rng: np.random.Generator) -> Samples:
    """Errors from three sources in the first layer, on each mesh."""
    for _ in range(options.meshes):
        mesh, layer = layered(n_layers, ACROSS, rng)
        V, g, border = mesh.V[:, :2], metrics(rng), 1 / n_layers
        for place, x in zip(PLACES, (border, border - 1.5 / ACROSS, border / 2), strict=True):
            away = np.linalg.norm(V - [x, rng.uniform(0.3, 0.7)], axis=1)
            source = int(np.where((V[:, 0] == border) == (x == border), away, np.inf).argmin())
            half, whole = (through_borders(V, source, g, n * ACROSS + 1) for n in (options.border // 2, options.border))
            yield place, errors(mesh, source, g[layer], whole, rng.uniform(0, np.pi))
            yield HALF, relative(half, whole)


def on_faces(metric: Faces, options: Namespace, rng: np.random.Generator) -> Samples:
    for _ in range(options.meshes):
        mesh = layered(1, FINE, rng)[0]
        g, source = metric(mesh, rng), int(rng.integers(mesh.n_vertices))
        half, whole = (through_edges(mesh, source, g, n) for n in (options.edge // 2, options.edge))
        yield DEFAULT, errors(mesh, source, g, whole, rng.uniform(0, np.pi))
        yield HALF, relative(half, whole)


def summary(name: str, samples: Samples) -> dict[str, Any]:
    """Mean and largest, by column."""
    columns: dict[str, FloatArray] = {}
    for column, found in samples:
        columns[column] = np.append(columns.get(column, []), found)
    row = {"case": name} | {column: (float(e.mean()), float(e.max())) for column, e in columns.items()}
    print(row, file=sys.stderr, flush=True)
    return row


def lines(kind: str, columns: Sequence[str], rows: list[dict[str, Any]]) -> list[str]:
    cells = [(row["case"], *(" and ".join(f"{value:.2g}" for value in row[c]) for c in columns)) for row in rows]
    return table([kind, *columns], cells)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--border", type=int, default=24, help="points on each edge of a border (default 24)")
    parser.add_argument("--edge", type=int, default=20, help="points on each edge, metric per face (default 20)")
    parser.add_argument("--meshes", type=int, default=3, help="per case (default 3)")
    add_seed(parser)
    add_json(parser)
    options = parser.parse_args(argv)
    rng = np.random.default_rng(options.seed)
    layers = [summary(name, on_layers(n, g, options, rng)) for name, n, g in layer_cases()]
    faces = [summary(name, on_faces(g, options, rng)) for name, g in face_cases()]
    text = [*lines("layers", (*PLACES, HALF), layers), "", *lines("metric per face", (DEFAULT, HALF), faces)]
    publish({"environment": environment(), "layers": layers, "faces": faces}, "\n".join(text), json_file=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
