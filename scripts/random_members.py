"""Random members of families that once were answered wrongly, each determined by its seed.

    python scripts/random_members.py exact --members 2000           # those of the seeds 0 to 1999
    python scripts/random_members.py cuts --members 100 --first 500
    python scripts/random_members.py log-maps
    python scripts/random_members.py signed

A table has a row for each kind, with the largest of each figure, and the seeds of members with a larger one than
`LARGEST` and than rounding explains: with smallest angle a in radians, a rounded length changes the shape of a triangle
by 2^-52 / a^2 of itself. The exit status is 1 if there are any.

exact: distance by windows on nearly flat surfaces (validation/random_shapes.py) and on coarse rough ones, from three
vertices, on the intrinsic Delaunay triangulation and on the triangles as given. "edges": by how much distance grows
faster than along an edge, inf where a vertex has none. "triangulations": the difference of both. "straight lines": on
at most 60 vertices, the difference to `straight_lines`. All as shares of the largest distance.

cuts: small meshes cut along curves across, through and along everything. "area": how far the parts of a face are from
its area. "length": how far the curves among the edges are from their length. "distance": how far exact distances
between the old vertices are from those before, and 0 where triangles are so thin that the solver makes edges longer.
"topology": 1 unless every edge has two faces at most, every vertex one fan, and the surface the same Euler
characteristic, boundary loops and orientation.

log-maps: hulls stretched by up to 100, spiky spheres, tori, cylinders and rough squares, from vertices, edges and
faces, also from 1e-12 to 1e-3 of an edge beside vertices and edges: the largest distance between a vertex and `exp_map`
of its log map, over the vertices whose shortest path is straight, as a share of the largest distance.

signed: Delaunay triangulations of 2000 unevenly spread points in the plane, and discs of their faces with faces taken
out and others put in at random: how far the size is from the exact distance, as a share of the largest distance; 1 for
a wrong sign, where all faces of a vertex are inside, or none.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

import igl
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

import heat_igl
from heat_igl import Mesh, SurfaceCurve, curve_on, exp_map, geodesic_distance, isolines, log_map, shapes, tangent_frames
from heat_igl.errors import MeshError
from heat_igl.intrinsic import intrinsic_triangulation, mollify
from heat_igl.mesh import region_boundary
from heat_igl.mesh.connectivity import boundary_loops
from heat_igl.operators import operators
from heat_igl.sources import source_set
from heat_igl.typing import FloatArray
from heat_igl.validation.construction import hull, on_sphere, planar, revolved
from heat_igl.validation.zoo import FAMILIES
from heat_igl.windows import ExactSurface, exact_distance
from heat_igl.windows.tables import MARGIN, from_mesh

from harness import Row, Table, parsed, publish

Random = np.random.Generator
# Kind, figures, and what of them the rounding of lengths explains.
Member = tuple[str, dict[str, float], float]
LARGEST = {"exact": 1e-9, "cuts": 1e-12, "log-maps": 1e-8, "signed": 1e-12}
_MOST_COMPARED, _COARSE = 60, 30


def rough(shape: Mesh, most: float = 0.05) -> Callable[[Random], Mesh]:
    """A shape with its vertices moved."""
    return lambda rng: Mesh(shape.V + rng.normal(size=shape.V.shape) * rng.uniform(0, most), shape.F)


def spikes(mesh: Mesh, rng: Random, most: float) -> Mesh:
    """A random radius at each vertex."""
    return Mesh(mesh.V * np.exp(rng.normal(size=(mesh.n_vertices, 1)) * rng.uniform(0, most)), mesh.F)


def rounding(mesh: Mesh) -> float:
    """By how much a rounded length changes the shape of the thinnest triangle."""
    return float(2.0**-52 / max(np.radians(mesh.report().smallest_angle), 1e-20) ** 2)


# Exact distance.


def height_field(rng: Random) -> Mesh:
    """Random heights on a Delaunay triangulation of random points."""
    P = rng.random((rng.integers(8, _COARSE), 2))
    return planar(P, rng.normal(size=len(P)) * rng.uniform(0, 0.5))


def needles(rng: Random) -> Mesh:
    """A height field, stretched 10 to 100 times along one axis."""
    mesh = height_field(rng)
    return Mesh(mesh.V * 10 ** (rng.permutation([1, 0, 0]) * rng.uniform(1, 2)), mesh.F)


def long_tube(rng: Random) -> Mesh:
    """Rings of few vertices, up to 1.6 times as far from the next as from the one before; ridges that are straight."""
    around, along = int(rng.integers(3, 9)), int(rng.integers(10, 31))
    turn, height = rng.choice([0.0, np.pi / around]), np.cumsum(rng.uniform(1.2, 1.6) ** np.arange(along))
    tube = revolved(np.ones(along), height, around, turn)
    V = tube.V @ np.linalg.qr(rng.normal(size=(3, 3)))[0] if rng.random() < 0.5 else tube.V
    V = V.astype(np.float32).astype(float) if rng.random() < 0.5 else V
    return Mesh(V, tube.F)


COARSE: dict[str, Callable[[Random], Mesh]] = {
    "star": lambda rng: spikes(hull(on_sphere(int(rng.integers(8, _COARSE)), rng)), rng, 0.6),
    "height field": height_field,
    "torus of 30 vertices": rough(shapes.torus(6, 5), 0.3),
    "book of 3 pages": rough(shapes.book(3, 3), 0.3),
    "needles": needles,
    "long tube": long_tube,
}
NEARLY_FLAT = ("nearly flat cylinder", "nearly flat cone", "pipe reducer", "geometrically spaced rings",
               "nearly flat grid", "grid of integers")  # fmt: skip
EXACT = *NEARLY_FLAT, *COARSE


def straight_lines(mesh: Mesh, sources: Sequence[int]) -> FloatArray:
    """Distance (k, n) of every vertex from each source, by all straight lines between vertices.

    From every vertex all straight lines over sequences of faces, and Dijkstra's algorithm on the vertices that they
    connect: this keeps no windows, cuts nothing, and knows no angles. A line is followed as long as it reaches an edge
    sooner than paths along edges reach its farther points.
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


