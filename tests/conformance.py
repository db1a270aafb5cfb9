"""The domains and methods of the table of conformance (`test_conformance.py`), and what is done to a domain there.

A domain is arrays, so that all are renumbered, moved and doubled alike; a solver is made of them at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from conftest import flat_perturbed, perturbed
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation
from surfaces import arcs, dual_of_sphere, moebius_strip

from heat_igl import Mesh, PointCloud, PolygonMesh, image_domain, metric_operators, shapes, speed_operators
from heat_igl.geodesic import SolverChoice
from heat_igl.geodesic.choice import Solver

METHODS = ("windows", "exact", "sweep", "heat")
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
            return PointCloud(self.V, self.field)
        if self.kind == "polygons":
            return PolygonMesh(self.V, self.cells)
        mesh = Mesh(self.V, self.cells)
        if self.field is None:
            return mesh
        return (speed_operators if self.field.ndim == 1 else metric_operators)(mesh, self.field)

    def solver(self, method: str) -> Solver:
        return SolverChoice(method).on(self.made())

    def renumbered(self, rng: np.random.Generator) -> tuple[Domain, np.ndarray]:
        """The same with vertices and cells in another order, and the new number of each vertex.

        The first corner of a polygon stays: the polygon is cut into triangles around it.
        """
        order = rng.permutation(self.n)
        label = np.argsort(order)
        if self.kind == "points":
            return replace(self, V=self.V[order], field=None if self.field is None else self.field[order]), label
        rows = rng.permutation(len(self.cells))
        turns = np.zeros(len(rows), int) if self.kind == "polygons" else rng.integers(3, size=len(rows))
        cells = [np.roll(label[self.cells[i]], turn) for i, turn in zip(rows, turns, strict=True)]
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
        """Two copies side by side, in two components."""
        V = np.concatenate([self.V, self.V + np.array([0, 0, 3 * np.ptp(self.V)])])
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


def lines(V: np.ndarray) -> Callable[[int], np.ndarray]:
    return lambda source: np.linalg.norm(V - V[source], axis=1)


def _of_mesh(mesh: Mesh, **others: Any) -> Domain:
    return Domain("simplices", np.array(mesh.V), np.array(mesh.F), **others)


def _convex(mesh: Mesh) -> Domain:
    """A convex part of the plane, or a convex body."""
    return _of_mesh(mesh, truth=lines(mesh.V))


def _pages() -> Domain:
    """Three flat pages at a spine; any two of them lie in one plane if they are unfolded."""
    mesh = shapes.book(3, 18)
    on_page = np.hypot(mesh.V[:, 0], mesh.V[:, 1])
    angle = np.round(np.arctan2(mesh.V[:, 1], mesh.V[:, 0]), 6)

    def truth(source: int) -> np.ndarray:
        is_same = (np.abs(angle - angle[source]) < 1e-5) | (on_page < 1e-9) | (on_page[source] < 1e-9)
        across = np.where(is_same, on_page - on_page[source], on_page + on_page[source])
        return np.hypot(across, mesh.V[:, 2] - mesh.V[source, 2])

    return _of_mesh(mesh, truth=truth)


def _tensor(dimensions: int) -> np.ndarray:
    """One constant metric, by half longer in one direction."""
    axes = Rotation.from_rotvec([0.0, 0.0, 0.5] if dimensions == 2 else [0.3, 0.8, 0.2]).as_matrix()
    return axes @ np.diag([2.25, 1.0, 1.0]) @ axes.T


def _with_tensor(mesh: Mesh, dimensions: int) -> Domain:
    metric = _tensor(dimensions)
    return _of_mesh(mesh, field=np.tile(metric, (len(mesh.F), 1, 1)), truth=lines(mesh.V @ np.linalg.cholesky(metric)))


def _scattered(n: int) -> np.ndarray:
    P = np.random.default_rng(8).standard_normal((n, 3))
    return P / np.linalg.norm(P, axis=1, keepdims=True)


def _ball_of_tetrahedra() -> Mesh:
    """Delaunay tetrahedra of random points: a convex body."""
    V = np.random.default_rng(3).random((500, 3))
    F = Delaunay(V).simplices
    return Mesh(V, F[np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]])) > 1e-9])


def _speeds() -> Domain:
    """Two halves of a square at speeds 1 and 2: triangles that see their common sides at different lengths."""
    mesh = flat_perturbed(shapes.grid(24))
    V = np.array(mesh.V)
    V[shapes.grid(24).V[:, 0] == 0.5, 0] = 0.5
    is_fast = V[:, 0] > 0.5
    border = np.column_stack([np.full(2001, 0.5), np.linspace(0, 1, 2001), np.zeros(2001)])
    to_border = np.linalg.norm(V[:, None] - border, axis=2) / np.where(is_fast, 2.0, 1.0)[:, None]

    def truth(source: int) -> np.ndarray:
        """Along straight lines that are refracted at the border, or go along it on the fast side."""
        arrival = to_border[source]
        forth = np.minimum.accumulate(arrival - border[:, 1] / 2) + border[:, 1] / 2
        back = (np.minimum.accumulate((arrival + border[:, 1] / 2)[::-1]) - border[::-1, 1] / 2)[::-1]
        over = (np.minimum(forth, back) + to_border).min(axis=1)
        straight = lines(V)(source) / (2.0 if is_fast[source] else 1.0)
        return np.where(is_fast == is_fast[source], np.minimum(over, straight), over)

    return _of_mesh(Mesh(V, mesh.F), field=np.where(V[mesh.F].mean(axis=1)[:, 0] > 0.5, 2.0, 1.0), truth=truth)


_MAKE: dict[str, Callable[[], Domain]] = {
    "closed": lambda: _of_mesh(Mesh(perturbed(shapes.icosphere(4), 0.25).V * [1.0, 0.7, 0.5], shapes.icosphere(4).F)),
    "handle": lambda: _of_mesh(perturbed(shapes.torus(36, 60), 0.25)),
    "boundary": lambda: _convex(flat_perturbed(shapes.disk(19))),
    "one side": lambda: _of_mesh(moebius_strip(150, 8)),
    "non-manifold": _pages,
    "polygons": lambda: Domain("polygons", (mesh := dual_of_sphere(3)).V, mesh.polygons, truth=partial(arcs, mesh.V)),
    "points": lambda: Domain("points", P := _scattered(1500), None, truth=partial(arcs, P)),
    "points with normals": lambda: Domain("points", P := _scattered(1500), None, P, partial(arcs, P)),
    "pixels": lambda: _convex(image_domain(np.ones((30, 40), bool), (0.5, 0.7)).mesh),
    "voxels": lambda: _convex(image_domain(np.ones((5, 6, 7), bool), (1.0, 0.8, 0.7)).mesh),
    "tetrahedra": lambda: _convex(_ball_of_tetrahedra()),
    "metric on triangles": lambda: _with_tensor(flat_perturbed(shapes.disk(19)), 2),
    "speeds on triangles": _speeds,
    "metric on tetrahedra": lambda: _with_tensor(perturbed(shapes.box(5)), 3),
}
DOMAINS = tuple(_MAKE)


@cache
def domain(name: str) -> Domain:
    return _MAKE[name]()


@cache
def solver(name: str, method: str) -> Solver:
    return domain(name).solver(method)


@cache
def distance(name: str, method: str, source: int) -> np.ndarray:
    found = solver(name, method).distance(source)
    found.flags.writeable = False
    return found
