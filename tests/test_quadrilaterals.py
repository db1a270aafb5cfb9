"""Arrays (m, 4): quadrilaterals are refused where tetrahedra are expected, and no tetrahedra are."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import Mesh, MeshError, PolygonMesh, shapes


def quads(bend: float = 0.0, n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """A sheet of n by n quadrilaterals, flat or bent so that none of them is planar."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    V = np.stack([x.ravel(), y.ravel(), bend * np.sin(x * y).ravel()], axis=1)
    corner = np.arange(n)[:, None] * (n + 1) + np.arange(n)
    return V, np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], axis=-1).reshape(-1, 4)


CUBE = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], float)


@pytest.mark.parametrize("bend", [0, 0.1, 0.5, 2])
@pytest.mark.parametrize("n", [2, 6, 40])
def test_a_sheet_of_quadrilaterals_is_not_taken_for_tetrahedra(bend: float, n: int) -> None:
    V, F = quads(bend, n)
    with pytest.raises(MeshError, match=r"F has 4 columns, which stands for tetrahedra, but F\[\d+\] = .* is a quadri"):
        Mesh(V, F)
    assert PolygonMesh(V, F).triangles.n_faces == 2 * n * n


@pytest.mark.parametrize(
    "F", [CUBE, CUBE[:2], CUBE[:1], CUBE[:3], [*CUBE, CUBE[0]]], ids=["closed", "apart", "single", "open", "twice"]
)
def test_a_cube_of_quadrilaterals_is_not_taken_for_tetrahedra(F: list[list[int]]) -> None:
    with pytest.raises(MeshError, match=r"F\[0\] = \[0, 2, 3, 1\] is a quadrilateral: pass PolygonMesh\(V, F\)"):
        Mesh(CORNERS, F)


def scattered(n: int, seed: int) -> Mesh:
    from scipy.spatial import Delaunay

    points = np.random.default_rng(seed).random((n, 3))
    return Mesh(points, Delaunay(points).simplices)


@pytest.mark.parametrize("seed", range(10))
def test_scattered_tetrahedra(seed: int) -> None:
    mesh = scattered(8 + 40 * seed, seed)
    rng = np.random.default_rng(seed)
    corners = rng.permuted(mesh.F, axis=1)
    flat = mesh.V * [1, 1, 1e-4]
    for V in (mesh.V, flat):
        assert Mesh(V, corners).is_tetrahedral


@pytest.mark.parametrize("n", [1, 2, 9])
def test_boxes_of_tetrahedra_are_not_taken_for_quadrilaterals(n: int) -> None:
    assert shapes.box(n).n_faces == 6 * n**3
    assert shapes.box(n, (1, 1, 1e-3)).n_faces == 6 * n**3


def test_tetrahedra_without_neighbours() -> None:
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    thin = corner * [1, 1, 1e-3]
    for V in (corner, thin):
        assert Mesh(V, [[0, 1, 2, 3]]).n_faces == 1
        apart = np.concatenate([V + 3 * i for i in range(50)])
        assert Mesh(apart, np.arange(200).reshape(50, 4)).n_faces == 50
    # Two that share an edge, or a vertex.
    V = np.concatenate([corner, [[0, -1, 0], [0, 0, -1], [-1, 0, 0]]])
    assert Mesh(V, [[0, 1, 2, 3], [0, 1, 4, 5]]).n_faces == 2
    assert Mesh(V, [[0, 1, 2, 3], [0, 6, 4, 5]]).n_faces == 2
    # A flat one beside others is for the report.
    V = np.concatenate([corner, [[1, 1, 0]]])
    assert Mesh(V, [[0, 1, 2, 3], [0, 1, 4, 2]]).report().degenerate_faces.tolist() == [1]


def test_tetrahedra_of_which_one_hangs_on_an_edge() -> None:
    V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [0, -1, 0], [0, 0, -1]]
    F = [[0, 1, 2, 3], [1, 2, 3, 4], [0, 1, 5, 6]]
    for thickness in (1, 1e-2):
        assert Mesh(np.array(V) * [1, 1, thickness], F).n_faces == 3


def test_half_a_million_quadrilaterals_are_told_from_tetrahedra() -> None:
    """Half a million quadrilaterals and nearly as many tetrahedra: a quadratic check would not end."""
    V, F = quads(0.2, 700)
    with pytest.raises(MeshError, match="is a quadrilateral"):
        Mesh(V, F)
    assert shapes.box(40).n_faces == 384_000