def exact(seed: int) -> Member:
    name = EXACT[seed % len(EXACT)]
    try:
        mesh = COARSE[name](np.random.default_rng(seed)) if name in COARSE else FAMILIES[name](seed)
        surfaces = [ExactSurface(from_mesh(mesh, 0)), ExactSurface(intrinsic_triangulation(mesh, MARGIN))]
    except MeshError:
        return f"{name}, refused", {}, 0.0
    sources = np.random.default_rng(seed).choice(np.unique(mesh.F), 3)
    chosen = [source_set(int(source), mesh.n_vertices, None) for source in sources]
    found, again = (np.array([surface.distance(each) for each in chosen]) for surface in surfaces)
    if not np.isfinite([found, again]).all():
        return name, {"edges": np.inf}, 0.0
    a, b = mesh.edges.T
    length = np.linalg.norm(mesh.V[a] - mesh.V[b], axis=1)
    steeper = max(float((np.abs(d[:, a] - d[:, b]) - length).max()) for d in (found, again))
    off = {"edges": steeper, "triangulations": float(np.abs(found - again).max())}
    if mesh.n_vertices <= _MOST_COMPARED:
        off["straight lines"] = float(np.abs(straight_lines(mesh, sources) - found).max())
    return name, {key: max(each / float(found.max()), 0.0) for key, each in off.items()}, rounding(mesh)


# Cuts.


def any_mesh(rng: Random) -> Mesh:
    """A square with an uneven surface, or a sphere, a torus or a blob with its vertices moved."""
    if rng.random() < 0.5:
        mesh = shapes.grid(int(rng.integers(2, 7)))
        V = mesh.V + rng.normal(size=mesh.V.shape) * rng.uniform(0, 0.1) / np.sqrt(mesh.n_faces) * [0, 0, 1]
        return Mesh(V, mesh.F)
    return rough((shapes.icosphere(1), shapes.icosphere(2), shapes.torus(10, 6), shapes.blob(2))[rng.integers(4)])(rng)


