"""Half-edge tables for walks: what holds of them on any triangulation."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import Mesh, shapes
from heat_igl.intrinsic import IntrinsicTriangulation, intrinsic_delaunay, intrinsic_triangulation
from heat_igl.intrinsic.fans import Tables, breadth_first, tables


def triangulations() -> list[IntrinsicTriangulation]:
    bow_tie = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], [[0, 1, 2], [0, 3, 4]])
    fins = Mesh([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    meshes = [perturbed(shapes.icosphere(2), 0.1, 1), perturbed(shapes.grid(5), 0.05, 2), shapes.strip(7, 2), bow_tie]
    return [*(intrinsic_delaunay(intrinsic_triangulation(mesh)) for mesh in meshes), intrinsic_triangulation(fins)]


@pytest.fixture(params=range(5), ids=["sphere", "square", "strip", "bow tie", "fins"])
def triangulation(request) -> IntrinsicTriangulation:
    return triangulations()[request.param]


def tables_of(triangulation: IntrinsicTriangulation) -> Tables:
    F, twin = triangulation.F.astype(np.int32), triangulation.twin.astype(np.int32)
    return tables(F, triangulation.l, twin, triangulation.n)


def test_breadth_first_renames_vertices_and_faces(triangulation):
    number, face, F, lengths, twin = breadth_first(
        triangulation.F, triangulation.l, triangulation.twin, triangulation.n
    )
    assert (np.sort(number) == np.arange(triangulation.n)).all()
    np.testing.assert_array_equal(F[face], number[triangulation.F])
    np.testing.assert_array_equal(lengths[face], triangulation.l)
    glued = triangulation.twin >= 0
    new = 3 * face[np.arange(len(glued)) // 3] + np.arange(len(glued)) % 3
    np.testing.assert_array_equal(twin[new][glued], new[triangulation.twin[glued]])
    np.testing.assert_array_equal(twin[new][~glued], triangulation.twin[~glued])


def test_steps_lead_across_the_sides_of_their_face(triangulation):
    t, twin = tables_of(triangulation), triangulation.twin
    h = np.arange(len(twin))
    np.testing.assert_array_equal(t.across(h // 3, h % 3), twin)
    right, left = 3 * (h // 3) + (h + 1) % 3, 3 * (h // 3) + (h + 2) % 3
    np.testing.assert_array_equal(t.step["to_right"], twin[right])
    np.testing.assert_array_equal(t.step["to_left"], twin[left])
    # The apex has its distances from both ends, x measured from the right end of the half-edge crossed.
    lengths = triangulation.l.ravel()
    x, y = t.step["x"] * lengths, t.step["y"] * lengths
    np.testing.assert_allclose(np.hypot(x, y), lengths[left], rtol=1e-12)
    np.testing.assert_allclose(np.hypot(lengths - x, y), lengths[right], rtol=1e-12)


def test_angles_of_a_fan_add_up(triangulation):
    t = tables_of(triangulation)
    angle = np.zeros(len(t.total))
    np.add.at(angle, t.step["fan"], t.step["angle"])
    np.testing.assert_allclose(angle, np.abs(t.total), rtol=1e-12)
    np.testing.assert_allclose(angle.sum(), np.pi * len(triangulation.F), rtol=1e-12)
    # Around: the next spoke is farther by the angle of the corner between them.
    k = np.flatnonzero(t.turn["corner"] >= 0)
    following = t.spoke["next"][k]
    total = t.total[t.turn["fan_here"][k]]
    between = t.turn["here"][following] - t.turn["here"][k]
    between += np.where((total > 0) & (between < 0), total, 0)
    np.testing.assert_allclose(between, t.step["angle"][t.turn["corner"][k]], atol=1e-12)
    np.testing.assert_array_equal(t.spoke["neighbour"][following], t.spoke["next_neighbour"][k])


def test_a_spoke_is_seen_the_other_way_from_its_other_end(triangulation):
    t = tables_of(triangulation)
    vertex = np.repeat(np.arange(triangulation.n), np.diff(t.first))
    for k in range(len(t.spoke)):
        w = t.spoke["neighbour"][k]
        back = np.arange(t.first[w], t.first[w + 1])
        same = (t.spoke["neighbour"][back] == vertex[k]) & (t.turn["fan_here"][back] == t.turn["fan_there"][k])
        turned = np.abs(t.turn["here"][back] - t.turn["there"][k]) % np.abs(t.total[t.turn["fan_there"][k]])
        whole = np.abs(t.total[t.turn["fan_there"][k]])
        same &= np.minimum(turned, whole - turned) < 1e-12
        assert same.any()
        np.testing.assert_allclose(t.spoke["length"][back[same]], t.spoke["length"][k], rtol=1e-15)


def test_curvature_adds_up_to_the_characteristic():
    t = tables_of(triangulations()[0])
    assert (t.total > 0).all()
    assert (2 * np.pi - t.total).sum() == pytest.approx(4 * np.pi, rel=1e-12)
    assert not t.is_flat.any()
    grid = tables_of(triangulations()[2])
    assert grid.is_flat.all()


def test_rows_begin_where_lines_of_the_cache_do(triangulation):
    t = tables_of(triangulation)
    assert [one.dtype.itemsize for one in (t.spoke, t.turn, t.step)] == [64, 32, 64]
    assert all(one.ctypes.data % 64 == 0 for one in (t.spoke, t.turn, t.step))
