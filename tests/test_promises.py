"""What a refined distance promises: not below exact, not above paths along edges, near exact on every kind of shape."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import GeodesicSolver, Mesh, shapes
from heat_igl.mesh import connectivity
from heat_igl.operators import unfolding_surface
from heat_igl.sources import source_set
from heat_igl.unfolding import MeshTriangles, SweepEngine
from heat_igl.unfolding.bounds import Bounds
from heat_igl.unfolding.exact import exact_distance
from heat_igl.validation import zoo

ROUGH = ["noise 10 times", "beams", "voxel ball", "plate", "cube less one", "noisy sphere"]
TORUS = shapes.torus(48, 30)


def shape(name: str) -> Mesh:
    return next(each for each in zoo.SHAPES if each.name == name).make()


def relative(d: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return (d - truth) / truth.max()


def test_surfaces_with_holes_are_told_from_disks_and_spheres():
    for mesh in (shape("sponge"), TORUS):
        assert SweepEngine(MeshTriangles(mesh)).measures.has_holes
    for mesh in (shapes.grid(5), shapes.icosphere(2), shape("two spheres 1 to 10")):
        assert not SweepEngine(MeshTriangles(mesh)).measures.has_holes


@pytest.mark.parametrize("name", ROUGH)
def test_small_and_rough_meshes_are_exact(name):
    mesh = shape(name)
    solver = GeodesicSolver(mesh, method="sweep")
    for source in (0, mesh.n_vertices // 2):
        np.testing.assert_allclose(
            relative(solver.distance(source), exact_distance(mesh.V, mesh.F, source)), 0, atol=1e-10
        )


@pytest.mark.parametrize("count", [4, 300])
def test_a_sweep_from_vertices_is_no_sweep_from_the_edges_between_them(count):
    mesh = shapes.grid(40)
    sources = np.random.default_rng(3).choice(mesh.n_vertices, count, replace=False)
    if count == 4:
        sources = np.array([820, 821, 861, 862])  # the corners of a cell
    truth = np.linalg.norm(mesh.V[:, None] - mesh.V[sources], axis=2).min(axis=1)
    d = GeodesicSolver(mesh, method="sweep").distance(sources)
    assert np.abs(d - truth)[truth > 0].mean() < 0.002 * truth.mean()
    assert np.abs(d - truth).max() < 0.05 * truth.max()


def test_what_leaves_the_bounds_is_brought_back():
    mesh = TORUS
    surface = unfolding_surface(mesh)
    sources = source_set(5, mesh.n_vertices, mesh.F)
    along_edges = connectivity.edge_distance(mesh.edge_graph, np.array([5]))
    straight = np.linalg.norm(mesh.V - mesh.V[5], axis=1)
    d = 2 * along_edges
    Bounds(surface).shorten(d)
    assert (d <= along_edges * (1 + 1e-9)).all()
    d = straight / 2
    Bounds(surface).lengthen(d, sources, sources.points)
    np.testing.assert_allclose(d, straight, rtol=1e-9)