def segments(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """Unconnected segments, several in a face: in corners, along and across sides, inside, over each other."""
    mesh, count = any_mesh(rng), int(rng.integers(1, 40))
    kinds = np.array([[0, 0, 1], [0.5, 0.5, 0], [0.25, 0, 0.75], [0.25, 0.25, 0.5], [0.6, 0.2, 0.2], [1 / 3] * 3])
    ends = rng.permuted(kinds[rng.integers(len(kinds), size=(2, count))], axis=2)
    return mesh, [SurfaceCurve(rng.integers(0, min(10, mesh.n_faces), count), *ends)]


def nearly(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """Segments whose ends lie close to vertices, edges and each other."""
    mesh, count = any_mesh(rng), int(rng.integers(1, 15))
    ends = rng.dirichlet([1, 1, 1], size=(2, count))
    ends[rng.random(ends.shape) < 0.3] *= 10.0 ** rng.uniform(-16, -6)
    ends /= ends.sum(axis=2, keepdims=True)
    ends[1, : count // 3] = ends[0, : count // 3][:, ::-1]
    return mesh, [SurfaceCurve(rng.integers(0, min(6, mesh.n_faces), count), *ends)]


def loops(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """Closed polylines over a flat square that cross themselves and each other, some twice."""
    mesh = shapes.grid(int(rng.integers(2, 9)))
    drawn = []
    for _ in range(rng.integers(1, 4)):
        corners = np.pad(rng.uniform(0, 1, (int(rng.integers(3, 9)), 2)), ((0, 0), (0, 1)))
        corners[rng.random(corners.shape) < 0.1] = 0.0  # on the boundary
        drawn.append(curve_on(mesh, corners, closed=True))
    return mesh, drawn * int(rng.integers(1, 3))


def across(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """Straight lines over a flat square from boundary to boundary, some along rows and diagonals of its vertices."""
    n = int(rng.integers(2, 9))
    mesh, ends = shapes.grid(n), rng.uniform(0, 1, (2, int(rng.integers(1, 4))))
    ends = np.rint(n * ends) / n if rng.random() < 0.5 else ends
    return mesh, [curve_on(mesh, [[0, a, 0], [1, b, 0]]) for a, b in ends.T]


def levels(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """Levels of a random function, through vertices in half of the cases."""
    mesh = any_mesh(rng)
    values = np.sin(mesh.V @ rng.normal(size=(3, 3)) * 3 + rng.uniform(0, 6, 3)).sum(axis=1)
    values = np.rint(4 * values) if rng.random() < 0.3 else values  # faces and edges of one value
    chosen = rng.choice(values, 2) if rng.random() < 0.5 else np.quantile(values, rng.uniform(0.1, 0.9, 2))
    return mesh, [curve for level in chosen for curve in isolines(mesh, values, [float(level)])[0]]


def along_edges(rng: Random) -> tuple[Mesh, list[SurfaceCurve]]:
    """A random walk along edges."""
    mesh = any_mesh(rng)
    tail, head = mesh.edges.T
    path = [int(rng.integers(mesh.n_vertices))]
    for _ in range(int(rng.integers(1, 20))):
        path.append(int(rng.choice(np.concatenate([head[tail == path[-1]], tail[head == path[-1]]]))))
    return mesh, [heat_igl.edge_curve(mesh, path)]


CURVES = (segments, nearly, loops, across, levels, along_edges)


def cuts(seed: int) -> Member:
    make = CURVES[seed % len(CURVES)]
    mesh, curves = make(np.random.default_rng(seed))
    name = make.__name__.replace("_", " ")
    if not curves:
        return f"{name}, no curve", {}, 0.0
    found = heat_igl.cut(mesh, curves)
    new, both = found.mesh, (mesh, found.mesh)
    tangent_frames(new)  # raises unless each vertex has one fan, and neighbours are oriented alike
    characteristic, n_loops = (
        {measure(each) for each in both}
        for measure in (
            lambda m: len(m.facets.vertices) - m.n_faces - m.n_vertices,
            lambda m: boundary_loops(m.facets, m.n_vertices),
        )
    )
    is_edge = np.isin(np.sort(found.edges, axis=1) @ [new.n_vertices, 1], np.sort(new.edges) @ [new.n_vertices, 1])
    same = len(characteristic) == len(n_loops) == 1 and new.facets.n_faces.max() <= 2 and is_edge.all()
    area = np.bincount(found.old_faces, new.measures, mesh.n_faces)
    # A corner within 1e-9 of an edge is put there.
    moved = 1e-8 * mesh.edge_lengths.max() * sum(map(len, curves))
    length = np.linalg.norm(np.diff(new.V[found.edges], axis=1)[:, 0], axis=1).sum()
    drawn = 0.0
    for curve in curves:
        start, end = (np.einsum("sc,scx->sx", at, mesh.V[mesh.F[curve.faces]]) for at in (curve.start, curve.end))
        drawn += np.linalg.norm(end - start, axis=1).sum()
    figures = {
        "area": float((np.abs(area - mesh.measures) / mesh.measures).max()),
        "length": max(0.0, float(abs(length - drawn) - moved)),
        "topology": float(not same),
        "distance": 0.0,
    }
    if not mollify(igl.edge_lengths(new.V, new.F), new.F, MARGIN).any():
        start = [0, mesh.n_vertices // 2]
        before, after = (exact_distance(each.V, each.F, start)[: mesh.n_vertices] for each in both)
        figures["distance"] = float(np.abs(after - before).max() / before.max())
    return name, figures, rounding(new)


# Log maps.

BODIES: dict[str, Callable[[Random], Mesh]] = {
    "hull": lambda rng: hull(on_sphere(int(rng.integers(50, 500)), rng)),
    "spiky sphere": lambda rng: spikes(shapes.icosphere(2), rng, 0.4),
    "torus": rough(shapes.torus(12, 24)),
    "cylinder": rough(shapes.cylinder(12, 12)),
    "square": rough(shapes.grid(10)),
}


def near(corners: FloatArray, rng: Random) -> FloatArray:
    """A place in a face, `corners` but for shares of 1e-12 to 1e-3 at those where it is 0."""
    place = np.where(corners > 0, 0, 10 ** rng.uniform(-12, -3, 3))
    return place + (1 - place.sum()) * corners


PLACES: dict[str, Callable[[Random], FloatArray]] = {
    "vertex": lambda rng: np.eye(3)[rng.integers(3)],
    "edge": lambda rng: np.append(rng.dirichlet([1, 1]), 0),
    "edge, near a vertex": lambda rng: np.array([1 - (share := 10 ** rng.uniform(-12, -3)), share, 0]),
    "face, near a vertex": lambda rng: near(np.eye(3)[0], rng),
    "face, near an edge": lambda rng: near(np.append(rng.dirichlet([1, 1]), 0), rng),
    "face": lambda rng: rng.dirichlet([1, 1, 1]),
}


def log_maps(seed: int) -> Member:
    rng = np.random.default_rng(seed)
    body, place = rng.choice(list(BODIES)), rng.choice(list(PLACES))
    made = BODIES[body](rng)
    mesh = Mesh(made.V * 10 ** rng.uniform(0, 2, 3), made.F)
    start = heat_igl.SurfacePoints([int(rng.integers(mesh.n_faces))], [rng.permutation(PLACES[place](rng))])
    log = log_map(mesh, start, method="exact")
    surface = operators(mesh).surface
    if surface is None:
        raise RuntimeError("triangles have a surface")
    windows = ExactSurface(surface.unfolding)
    if place == "vertex":
        source = mesh.F[start.faces[0], start.barycentric[0].argmax()]
        is_straight = windows.solve(source_set(int(source), mesh.n_vertices, None)).origin.root == source
    else:
        is_straight = windows.solve(source_set(start, mesh.n_vertices, mesh.F)).origin.root == mesh.n_vertices
    gap = np.linalg.norm(exp_map(mesh, start, log).positions(mesh) - mesh.V, axis=1)
    return f"{body}, {place}", {"gap": float(gap[is_straight].max() / np.hypot(*log.T).max())}, 0.0


# Signed distance.


def around(rng: Random) -> FloatArray:
    """Points around 0, each at a distance of its own order."""
    return rng.normal(size=(2000, 2)) * 10 ** rng.uniform(-3, -0.5, (2000, 1))


SPREADS: dict[str, Callable[[Random], FloatArray]] = {
    "powers": lambda rng: rng.random((2000, 2)) ** rng.uniform(1, 4),  # dense towards two sides of a square
    "clusters": lambda rng: rng.random((6, 2))[rng.integers(6, size=2000)] + around(rng),
    "around a point": around,
}


def signed(seed: int) -> Member:
    rng = np.random.default_rng(seed)
    spread, exchanged = rng.choice(list(SPREADS)), rng.choice([0.0, 0.1, 0.3])
    mesh = planar(SPREADS[spread](rng))
    centres = mesh.V[mesh.F].mean(axis=1)
    radius = np.linalg.norm(centres - centres[rng.integers(len(centres))], axis=1)
    region = (radius < np.quantile(radius, rng.uniform(0.05, 0.6))) ^ (rng.random(len(radius)) < exchanged)
    distance = heat_igl.SignedHeatSolver(mesh).distance(region)
    n_faces, n_inside = (np.bincount(f.ravel(), minlength=mesh.n_vertices) for f in (mesh.F, mesh.F[region]))
    is_wrong = (distance >= 0) & (n_inside == n_faces) | (distance <= 0) & (n_inside == 0)
    truth = geodesic_distance(mesh, region_boundary(mesh, faces=region), method="exact")
    off = 1.0 if is_wrong[n_faces > 0].any() else float(np.abs(np.abs(distance) - truth).max() / truth.max())
    return f"{spread}, {100 * exchanged:.0f} % exchanged", {"difference": off}, 0.0


TABLES: dict[str, Callable[[int], Member]] = {"exact": exact, "cuts": cuts, "log-maps": log_maps, "signed": signed}


def main(argv: Sequence[str] | None = None) -> bool:
    options = parsed(__doc__, argv, tables=TABLES, members=1000, first=0)
    rows: dict[str, Row] = {}
    heads: dict[str, str] = {}
    for seed in range(options.first, options.first + options.members):
        kind, figures, explained = TABLES[options.table](seed)
        most = max(LARGEST[options.table], explained)
        row = rows.setdefault(kind, {"kind": kind, "members": 0, "failed": []})
        row["members"] += 1
        row |= {key: max(figure, row.get(key, 0.0)) for key, figure in figures.items()}
        row["failed"] += [seed] * (not all(figure <= most for figure in figures.values()))
        heads |= {key: f"{{{key}:.1e}}" for key in figures}
    columns = {"kind": "kind", "members": "members"} | heads | {"seeds of failures": "failed"}
    publish(options, {options.table: Table([rows[kind] for kind in sorted(rows)], columns)})
    return any(row["failed"] for row in rows.values())


if __name__ == "__main__":
    sys.exit(main())
