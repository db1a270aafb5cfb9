"""Cut meshes along many random curves, and check that the surface stays.

    python scripts/random_cuts.py --count 10000                   # curves of the seeds 0 to 9999
    python scripts/random_cuts.py --count 100 --first 5000        # of the seeds 5000 to 5099

A case is determined by its seed: a small mesh and curves of one kind (unconnected segments in corners, along and across
sides and over each other; loops that cross themselves; lines from boundary to boundary; levels of a function, through
vertices or not; paths along edges; corners that lie within 1e-9 of a vertex or an edge, or a little farther). Of the
cut mesh it is checked

- that the area of every old face is that of its parts,
- that exact distances between the old vertices are the same. Not compared are those over triangles so thin that the
  solver makes edges longer; with smallest angle a in radians, a rounded length changes the shape of a triangle by up to
  2^-52 / a^2 of itself, and differences below that are counted as rounding,
- that every edge has as many faces as before at most, every vertex one fan, the surface the same Euler characteristic,
  number of boundary loops and orientation,
- that the curves are edges, with the same length.

Ten thousand curves take about three minutes.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import igl
import numpy as np

from heat_igl import Mesh, SurfaceCurve, curve_on, cut, edge_curve, isolines, shapes, tangent_frames
from heat_igl.curves import CutMesh
from heat_igl.intrinsic import mollify
from heat_igl.mesh.connectivity import boundary_loops
from heat_igl.typing import FloatArray
from heat_igl.windows import exact_distance
from heat_igl.windows.tables import MARGIN

from harness import Table, parsed, publish

# Relative differences above this are failures.
LARGEST = 1e-12


class Case(NamedTuple):
    """A mesh and curves on it."""

    mesh: Mesh
    curves: list[SurfaceCurve]


def square(rng: np.random.Generator) -> Mesh:
    """A square with an uneven surface."""
    mesh = shapes.grid(int(rng.integers(2, 7)))
    V = mesh.V + rng.normal(size=mesh.V.shape) * rng.uniform(0, 0.1) / np.sqrt(mesh.n_faces) * [0, 0, 1]
    return Mesh(V, mesh.F)


def closed(rng: np.random.Generator) -> Mesh:
    """A sphere, a torus or a blob, its vertices moved."""
    mesh = (shapes.icosphere(1), shapes.icosphere(2), shapes.torus(10, 6), shapes.blob(2))[rng.integers(4)]
    return Mesh(mesh.V + rng.normal(size=mesh.V.shape) * rng.uniform(0, 0.05), mesh.F)


def segments(rng: np.random.Generator) -> Case:
    """Unconnected segments, several in a face: in corners, along and across sides, inside, over each other."""
    mesh = square(rng) if rng.random() < 0.5 else closed(rng)
    kinds = np.array([[0, 0, 1], [0.5, 0.5, 0], [0.25, 0, 0.75], [0.25, 0.25, 0.5], [0.6, 0.2, 0.2], [1 / 3] * 3])
    count = int(rng.integers(1, 40))
    ends = rng.permuted(kinds[rng.integers(len(kinds), size=(2, count))], axis=2)
    return Case(mesh, [SurfaceCurve(rng.integers(0, min(10, mesh.n_faces), count), *ends)])


def nearly(rng: np.random.Generator) -> Case:
    """Segments whose ends lie close to vertices, edges and each other."""
    mesh = square(rng) if rng.random() < 0.5 else closed(rng)
    count = int(rng.integers(1, 15))
    ends = rng.dirichlet([1, 1, 1], size=(2, count))
    ends[rng.random(ends.shape) < 0.3] *= 10.0 ** rng.uniform(-16, -6)
    ends /= ends.sum(axis=2, keepdims=True)
    ends[1, : count // 3] = ends[0, : count // 3][:, ::-1]
    return Case(mesh, [SurfaceCurve(rng.integers(0, min(6, mesh.n_faces), count), *ends)])


def loops(rng: np.random.Generator) -> Case:
    """Closed polylines over a flat square that cross themselves and each other, some twice."""
    mesh = shapes.grid(int(rng.integers(2, 9)))
    drawn = []
    for _ in range(rng.integers(1, 4)):
        corners = rng.uniform(0, 1, (int(rng.integers(3, 9)), 2))
        corners[rng.random(corners.shape) < 0.1] = 0.0  # on the boundary
        drawn.append(curve_on(mesh, np.column_stack([corners, np.zeros(len(corners))]), closed=True))
    return Case(mesh, drawn * int(rng.integers(1, 3)))


def across(rng: np.random.Generator) -> Case:
    """Straight lines over a flat square from boundary to boundary, some along rows and diagonals of its vertices."""
    n = int(rng.integers(2, 9))
    mesh = shapes.grid(n)
    ends = rng.uniform(0, 1, (2, int(rng.integers(1, 4))))
    if rng.random() < 0.5:
        ends = np.rint(n * ends) / n
    lines = [curve_on(mesh, [[0, a, 0], [1, b, 0]]) for a, b in ends.T]
    return Case(mesh, lines)


def levels(rng: np.random.Generator) -> Case:
    """Levels of a random function, through vertices in half of the cases."""
    mesh = square(rng) if rng.random() < 0.5 else closed(rng)
    values = np.sin(mesh.V @ rng.normal(size=(3, 3)) * 3 + rng.uniform(0, 6, 3)).sum(axis=1)
    if rng.random() < 0.3:
        values = np.rint(4 * values)  # faces and edges of one value
    chosen = rng.choice(values, 2) if rng.random() < 0.5 else np.quantile(values, rng.uniform(0.1, 0.9, 2))
    return Case(mesh, [curve for level in chosen for curve in isolines(mesh, values, float(level))[0]])


def along_edges(rng: np.random.Generator) -> Case:
    """Random walks along edges."""
    mesh = square(rng) if rng.random() < 0.5 else closed(rng)
    tail, head = mesh.edges.T
    path = [int(rng.integers(mesh.n_vertices))]
    for _ in range(int(rng.integers(1, 20))):
        beside = np.concatenate([head[tail == path[-1]], tail[head == path[-1]]])
        path.append(int(rng.choice(beside)))
    return Case(mesh, [edge_curve(mesh, path)])


KINDS: tuple[Callable[[np.random.Generator], Case], ...] = (
    segments,
    nearly,
    loops,
    across,
    levels,
    along_edges,
)


def failures(case: Case) -> tuple[list[str], str]:
    """What is wrong with one cut mesh, and whether distances are the same, "rounding" or not compared ("thin")."""
    mesh = case.mesh
    found = cut(mesh, case.curves)
    wrong = []
    area = np.bincount(found.old_faces, found.mesh.measures, mesh.n_faces)
    if (np.abs(area - mesh.measures) > LARGEST * mesh.measures).any():
        wrong.append("area")
    if not _same_topology(mesh, found):
        wrong.append("topology")
    n = found.mesh.n_vertices
    edges = np.sort(found.mesh.edges, axis=1) @ [n, 1]
    drawn = sum(float(_drawn(mesh, curve).sum()) for curve in case.curves)
    length = np.linalg.norm(np.diff(found.mesh.V[found.edges], axis=1)[:, 0], axis=1).sum()
    # A corner within 1e-9 of an edge is put there.
    moved = 1e-8 * mesh.edge_lengths.max() * sum(len(curve) for curve in case.curves)
    if not np.isin(np.sort(found.edges, axis=1) @ [n, 1], edges).all() or abs(length - drawn) > moved:
        wrong.append("curve")
    # The solver makes edges longer where triangles are so thin that their lengths do not tell their height.
    if mollify(igl.edge_lengths(found.mesh.V, found.mesh.F), found.mesh.F, MARGIN).any():
        return wrong, "thin"
    start = [0, mesh.n_vertices // 2]
    before, after = (exact_distance(each.V, each.F, start)[: mesh.n_vertices] for each in (mesh, found.mesh))
    off = float(np.abs(after - before).max() / before.max())
    if off <= LARGEST:
        return wrong, "same"
    if off <= 2.0**-52 / float(igl.internal_angles(found.mesh.V, found.mesh.F).min()) ** 2:
        return wrong, "rounding"
    return [*wrong, "distance"], "different"


def _same_topology(mesh: Mesh, found: CutMesh) -> bool:
    new = found.mesh
    tangent_frames(new)  # raises unless each vertex has one fan, and neighbours are oriented alike
    characteristic = [len(each.facets.vertices) - each.n_faces - each.n_vertices for each in (mesh, new)]
    n_loops = [boundary_loops(each.facets, each.n_vertices) for each in (mesh, new)]
    return characteristic[0] == characteristic[1] and n_loops[0] == n_loops[1] and new.facets.n_faces.max() <= 2


def _drawn(mesh: Mesh, curve: SurfaceCurve) -> FloatArray:
    """Lengths of segments, whether or not each begins where the one before ends."""
    ends = (np.einsum("sc,scx->sx", at, mesh.V[mesh.F[curve.faces]]) for at in (curve.start, curve.end))
    return np.asarray(np.linalg.norm(np.subtract(*ends), axis=1))


def campaign(count: int, first: int) -> dict[str, Any]:
    """Counts by kind, and the seeds that failed."""
    counts: dict[str, Counter[str]] = {kind.__name__: Counter() for kind in KINDS}
    failed: list[dict[str, Any]] = []
    for seed in range(first, first + count):
        kind = KINDS[seed % len(KINDS)]
        case = kind(np.random.default_rng(seed))
        of_kind = counts[kind.__name__]
        of_kind["curves"] += len(case.curves)
        if not case.curves:
            continue
        try:
            wrong, distances = failures(case)
        except Exception as error:  # a seed that raises is a finding too
            wrong, distances = [f"{type(error).__name__}: {error}"], "different"
        of_kind["meshes"] += 1
        of_kind[f"distances {distances}"] += 1
        of_kind["failed"] += bool(wrong)
        if wrong:
            failed.append({"seed": seed, "kind": kind.__name__, "wrong": wrong})
    return {"counts": counts, "failed": failed}


def main(argv: Sequence[str] | None = None) -> int:
    options = parsed(__doc__, argv, count=1000, first=0)
    found = campaign(options.count, options.first)
    heads = ["meshes", "curves", "distances same", "distances rounding", "distances thin", "failed"]
    rows = [{"kind": name} | {head: counts[head] for head in heads} for name, counts in found["counts"].items()]
    failed = "\n".join(f"- {each}" for each in found["failed"])
    publish(options, {"cuts": Table(rows, {head: head for head in ["kind", *heads]}), "failed": failed})
    return 1 if found["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
