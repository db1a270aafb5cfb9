"""Windows cover what they enter: no vertex of a nearly flat surface is missed, whatever rounding does to its angles."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT, pygeodesic_distance

from heat_igl import Mesh, geodesic_distance, pair_distances, shapes
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.validation.zoo import FAMILIES
from heat_igl.windows import ExactSurface, exact, exact_distance


def single_precision_cylinder() -> Mesh:
    """Turned, and rounded as an STL file rounds it: the angles at a vertex sum to 2 pi up to about 1e-7."""
    mesh = shapes.cylinder(100, 199, 10.0)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    return Mesh((mesh.V @ turn).astype(np.float32).astype(float), mesh.F)


@pytest.mark.parametrize("source", [50, 2883, 5000])
def test_a_cylinder_in_single_precision_is_covered(source):
    mesh = single_precision_cylinder()
    found = exact_distance(mesh.V, mesh.F, source)
    radius, (around, along) = 1.0, (100, 200)
    # The smooth cylinder through the vertices is longer by the arc over each chord, (pi / 100)^2 / 6 of it.
    ring, place = np.divmod(np.arange(along * around), around)
    turn = np.abs(place - source % around)
    turn = np.minimum(turn, around - turn) * 2 * radius * np.sin(np.pi / around)
    height = (ring - source // around) * 10.0 / (along - 1)
    assert np.abs(found - np.hypot(turn, height)).max() < 1e-5


def test_pairs_on_a_cylinder_in_single_precision():
    mesh = single_precision_cylinder()
    truth = geodesic_distance(mesh, 2883, method="exact")
    goals = [13625, 17239, 4690]
    found = pair_distances(mesh, [[2883, goal] for goal in goals])
    np.testing.assert_allclose(found, truth[goals], rtol=1e-12)


def test_random_surfaces_against_straight_lines(monkeypatch):
    """The script compares thousands."""
    monkeypatch.syspath_prepend(ROOT / "scripts")
    script = importlib.import_module("random_members")
    found = [script.exact(seed) for seed in range(44)]
    assert {name for name, _, _ in found} == set(script.EXACT)
    assert sum("straight lines" in figures for _, figures, _ in found) > 20
    for seed, (_, figures, explained) in enumerate(found):
        assert max(figures.values()) < max(1e-9, explained), seed


@pytest.mark.parametrize(
    ("name", "seed", "source"),
    [("comb", 1, 545), ("comb", 1, 263), ("comb", 28, 333), ("thin plate", 56, 675), ("thin plate", 83, 479)],
)
def test_every_window_is_a_path(name, seed, source, monkeypatch):
    """Sides run towards roots here: lines along them were taken to meet them beyond their ends, up to 1 % too short.

    So windows that are kept although other paths are shorter change nothing.
    """
    mesh = FAMILIES[name](seed)
    truth = pygeodesic_distance(mesh, source)
    np.testing.assert_allclose(exact_distance(mesh.V, mesh.F, source), truth, rtol=1e-12)
    monkeypatch.setattr(exact, "TOLERANCE", 0.1)
    np.testing.assert_allclose(exact_distance(mesh.V, mesh.F, source), truth, rtol=1e-12)


def test_vertices_in_line_behind_many_that_are_nearly_flat():
    """Angles along a ridge exceed 2 pi by 1e-13 and more: a million sides behind, halves of a window miss a vertex."""
    mesh = FAMILIES["geometrically spaced rings"](71525)
    for source in (38, 52):
        truth = pygeodesic_distance(mesh, source)
        assert np.abs(exact_distance(mesh.V, mesh.F, source) - truth).max() < 1e-12 * truth.max()


@pytest.mark.parametrize("wrong", ["aligned", "twin"])
def test_half_edges_that_are_not_glued_alike_are_refused(wrong):
    """Windows would go around between them without an end."""
    given = intrinsic_triangulation(shapes.torus(6, 5), 0)
    broken = {"aligned": np.arange(given.F.size) != 7, "twin": np.roll(given.twin, 1)}[wrong]
    assert ExactSurface(given).n == 30
    with pytest.raises(ValueError, match="not glued alike"):
        ExactSurface(replace(given, **{wrong: broken}))
