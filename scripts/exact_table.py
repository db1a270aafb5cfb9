"""Exact distance by windows: agreement with pygeodesic, windows per edge, times, and what local queries cost.

    python scripts/exact_table.py bunny.obj cow.obj         # 4 sources on each
    python scripts/exact_table.py MESH --vtp PROGRAM        # the program prints the seconds of its propagation
    python scripts/exact_table.py MESH --matrix 10000       # rows of the 5 % nearest vertices, into a store
    python scripts/exact_table.py MESH --output DIRECTORY   # where exact.json and exact.md go

Truth is pygeodesic's (extra ``validate``); meshes that it refuses have no such column. The program of VTP (Qin et al.
2016) is called with ``-m FILE -s VERTEX -o DISTANCES``, each time beside exact distance from arrays. Local queries are
compared with a full query. Times are those of the processor, as VTP prints them, summed over
threads. The rows of the matrix are those of the first vertices of a torus of 100 000.
"""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import (
    GeodesicSolver,
    Mesh,
    distances_within,
    geodesic_distance,
    nearest_vertices,
    pair_distances,
    reference,
    shapes,
    write_distances_within,
    write_mesh,
)
from heat_igl.errors import ReferenceSolverError
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.runtime import PeakMemory
from heat_igl.unfolding import exact_distance
from heat_igl.unfolding.exact import ExactSurface

from measuring import drawn_sources
from scaffold import add_output, environment, option_parser, over_meshes, publish, table

# Local queries: how many, the share of the vertices that a radius holds, and mean edges between the ends of a pair.
_LOCAL, _SHARE, _APART = 1000, 0.01, 2.0
_NEAREST = 32
# The share of the vertices in each row of a matrix, and how many vertices there are around and along the torus.
_IN_ROW, _TORUS = 0.05, (400, 250)


