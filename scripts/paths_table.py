"""Length of paths and loops against flips of edges and exact distance, and the time that they take.

    python scripts/paths_table.py bunny.obj cow.obj --pairs 500 --docs docs/paths_theory.md

`GeodesicPathSolver` and potpourri3d's `EdgeFlipGeodesicSolver` (extra ``bench``) join so many pairs of vertices by
paths and straighten a tenth as many loops through four vertices along edges. Counted are results of ours that are
shorter and longer by more than 1e-9, and paths that are longer than the exact distance. Ratios of processor times, ours
to theirs, are the median over the calls, and that of the sums.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np
from scipy.sparse import csgraph

from heat_igl import Mesh, edge_curve, pair_distances
from heat_igl.curves import GeodesicPathSolver
from heat_igl.typing import FloatArray

from harness import Row, Table, collected, named, parsed, publish, seconds

# Lengths that differ by a smaller share are the same.
SAME = 1e-9
Call = Callable[[], float]


def edge_loop(mesh: Mesh, stops: list[int]) -> list[int]:
    """The vertices of the loop along shortest ways of edges through some vertices."""
    loop: list[int] = []
    for a, b in pairwise([*stops, stops[0]]):
        before = csgraph.dijkstra(mesh.edge_graph, directed=False, indices=b, return_predecessors=True)[1]
        while a != b:
            loop.append(int(a))
            a = int(before[a])
    return loop


def compared(name: str, mesh: Mesh, n_pairs: int, seed: int) -> Iterator[Row]:
    """A row for paths and one for loops."""
    import potpourri3d

    rng = np.random.default_rng(seed)
    usable = np.flatnonzero(mesh.components == mesh.components[mesh.F[0, 0]])
    pairs = [rng.choice(usable, 2, replace=False).tolist() for _ in range(n_pairs)]
    loops = [edge_loop(mesh, rng.choice(usable, 4, replace=False).tolist()) for _ in range(max(n_pairs // 10, 1))]
    curves = [edge_curve(mesh, loop, closed=True) for loop in loops]
    ours, theirs = GeodesicPathSolver(mesh), potpourri3d.EdgeFlipGeodesicSolver(mesh.V, mesh.F)
    found: dict[str, list[tuple[float, float, float, float]]] = {"paths": [], "loops": []}

    def take(kind: str, one: Callable[[], object], other: Callable[[], FloatArray]) -> None:
        kept: list[object] = []
        times = seconds(lambda: kept.append(one())), seconds(lambda: kept.append(other()))
        length = np.linalg.norm(np.diff(kept[1], axis=0), axis=1).sum()  # type: ignore[call-overload]
        found[kind].append((*times, kept[0].lengths(mesh).sum(), length))  # type: ignore[attr-defined]

    for pair in [pairs[0], *pairs]:
        take("paths", lambda p=pair: ours.path(p), lambda p=pair: theirs.find_geodesic_path(*p))
    del found["paths"][0]
    for curve, loop in zip(curves, loops, strict=True):
        take("loops", lambda c=curve: ours.straighten(c), lambda v=loop: theirs.find_geodesic_loop(np.array(v)))
    for kind, values in found.items():
        time, peer_time, length, other = np.array(values).T
        excess = (length - other) / other.clip(mesh.edge_lengths.mean())
        row = {"mesh": name, "n": mesh.n_vertices, "kind": kind, "count": len(values), "most": 100 * excess.max()}
        row |= {"shorter": int((excess < -SAME).sum()), "longer": int((excess > SAME).sum())}
        row |= {"median time": np.median(time / peer_time), "time": time.sum() / peer_time.sum()}
        if kind == "paths":
            exact = pair_distances(mesh, np.array(pairs))
            row["not shortest"] = [int((each > exact * (1 + SAME)).sum()) for each in (length, other)]
        yield row


COLUMNS = {
    "mesh": "mesh", "vertices": "{n}", "kind": "{kind}", "count": "{count}",
    "shorter / longer": "{shorter} / {longer}", "longer by at most, %": "{most:.2g}",
    "time": "{median time:.2f}, {time:.2f}",
    "not the shortest: here / flips": "{not shortest[0]} / {not shortest[1]}",
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", pairs=500)
    meshes = named(options.meshes, "cow").items()
    rows = collected(row for name, mesh in meshes for row in compared(name, mesh, options.pairs, options.seed))
    publish(options, {"paths": Table(rows, COLUMNS)})


if __name__ == "__main__":
    sys.exit(main())
