"""Exact distance on many random coarse meshes against pygeodesic, with an explanation of every difference.

    python scripts/random_exact.py --count 10000                 # meshes of 10 to 300 faces, one source on each
    python scripts/random_exact.py --count 100 --first 5000      # the meshes of the seeds 5000 to 5099

A mesh is determined by its seed. Distances are computed by windows twice, on the intrinsic Delaunay triangulation and
on the triangles as given. pygeodesic (extra ``validate``) runs in a child process, which may crash. A relative
difference above 1e-10 has one of these causes:

- rounding: with smallest angle a in radians, a rounded length changes the shape of a triangle by up to 2^-52 / a^2 of
  itself, and the difference is below that.
- no height: some triangles are so thin that all edges were made longer (Sharp and Crane 2020), and the difference is
  at most what was added to the edges that the path crosses.
- too long: pygeodesic is longer than the path that the windows give, traced and measured on the mesh.
- contradiction: pygeodesic is shorter than its own path, which is no shorter than the distance by windows.

What remains is unexplained, and listed with the seed. Most of the
time is that of the child processes, a fifth of a second each.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.spatial

from heat_igl import Mesh, SourceError, reference, shapes, shortest_paths
from heat_igl.errors import ReferenceSolverError
from heat_igl.intrinsic import intrinsic_triangulation, mollify
from heat_igl.reference import guarded
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.zoo.registry import compact, hull, joined
from heat_igl.windows import exact_distance
from heat_igl.windows.exact import ExactSurface
from heat_igl.windows.tables import MARGIN

from harness import Row, Table, on_sphere, parsed, publish

LARGEST = 1e-10
CAUSES = ("rounding", "no height", "too long", "contradiction", "unexplained")
_FEWEST_FACES, _MOST_FACES = 10, 300


# The meshes.


def star(rng: np.random.Generator) -> Mesh:
    """A closed surface that is seen whole from inside, with a random radius in every direction."""
    mesh = hull(on_sphere(int(rng.integers(8, 150)), rng))
    return Mesh(mesh.V * np.exp(rng.normal(size=(mesh.n_vertices, 1)) * rng.uniform(0, 0.6)), mesh.F)


def polyhedron(rng: np.random.Generator) -> Mesh:
    """The convex hull of random points."""
    return hull(rng.normal(size=(rng.integers(8, 150), 3)))


def height_field(rng: np.random.Generator) -> Mesh:
    """Random heights on a Delaunay triangulation of random points."""
    P = rng.random((rng.integers(10, 150), 2))
    heights = rng.normal(size=len(P)) * rng.uniform(0, 0.5)
    return Mesh(np.column_stack([P, heights]), scipy.spatial.Delaunay(P).simplices)


def lattice(rng: np.random.Generator) -> Mesh:
    """A grid with whole heights: many paths of the same length, many points on one circle."""
    mesh = shapes.grid(int(rng.integers(3, 12)))
    heights = rng.integers(0, rng.integers(1, 4), size=mesh.n_vertices)
    return Mesh(np.column_stack([np.rint(mesh.V[:, :2] / mesh.edge_lengths.min()), heights]), mesh.F)


def torus(rng: np.random.Generator) -> Mesh:
    """A torus, or a cylinder, with vertices moved at random."""
    around, along = (int(k) for k in rng.integers(3, 12, size=2))
    mesh = shapes.torus(around, along) if rng.random() < 0.5 else shapes.cylinder(around, along)
    return Mesh(mesh.V + rng.normal(size=mesh.V.shape) * rng.uniform(0, 0.5) * mesh.edge_lengths.mean(), mesh.F)


def moebius_strip(rng: np.random.Generator) -> Mesh:
    """A strip whose ends are joined after half a turn."""
    around, across = int(rng.integers(5, 25)), int(rng.integers(1, 5))
    turn, along = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(-0.4, 0.4, across + 1), indexing="ij")
    x, y, z = (1 + along * np.cos(turn / 2)) * np.cos(turn), (1 + along * np.cos(turn / 2)) * np.sin(turn), along
    V = np.stack([x, y, z * np.sin(turn / 2)], axis=-1).reshape(-1, 3)
    number = np.arange(around * (across + 1)).reshape(around, -1)
    rows = np.concatenate([number, number[:1, ::-1]])
    a, b, c, d = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
    F = np.concatenate([np.stack([a, c, b], axis=-1).reshape(-1, 3), np.stack([b, c, d], axis=-1).reshape(-1, 3)])
    return Mesh(V + rng.normal(size=V.shape) * rng.uniform(0, 0.1), F)


def with_holes(rng: np.random.Generator) -> Mesh:
    """A star or a height field from which vertices are cut out with their faces, so that no two holes touch."""
    mesh = (star if rng.random() < 0.5 else height_field)(rng)
    kept, is_at_hole = np.ones(mesh.n_faces, bool), np.zeros(mesh.n_vertices, bool)
    is_at_hole[mesh.boundary] = True
    for v in rng.permutation(mesh.n_vertices)[: rng.integers(1, 10)]:
        around = (v == mesh.F).any(axis=1)
        if not is_at_hole[mesh.F[around]].any():
            is_at_hole[mesh.F[around]] = True
            kept &= ~around
    return compact(mesh.V, mesh.F[kept])


def needles(rng: np.random.Generator) -> Mesh:
    """Another mesh, stretched 10 to 10 000 times along one axis."""
    mesh = _SIMPLE[rng.integers(len(_SIMPLE))](rng)
    stretch = np.ones(3)
    stretch[rng.integers(3)] = 10 ** rng.uniform(1, 4)
    return Mesh(mesh.V * stretch, mesh.F)


def components(rng: np.random.Generator) -> Mesh:
    """Two meshes, of which the second may be much smaller."""
    one, two = (_SIMPLE[rng.integers(len(_SIMPLE))](rng) for _ in range(2))
    return joined(one, Mesh(10 ** rng.uniform(-4, 0) * two.V, two.F))


_SIMPLE: list[Callable[[np.random.Generator], Mesh]] = [
    star,
    polyhedron,
    height_field,
    lattice,
    torus,
    moebius_strip,
    with_holes,
]
KINDS = [*_SIMPLE, needles, components]


def random_mesh(seed: int) -> tuple[str, Mesh, int]:
    """The kind of a mesh, the mesh, and a source vertex."""
    rng = np.random.default_rng(seed)
    make = KINDS[seed % len(KINDS)]
    mesh = make(rng)
    while not _FEWEST_FACES <= mesh.n_faces <= _MOST_FACES:
        mesh = make(rng)
    return make.__name__.replace("_", " "), mesh, int(rng.choice(np.unique(mesh.F)))


# The comparison.


@dataclass
class Compared:
    """One mesh.

    Attributes
    ----------
    kind : str
        Name of the generator.
    n_values : int
        Distances that were compared, of both computations; 0 if pygeodesic gave none.
    difference : float
        The largest relative difference of those that need no explanation.
    causes : Counter
        How many of the others have which of `CAUSES`.
    refused : str
        Why pygeodesic gave no distances.
    """

    kind: str
    n_values: int
    difference: float
    causes: Counter[str]
    refused: str = ""


def compared(seed: int) -> Compared:
    """Windows and pygeodesic on the mesh of a seed."""
    kind, mesh, source = random_mesh(seed)
    given = ExactSurface(intrinsic_triangulation(mesh, MARGIN)).solve(np.array([source])).distance
    found = [exact_distance(mesh.V, mesh.F, source), given]
    try:
        other = reference.exact(mesh, source, solver="pygeodesic")
    except ReferenceSolverError as error:
        return Compared(kind, 0, 0.0, Counter(), str(error))
    there = np.isfinite(other) & (other > 0)
    result = Compared(kind, 0, 0.0, Counter())
    for distance in found:
        if not np.array_equal(np.isfinite(distance), np.isfinite(other)):
            result.causes["unexplained"] += 1
        difference = np.zeros(mesh.n_vertices)
        difference[there] = np.abs(distance[there] - other[there]) / other[there]
        result.n_values += int(there.sum())
        result.difference = max(result.difference, float(difference[difference <= LARGEST].max()))
        different = np.flatnonzero(~(difference <= LARGEST))
        if len(different):
            causes = _Causes(mesh, source)
            result.causes.update(causes.of(int(v), float(distance[v]), float(other[v])) for v in different)
    return result


class _Causes:
    """Why distances differ on one mesh from those of pygeodesic."""

    def __init__(self, mesh: Mesh, source: int) -> None:
        self._mesh, self._source = mesh, source
        self._rounding = 2.0**-52 / float(np.radians(mesh.report().smallest_angle)) ** 2
        here = mesh.components[mesh.F[:, 0]] == mesh.components[source]
        self._added = float(mollify(_lengths(mesh), mesh.F, MARGIN)[here].max())

    def of(self, target: int, distance: float, other: float) -> str:
        """The first of the causes that holds; cheap ones come first."""
        if abs(distance - other) <= self._rounding * other:
            return "rounding"
        try:
            (path,) = shortest_paths(self._mesh, [target], [self._source])
        except SourceError:
            return "unexplained"
        if self._added > 0 and abs(distance - other) <= self._added * (1 + len(path.faces)):
            return "no height"
        if distance < other and float(path.lengths(self._mesh).sum()) <= distance * (1 + LARGEST):
            return "too long"
        own = _length_of_its_path(self._mesh, self._source, target)
        return "contradiction" if other < distance * (1 - LARGEST) <= own else "unexplained"


def _length_of_its_path(mesh: Mesh, source: int, target: int) -> float:
    """Length of the path that pygeodesic gives."""
    faces = mesh.F[mesh.components[mesh.F[:, 0]] == mesh.components[source]]
    used, numbers = np.unique(faces, return_inverse=True)
    ends = np.searchsorted(used, [source, target])
    arrays = {"V": mesh.V[used], "F": numbers.reshape(-1, 3), "ends": ends}
    try:
        reply = guarded.call("random_exact:pygeodesic_path", arrays)
    except ReferenceSolverError:
        return 0.0
    return float(np.linalg.norm(np.diff(reply.values["path"], axis=0), axis=1).sum())


def pygeodesic_path(V: FloatArray, F: IntArray, ends: IntArray) -> dict[str, FloatArray]:
    """The path of pygeodesic between two vertices, in the child process."""
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    return {"path": np.array(PyGeodesicAlgorithmExact(V, F).geodesicDistance(*(int(end) for end in ends))[1])}


def _lengths(mesh: Mesh) -> FloatArray:
    """Edge lengths (m, 3) opposite each corner."""
    a, b, c = (mesh.V[corner] for corner in mesh.F.T)
    return np.stack([np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1), np.linalg.norm(b - a, axis=1)], 1)


def rows(found: Sequence[Compared]) -> Iterator[Row]:
    """A row for each kind of meshes."""
    for kind in dict.fromkeys(one.kind for one in found):
        here = [one for one in found if one.kind == kind]
        counts = {"refused": sum(bool(one.refused) for one in here), "distances": sum(one.n_values for one in here)}
        causes = sum((one.causes for one in here), Counter())
        row = {"meshes": kind, "number": len(here)} | counts | {cause: causes[cause] for cause in CAUSES}
        yield row | {"largest relative difference": f"{max(one.difference for one in here):.1e}"}


def main(argv: Sequence[str] | None = None) -> int:
    options = parsed(__doc__, argv, count=1000, first=0)
    seeds = range(options.first, options.first + options.count)
    found = [compared(seed) for seed in seeds]
    unexplained = [seed for seed, one in zip(seeds, found, strict=True) if one.causes["unexplained"]]
    reasons = Counter(one.refused.split(":")[0][:90] for one in found if one.refused)
    said = [f"Refused by pygeodesic, {count} times: {reason}" for reason, count in reasons.most_common(10)]
    heads = ("meshes", "number", "refused", "distances", "largest relative difference", *CAUSES)
    text = "\n".join([*said, f"Unexplained: the seeds {unexplained}"])
    publish(options, {"random": Table(list(rows(found)), {head: head for head in heads}), "reasons": text})
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
