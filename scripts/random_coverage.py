"""Exact distance by windows on random nearly flat surfaces, against straight lines that are followed one by one.

    python scripts/random_coverage.py --count 2000        # members of the families of validation/zoo/nearly_flat.py
    python scripts/random_coverage.py --count 100 --first 500     # those of the seeds 500 to 599

Each member is asked from three vertices, on the intrinsic Delaunay triangulation and on the triangles as given. Every
distance must be finite and no larger than its neighbour's plus the edge between. On members of at most 60 vertices it
is compared with `straight_lines`: from every vertex, all straight lines over sequences of faces, and Dijkstra's
algorithm on the vertices that they connect. This keeps no windows, cuts nothing, and knows no angles.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from heat_igl import Mesh
from heat_igl.errors import MeshError
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.typing import FloatArray
from heat_igl.validation.zoo import FAMILIES
from heat_igl.windows.exact import ExactSurface
from heat_igl.windows.tables import MARGIN, from_mesh

from harness import Table, parsed, publish

NAMES = [name for name, make in FAMILIES.items() if make.__module__.endswith("nearly_flat")]
_MOST_COMPARED = 60


def straight_lines(mesh: Mesh, sources: Sequence[int]) -> FloatArray:
    """Distance (k, n) of every vertex from each source, by all straight lines between vertices.

    On a surface of some dozens of vertices in which each edge has at most two faces. A line is followed as long as it
    reaches an edge sooner than paths along edges reach its farther points.
    """
    n = mesh.n_vertices
    length = {}
    across: dict[tuple[int, int], list[int]] = {}
    for face in mesh.F.tolist():
        for c in range(3):
            a, b = face[c], face[c - 1]
            length[a, b] = length[b, a] = float(np.linalg.norm(mesh.V[a] - mesh.V[b]))
            for edge in ((a, b), (b, a)):
                across.setdefault(edge, []).append(face[c - 2])
    between = dict(length)
    edges = np.array(list(length))
    along_edges = dijkstra(csr_array((list(length.values()), edges.T), (n, n))).tolist()
    for source in range(n):
        longest = along_edges[source]
        for face in mesh.F[(source == mesh.F).any(axis=1)].tolist():
            i = face.index(source)
            a, b = face[i - 2], face[i - 1]
            ax, (bx, by) = length[source, a], _corner(length[source, a], length[source, b], length[a, b])
            # The edge from a to b in the plane of the source; lines between two directions cross it.
            waiting = [(a, (ax, 0.0), b, (bx, by), source, (ax, 0.0), (bx, by))]
            while waiting:
                a, A, b, B, behind, right, left = waiting.pop()
                for c in across[a, b]:
                    if c == behind:
                        continue
                    side = length[a, b]
                    along, above = _corner(side, length[a, c], length[b, c])
                    ux, uy = (B[0] - A[0]) / side, (B[1] - A[1]) / side
                    C = (A[0] + along * ux + above * uy, A[1] + along * uy - above * ux)
                    to_right = right[0] * C[1] - right[1] * C[0]
                    to_left = C[0] * left[1] - C[1] * left[0]
                    if to_right >= 0.0 and to_left >= 0.0:
                        pair = (source, c)
                        between[pair] = min(between.get(pair, np.inf), float(np.hypot(*C)))
                    if to_right > 0.0 and _least(A, C) <= min(longest[a], longest[c]) + length[a, c]:
                        waiting.append((a, A, c, C, b, right, C if to_left > 0.0 else left))
                    if to_left > 0.0 and _least(C, B) <= min(longest[b], longest[c]) + length[b, c]:
                        waiting.append((c, C, b, B, a, C if to_right > 0.0 else right, left))
    pairs = np.array(list(between))
    graph = csr_array((list(between.values()), pairs.T), (n, n))
    return np.asarray(dijkstra(graph, indices=sources))


def _corner(base: float, left: float, right: float) -> tuple[float, float]:
    """The corner of a triangle over its base, by the sides at both ends."""
    if base >= left:
        x = 0.5 * ((base - right) * (base + right) + left * left) / base
    else:
        x = 0.5 * ((left - right) * (left + right) + base * base) / base
    return x, float(np.sqrt(max((left - x) * (left + x), 0.0)))


def _least(P: tuple[float, float], Q: tuple[float, float]) -> float:
    """Distance of a segment from the origin."""
    dx, dy = Q[0] - P[0], Q[1] - P[1]
    at = min(max(-(P[0] * dx + P[1] * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return float(np.hypot(P[0] + at * dx, P[1] + at * dy))


def excess(mesh: Mesh, distance: FloatArray) -> float:
    """By how much distance grows faster than along an edge, over the largest distance; inf if a vertex has none."""
    if not np.isfinite(distance).all():
        return np.inf
    a, b = mesh.edges.T
    more = np.abs(distance[a] - distance[b]) - np.linalg.norm(mesh.V[a] - mesh.V[b], axis=1)
    return float(max(more.max(), 0.0) / distance.max())


def compared(seed: int) -> tuple[str, int, float, float, float]:
    """Family, vertices, `excess`, difference of two triangulations, and to `straight_lines` (0 if not compared)."""
    name = NAMES[seed % len(NAMES)]
    try:
        mesh = FAMILIES[name](seed)
        surfaces = [
            ExactSurface(from_mesh(mesh, 0)),
            ExactSurface(intrinsic_triangulation(mesh, MARGIN)),
        ]
    except MeshError:
        return name, 0, 0.0, 0.0, 0.0
    sources = np.random.default_rng(seed).integers(0, mesh.n_vertices, 3)
    first, second = ([surface.distance(np.array([s])) for s in sources] for surface in surfaces)
    found, again = np.array(first), np.array(second)
    worst = max(excess(mesh, d) for d in [*found, *again])
    if not np.isfinite(worst):
        return name, mesh.n_vertices, np.inf, np.inf, np.inf
    apart, largest = float(np.abs(found - again).max()), float(found.max())
    lines = straight_lines(mesh, sources) if mesh.n_vertices <= _MOST_COMPARED else found
    return name, mesh.n_vertices, worst, apart / largest, float(np.abs(lines - found).max()) / largest


def main(argv: Sequence[str] | None = None) -> int:
    options = parsed(__doc__, argv, count=200, first=0)
    found = [compared(seed) for seed in range(options.first, options.first + options.count)]
    heads = ("unreached or longer", "triangulations", "straight lines")
    rows = []
    for name in dict.fromkeys(one[0] for one in found):
        mine = [one for one in found if one[0] == name]
        row = {"family": name, "members": len(mine), "refused": sum(one[1] == 0 for one in mine)}
        row["compared"] = sum(0 < one[1] <= _MOST_COMPARED for one in mine)
        rows.append(row | dict(zip(heads, np.array([one[2:] for one in mine]).max(axis=0).tolist(), strict=True)))
    bad = [seed for seed, one in enumerate(found, options.first) if max(one[2:]) > 1e-9]
    columns = {key: key for key in ("family", "members", "refused", "compared")}
    table = Table(rows, columns | {head: f"{{{head}:.1e}}" for head in heads})
    publish(options, {"coverage": table, "seeds": f"Seeds above 1e-9: {bad}"})
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
