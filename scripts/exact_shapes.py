"""Exact distance from arrays as a share of VTP's propagation, and its memory as a share of pygeodesic's.

    python scripts/exact_shapes.py --vtp PROGRAM                        # generated shapes of 5000 to 130 000 vertices
    python scripts/exact_shapes.py --vtp PROGRAM bunny.obj face.obj     # and meshes
    python scripts/exact_shapes.py --vtp PROGRAM --memory               # and memory; pygeodesic takes minutes
    python scripts/exact_shapes.py --vtp PROGRAM --walls                # and the gain of two threads, on idle machines
    python scripts/exact_shapes.py --vtp PROGRAM --output DIRECTORY     # where exact_shapes.json and exact_shapes.md go

Times are those of the processor, for one thread with HEAT_IGL_NUM_THREADS=1, validation of the arrays included; those
of VTP are for its propagation alone, as it prints them. The calls take turns, and shares are medians. The shapes are
smooth, where a window is carried far, and rough, where there are few windows and preparation counts most.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.spatial
from exact_table import beside_vtp, run_vtp

from heat_igl import Mesh, read_mesh, reference, shapes
from heat_igl.errors import ReferenceSolverError
from heat_igl.runtime import PeakMemory
from heat_igl.typing import FloatArray
from heat_igl.unfolding import exact_distance
from heat_igl.unfolding.exact import ExactSurface
from heat_igl.unfolding.half_edges import from_mesh

from measuring import drawn_sources
from scaffold import add_output, environment, option_parser, publish, table

# VTP leaves single vertices of regular spheres at 1e100.
_LOST = 1e99
# Where VTP differs by more, relative to the distance, pygeodesic is asked too.
_AGREE = 1e-10


def on_sphere(n: int, semi_axes: Sequence[float] = (1.0, 1.0, 1.0)) -> Mesh:
    """The convex hull of random points on a sphere, stretched to an ellipsoid."""
    P = np.random.default_rng(0).normal(size=(n, 3))
    P /= np.linalg.norm(P, axis=1)[:, None]
    F = scipy.spatial.ConvexHull(P).simplices.astype(np.int64)
    inward = np.linalg.det(P[F]) < 0
    F[inward] = F[inward, ::-1]
    return Mesh(P * semi_axes, F)


def ground(n: int, roughness: float, shear: float = 0.0) -> Mesh:
    """Random heights on the Delaunay triangulation of random points; `roughness` in units of their spacing."""
    rng = np.random.default_rng(0)
    P = rng.random((n, 2))
    F = scipy.spatial.Delaunay(P).simplices.astype(np.int64)
    return Mesh(np.column_stack([P[:, 0] + shear * P[:, 1], P[:, 1], rng.normal(size=n) * roughness / np.sqrt(n)]), F)


def stretched(mesh: Mesh, factors: FloatArray) -> Mesh:
    """The mesh with its coordinates multiplied."""
    return Mesh(mesh.V * factors, mesh.F)


SHAPES: dict[str, Callable[[], Mesh]] = {
    "icosphere 5": lambda: shapes.icosphere(5),
    "icosphere 6": lambda: shapes.icosphere(6),
    "ellipsoid": lambda: stretched(shapes.icosphere(6), np.array([1.0, 0.8, 0.6])),
    "bumpy sphere": lambda: shapes.blob(6),
    "small torus": lambda: shapes.torus(120, 50),
    "large torus": lambda: shapes.torus(400, 250),
    "5000 points on a sphere": lambda: on_sphere(5000),
    "100 000 points on a sphere": lambda: on_sphere(100_000),
    "points on a flat ellipsoid": lambda: on_sphere(20_000, (1.0, 0.3, 0.1)),
    "plane": lambda: shapes.grid(316),
    "gentle ground": lambda: ground(5000, 0.2),
    "rough ground": lambda: ground(5000, 0.5),
    "rugged ground": lambda: ground(5000, 1.0),
    "rough ground, large": lambda: ground(50_000, 0.5),
    "rough ground, largest": lambda: ground(130_000, 0.5),
    "sheared ground": lambda: ground(5000, 0.3, 4.0),
    "sheared ground, large": lambda: ground(50_000, 0.3, 4.0),
}


def speedup(mesh: Mesh, source: int, repeats: int) -> float:
    """By how much two threads are faster than one, from arrays, by the clock: the median of calls that take turns."""
    ratios = []
    before = os.environ.get("HEAT_IGL_NUM_THREADS")
    try:
        for _ in range(repeats):
            walls = []
            for threads in ("1", "2"):
                os.environ["HEAT_IGL_NUM_THREADS"] = threads
                begin = time.perf_counter()
                exact_distance(mesh.V, mesh.F, source)
                walls.append(time.perf_counter() - begin)
            ratios.append(walls[0] / walls[1])
    finally:
        if before is None:
            del os.environ["HEAT_IGL_NUM_THREADS"]
        else:
            os.environ["HEAT_IGL_NUM_THREADS"] = before
    return float(np.median(ratios))


def measured(mesh: Mesh, n_sources: int, repeats: int, vtp: Path, has_memory: bool, has_walls: bool) -> dict[str, Any]:
    """Windows per edge, seconds, shares and differences, over the sources; memory from the first."""
    windows, seconds, ratios, differences, n_lost = [], [], [], [], 0
    arbitrated: list[tuple[float, float]] = []
    for source in drawn_sources(mesh, range(n_sources)):
        found = ExactSurface(from_mesh(mesh, source)).solve(np.array([source]))
        windows.append(found.n_windows / len(mesh.edges))
        theirs, ratio = beside_vtp(vtp, mesh, source, repeats)
        seconds.append(theirs)
        ratios.append(ratio)
        other = run_vtp(vtp, mesh, source)[1]
        if len(other) == mesh.n_vertices:  # it drops some vertices of some meshes
            n_lost += int((other >= _LOST).sum())
            differences.append(_difference(found.distance, other))
            if differences[-1] > _AGREE:
                # On the largest shapes it runs out of time or memory.
                with contextlib.suppress(ReferenceSolverError):
                    third = reference.measured("pygeodesic", mesh, source).distance
                    arbitrated.append((_difference(found.distance, third), _difference(other, third)))
    row: dict[str, Any] = {
        "n": mesh.n_vertices,
        "windows per edge": float(np.mean(windows)),
        "vtp": float(np.median(seconds)),
        "share": float(np.median(ratios)),
        "largest share": float(max(ratios)),
        "lost": n_lost,
    }
    if differences:
        row["difference"] = max(differences)
    if arbitrated:
        row["to pygeodesic"], row["VTP to pygeodesic"] = np.max(arbitrated, axis=0).tolist()
    if has_walls:
        row["speedup"] = speedup(mesh, drawn_sources(mesh, range(1))[0], 5 * repeats)
    return row | (memory(mesh) if has_memory else {})


def _difference(distance: FloatArray, other: FloatArray) -> float:
    """The largest relative difference, at the vertices that the other solver has reached."""
    known = (other > 0) & (other < _LOST)
    return float((np.abs(distance - other)[known] / other[known]).max())


def memory(mesh: Mesh) -> dict[str, Any]:
    """Bytes by which the process grows at most from arrays to distances, and pygeodesic's child process."""
    source = drawn_sources(mesh, range(1))[0]
    V, F = mesh.V.copy(), mesh.F.copy()
    with PeakMemory() as peak:
        exact_distance(V, F, source)
    try:
        return {"peak": peak.bytes, "their peak": reference.measured("pygeodesic", mesh, source).peak_memory}
    except ReferenceSolverError as error:
        return {"peak": peak.bytes, "refused": str(error)}


