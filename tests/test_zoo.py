"""Shapes that no default was tuned for, and the check that every answer by heat gets."""

import re

import numpy as np
import pytest
from conftest import mean_error, zoo
from surfaces import sheared

import heat_igl
from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, OffsetSources, SurfacePoints, geodesic_distance, shapes
from heat_igl.errors import FactorizationError
from heat_igl.heat.source_terms import SourceAssembler, drop_overtaken
from heat_igl.sources import source_set
from heat_igl.typing import FloatArray
from heat_igl.validation.closed_forms import by_fermat
from heat_igl.validation.construction import delaunay
from heat_igl.validation.zoo import FAMILIES, SHAPES


def test_a_third_is_held_out():
    assert len(SHAPES) >= 60
    assert 0.33 < np.mean([shape.held_out for shape in SHAPES]) < 0.5
    assert len({shape.name for shape in SHAPES}) == len(SHAPES)


@pytest.mark.parametrize("kind", FAMILIES)
def test_a_seed_is_a_mesh_of_its_own(kind):
    one, again, other = (FAMILIES[kind](seed) for seed in (1, 1, 2))
    assert np.array_equal(one.V, again.V)
    assert np.array_equal(one.F, again.F)
    assert not np.array_equal(one.V, other.V)
    assert one.n_faces > 10
    assert len(np.unique(one.F)) == one.n_vertices


UNEVEN = [
    "capped cylinder 128", "plate", "box cube", "hull of 12", "scattered square 1000", "sheared grid by 3", "maze",
    "height field coarse", "noise 10 times", "beams", "spiky sphere", "two spheres 1 to 100",
]  # fmt: skip


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
@pytest.mark.parametrize("name", UNEVEN)
def test_heat_on_uneven_shapes_is_nearer_than_the_papers(name):
    mesh, errors = zoo(name), []
    for options in ({}, {"laplacian": "cotan", "magnitude": "unit"}):
        solver = HeatMethodSolver(mesh, **options)
        for source in np.random.default_rng(0).choice(np.unique(mesh.F), 3).tolist():
            errors.append(mean_error(solver.distance(source), geodesic_distance(mesh, source)))
    assert sum(errors[:3]) < 0.6 * sum(errors[3:])


# Components of different size.


def beside_a_larger_one(ratio: float) -> tuple[Mesh, int]:
    """A sphere beside one `ratio` times larger, with a flat triangle of the size of the larger."""
    sphere = shapes.icosphere(3)
    n = sphere.n_vertices
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]) * ratio + [0, 5 * ratio, 0]
    V = np.concatenate([sphere.V, sphere.V * ratio + [3 * ratio, 0, 0], flat])
    return Mesh(V, np.concatenate([sphere.F, sphere.F + n, [[2 * n, 2 * n + 1, 2 * n + 2]]])), n


@pytest.mark.parametrize("options", [{}, {"laplacian": "cotan"}, {"magnitude": "unit"}])
@pytest.mark.parametrize("ratio", [10.0, 1e3, 1e8])
def test_a_small_component_is_as_accurate_as_alone(ratio, options):
    mesh, n = beside_a_larger_one(ratio)
    solver = HeatMethodSolver(mesh, **options)
    alone = HeatMethodSolver(shapes.icosphere(3), **options)
    assert np.abs(solver.distance(0)[:n] - alone.distance(0)).max() < 1e-9
    assert np.abs(solver.distance(n)[n : 2 * n] / ratio - alone.distance(0)).max() < 1e-9
    small, large = solver.time_steps[:2]
    assert large / small == pytest.approx(ratio**2)
    assert ratio > 10 or (HeatMethodSolver(mesh, t=small).time_steps == small).all()
    point = SurfacePoints([5], [[0.2, 0.3, 0.5]])
    assert np.abs(solver.distance(point)[:n] - alone.distance(point)).max() < 1e-9


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
@pytest.mark.parametrize("name", ["hull of 12", "beams", "maze"])
def test_components_do_not_change_each_other(name):
    one, other = zoo(name), shapes.icosphere(3)
    n, far = one.n_vertices, other.V + 3 * np.ptp(one.V, axis=0).max()
    both = HeatMethodSolver(Mesh(np.concatenate([one.V, far]), np.concatenate([one.F, other.F + n])))
    for mesh, start, first in ((one, 0, 0), (other, n, one.n_faces)):
        solver, weights = HeatMethodSolver(mesh), [[0.2, 0.3, 0.5]]
        for source, moved in ((0, start), (SurfacePoints([5], weights), SurfacePoints([first + 5], weights))):
            alone, together = solver.distance(source), both.distance(moved)[start : start + mesh.n_vertices]
            assert np.abs(together - alone).max() < 0.003 * alone.max()


def test_where_heat_has_no_digits_a_face_is_named():
    grid, ball = shapes.grid(3), shapes.icosphere(2)
    point = Mesh([*grid.V, *([[2.0, 2, 2]] * 3)], [*grid.F, [16, 17, 18]])
    with pytest.raises(FactorizationError, match=r"; the thinnest face is F\[18\] = \[16, 17, 18\]: repair it, and"):
        HeatMethodSolver(point)
    with pytest.raises(FactorizationError, match=r"nan at vertex 1; .* F\[\d+\] = .* laplacian at 'auto'"):
        HeatMethodSolver(Mesh(ball.V * [1e12, 1, 1], ball.F), laplacian="cotan").distance(0)
    P = np.random.default_rng(10).standard_normal((10, 3))
    with pytest.raises(FactorizationError, match=r"; the thinnest face is F\[\d+\] = .*: repair it"):
        heat_igl.VectorHeatSolver(Mesh(P * [0.1, 1e-3, 1], delaunay(P[:, :2])))


