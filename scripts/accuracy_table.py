"""Error and time per query of every method on the same meshes and sources, against exact polyhedral distance.

    python scripts/accuracy_table.py bunny.obj cow.obj --seeds 3 --json table.json

Prints a Markdown table: the mean of |d - exact| / exact over vertices (averaged over sources), its 99th percentile and
the largest |d - exact| relative to the largest distance (both for the worst source), all in percent; milliseconds per
query, and what that is relative to MeshLab's front and to exact distance. Methods whose package is not installed are
left out. Exact distances come from pygeodesic (1 to 2 s per source at 30 000 vertices); ``--exact-cache DIR`` keeps
them for the next run.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl.geodesic import DistanceMethod, SolverChoice
from heat_igl.typing import FloatArray

from measuring import Query, drawn_sources, errors, exact_distance, potpourri3d, seconds_of
from scaffold import add_json, environment, option_parser, publish, table

Row = dict[str, Any]


def ours(method: DistanceMethod) -> Callable[[heat_igl.Mesh], Query]:
    return lambda mesh: SolverChoice(method).on(mesh).distance


def front(mesh: heat_igl.Mesh) -> Query:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.V, mesh.F))
    # The default maximum cuts the front off and leaves zeros behind.
    without_limit = pymeshlab.PureValue(1e3 * float(np.ptp(mesh.V, axis=0).max()))

    def query(source: int) -> FloatArray:
        meshes.apply_filter(
            "compute_scalar_by_geodesic_distance_from_given_point_per_vertex",
            startpoint=mesh.V[source],
            maxdistance=without_limit,
        )
        return np.asarray(meshes.current_mesh().vertex_scalar_array())

    return query


METHODS: dict[str, Callable[[heat_igl.Mesh], Query]] = {
    "potpourri3d": potpourri3d,
    "MeshLab front": front,
    "heat": ours("heat"),
    "sweep": ours("sweep"),
    "windows": ours("windows"),
}


def fastest(query: Query, source: int, repeats: int) -> tuple[FloatArray, float]:
    """The distance, and the least time after one call that warms up: the one that others disturbed least."""
    distance = query(source)
    return distance, min(seconds_of(lambda: query(source)) for _ in range(repeats))


def measure(path: str, names: list[str], seeds: int, repeats: int, cache: Path | None) -> list[Row]:
    mesh = heat_igl.read_mesh(path)
    sources = drawn_sources(mesh, range(seeds))
    exact = [exact_distance(mesh, source, cache) for source in sources]
    rows = []
    for name in names:
        try:
            query = METHODS[name](mesh)
        except ImportError as error:
            print(f"{name} left out: {error}", file=sys.stderr)
            continue
        found = [fastest(query, source, repeats) for source in sources]
        error = np.array([errors(d, e) for (d, _), (e, _) in zip(found, exact, strict=True)])
        rows.append(
            {
                "mesh": Path(path).stem,
                "vertices": mesh.n_vertices,
                "method": name,
                "mean": float(error[:, 0].mean()),
                "p99": float(error[:, 1].max()),
                "worst": float(error[:, 2].max()),
                "milliseconds": 1e3 * float(np.mean([seconds for _, seconds in found])),
                "exact_milliseconds": 1e3 * float(np.mean([seconds for _, seconds in exact])),
            }
        )
    return rows


def markdown(rows: list[Row]) -> str:
    front_time = {row["mesh"]: row["milliseconds"] for row in rows if row["method"] == "MeshLab front"}
    cells = [
        (
            row["mesh"],
            f"{row['vertices']}",
            row["method"],
            f"{row['mean']:.4f}",
            f"{row['p99']:.3f}",
            f"{row['worst']:.2f}",
            f"{row['milliseconds']:.1f}",
            f"{row['milliseconds'] / front_time[row['mesh']]:.2f}" if row["mesh"] in front_time else "-",
            f"{row['milliseconds'] / row['exact_milliseconds']:.4f}",
        )
        for row in rows
    ]
    head = "mesh | vertices | method | mean % | 99th % | worst % | ms | of front | of exact".split(" | ")
    return "\n".join([*table(head, cells, (0, 2)), "", *summary(rows)])


def summary(rows: list[Row]) -> list[str]:
    """Geometric means over the meshes, and their ratios to the two usual methods."""
    by_method: dict[str, dict[str, float]] = {}
    for row in rows:
        by_method.setdefault(row["method"], {})[row["mesh"]] = row["mean"]
    lines = []
    for method, means in by_method.items():
        line = f"- {method}: geometric mean {np.exp(np.mean(np.log(list(means.values())))):.5f} %"
        for other in ("potpourri3d", "MeshLab front"):
            if other in by_method and other != method:
                ratio = np.mean([np.log(means[mesh] / by_method[other][mesh]) for mesh in means])
                line += f", {np.exp(ratio):.5f} of {other}"
        lines.append(line)
    return lines


def main(argv: list[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--seeds", type=int, default=3, help="sources per mesh, one per seed")
    parser.add_argument("--repeats", type=int, default=5, help="timed calls per source")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--exact-cache", type=Path, help="directory that keeps exact distances")
    add_json(parser)
    options = parser.parse_args(argv)
    rows: list[Row] = []
    for path in options.meshes:
        rows += measure(path, options.methods, options.seeds, options.repeats, options.exact_cache)
        print(f"{Path(path).stem} done", file=sys.stderr, flush=True)
    publish({"environment": environment(), "rows": rows}, markdown(rows), json_file=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
