"""Which linear solver for which size: what `analyse` chooses by, and how far a query is from the memory's bandwidth.

On spheres of random points, for each size and backend: seconds to analyse, to factor the heat and the Poisson matrix,
and to solve for one and for eight right-hand sides, medians over runs in which the backends take turns.

    python scripts/tune_backends.py                       # 300 to 100k vertices
    python scripts/tune_backends.py --size 1000000 --only multifrontal
    python scripts/tune_backends.py --mesh bunny.obj      # a mesh of your own

Writes tune_backends.json and tune_backends.md.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from heat_igl import Mesh, read_mesh
from heat_igl.linear import analyse
from heat_igl.operators import Operators, operators
from heat_igl.steps import HeatFlow, NormalizedDivergence, PoissonProblem

from measuring import bandwidth, seconds_of
from scaffold import add_seed, environment, option_parser, publish, table

SIZES = (300, 1000, 3000, 10_000, 30_000, 100_000)
COLUMNS = ("analysis", "factors", "one", "eight", "kernel", "nonzeros", "bytes")


def sphere(n: int, rng: np.random.Generator) -> Mesh:
    """The convex hull of n random points on the unit sphere."""
    points = rng.standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return Mesh(points, ConvexHull(points).simplices)


def run(domain: Operators, backend: str) -> dict[str, float]:
    """One run of all stages."""
    n, t = domain.n, domain.mean_edge_length**2
    start = time.perf_counter()
    analysis = analyse(domain.L, backend)
    analysed = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        poisson_later = pool.submit(PoissonProblem, domain, backend, analysis)
        heat = HeatFlow(domain, t, backend=backend, analysis=analysis)
        poisson = poisson_later.result()
    row = {"analysis": analysed - start, "factors": time.perf_counter() - analysed}
    for name, k in (("one", 1), ("eight", 8)):
        b = np.zeros((n, k))
        b[np.arange(k) * (n // k), np.arange(k)] = 1e290
        row[name] = seconds_of(lambda b=b: poisson.solve(heat.solve(b))) / k
    u = heat.solve(b[:, :1])
    descent = NormalizedDivergence(domain, t)
    row["kernel"] = seconds_of(lambda: descent.divergence(u))
    factors = [*heat.factors, poisson.factor]
    row["nonzeros"] = sum(factor.nonzeros for factor in factors)
    row["bytes"] = sum(factor.n_bytes for factor in factors)
    return row


def measured(domain: Operators, backends: Sequence[str], runs: int) -> list[dict[str, Any]]:
    """Medians per backend."""
    found: dict[str, list[dict[str, float]]] = {backend: [] for backend in backends}
    for _ in range(runs):
        for backend in backends:
            found[backend].append(run(domain, backend))
    return [
        {"n": domain.n, "backend": backend}
        | {key: statistics.median(one[key] for one in found[backend]) for key in COLUMNS}
        for backend in backends
    ]


def markdown(result: dict[str, Any]) -> str:
    """The result as a table."""
    speed = result["bandwidth"]
    lines = [
        f"Seconds, both matrices together; *one* and *eight* are per right-hand side. A copy moves {speed / 1e9:.1f} "
        "GB/s; *floor* is the time in which it would read both factors twice, and *over it* is *one* and *kernel* by "
        "that.",
        "",
    ]
    cells = []
    for row in result["rows"]:
        floor = 2 * row["bytes"] / speed
        cells.append((f"{row['n']}", row["backend"], f"{row['analysis']:.4f}", f"{row['factors']:.4f}"))
        cells[-1] += tuple(f"{row[name]:.5f}" for name in ("one", "eight", "kernel"))
        cells[-1] += (f"{row['nonzeros'] / row['n']:.1f}", f"{floor:.5f}")
        cells[-1] += (f"{(row['one'] + row['kernel']) / floor:.2f}",)
    head = "vertices | backend | analysis | factors | one | eight | kernel | nonzeros per vertex | floor | over it"
    lines += table(head.split(" | "), cells, (1,))
    return "\n".join([*lines, "", f"Smallest size from which multifrontal is faster: {result['threshold']}."])


def threshold(rows: Sequence[dict[str, Any]]) -> int | None:
    """The smallest size at which precomputation and ten queries are faster with the package's own factorization."""
    cost = {(row["n"], row["backend"]): row["analysis"] + row["factors"] + 10 * row["one"] for row in rows}
    sizes = sorted({n for n, backend in cost if (n, "scipy") in cost and (n, "multifrontal") in cost})
    faster = [n for n in sizes if cost[n, "multifrontal"] < cost[n, "scipy"]]
    return min(faster, default=None)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write; see the module's docstring."""
    parser = option_parser(__doc__)
    parser.add_argument("--size", type=int, action="append", help="number of vertices; may be repeated")
    parser.add_argument("--mesh", type=Path, action="append", help="a mesh file in place of the spheres")
    parser.add_argument("--only", action="append", choices=["scipy", "multifrontal"], help="a backend")
    parser.add_argument("--runs", type=int, default=5)
    add_seed(parser)
    parser.add_argument("--out", type=Path, default=Path("tune-results"), help="directory of the results")
    arguments = parser.parse_args(argv)
    backends = arguments.only or ["scipy", "multifrontal"]
    rng = np.random.default_rng(arguments.seed)
    if arguments.mesh:
        meshes = [read_mesh(path) for path in arguments.mesh]
    else:
        meshes = [sphere(n, rng) for n in arguments.size or SIZES]
    rows = [row for mesh in meshes for row in measured(operators(mesh), backends, arguments.runs)]
    result: dict[str, Any] = {
        "environment": environment() | {"seed": str(arguments.seed)},
        "bandwidth": bandwidth(),
        "rows": rows,
        "threshold": threshold(rows),
    }
    publish(result, markdown(result), folder=arguments.out, name="tune_backends")
    return 0


if __name__ == "__main__":
    sys.exit(main())
