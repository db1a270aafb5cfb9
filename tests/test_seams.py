"""Texture seams: what a loader split is measured as one, and nothing else is joined."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, merge_seams, shapes


def split(mesh: Mesh, chart: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """The mesh with separate vertices for each chart of faces, and the vertex that each one was."""
    corners = np.stack([mesh.F, np.repeat(chart[:, None], 3, axis=1)], axis=-1).reshape(-1, 2)
    rows, index = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(mesh.V[rows[:, 0]], index.reshape(-1, 3)), rows[:, 0]


def charts(mesh: Mesh, kind: str, seed: int) -> np.ndarray:
    centre = mesh.V[mesh.F].mean(axis=1)
    generator = np.random.default_rng(seed)
    if kind == "halves":
        return (centre @ generator.normal(size=3) > 0).astype(int)
    if kind == "cells":
        seeds = centre[generator.choice(len(centre), 9, replace=False)]
        return np.linalg.norm(centre[:, None] - seeds, axis=2).argmin(axis=1)
    return np.arange(len(centre))  # every face by itself, as in files without shared vertices


@pytest.mark.parametrize("kind", ["halves", "cells", "faces"])
@pytest.mark.parametrize("seed", range(4))
def test_a_split_model_is_measured_as_one(kind: str, seed: int) -> None:
    whole = [shapes.icosphere(3), shapes.torus(20, 12), shapes.grid(9), shapes.strip(30, 4)][seed]
    parts, was = split(whole, charts(whole, kind, seed))
    assert len(parts.report().seam_edges)
    joined = merge_seams(parts)
    assert joined.mesh.report().seam_edges.size == 0
    assert (joined.mesh.n_vertices, joined.mesh.n_faces) == (whole.n_vertices, whole.n_faces)
    np.testing.assert_array_equal(joined.mesh.V[joined.vertex], parts.V)
    distance = heat_igl.geodesic_distance(joined.mesh, joined.vertex[0], method="exact")[joined.vertex]
    truth = heat_igl.geodesic_distance(whole, was[0], method="exact")[was]
    np.testing.assert_allclose(distance, truth, rtol=1e-12, atol=1e-12 * truth.max())


def test_a_slit_that_leaves_one_piece_is_closed() -> None:
    n = 24
    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.arange(5.0))
    angle[:, -1] = 0  # the same positions, another column of vertices, as texture coordinates need
    V = np.stack([np.cos(angle), np.sin(angle), height], axis=-1).reshape(-1, 3)
    unrolled = Mesh(V, shapes.strip(n, 4).F)
    assert unrolled.components.max() == 0
    joined = merge_seams(unrolled)
    assert joined.mesh.n_vertices == 5 * n
    assert joined.mesh.report().n_boundary_loops == 2
    beside = joined.vertex[n - 1]
    assert heat_igl.geodesic_distance(joined.mesh, joined.vertex[0])[beside] == pytest.approx(2 * np.sin(np.pi / n))


def with_copy(mesh: Mesh, V: np.ndarray, flipped: bool) -> Mesh:
    F = mesh.F[:, ::-1] if flipped else mesh.F
    return Mesh(np.concatenate([mesh.V, V]), np.concatenate([mesh.F, F + mesh.n_vertices]))


@pytest.mark.parametrize("flipped", [False, True])
def test_a_sheet_on_another_is_left_alone(flipped: bool) -> None:
    sheet = shapes.grid(5)
    double = with_copy(sheet, sheet.V, flipped)
    assert merge_seams(double).mesh is double
    assert double.report().seam_edges.size == 0


@pytest.mark.parametrize("seed", range(50))
def test_sheets_that_are_only_near_are_left_alone(seed: int) -> None:
    generator = np.random.default_rng(seed)
    ball = shapes.icosphere(2)
    parts, _ = split(ball, charts(ball, "cells", seed))
    gap = 10.0 ** -generator.integers(3, 15)
    moved = Mesh(parts.V * (1 + gap * generator.uniform(1, 2, (parts.n_vertices, 1))), parts.F)
    assert merge_seams(moved).mesh is moved


def test_t_junctions_and_three_sheets_are_left_alone() -> None:
    V = np.array([[0, 0, 0], [2, 0, 0], [1, 2, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0], [1, -2, 0]], float)
    tee = Mesh(V, [[0, 1, 2], [4, 3, 6], [5, 4, 6]])
    assert merge_seams(tee).mesh is tee
    three = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, -1, 0], [1, 0, 0], [0, 0, 0], [0, 0, 1]],
        [[0, 1, 2], [3, 4, 5], [6, 7, 8]],
    )
    assert merge_seams(three).mesh is three
    two = Mesh(three.V[:6], three.F[:2])
    assert merge_seams(two).mesh.n_vertices == 4


def test_objects_of_other_libraries_are_warned_of() -> None:
    parts, _ = split(shapes.icosphere(2), charts(shapes.icosphere(2), "halves", 1))
    theirs = SimpleNamespace(vertices=parts.V, faces=parts.F)
    with pytest.warns(heat_igl.AccuracyWarning, match=r"\d+ boundary edges .* heat_igl.merge_seams joins them"):
        heat_igl.geodesic_distance(theirs, 0)
    assert merge_seams(theirs).mesh.n_vertices == 162
    heat_igl.as_mesh(SimpleNamespace(vertices=shapes.grid(3).V, faces=shapes.grid(3).F))
    with pytest.raises(MeshError, match="mesh is tetrahedral"):
        merge_seams(shapes.box(1))
