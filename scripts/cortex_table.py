"""Matrices of a cortex with a region left out: time, peak memory, error, beside Dijkstra's algorithm and potpourri3d.

    python scripts/cortex_table.py [--vertices 32492] [--parcels 360] [--radius 20] [--sources 40]

A folded sphere, of which a cap of a tenth of the vertices is the medial wall. Dijkstra's algorithm, along edges, is
what neuromaps and surfdist run; potpourri3d and it take the mesh cut out. Seconds of one processor; with ``~``
extrapolated from the rows of ``--sources`` vertices. Memory is the growth of a process of its own to its peak. Errors
are means over the same rows, in percent. Needs the extra ``bench``. docs/regions.md shows the table.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import ConvexHull

import heat_igl
from heat_igl import Mesh
from heat_igl.runtime import PeakMemory
from heat_igl.typing import BoolArray, FloatArray, IntArray

from harness import METHODS, Query, Row, Table, collected, errors, ours, parsed, publish

WALL = 0.092  # share of the vertices


def cortex(n: int) -> tuple[Mesh, BoolArray]:
    """A folded sphere of 100 mm, as in notebook 15, and the vertices outside of its medial wall."""
    turn = np.arange(n) * np.pi * (3 - np.sqrt(5))
    z = 1 - (2 * np.arange(n) + 1) / n
    P = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    rng = np.random.default_rng(3)
    waves = rng.standard_normal((60, 3))
    waves *= 8 / np.linalg.norm(waves, axis=1, keepdims=True)
    height = np.cos(P @ waves.T + rng.uniform(0, 2 * np.pi, 60)).sum(axis=1) / np.sqrt(30)
    depth = 0.25 * np.exp(-4 * height**2)
    return Mesh(50 * (1 - depth)[:, None] * P, ConvexHull(P).simplices), z > 2 * WALL - 1


def in_a_process(call: Callable[[], object]) -> tuple[float, float, Any]:
    """Processor seconds, megabytes to the peak, and the result of a call in a fork of this process."""
    context = get_context("fork")
    here, there = context.Pipe(duplex=False)

    def child() -> None:
        with PeakMemory() as peak:
            start = time.process_time()
            found = call()
            used = time.process_time() - start
        there.send((used, (peak.bytes or 0) / 1e6, found))

    process = context.Process(target=child)
    process.start()
    there.close()  # so that a child that fails is an EOFError here
    spent, peak, result = here.recv()
    process.join()
    return spent, peak, result


def rows_of(prepare: Callable[[Mesh], Query], part: Mesh, sources: Sequence[int], all_of: int) -> Callable[[], Any]:
    """Prepare, and ask for some rows: the time that all would take, and the rows."""

    def call() -> tuple[float, FloatArray]:
        start = time.process_time()
        query = prepare(part)
        prepared = time.process_time()
        rows = np.stack([query(source) for source in sources])
        each = (time.process_time() - prepared) / len(sources)
        return prepared - start + each * all_of, rows

    return call


def table(mesh: Mesh, region: BoolArray, labels: IntArray, radius: float, sources: int) -> Iterator[Row]:
    """Rows for the distances within a radius and for the means of parcels."""
    used, F = np.unique(mesh.F[region[mesh.F].all(axis=1)], return_inverse=True)
    part = Mesh(mesh.V[used], F.reshape(-1, 3))
    some = np.random.default_rng(0).choice(len(used), sources, replace=False).tolist()
    edges, solver = part.edge_graph, heat_igl.GeodesicSolver(part, method="exact")
    truth = solver.distances(some)

    def error(rows: FloatArray) -> float:
        """Mean over what the rows hold: all that is not 0, and reachable."""
        there = [np.where((row > 0) & np.isfinite(row), t, np.inf) for row, t in zip(rows, truth, strict=True)]
        return float(np.mean([errors(row, t)["mean"] for row, t in zip(rows, there, strict=True)]))

    def within() -> Any:
        return heat_igl.distances_within(mesh, radius, region=region)[used[some]].toarray()[:, used]

    def by_edges() -> Any:
        found = []
        for block in np.array_split(np.arange(len(used)), 64):  # n by n at once would take 7 GB
            dense = dijkstra(edges, directed=False, indices=block, limit=radius)
            i, j = np.nonzero(np.isfinite(dense))
            found.append(sp.csr_array((dense[i, j], (i, j)), shape=dense.shape))
        return sp.vstack(found).tocsr()[some].toarray()

    what = f"{radius:g} mm around every vertex"
    for name, call in (("`distances_within`, exact", within), ("Dijkstra along edges", by_edges)):
        spent, peak, rows = in_a_process(call)
        yield {"matrix": what, "method": name, "seconds": f"{spent:.1f}", "MB": peak, "error": error(rows)}
    what = f"means of {labels.max() + 1} parcels"
    peers: dict[str, Callable[[Mesh], Query]] = {
        "`parcel_distances`, exact": ours("exact"),
        '`parcel_distances(method="sweep")`': ours("sweep"),
        "Dijkstra along edges": lambda _: lambda source: dijkstra(edges, directed=False, indices=source),
        "potpourri3d, heat": METHODS["potpourri3d"].prepare,
    }
    members = int((labels[used] >= 0).sum())
    for name, prepare in peers.items():
        _, peak, (whole, rows) = in_a_process(rows_of(prepare, part, some, members))
        yield {"matrix": what, "method": name, "seconds": f"~{whole:.0f}", "MB": peak, "error": error(rows)}


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, vertices=32492, parcels=360, radius=20.0, sources=40)
    mesh, region = cortex(options.vertices)
    sites = heat_igl.farthest_points(heat_igl.GeodesicSolver(mesh, region=region), options.parcels, start=0)
    labels = heat_igl.voronoi_cells(mesh, sites).labels
    labels = np.where(region, labels, -1)
    found = collected(table(mesh, region, labels, options.radius, options.sources))
    columns = {"": "matrix", "method": "method", "s": "seconds", "peak, MB": "{MB:.0f}", "error, %": "{error:.2g}"}
    text = (
        f"{mesh.n_vertices} vertices, edges of {mesh.edge_lengths.mean():.1f} mm, "
        f"{int((~region).sum())} of them in the medial wall."
    )
    publish(options, {"cortex": Table(found, columns, text)})


if __name__ == "__main__":
    main()