def measured(mesh: Mesh, n_sources: int, repeats: int, vtp: Path | None) -> dict[str, Any]:
    sources = drawn_sources(mesh, range(n_sources))
    surface = ExactSurface(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    solutions = [surface.solve(np.array([source])) for source in sources]
    row: dict[str, Any] = {
        "n": mesh.n_vertices,
        "windows per edge": float(np.mean([found.n_windows for found in solutions])) / len(mesh.edges),
        "from arrays": processor_seconds(lambda: exact_distance(mesh.V.copy(), mesh.F.copy(), sources[0]), repeats),
        "per query": processor_seconds(lambda: surface.solve(np.array([sources[0]])), repeats),
    }
    with PeakMemory() as peak:
        exact_distance(mesh.V.copy(), mesh.F.copy(), sources[0])
    row["peak"] = peak.bytes
    try:
        others = [reference.measured("pygeodesic", mesh, source) for source in sources]
        pairs = zip(solutions, others, strict=True)
        row["difference"] = max(_difference(found.distance, other.distance) for found, other in pairs)
        row["their peak"] = others[0].peak_memory
    except ReferenceSolverError as error:
        row["refused"] = str(error)
    if vtp is not None:
        # It ends in an error at edges of more than two faces.
        with contextlib.suppress(subprocess.CalledProcessError):
            row |= beside_vtp(vtp, mesh, sources[0], repeats)
            theirs = [run_vtp(vtp, mesh, source)[1] for source in sources]
            if all(len(distance) == mesh.n_vertices for distance in theirs):  # it drops some vertices of some meshes
                pairs = zip(solutions, theirs, strict=True)
                row["vtp difference"] = max(_difference(found.distance, other) for found, other in pairs)
    return row | local(mesh, sources[0], solutions[0].distance, repeats)


def processor_seconds(call: Callable[[], object], repeats: int) -> float:
    """Processor time of a call on all threads, the median: what else the machine does counts little."""
    taken = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        taken.append(time.process_time() - begin)
    return float(np.median(taken))


def local(mesh: Mesh, source: int, distance: Any, repeats: int) -> dict[str, Any]:
    """Seconds of each of many local queries, preparation shared, and of one full query."""
    rng = np.random.default_rng(0)
    usable = np.flatnonzero(np.isfinite(distance))
    drawn = rng.choice(usable, min(_LOCAL, len(usable)), replace=False)
    radius = float(np.sort(distance)[int(_SHARE * mesh.n_vertices) + 1])
    apart = _APART * float(mesh.edge_lengths.mean())
    near = distances_within(mesh, 1.5 * apart, drawn)
    pairs = []
    for vertex, begin, end in zip(drawn, near.indptr[:-1], near.indptr[1:], strict=True):
        best = np.argmin(np.abs(near.data[begin:end] - apart))
        pairs.append((vertex, near.indices[begin + best]))
    solver = GeodesicSolver(mesh)
    return {
        "query": processor_seconds(lambda: solver.distance(source), max(repeats, 5)),
        "within": processor_seconds(lambda: distances_within(mesh, radius, drawn), repeats) / len(drawn),
        "held": float(np.diff(distances_within(mesh, radius, drawn).indptr).mean()),
        "pair": processor_seconds(lambda: pair_distances(mesh, pairs), repeats) / len(pairs),
        "nearest": processor_seconds(lambda: nearest_vertices(mesh, _NEAREST), 1),
    }


def beside_vtp(program: Path, mesh: Mesh, source: int, repeats: int) -> dict[str, float]:
    """Seconds of VTP, and what distance from arrays takes as a share of them: medians of calls that take turns."""
    rows = [
        (
            run_vtp(program, mesh, source)[0],
            # Three times: the first call after another program finds nothing in the caches.
            processor_seconds(lambda: exact_distance(mesh.V.copy(), mesh.F.copy(), source), 3),
            processor_seconds(lambda: geodesic_distance((mesh.V.copy(), mesh.F.copy()), source), 3),
        )
        for _ in range(repeats)
    ]
    theirs, exact, within = np.array(rows).T
    return {
        "vtp": float(np.median(theirs)),
        "share": float(np.median(exact / theirs)),
        "tolerance share": float(np.median(within / theirs)),
    }


def run_vtp(program: Path, mesh: Mesh, source: int) -> tuple[float, Any]:
    """The seconds of its propagation, as the program prints them, and the distances that it writes."""
    with tempfile.TemporaryDirectory() as folder:
        path, distances = Path(folder, "mesh.obj"), Path(folder, "distances.txt")
        write_mesh(path, mesh)
        command = [str(program), "-m", str(path), "-s", str(source), "-o", str(distances)]
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        found = np.array(distances.read_text().split(), float)
    return float(re.findall(r"propagation step took (\S+) seconds", printed)[0]), found


def streamed(n_rows: int) -> dict[str, float]:
    """What it takes to write rows of a matrix of nearest vertices to a store."""
    mesh = shapes.torus(*_TORUS)
    radius = float(np.quantile(exact_distance(mesh.V, mesh.F, 0), _IN_ROW))
    with tempfile.TemporaryDirectory() as folder:
        begin = time.process_time()
        with PeakMemory() as peak:
            write_distances_within(Path(folder, "matrix"), mesh, radius, np.arange(n_rows))
        seconds = time.process_time() - begin
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    return {"vertices": mesh.n_vertices, "rows": n_rows, "seconds": seconds, "peak": peak.bytes or 0, "size": size}


def _difference(distance: Any, other: Any) -> float:
    there = np.isfinite(other) & (other > 0)
    return float((np.abs(distance[there] - other[there]) / other[there]).max())


def _mebibytes(size: int | None) -> str:
    return "-" if size is None else f"{size / 2**20:.1f}"


_OPTIONAL = (("vtp", 3), ("share", 2), ("tolerance share", 2), ("difference", 2), ("vtp difference", 2))


def markdown(result: dict[str, Any]) -> str:
    rows, shares, memory = [], [], []
    for name, row in result["meshes"].items():
        optional = (f"{row[key]:.{digits}g}" if key in row else "-" for key, digits in _OPTIONAL)
        timed = ("from arrays", "per query")
        seconds = (f"{row['windows per edge']:.2f}", *(f"{row[key]:.4f}" for key in timed))
        rows.append((name, f"{row['n']}", *seconds, *optional))
        parts = (f"1/{row['query'] / row[key]:.0f}" for key in ("within", "pair"))
        last = (f"{1e6 * row['pair']:.1f}", f"{row['nearest']:.2f}")
        shares.append((name, f"{row['query']:.4f}", f"{row['held']:.0f}", *parts, *last))
        memory.append((name, *(_mebibytes(row.get(key)) for key in ("peak", "their peak"))))
    times = ("from arrays, s", "per query, s")
    head = ("mesh", "vertices", "windows per edge", *times, "VTP, s", "from arrays / VTP", "to the tolerance / VTP")
    nearest = f"{_NEAREST} nearest of all, s"
    local_head = ("mesh", "query, s", "vertices within", "within", "pair", "pair, µs", nearest)
    lines = [
        *table((*head, "difference to pygeodesic", "to VTP"), rows),
        "",
        f"Local queries as a share of a full one, of {_LOCAL}, preparation included: a radius "
        f"that holds {100 * _SHARE:.0f} % of the vertices around one of them, and pairs {_APART:g} mean edges apart.",
        "",
        *table(local_head, shares),
        "",
        "Peak memory above what the process held before.",
        "",
        *table(("mesh", "from arrays, MiB", "pygeodesic, MiB"), memory),
    ]
    if "matrix" in result:
        one = result["matrix"]
        lines += [
            "",
            f"{one['rows']} rows of {one['vertices']} columns into a store: {one['seconds']:.0f} s, "
            f"{one['peak'] / 2**20:.0f} MiB of memory, {one['size'] / 2**20:.0f} MiB of store.",
        ]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="*", help="triangle meshes")
    parser.add_argument("--sources", type=int, default=4, help="sources on each mesh (default 4)")
    parser.add_argument("--repeats", type=int, default=3, help="timed calls, of which the median counts (default 3)")
    parser.add_argument("--vtp", type=Path, metavar="PROGRAM", help="the program of VTP")
    parser.add_argument("--matrix", type=int, default=0, metavar="ROWS", help="rows of a matrix to write (default 0)")
    add_output(parser, "exact")
    arguments = parser.parse_args(argv)
    vtp = None if arguments.vtp is None else arguments.vtp.resolve()
    found = over_meshes(arguments.meshes, lambda mesh: measured(mesh, arguments.sources, arguments.repeats, vtp))
    result = {"environment": environment(), "meshes": found}
    if arguments.matrix:
        result["matrix"] = streamed(arguments.matrix)
    publish(result, markdown(result), folder=arguments.output, name="exact")
    return 0


if __name__ == "__main__":
    sys.exit(main())
