"""Exact distance by windows: agreement with VTP, windows per edge and time, and what local queries cost.

    python scripts/exact_table.py bunny.obj cow.obj --docs docs/exact_theory.md  # 4 sources on each
    python scripts/exact_table.py --shapes                 # generated shapes of 5000 to 130 000 vertices instead
    python scripts/exact_table.py --shapes --only "plane"  # some of them
    python scripts/exact_table.py --matrix 10000           # rows of the 5 % nearest vertices, into a store

Where the variable HEAT_IGL_VTP names the program of VTP (Qin et al. 2016), it takes turns with exact distance from
arrays; its seconds are those of the propagation alone, as it prints them, ours those of the processor with validation
and preparation (one thread with HEAT_IGL_NUM_THREADS=1).
``benchmark.py --peers`` has memory and other exact solvers. Local queries are a share of a full query. The shapes are
smooth, where a window is carried far, and rough, where there are few windows and preparation counts most. The matrix is
that of a torus of 100 000 vertices.
"""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import heat_igl
from heat_igl import Mesh, distances_within, geodesic_distance, pair_distances, shapes, write_distances_within
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.runtime import PeakMemory
from heat_igl.sources import source_set
from heat_igl.typing import FloatArray
from heat_igl.validation.construction import hull, on_sphere, planar
from heat_igl.windows.exact import ExactSurface

from harness import METHODS, Row, Table, collected, drawn, named, paired, parsed, publish, seconds
from harness import vtp as run_vtp

# Local queries: how many, the share of the vertices that a radius holds, mean edges between the ends of a pair, and how
# many nearest vertices.
LOCAL, SHARE, APART, NEAREST = 1000, 0.01, 2.0, 32
# The share of the vertices in each row of a matrix.
IN_ROW = 0.05


def points_on_sphere(n: int, semi_axes: Sequence[float] = (1.0, 1.0, 1.0)) -> Mesh:
    return hull(on_sphere(n, np.random.default_rng(0)) * semi_axes)


def ground(n: int, roughness: float, shear: float = 0.0) -> Mesh:
    """Random heights on the Delaunay triangulation of random points; `roughness` in units of their spacing."""
    rng = np.random.default_rng(0)
    P = rng.random((n, 2))
    mesh = planar(P, rng.normal(size=n) * roughness / np.sqrt(n))
    return mesh.with_vertices(mesh.V + shear * mesh.V[:, 1:2] * [1, 0, 0])


def drum(n: int) -> Mesh:
    """Two rings of n vertices, and a fan of n triangles over each: windows enter a fan over all sides of its rim."""
    wall, rim = shapes.cylinder(n, 1, 1.0), np.arange(n)
    ends = [np.column_stack([np.roll(rim, turn), np.roll(rim, 1 - turn), np.full(n, 2 * n + turn)]) for turn in (0, 1)]
    return Mesh(np.vstack([wall.V, [0, 0, 0], [0, 0, 1]]), np.vstack([wall.F, ends[0], ends[1] + [n, n, 0]]))


SHAPES: dict[str, Callable[[], Mesh]] = {
    "icosphere 5": lambda: shapes.icosphere(5),
    "icosphere 6": lambda: shapes.icosphere(6),
    "bumpy sphere": lambda: shapes.blob(6),
    "small torus": lambda: shapes.torus(120, 50),
    "large torus": lambda: shapes.torus(400, 250),
    "5000 points on a sphere": lambda: points_on_sphere(5000),
    "100 000 points on a sphere": lambda: points_on_sphere(100_000),
    "points on a flat ellipsoid": lambda: points_on_sphere(20_000, (1.0, 0.3, 0.1)),
    "plane": lambda: shapes.grid(316),
    "gentle ground": lambda: ground(5000, 0.2),
    "rough ground": lambda: ground(5000, 0.5),
    "rugged ground": lambda: ground(5000, 1.0),
    "rough ground, large": lambda: ground(50_000, 0.5),
    "rough ground, largest": lambda: ground(130_000, 0.5),
    "sheared ground": lambda: ground(5000, 0.3, 4.0),
    "sheared ground, large": lambda: ground(50_000, 0.3, 4.0),
    "drum of 2000": lambda: drum(2000),
    "drum of 4000": lambda: drum(4000),
    "drum of 8000": lambda: drum(8000),
}


def from_arrays(mesh: Mesh, source: int) -> FloatArray:
    return geodesic_distance((mesh.V.copy(), mesh.F.copy()), source, method="exact")


def difference(distance: FloatArray, other: FloatArray) -> float:
    """The largest relative difference, at the vertices that the other has reached."""
    known = (other > 0) & np.isfinite(other)
    return float((np.abs(distance - other)[known] / other[known]).max())


