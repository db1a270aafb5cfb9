"""Whether two copies of the package return the same bits: for moves, and for kernels that are written anew.

    python scripts/same_results.py OLD/bin/python NEW/bin/python
    python scripts/same_results.py OLD/bin/python NEW/bin/python --meshes FOLDER --tolerance 1e-12
    python scripts/same_results.py python python --new-path CHECKOUT    # a checkout that is not installed

OLD and NEW are Python interpreters, each with a copy of heat_igl; ``--old-path`` and ``--new-path`` put a folder before
what is installed. Both compute the same results on the meshes of the pymeshlab wheel, generated shapes and the meshes
of FOLDER up to ``--largest`` vertices: operators, heat, distances with each refinement and each kind of source,
Voronoi cells, paths, isolines, and batches with and without Dask (``--no-cluster`` leaves that out). A cell of the
table is ``=`` for the same bits, else the largest difference over the largest value. The exit status is 1 if one is
above the tolerance (by default, above 0), or if only one of the copies fails.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import warnings
from argparse import SUPPRESS
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, SurfaceCurve, SurfacePoints, isolines, shapes, shortest_paths

from scaffold import add_output, add_seed, environment, environment_line, option_parser, publish, table, wheel_mesh

WHEEL = ("airplane.obj", "bone.ply", "bunny.obj", "bunny10k_textured.obj", "cow.obj", "cube.obj")
SUFFIXES = (".off", ".obj", ".ply", ".mesh")


# What is compared. Only names that users have: these stay where they are.


def meshes(folder: Path | None, largest: int, seed: int) -> dict[str, Mesh]:
    """Generated shapes, meshes of the wheel and of a folder, by name."""
    sphere = shapes.icosphere(4)
    moved = sphere.V + np.random.default_rng(seed).uniform(-0.02, 0.02, sphere.V.shape)
    found = {
        "grid": shapes.grid(40),
        "sphere, moved": Mesh(moved, sphere.F),
        "torus": shapes.torus(60, 40),
        "cone": shapes.cone(40, 30),
        "five pages": shapes.book(5, 12),
        "box of tetrahedra": shapes.box(6),
    }
    paths = [path for path in map(wheel_mesh, WHEEL) if path is not None and path.exists()]
    paths += sorted(path for path in folder.iterdir() if path.suffix in SUFFIXES) if folder is not None else []
    for path in paths:
        try:
            mesh = heat_igl.read_mesh(path)
        except heat_igl.MeshError as error:
            print(f"{path.name} is left out: {error}", file=sys.stderr)
            continue
        found.setdefault(path.stem, mesh)
    return {name: mesh for name, mesh in found.items() if mesh.n_vertices <= largest}


def quantities(mesh: Mesh, seed: int) -> dict[str, Callable[[], Any]]:
    """What is computed on a mesh, by name; each returns an array, or a nest of lists of arrays."""
    rng = np.random.default_rng(seed)
    usable = np.unique(mesh.F)
    one, *several = (int(v) for v in rng.choice(usable, min(6, len(usable)), replace=False))
    targets = rng.choice(np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[one])), 6)
    sets = [[int(v)] for v in rng.choice(usable, min(20, len(usable)), replace=False)] + [several]
    kinds: list[Any] = [one, several]
    if not mesh.is_tetrahedral:
        kinds.append(SurfacePoints([int(rng.integers(mesh.n_faces))], [rng.dirichlet(np.ones(3))]))
    solvers: dict[str, HeatMethodSolver] = {}

    def solver(**options: Any) -> HeatMethodSolver:
        key = repr(options)
        if key not in solvers:
            solvers[key] = HeatMethodSolver(mesh, **options)
        return solvers[key]

    def levels() -> list[list[SurfaceCurve]]:
        distance = solver().distance(one)
        return isolines(mesh, distance, np.linspace(0.1, 0.9, 5) * distance[np.isfinite(distance)].max())

    def parts(solution: Any) -> list[np.ndarray]:
        return [solution.heat, solution.direction, solution.distance, np.array(solution.t)]

    def cells(found: Any) -> list[np.ndarray]:
        return [found.distance, found.labels]

    found: dict[str, Callable[[], Any]] = {
        "L, M, G, D": lambda: [
            array
            for A in (getattr(solver().operators, name).tocsc() for name in "LMGD")
            for array in (A.data, A.indices, A.indptr)
        ],
        "solve": lambda: parts(solver().solve(one)),
        "heat": lambda: [solver().distance(each) for each in kinds],
        "cotan": lambda: solver(laplacian="cotan").distance(one),
        "boundary": lambda: solver(boundary="dirichlet").distance(one),
        "batch": lambda: solver().distances(sets),
        "voronoi": lambda: cells(solver().voronoi(several)),
    }
    if not mesh.is_tetrahedral:
        found |= {
            "sweep": lambda: [solver(refine="sweep").distance(each) for each in kinds],
            "unfold": lambda: [solver(refine="unfold").distance(each) for each in kinds],
            "unfolded": lambda: heat_igl.unfolded_distance(mesh.V, mesh.F, one),
            "voronoi, unfold": lambda: cells(solver(refine="unfold").voronoi(several)),
            "batch, unfold": lambda: solver(refine="unfold").distances(sets),
            "isolines": lambda: [[curve.positions(mesh) for curve in level] for level in levels()],
            "paths": lambda: [
                path.positions(mesh) for path in shortest_paths(mesh, solver(refine="unfold"), targets, one)
            ],
        }
    return found


def computed(mesh: Mesh, seed: int) -> dict[str, Any]:
    """The arrays of each quantity; the kind of the error where it fails."""
    found: dict[str, Any] = {}
    for name, quantity in quantities(mesh, seed).items():
        try:
            found[name] = _flat(quantity())
        except Exception as error:
            found[name] = type(error).__name__
            print(f"    {name}: {type(error).__name__}: {error}", file=sys.stderr)
    return found


def _flat(value: Any) -> list[np.ndarray]:
    if isinstance(value, (list, tuple)):
        return [array for each in value for array in _flat(each)]
    return [np.asarray(value)]


def batch_on_dask(all_meshes: dict[str, Mesh], seed: int) -> dict[str, list[np.ndarray]]:
    """What `heat_igl.cluster.distances` stores, by mesh."""
    import zarr

    from heat_igl import cluster

    rng = np.random.default_rng(seed)
    chosen = {name.replace(" ", "_").replace(",", ""): mesh for name, mesh in all_meshes.items()}
    sources = sorted(int(v) for v in rng.choice(8, 4, replace=False))
    with tempfile.TemporaryDirectory() as scratch, cluster.connected(n_workers=1) as client:
        store = Path(scratch, "store")
        cluster.distances(chosen, sources, store, client=client)
        kept = {name: zarr.open_group(store / name, mode="r")["distance"][:] for name in chosen}
    return {name: [kept[key]] for name, key in zip(all_meshes, chosen, strict=True)}


def child(out: Path, folder: Path | None, largest: int, seed: int, with_cluster: bool) -> None:
    """Compute everything with the copy of the package that this interpreter imports."""
    warnings.simplefilter("ignore")
    all_meshes = meshes(folder, largest, seed)
    found = {}
    for name, mesh in all_meshes.items():
        print(f"  {name}: {mesh.n_vertices} vertices", file=sys.stderr, flush=True)
        found[name] = computed(mesh, seed)
    if with_cluster:
        for name, arrays in batch_on_dask(all_meshes, seed).items():
            found[name]["batch, Dask"] = arrays
    sizes = {name: mesh.n_vertices for name, mesh in all_meshes.items()}
    package = str(Path(heat_igl.__file__).parent)
    out.write_bytes(pickle.dumps({"package": package, "environment": environment(), "sizes": sizes, "found": found}))


# How it is compared.


def difference(old: Any, new: Any) -> float:
    """0 for the same bits; else the largest difference over the largest value, infinite if the shapes differ."""
    if isinstance(old, str) or isinstance(new, str):
        return 0.0 if isinstance(old, str) and isinstance(new, str) else np.inf
    if len(old) != len(new):
        return np.inf
    return max((_array_difference(a, b) for a, b in zip(old, new, strict=True)), default=0.0)


def _array_difference(a: np.ndarray, b: np.ndarray) -> float:
    if a.shape != b.shape or a.dtype.kind != b.dtype.kind:
        return np.inf
    if a.tobytes() == b.tobytes() and a.dtype == b.dtype:
        return 0.0
    if (np.isfinite(a) != np.isfinite(b)).any():
        return np.inf
    there = np.isfinite(a)
    largest = float(np.abs(a[there].astype(float) - b[there].astype(float)).max(initial=0.0))
    # Of bits that differ although the values do not, as those of 0 and -0, the least that shows.
    return max(largest / max(float(np.abs(a[there]).max(initial=0.0)), 1e-300), 5e-324)


def markdown(result: dict[str, Any]) -> str:
    rows = result["differences"]
    names = list(dict.fromkeys(name for row in rows.values() for name in row))

    def cell(row: dict[str, float], name: str) -> str:
        if name not in row:
            return ""
        return "=" if row[name] == 0 else f"{row[name]:.1e}"

    cells = [(mesh, str(result["sizes"][mesh]), *(cell(row, name) for name in names)) for mesh, row in rows.items()]
    lines = [f"OLD: {result['old']}", "", f"NEW: {result['new']}", "", *table(["mesh", "vertices", *names], cells)]
    failed = [f"- {mesh}, {name}: {kinds}" for mesh, row in result["failed"].items() for name, kinds in row.items()]
    if failed:
        lines += ["", "Not computed:", "", *failed]
    return "\n".join([*lines, "", f"Largest difference: {result['largest']:.3g}."])


def _run(python: str, path: Path | None, out: Path, options: Sequence[str]) -> dict[str, Any]:
    environ = {**os.environ, "PYTHONPATH": str(path.resolve()) if path else ""}
    print(f"{python} {path or ''}", file=sys.stderr, flush=True)
    command = [python, __file__, *options, "--child", str(out), python, python]
    subprocess.run(command, env=environ, cwd=out.parent, check=True)
    return dict(pickle.loads(out.read_bytes()))


def compared(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Differences and failures by mesh and quantity."""
    rows: dict[str, dict[str, float]] = {}
    failed: dict[str, dict[str, str]] = {}
    for mesh, before in old["found"].items():
        after = new["found"].get(mesh, {})
        rows[mesh] = {name: difference(before[name], after.get(name, "nothing")) for name in before}
        for name in before:
            kinds = [each if isinstance(each, str) else "" for each in (before[name], after.get(name, "nothing"))]
            if any(kinds):
                failed.setdefault(mesh, {})[name] = f"OLD {kinds[0] or 'computes it'}, NEW {kinds[1] or 'computes it'}"
    largest = max(value for row in rows.values() for value in row.values())
    return {"differences": rows, "failed": failed, "sizes": old["sizes"], "largest": largest}


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("old", help="interpreter with the copy to compare with")
    parser.add_argument("new", help="interpreter with the other copy")
    parser.add_argument("--old-path", type=Path, metavar="FOLDER", help="that holds heat_igl, before what is installed")
    parser.add_argument("--new-path", type=Path, metavar="FOLDER")
    parser.add_argument("--meshes", type=Path, metavar="FOLDER", help="further meshes")
    parser.add_argument("--largest", type=int, default=40_000, help="vertices of a mesh that is taken (default 40000)")
    parser.add_argument("--tolerance", type=float, default=0.0, help="relative (default 0)")
    parser.add_argument("--no-cluster", action="store_true", help="no batch on Dask")
    parser.add_argument("--child", type=Path, help=SUPPRESS)
    add_seed(parser)
    add_output(parser, "same_results")
    options = parser.parse_args(argv)
    if options.child:
        child(options.child, options.meshes, options.largest, options.seed, not options.no_cluster)
        return 0
    handed_on = ["--largest", str(options.largest), "--seed", str(options.seed)]
    handed_on += ["--meshes", str(options.meshes.resolve())] if options.meshes else []
    handed_on += ["--no-cluster"] if options.no_cluster else []
    with tempfile.TemporaryDirectory() as scratch:
        old = _run(options.old, options.old_path, Path(scratch, "old.pickle"), handed_on)
        new = _run(options.new, options.new_path, Path(scratch, "new.pickle"), handed_on)
    if old["package"] == new["package"]:
        parser.error(f"both interpreters import {old['package']}: give --old-path or --new-path")
    result = {
        "environment": new["environment"],
        "old": f"{old['package']} ({environment_line(old['environment'])})",
        "new": f"{new['package']} ({environment_line(new['environment'])})",
        "tolerance": options.tolerance,
        **compared(old, new),
    }
    publish(result, markdown(result), folder=options.output, name="same_results")
    return int(result["largest"] > options.tolerance)


if __name__ == "__main__":
    sys.exit(main())
