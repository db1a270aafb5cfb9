"""The domains and methods of the table of conformance (`test_conformance.py`), and what is done to a domain there.

A domain is arrays, so that all are renumbered, moved and doubled alike; a solver is made of them at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from conftest import flat_perturbed, perturbed, two_halves
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation
from surfaces import arcs, dual_of_sphere, moebius_strip, on_pages, points_of_sphere

import heat_igl
from heat_igl import Mesh, PolygonMesh, fibre_metric, image_domain, metric_operators, shapes, speed_operators
from heat_igl.geodesic import SolverChoice
from heat_igl.geodesic.choice import Solver
from heat_igl.typing import ArrayLike, BoolArray, FloatArray
from heat_igl.validation.closed_forms import by_fermat, straight
from heat_igl.validation.construction import tetrahedra

METHODS = ("exact", "sweep", "heat")
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


@dataclass
class Domain:
    """Arrays of a domain.

    `kind` is what is made of them. `cells` are faces, tetrahedra or polygons, and none on points; `field` are tensors
    (m, 3, 3) or speeds (m,) on the cells, or normals (n, 3) of points. `truth` gives distance (n,) from a vertex, where
    a closed form is known.
    """

    kind: str
    V: np.ndarray
    cells: np.ndarray | list[np.ndarray] | None
    field: np.ndarray | None = None
    truth: Callable[[int], np.ndarray] | None = None

    @property
    def n(self) -> int:
        return len(self.V)

    def made(self) -> Any:
        """What a solver is given."""
        if self.kind == "points":
            return heat_igl.PointCloud(self.V, self.field)
        if self.kind == "polygons":
            return PolygonMesh(self.V, self.cells)
        mesh = Mesh(self.V, self.cells)
        if self.field is None:
            return mesh
        return (speed_operators if self.field.ndim == 1 else metric_operators)(mesh, self.field)

    def solver(self, method: str) -> Solver:
        return SolverChoice(method).on(self.made())

    def renumbered(self, rng: np.random.Generator) -> tuple[Domain, np.ndarray]:
        """The same in another order, some cells turned over, and the new number of each vertex.

        The first corner of a polygon stays: the polygon is cut into triangles around it.
        """
        order = rng.permutation(self.n)
        label = np.argsort(order)
        if self.kind == "points":
            return replace(self, V=self.V[order], field=None if self.field is None else self.field[order]), label
        rows = rng.permutation(len(self.cells))
        turns = np.zeros(len(rows), int) if self.kind == "polygons" else rng.integers(3, size=len(rows))
        cells = [np.roll(label[self.cells[i]], turn) for i, turn in zip(rows, turns, strict=True)]
        if self.kind == "simplices":
            cells = [cell[::way] for cell, way in zip(cells, rng.choice([1, -1], len(rows)), strict=True)]
        field = None if self.field is None else self.field[rows]
        return replace(self, V=self.V[order], cells=cells, field=field), label

    def moved(self, turn: np.ndarray, shift: np.ndarray | float = 0.0, scale: float = 1.0) -> Domain:
        field = self.field
        if field is not None and field.ndim == 3:
            field = turn @ field @ turn.T
        elif self.kind == "points" and field is not None:
            field = field @ turn.T
        return replace(self, V=scale * (self.V @ turn.T) + shift, field=field)

    def doubled(self) -> Domain:
        """Two copies side by side, in two components, and where there are cells, a vertex of none."""
        apart = np.array([0, 0, 3 * np.ptp(self.V)])
        V = np.concatenate([self.V, self.V + apart, self.V[: 0 if self.cells is None else 1] - apart])
        field = None if self.field is None else np.concatenate([self.field, self.field])
        cells = None if self.cells is None else [*self.cells, *(np.asarray(cell) + self.n for cell in self.cells)]
        return replace(self, V=V, cells=cells, field=field)

    def subdivided(self) -> Domain | None:
        """A vertex in the middle of each simplex: the same flat simplices, the first `n` vertices the same."""
        if self.kind != "simplices":
            return None
        cells = np.asarray(self.cells)
        d = cells.shape[1]
        middle = self.n + np.arange(len(cells))
        parts = np.concatenate([np.where(np.arange(d) == corner, middle[:, None], cells) for corner in range(d)])
        field = None if self.field is None else np.concatenate(d * [self.field])
        return replace(self, V=np.concatenate([self.V, self.V[cells].mean(axis=1)]), cells=parts, field=field)

    @cached_property
    def edge_graph(self) -> csr_array:
        """The sides of the cells (n, n), each at the shortest of its lengths within cells."""
        if self.kind == "polygons":
            sides = [np.stack([cell, np.roll(cell, -1)], axis=1) for cell in self.cells]
        else:
            cells = np.asarray(self.cells)
            sides = cells[:, np.stack(np.triu_indices(cells.shape[1], 1), axis=1)]
        of_cell = np.repeat(np.arange(len(sides)), [len(each) for each in sides])
        pairs = np.sort(np.concatenate(sides), axis=1)
        along = self.V[pairs[:, 1]] - self.V[pairs[:, 0]]
        length = np.linalg.norm(along, axis=1)
        if self.field is not None and self.field.ndim == 3:
            length = np.sqrt(np.einsum("ex,exy,ey->e", along, self.field[of_cell], along))
        elif self.field is not None:
            length = length / self.field[of_cell]
        order = np.lexsort((length, *pairs.T))
        pairs, length = pairs[order], length[order]
        is_first = np.append(True, (np.diff(pairs, axis=0) != 0).any(axis=1))
        return csr_array((length[is_first], tuple(pairs[is_first].T)), shape=(self.n, self.n))

    def along_edges(self, source: int) -> np.ndarray:
        """Distance (n,) along sides of cells: no distance is longer."""
        return dijkstra(self.edge_graph, directed=False, indices=source)

    def straight(self, source: int) -> np.ndarray:
        """Length (n,) of straight lines where they are shortest: no distance is shorter."""
        lines = np.linalg.norm(self.V - self.V[source], axis=1)
        if self.kind == "points" or self.field is None:
            return lines
        return lines * (np.sqrt(np.linalg.eigvalsh(self.field).min()) if self.field.ndim == 3 else 1 / self.field.max())


def _of_mesh(mesh: Mesh, **others: Any) -> Domain:
    return Domain("simplices", np.array(mesh.V), np.array(mesh.F), **others)


def _convex(mesh: Mesh) -> Domain:
    """A convex part of the plane, or a convex body."""
    return _of_mesh(mesh, truth=partial(straight, mesh.V))


def _tensor(dimensions: int) -> np.ndarray:
    """One constant metric, by half longer in one direction."""
    axes = Rotation.from_rotvec([0.0, 0.0, 0.5] if dimensions == 2 else [0.3, 0.8, 0.2]).as_matrix()
    return axes @ np.diag([2.25, 1.0, 1.0]) @ axes.T


def _with_metric(mesh: Mesh, metric: np.ndarray) -> Domain:
    """The same tensor (3, 3) everywhere."""
    return _of_mesh(
        mesh,
        field=np.tile(metric, (len(mesh.F), 1, 1)),
        truth=partial(straight, mesh.V @ np.linalg.cholesky(metric)),
    )


def _speeds() -> Domain:
    """Two halves of a square at speeds 1 and 2: triangles that see their common sides at different lengths."""
    mesh = two_halves(24)
    speed = np.where(mesh.V[mesh.F].mean(axis=1)[:, 0] > 0.5, 2.0, 1.0)
    return _of_mesh(mesh, field=speed, truth=partial(by_fermat, mesh.V, left=1.0, right=2.0))


_MAKE: dict[str, Callable[[], Domain]] = {
    "closed": lambda: _of_mesh(Mesh(perturbed(shapes.icosphere(4), 0.25).V * [1.0, 0.7, 0.5], shapes.icosphere(4).F)),
    "handle": lambda: _of_mesh(perturbed(shapes.torus(36, 60), 0.25)),
    "boundary": lambda: _convex(flat_perturbed(shapes.disk(19))),
    "one side": lambda: _of_mesh(moebius_strip(150, 8)),
    "non-manifold": lambda: _of_mesh(mesh := shapes.book(3, 18), truth=partial(on_pages, mesh.V)),
    "polygons": lambda: Domain("polygons", (mesh := dual_of_sphere(3)).V, mesh.polygons, truth=partial(arcs, mesh.V)),
    "points": lambda: Domain("points", P := points_of_sphere(1500, 8), None, truth=partial(arcs, P)),
    "points with normals": lambda: Domain("points", P := points_of_sphere(1500, 8), None, P, partial(arcs, P)),
    "pixels": lambda: _convex(image_domain(np.ones((30, 40), bool), (0.5, 0.7)).mesh),
    "voxels": lambda: _convex(image_domain(np.ones((5, 6, 7), bool), (1.0, 0.8, 0.7)).mesh),
    "tetrahedra": lambda: _convex(tetrahedra(np.random.default_rng(3).random((500, 3)))),
    "metric on triangles": lambda: _with_metric(flat_perturbed(shapes.disk(19)), _tensor(2)),
    "speeds on triangles": _speeds,
    "metric on tetrahedra": lambda: _with_metric(perturbed(shapes.box(5)), _tensor(3)),
}
DOMAINS = tuple(_MAKE)


# Harder ones, of which errors alone are bounded.


def _points_on_a_cylinder() -> Domain:
    rng = np.random.default_rng(5)
    angle, height = rng.uniform(0, 2 * np.pi, 4000), rng.uniform(0, 3, 4000)

    def helices(source: int) -> np.ndarray:
        turn = np.abs(np.remainder(angle - angle[source] + np.pi, 2 * np.pi) - np.pi)
        return np.hypot(turn, height - height[source])

    return Domain("points", np.stack([np.cos(angle), np.sin(angle), height], axis=1), None, truth=helices)


def _points_in_a_square() -> Domain:
    P = np.pad(np.random.default_rng(6).random((4000, 2)), ((0, 0), (0, 1)))
    return Domain("points", P, None, truth=partial(straight, P))


def _helical_fibres() -> Domain:
    """Fibres 1 : 3 along helices on a prism, which is unrolled: ways around it end at copies of the vertex."""
    around, rise = 48, 0.5
    tube = shapes.cylinder(around, 24, np.pi)
    corners = tube.V[tube.F]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward *= np.sign((outward * corners.mean(axis=1)).sum(axis=1, keepdims=True))
    fibres = np.stack([-outward[:, 1], outward[:, 0], rise * np.linalg.norm(outward, axis=1)], axis=1)
    side = 2 * np.sin(np.pi / around)
    flat = np.stack([np.arange(tube.n_vertices) % around * side, tube.V[:, 2]], axis=1)
    along = np.array([1.0, rise]) / np.hypot(1.0, rise)

    def truth(source: int) -> np.ndarray:
        copies = flat - flat[source] + np.arange(-2, 3)[:, None, None] * [around * side, 0.0]
        return np.hypot(copies @ along, 3 * (copies @ [-along[1], along[0]])).min(axis=0)

    return _of_mesh(tube, field=fibre_metric(fibres, 1.0, 3.0), truth=truth)


def _exponential_speed() -> Domain:
    """From 1 to a million along a strip: the map exp(-k z) / k makes paths straight."""
    mesh, rate = flat_perturbed(shapes.strip(200, 12), 0.25), np.log(1e6) / 200
    unrolled = np.exp(-rate * (mesh.V[:, 0] + 1j * (mesh.V[:, 1] - 6))) / rate
    speed = np.exp(rate * mesh.V[mesh.F][:, :, 0].mean(axis=1))
    return _of_mesh(mesh, field=speed, truth=lambda source: np.abs(unrolled - unrolled[source]))


def _concave_polygons() -> Domain:
    """Squares whose inner sides are bent: two opposite sides inwards, the others outwards."""
    n = 14
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    corner, bend = np.arange(len(x)), np.where((x + y) % 2, 0.18, -0.18)
    # Vertices in the middle of the inner sides that start at a corner, towards +x and towards +y.
    lying, standing = corner[(x < n) & (y % n > 0)], corner[(y < n) & (x % n > 0)]
    V = np.concatenate(
        [
            np.stack([x, y], axis=1),
            np.stack([x + 0.5, y + bend], axis=1)[lying],
            np.stack([x - bend, y + 0.5], axis=1)[standing],
        ]
    )
    below, beside = np.full((2, len(corner)), -1)
    below[lying] = len(corner) + np.arange(len(lying))
    beside[standing] = len(corner) + len(lying) + np.arange(len(standing))
    at = corner[(x < n) & (y < n)]
    right, up = at + 1, at + n + 1
    rows = np.stack([at, below[at], right, beside[right], up + 1, below[up], up, beside[at]], axis=1)
    V = np.pad(V / n, ((0, 0), (0, 1)))
    return Domain("polygons", V, [row[row >= 0] for row in rows], truth=partial(straight, V))


def crosses_box(p: FloatArray, q: FloatArray, low: ArrayLike, high: ArrayLike) -> BoolArray:
    """Whether the segments from p to q pass through the inside of a box."""
    corners, way = np.add([low, high], [[1e-9], [-1e-9]]), q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        at = [(corner - p) / way for corner in corners]
    is_between = (corners[0] < p) & (p < corners[1])
    enters = np.where(way == 0, np.where(is_between, -np.inf, np.inf), np.minimum(*at)).max(axis=-1)
    leaves = np.where(way == 0, np.inf, np.maximum(*at)).min(axis=-1)
    return np.maximum(enters, 0) < np.minimum(leaves, 1)


def around_the_wall(V: FloatArray, source: int, wall: float, end: float) -> FloatArray:
    """Distance around a wall at wall < x < wall + 1, y < end, parallel to z."""
    P, low, high = V[:, :2], [wall, -np.inf], [wall + 1, end]
    straight = lambda p, q: np.where(crosses_box(p, q, low, high), np.inf, np.linalg.norm(q - p, axis=-1))  # noqa: E731
    edges = np.array([[wall, end], high])
    to_edges = straight(P[source], edges)
    to_edges = np.minimum(to_edges, to_edges[::-1] + 1)
    flat = np.minimum(straight(P[source], P), (to_edges + straight(P[:, None], edges)).min(axis=1))
    return np.hypot(flat, V[:, 2] - V[source, 2])


def _wall(shape: tuple[int, ...], spacing: tuple[float, ...], rows: int) -> Domain:
    """Pixels or voxels without `rows` of the middle column, from rows above the end of this wall."""
    mask, column = np.ones(shape, bool), shape[-1] // 2
    mask[..., :rows, column] = False
    mesh = image_domain(mask, spacing).mesh
    return _of_mesh(mesh, truth=partial(around_the_wall, mesh.V, wall=column - 0.5, end=(rows - 0.5) * spacing[-2]))


_STRETCH = np.array([[80.0, 60.0, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])  # singular values 100, 1 and 1
_CLOUD = {"heat": 0.012, "auto": 0.003, "windows": 1e-3}
_FINE = {"sweep": 1e-3, "windows": 1e-3, "exact": 1e-9}
_COARSE = {"sweep": 0.01, "windows": 1e-3, "exact": 1e-9}
#: Name -> domain, the source, and the largest mean relative error by method.
HARD: dict[str, tuple[Callable[[], Domain], int, dict[str, float]]] = {
    "points on a cylinder": (_points_on_a_cylinder, 0, _CLOUD),
    "points in a square": (_points_in_a_square, 0, _CLOUD),
    "tensor of 1 : 100": (
        lambda: _with_metric(flat_perturbed(shapes.grid(32)), _STRETCH.T @ _STRETCH), 500, {"heat": 0.015, **_FINE},
    ),
    "helical fibres on a cylinder": (_helical_fibres, 600, {"heat": 0.02, **_FINE}),
    "speed that grows exponentially": (_exponential_speed, 1300, {"auto": 0.003}),
    "concave polygons": (_concave_polygons, 100, {"heat": 0.03, **_COARSE}),
    "wall of pixels": (partial(_wall, (20, 31), (2.0, 1.0), 15), 99, {"heat": 0.04, **_COARSE}),
    "wall of voxels": (partial(_wall, (6, 12, 15), (1.5, 2.0, 1.0), 9), 400, {"auto": 0.01}),
}  # fmt: skip


@cache
def domain(name: str) -> Domain:
    return _MAKE[name]()


@cache
def solver(name: str, method: str) -> Solver:
    return domain(name).solver(method)


@cache
def subdivided(name: str, method: str) -> Solver:
    return domain(name).subdivided().solver(method)


@cache
def distance(name: str, method: str, source: int) -> np.ndarray:
    found = solver(name, method).distance(source)
    found.flags.writeable = False
    return found