def markdown(found: dict[str, Any]) -> str:
    """The table."""
    rows = []
    for name, row in found.items():
        numbers = (f"{row['windows per edge']:.2f}", f"{row['vtp']:.3f}", f"{row['share']:.2f}")
        cells = [name, f"{row['n']}", *numbers, f"{row['largest share']:.2f}"]
        cells.append(f"{row['difference']:.1e}" if "difference" in row else "-")
        if row.get("peak") and row.get("their peak"):
            cells += [f"{row['peak'] / 2**20:.1f}", f"{row['peak'] / row['their peak']:.2f}"]
        else:
            cells += ["-", "-"]
        cells.append(f"{row['speedup']:.2f}" if "speedup" in row else "-")
        rows.append(cells)
    head = ("shape", "vertices", "windows per edge", "VTP, s", "from arrays / VTP", "largest", "difference")
    lost = sum(row["lost"] for row in found.values())
    wrong = [
        f"{name}: pygeodesic differs from this package by {row['to pygeodesic']:.1e}, from VTP by "
        f"{row['VTP to pygeodesic']:.1e}."
        for name, row in found.items()
        if "to pygeodesic" in row
    ]
    return "\n".join(
        [
            *table((*head, "peak, MiB", "peak / pygeodesic's", "two threads"), rows),
            "",
            f"VTP left {lost} vertices without a distance; they are not compared.",
            *wrong,
        ]
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write."""
    parser = option_parser(__doc__)
    parser.add_argument("meshes", type=Path, nargs="*", help="triangle meshes beside the generated shapes")
    parser.add_argument("--vtp", type=Path, required=True, metavar="PROGRAM", help="the program of VTP")
    parser.add_argument("--only", nargs="*", metavar="SHAPE", help="the generated shapes to take (default all)")
    parser.add_argument("--sources", type=int, default=2, help="sources on each mesh (default 2)")
    parser.add_argument("--repeats", type=int, default=3, help="calls that take turns, for each source (default 3)")
    parser.add_argument("--memory", action="store_true", help="measure memory, and that of pygeodesic")
    parser.add_argument("--walls", action="store_true", help="measure by how much two threads are faster")
    add_output(parser, "exact_shapes")
    arguments = parser.parse_args(argv)
    chosen: dict[str, Callable[[], Mesh]] = {
        name: make for name, make in SHAPES.items() if arguments.only is None or name in arguments.only
    }
    chosen |= {path.stem: lambda path=path: read_mesh(path) for path in arguments.meshes}
    found = {}
    for name, make in chosen.items():
        vtp = arguments.vtp.resolve()
        options = (arguments.sources, arguments.repeats, vtp, arguments.memory, arguments.walls)
        found[name] = measured(make(), *options)
        print(f"{name}: {found[name]['share']:.2f}", file=sys.stderr, flush=True)
    publish(
        {"environment": environment(), "meshes": found}, markdown(found), folder=arguments.output, name="exact_shapes"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