# The check.


def test_a_wrong_answer_is_raised_to_straight_lines_or_warns():
    """Most edges have negative weights, and the method of the paper is far off."""
    mesh = sheared(shapes.grid(20), 3)
    lines = np.linalg.norm(mesh.V - mesh.V[210], axis=1)
    solver = HeatMethodSolver(mesh, laplacian="intrinsic-delaunay")
    assert mean_error(solver.distance(210), lines) < 0.02
    check = solver.solve(210).diagnostics.check
    assert check.shortfall > 0.1
    assert check.raised
    # The paper's method keeps its answer.
    paper = HeatMethodSolver(mesh, laplacian="cotan")
    with pytest.warns(AccuracyWarning, match="too short on average, below straight lines, most at"):
        assert np.mean(paper.distance(210) < 0.9 * lines) > 0.2
    # So does a time step that was asked for, which may be meant to smooth.
    smooth = HeatMethodSolver(mesh, t_coef=2000)
    with pytest.warns(AccuracyWarning, match="too short"):
        assert np.mean(smooth.distance(210) < 0.9 * lines) > 0.2
    # Nothing is known about lines without positions.
    with pytest.warns(AccuracyWarning, match=r"off by \d+\.\d % on average") as caught:
        unchecked = HeatMethodSolver(solver.operators).solve(210)
    told = float(re.search(r"off by (\S+) %", str(caught[0].message))[1]) / 100
    assert told == pytest.approx(np.abs(unchecked.distance - lines).mean() / lines.mean(), rel=0.1)
    assert np.isnan(unchecked.diagnostics.check.shortfall)


def test_a_good_answer_is_left_alone():
    mesh = shapes.icosphere(3)
    solution = HeatMethodSolver(mesh, t_coef=0.5).solve(0)
    check = solution.diagnostics.check
    assert not check.raised
    assert 0 <= check.shortfall < 0.005
    assert check.steepness < 0.01
    assert check.largest_shortfall < 0.02
    below = np.linalg.norm(mesh.V - mesh.V[0], axis=1) - solution.distance
    # The check looks at some vertices only, and takes the largest distance from these.
    assert check.largest_shortfall * solution.distance.max() <= 1.1 * below.max()


def test_the_check_measures_from_where_distance_begins():
    solver = HeatMethodSolver(sheared(shapes.grid(20), 3), laplacian="cotan")
    with pytest.warns(AccuracyWarning, match="too short"):
        plain, late = (solver.distance(source) for source in (210, OffsetSources(210, 1e5)))
    assert np.abs(late - 1e5 - plain).max() < 1e-6


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
def test_many_sources_are_checked_too():
    mesh = sheared(shapes.grid(20), 3)
    sources = np.flatnonzero(mesh.V[:, 1] <= 0.05)
    assert len(sources) > 32
    solver = HeatMethodSolver(mesh, laplacian="intrinsic-delaunay")
    lines = np.maximum(mesh.V[:, 1] - 0.05, 0)
    assert (solver.distance(sources) >= lines - 1e-12).all()


# Options that cannot be fulfilled.


@pytest.mark.parametrize("boundary", ["dirichlet", "average"])
def test_a_boundary_of_all_vertices_cannot_be_held(boundary):
    triangle = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(ValueError, match=f"boundary='{boundary}' holds the heat .* every vertex lies there: take"):
        HeatMethodSolver(triangle, boundary=boundary, laplacian="intrinsic-delaunay")
    # Refined, it has vertices inside.
    assert HeatMethodSolver(triangle, boundary=boundary).distance(0).tolist() == [0, 1, 1]


class NegativeHeat:
    """A heat flow on obtuse triangles: heat at the sources is below 0, or many times what it should be."""

    def __init__(self, *heat: float) -> None:
        self.heat = heat

    def solve(self, b: FloatArray) -> FloatArray:
        return np.broadcast_to(np.array(self.heat), b.shape).copy()


@pytest.mark.parametrize("heat", [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (1e9, 1.0)])
def test_the_first_source_is_never_overtaken(heat):
    domain = HeatMethodSolver(shapes.icosphere(2), laplacian="cotan").operators
    assembler = SourceAssembler(domain, 0.1, domain.mean_mass)
    sources = source_set(OffsetSources([3, 80], [0.0, 0.4]), domain.n, None)
    term = drop_overtaken(assembler.term(sources), NegativeHeat(*heat), domain.n)
    assert 3 in term.anchors.vertex
    assert 3 in term.near.vertex


# Closed forms.


def test_refracted_time_obeys_snells_law():
    """The ray at an angle of incidence a leaves at b with sin a / sin b the ratio of the speeds."""
    left, right = 1.0, 0.4
    incidence = np.radians([0.0, 20, 40, 60])
    refracted = np.arcsin(np.sin(incidence) * right / left)
    end = np.stack([0.5 + 0.3 * np.cos(refracted), 0.1 + 0.2 * np.tan(incidence) + 0.3 * np.sin(refracted)], axis=1)
    V = np.concatenate([[[0.3, 0.1]], end])
    time = by_fermat(np.column_stack([V, np.zeros(5)]), 0, left, right)
    np.testing.assert_allclose(time[1:], 0.2 / np.cos(incidence) / left + 0.3 / right, rtol=1e-6)
