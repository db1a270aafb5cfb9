"""heat_igl against its peers: the methods beyond those of the benchmark, and the page that compares them all.

``python scripts/benchmark.py --page docs/peers.md`` measures and writes it.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import GeodesicSolver, Mesh, write_mesh

from scaffold import environment_line, fill_in, table

# Name -> number of vertices above which it is left out: minutes and gigabytes are known by then.
LARGEST = {
    "heat_igl": 5_000_000,
    "potpourri3d": 500_000,
    "libigl heat": 500_000,
    "heat_igl near-exact": 5_000_000,
    "MeshLab's front": 200_000,
    "potpourri3d fast marching": 500_000,
    "heat_igl exact": 1_000_000,
    "VTP": 500_000,
    "pygeodesic": 60_000,
    "libigl exact": 30_000,
    "gdist": 60_000,
}
# Where the child process of VTP finds the program.
VTP = "HEAT_IGL_VTP"
UNREACHED = 1e99  # VTP writes 1e100
Prepared = tuple[Callable[[int], np.ndarray], Callable[[Sequence[int]], Any] | None, dict[str, Any]]


def _solver(method: str) -> Callable[[np.ndarray, np.ndarray], Prepared]:
    def prepare(V: np.ndarray, F: np.ndarray) -> Prepared:
        solver = GeodesicSolver((V, F), method=method)
        return solver.distance, solver.distances, {}

    return prepare


def _fast_marching(V: np.ndarray, F: np.ndarray) -> Prepared:
    import potpourri3d

    solver = potpourri3d.MeshFastMarchingDistanceSolver(V, F)

    def solve(source: int) -> np.ndarray:
        return np.asarray(solver.compute_distance([[(int(source), [])]]))

    return solve, lambda sources: [solve(source) for source in sources], {}


def _libigl_exact(V: np.ndarray, F: np.ndarray) -> Prepared:
    import igl

    targets, none = np.arange(len(V)), np.zeros(0, np.int64)
    return lambda source: igl.exact_geodesic(V, F, np.array([source]), none, targets, none), None, {}


def _gdist(V: np.ndarray, F: np.ndarray) -> Prepared:
    import gdist

    faces = F.astype(np.int32)
    return lambda source: gdist.compute_gdist(V, faces, source_indices=np.array([source], np.int32)), None, {}


def _vtp(V: np.ndarray, F: np.ndarray) -> Prepared:
    """The program of Qin et al. (2016): the seconds are those of the propagation, without reading and preparation."""
    facts: dict[str, Any] = {"precomputation": 0.0, "peak_memory": None}
    # The program merges vertices in one place, and counts them in the order in which they come first.
    _, first, place = np.unique(V, axis=0, return_index=True, return_inverse=True)
    merged = np.argsort(np.argsort(first))[place.ravel()]

    def solve(source: int) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            mesh, found = Path(folder, "mesh.obj"), Path(folder, "distance.txt")
            write_mesh(mesh, (V, F))
            command = [os.environ[VTP], "-m", str(mesh), "-s", str(merged[source]), "-o", str(found)]
            printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            distance = np.loadtxt(found)
        facts["query"] = float(re.findall(r"propagation step took (\S+) seconds", printed)[0])
        return np.where(distance < UNREACHED, distance, np.inf)[merged]

    return solve, None, facts


PREPARE = {
    "heat_igl windows": _solver("windows"),
    "heat_igl exact": _solver("exact"),
    "potpourri3d fast marching": _fast_marching,
    "libigl exact": _libigl_exact,
    "gdist": _gdist,
    "VTP": _vtp,
}
NEEDS = {"potpourri3d fast marching": "potpourri3d", "gdist": "gdist"}


def measured(
    measure: Callable[..., list[dict[str, Any]]], meshes: Sequence[tuple[str, Mesh]], methods: Sequence[str], runs: int
) -> list[dict[str, Any]]:
    """A row for each method and mesh, by the benchmark's `measure`; truth is the exact distance of this package."""
    rows: list[dict[str, Any]] = []
    for name, mesh in meshes:
        print(name, file=sys.stderr)
        rng = np.random.default_rng(0)
        sources = rng.choice(np.flatnonzero(mesh.referenced), 6, replace=False)
        exact = GeodesicSolver(mesh, tolerance=0).distance(int(sources[0]))
        chosen = [method for method in methods if mesh.n_vertices <= LARGEST[method]]
        rows += measure(name, mesh, chosen, runs, sources, exact)
    return rows


def parts(result: dict[str, Any]) -> dict[str, str]:
    """The parts of the page: the table of each mesh, and the environment."""
    head = ("method", "preparation, s", "first query, s", "later query, s", "peak MB", "mean error, %", "largest, %")
    lines: list[str] = []
    for name in dict.fromkeys(row["mesh"] for row in result["peers"]):
        rows = [row for row in result["peers"] if row["mesh"] == name]
        lines += [f"### {name}, {rows[0]['n']} vertices", "", *table(head, [_cells(row) for row in rows]), ""]
    return {"peers": "\n".join(lines), "environment": f"{environment_line(result['environment'])}."}


def _cells(row: dict[str, Any]) -> list[str]:
    prepared = row["precomputation"] if row.get("later") is not None else None
    memory = None if row["peak_memory"] is None else row["peak_memory"] / 1e6
    found = (prepared, row["query"], row.get("later"), memory, row["mean_error"], row["max_error"])
    digits = (".3f", ".4f", ".4f", ".0f", ".3f", ".3f")
    cells = ["-" if value is None else format(value, form) for value, form in zip(found, digits, strict=True)]
    return [row["method"], *cells]


def write_page(path: Path, result: dict[str, Any]) -> None:
    """Fill in the parts of the page."""
    path.write_text(fill_in(path.read_text(encoding="utf8"), parts(result)), encoding="utf8")