def measured(name: str, mesh: Mesh, n_sources: int, repeats: int) -> Row:
    """Windows, seconds, and the difference to VTP."""
    sources = drawn(mesh, n_sources)
    surface = ExactSurface(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    chosen = [source_set(source, mesh.n_vertices, mesh.F) for source in sources]
    windows = [surface.solve(each).n_windows / len(mesh.edges) for each in chosen]
    row: Row = {"mesh": name, "n": mesh.n_vertices, "windows": np.mean(windows)}
    calls = {"from arrays": lambda: from_arrays(mesh, sources[0])}
    calls["query"] = lambda: surface.solve(chosen[0])
    row |= {key: np.median(times) for key, times in paired(calls, repeats).items()}
    if METHODS["VTP"].is_there:
        # It ends in an error at edges of more than two faces.
        with contextlib.suppress(subprocess.CalledProcessError):
            times = [beside_vtp(mesh, source, repeats) for source in sources]
            shares = [share for _, share in times]
            row |= {"vtp": np.median([theirs for theirs, _ in times])}
            row |= {"share": np.median(shares), "largest share": max(shares)}
            theirs = run_vtp(mesh, sources[0])[1]
            row |= {"lost": int(np.isinf(theirs).sum()), "to VTP": difference(from_arrays(mesh, sources[0]), theirs)}
    return row


def beside_vtp(mesh: Mesh, source: int, repeats: int) -> tuple[float, float]:
    """Seconds of VTP, and the median share that distance from arrays takes, in turns; the first call warms up."""
    theirs, shares = [], []
    for _ in range(repeats):
        theirs.append(run_vtp(mesh, source)[0])
        shares.append(np.median([seconds(lambda: from_arrays(mesh, source)) for _ in range(3)]) / theirs[-1])
    return float(np.median(theirs)), float(np.median(shares))


def local(name: str, mesh: Mesh, repeats: int) -> Row:
    """Seconds of each of many local queries, preparation shared, and of one full query."""
    source, solver = drawn(mesh, 1)[0], heat_igl.GeodesicSolver(mesh)
    distance = solver.distance(source)
    usable = np.flatnonzero(np.isfinite(distance))
    some = np.random.default_rng(0).choice(usable, min(LOCAL, len(usable)), replace=False)
    radius = float(np.sort(distance)[int(SHARE * mesh.n_vertices) + 1])
    apart = APART * float(mesh.edge_lengths.mean())
    near = distances_within(mesh, 1.5 * apart, some)
    pairs = []
    for vertex, begin, end in zip(some, near.indptr[:-1], near.indptr[1:], strict=True):
        best = np.argmin(np.abs(near.data[begin:end] - apart))
        pairs.append((vertex, near.indices[begin + best]))
    calls: dict[str, Callable[[], object]] = {
        "query": lambda: solver.distance(source),
        "within": lambda: distances_within(mesh, radius, some),
        "pair": lambda: pair_distances(mesh, pairs),
        "nearest": lambda: heat_igl.nearest_vertices(mesh, NEAREST),
    }
    took = {key: float(np.median(times)) for key, times in paired(calls, repeats).items()}
    parts = {key: took["query"] / took[key] * len(some) for key in ("within", "pair")}
    held = np.diff(distances_within(mesh, radius, some).indptr).mean()
    return {"mesh": name, "held": held, "pair, us": 1e6 * took["pair"] / len(some), "parts": parts} | took


def streamed(n_rows: int) -> str:
    """What it takes to write rows of a matrix of nearest vertices to a store."""
    mesh = shapes.torus(400, 250)
    radius = float(np.quantile(geodesic_distance(mesh, 0, method="exact"), IN_ROW))
    with tempfile.TemporaryDirectory() as folder, PeakMemory() as peak:
        took = seconds(lambda: write_distances_within(Path(folder, "matrix"), mesh, radius, np.arange(n_rows)))
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    return (
        f"{n_rows} rows of {mesh.n_vertices} columns into a store: {took:.0f} s, {(peak.bytes or 0) / 2**20:.0f} MiB "
        f"of memory, {size / 2**20:.0f} MiB of store."
    )


EXACT = {
    "mesh": "mesh", "vertices": "{n}", "windows per edge": "{windows:.2f}", "from arrays, s": "{from arrays:.4f}",
    "per query, s": "{query:.4f}",
    "VTP, s": "{vtp:.3g}", "from arrays / VTP": "{share:.2f}", "largest": "{largest share:.2f}",
    "difference to VTP": "{to VTP:.1e}", "VTP without distance": "{lost}",
}  # fmt: skip
OF_LOCAL = {
    "mesh": "mesh", "query, s": "{query:.4f}", "vertices within": "{held:.0f}", "within": "1/{parts[within]:.0f}",
    "pair": "1/{parts[pair]:.0f}", "pair, µs": "{pair, us:.1f}", f"{NEAREST} nearest of all, s": "{nearest:.2f}",
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", sources=4, repeats=3, matrix=0, only=[*SHAPES], shapes=False)
    tables: dict[str, Table | str] = {}
    meshes = named(options.meshes)
    generated = {name: SHAPES[name]() for name in options.only} if options.shapes else {}
    for part, chosen in (("exact", meshes), ("shapes", generated)):
        rows = collected(measured(name, mesh, options.sources, options.repeats) for name, mesh in chosen.items())
        if rows:
            tables[part] = Table(rows, EXACT)
    if meshes:
        text = f"Local queries as shares of a full one, of {LOCAL}, preparation included."
        rows = collected(local(name, mesh, options.repeats) for name, mesh in meshes.items())
        tables["local"] = Table(rows, OF_LOCAL, text)
    if options.matrix:
        tables["matrix"] = streamed(options.matrix)
    publish(options, tables)


if __name__ == "__main__":
    main()
