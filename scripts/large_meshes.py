"""Time and memory of near-exact distance on spheres of millions of vertices, each method in a process of its own.

    python scripts/large_meshes.py                               # 655 362 vertices, in half a minute
    python scripts/large_meshes.py --level 10                    # 10 485 762 vertices: 12 GiB, then 20 GiB
    python scripts/large_meshes.py --level 10 --method windows   # one of them
    python scripts/large_meshes.py --level 10 --docs docs/cost.md

"windows" is `geodesic_distance` of arrays, from scratch. "sweep" is a `GeodesicSolver` that sweeps: precomputation,
and a query from each of three vertices. Memory is all of the process at the peak, the mesh included, up to the answer.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import GeodesicSolver, geodesic_distance, shapes
from heat_igl.runtime import PeakMemory, resident_memory

from scaffold import add_output, environment, option_parser, publish, table, write_parts

METHODS = ("windows", "sweep")
STEPS = ("precomputation", "first query", "second query", "third query")


def asked(method: str, V: np.ndarray, F: np.ndarray) -> dict[str, Any]:
    """Seconds of each step of a method, the memory at the peak, and the mean and largest relative error."""
    row: dict[str, Any] = {"method": method, "vertices": len(V)}
    held = resident_memory() or 0
    with PeakMemory() as peak:

        def timed(step: str, work: Callable[[], Any]) -> Any:
            start = time.perf_counter()
            found = work()
            row[step] = time.perf_counter() - start
            return found

        if method == "windows":
            answers = [(0, timed("first query", lambda: geodesic_distance((V, F), 0)))]
        else:
            solver = timed("precomputation", lambda: GeodesicSolver((V, F), method="sweep"))
            sources = (0, 1, len(V) // 2)
            answers = [
                (s, timed(step, lambda s=s: solver.distance(s))) for s, step in zip(sources, STEPS[1:], strict=True)
            ]
    row["peak_memory"] = None if peak.bytes is None else held + peak.bytes
    errors = [relative_errors(V, source, distance) for source, distance in answers]
    row["mean_error"], row["max_error"] = (max(column) for column in zip(*errors, strict=True))
    return row


def relative_errors(V: np.ndarray, source: int, distance: np.ndarray) -> tuple[float, float]:
    """Mean relative error of a distance on the unit sphere, and the largest as a share of the largest distance."""
    total, largest = 0.0, 0.0
    for first in range(0, len(V), 1_000_000):  # in parts, to need less memory than what is measured
        some = slice(first, first + 1_000_000)
        exact = 2 * np.arcsin(np.minimum(np.linalg.norm(V[some] - V[source], axis=1) / 2, 1.0))
        wrong = np.abs(distance[some] - exact)
        total += float((wrong[exact > 0] / exact[exact > 0]).sum())
        largest = max(largest, float(wrong.max()))
    return total / (len(V) - 1), largest / np.pi


def measured(method: str, folder: Path) -> dict[str, Any]:
    """`asked` in a process of its own, on the arrays in a folder."""
    command = [sys.executable, __file__, "--child", str(folder), "--method", method]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        return {"method": method, "failed": f"exit status {done.returncode}"}
    row: dict[str, Any] = json.loads(done.stdout)
    return row


def markdown(rows: Sequence[dict[str, Any]]) -> str:
    """One row for each method: seconds, GiB and percent."""
    cells = []
    for row in rows:
        if "failed" in row:
            cells.append((row["method"], row["failed"], *["-"] * 7))
            continue
        seconds = (f"{row[step]:.1f}" if step in row else "-" for step in STEPS)
        memory = "-" if row["peak_memory"] is None else f"{row['peak_memory'] / 2**30:.1f}"
        errors = (f"{100 * row[name]:.4f}" for name in ("mean_error", "max_error"))
        cells.append((row["method"], str(row["vertices"]), *seconds, memory, *errors))
    return "\n".join(table(("method", "vertices", *STEPS, "peak GiB", "mean error %", "largest error %"), cells, (0,)))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--level", type=int, default=8, help="subdivisions k of an icosahedron: 10 * 4^k + 2 vertices")
    parser.add_argument("--method", choices=METHODS, nargs="+", default=list(METHODS), help="what is measured")
    parser.add_argument("--docs", type=Path, help="a page whose part `large` gets the table")
    parser.add_argument("--child", type=Path, help="measure one method on the arrays in this folder, and print JSON")
    add_output(parser, "large")
    arguments = parser.parse_args(argv)
    if arguments.child:
        V, F = (np.load(arguments.child / f"{name}.npy") for name in "VF")
        geodesic_distance(shapes.icosphere(6), 0)  # what is imported or compiled once
        print(json.dumps(asked(arguments.method[0], V, F)))
        return 0
    with tempfile.TemporaryDirectory() as name:
        sphere = shapes.icosphere(arguments.level)
        np.save(Path(name, "V.npy"), sphere.V)
        np.save(Path(name, "F.npy"), sphere.F)
        del sphere
        rows = [measured(method, Path(name)) for method in arguments.method]
    result = {"environment": environment(), "rows": rows}
    text = markdown(rows)
    publish(result, text, folder=arguments.output, name="large")
    if arguments.docs:
        write_parts(arguments.docs, {"large": text})
    return int(any("failed" in row for row in rows))


if __name__ == "__main__":
    sys.exit(main())
