"""Windows with a tolerance: every distance is within the tolerance of exact, nothing is missed, and 0 is exact."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import bumpy, rough_star

from heat_igl import Mesh, shapes
from heat_igl.unfolding.exact import ExactSurface
from heat_igl.unfolding.half_edges import from_mesh
from heat_igl.validation.zoo import FAMILIES

SURFACES = {
    "sphere": lambda: shapes.icosphere(4),
    "bumpy": bumpy,
    "torus": lambda: shapes.torus(40, 60),
    "cylinder": lambda: shapes.cylinder(30, 30),
    "rough": lambda: rough_star(5),
    "vase": lambda: FAMILIES["vase"](3),
    "handles": lambda: FAMILIES["handles"](1),
    "terrain": lambda: FAMILIES["terrain"](2),
}


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("name", SURFACES)
def test_errors_stay_below_the_tolerance(name, tolerance):
    mesh = SURFACES[name]()
    surface = ExactSurface(from_mesh(mesh, 0))
    for sources in (np.array([mesh.F[0, 0]]), mesh.F[[1, len(mesh.F) // 2], 1]):
        exact = surface.distance(sources)
        reached = np.isfinite(exact)
        found = surface.distance(sources, tolerance=tolerance)
        np.testing.assert_array_equal(np.isfinite(found), reached)
        assert (np.abs(found - exact)[reached] <= tolerance * exact[reached] + 1e-14 * exact[reached].max()).all()


def test_fewer_windows_with_a_larger_tolerance():
    surface = ExactSurface(from_mesh(shapes.icosphere(4), 0))
    source = np.array([7])
    numbers = [surface.solve(source, tolerance=tolerance).n_windows for tolerance in (0.0, 1e-5, 1e-4, 1e-3)]
    assert sorted(numbers, reverse=True) == numbers
    assert numbers[-1] < 0.5 * numbers[0]


def test_labels_are_those_of_exact_windows():
    mesh = bumpy()
    surface = ExactSurface(from_mesh(mesh, 0))
    sources = np.array([3, 300, 600])
    exact, found = surface.solve(sources), surface.solve(sources, tolerance=1e-4)
    other = np.flatnonzero(found.origin.label != exact.origin.label)
    # Only where two sources are equally near up to the errors of both.
    alone = np.array([surface.distance(sources[[label]])[other] for label in range(3)])
    chosen = alone[found.origin.label[other], np.arange(len(other))]
    np.testing.assert_allclose(chosen, exact.distance[other], rtol=2e-4)


def test_a_tolerance_of_0_gives_the_bits_of_exact_distance():
    mesh: Mesh = rough_star(3)
    surface = ExactSurface(from_mesh(mesh, 0))
    found = surface.solve(np.array([5]), tolerance=0.0).distance
    np.testing.assert_array_equal(found, surface.distance(np.array([5])))


def test_directions_with_a_tolerance_are_refused():
    surface = ExactSurface(from_mesh(shapes.icosphere(1), 0))
    with pytest.raises(ValueError, match="leave out the tolerance"):
        surface.solve(np.array([0]), directed=True, tolerance=1e-5)
    assert np.isfinite(surface.solve(np.array([0]), tolerance=1e-5).distance).all()
