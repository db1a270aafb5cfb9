"""Particles, which must agree with scikit-image's, and offsets of a curve."""

import numpy as np
import pytest

import heat_igl
from heat_igl import shapes
from heat_igl.applications import particle_length, reconstruct, skeleton, zones_of_influence

# Particles.


def blobs(seed: int, n: int = 80) -> np.ndarray:
    ndimage = pytest.importorskip("scipy.ndimage")
    return ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((n, n)), 2.5) > 0.02


def test_marked_particles_are_reconstructed_as_scikit_image_does():
    morphology = pytest.importorskip("skimage.morphology")
    mask = blobs(0)
    markers = np.zeros_like(mask)
    markers[::13, ::17] = True
    expected = morphology.reconstruction((markers & mask).astype(float), mask.astype(float), footprint=np.ones((3, 3)))
    found = reconstruct(mask, markers)
    assert 0 < found.sum() < mask.sum()
    assert np.array_equal(found, expected > 0)


def test_reconstruction_within_a_radius_stays_inside_the_particle():
    """A hook: its ends are near each other in the plane, and far inside."""
    mask = np.zeros((12, 30), bool)
    mask[2:5], mask[7:10], mask[2:10, 26:] = True, True, True
    marker = np.zeros_like(mask)
    marker[3, 2] = True
    near = reconstruct(mask, marker, radius=20.5, method="sweep")
    assert near[3, 22]
    assert not near[3, 23]
    assert not near[7:10, :20].any()
    assert reconstruct(mask, marker).all() == mask.all()
    assert np.array_equal(reconstruct(mask, marker), mask)
    with pytest.raises(heat_igl.SourceError, match="pixels selects no pixel"):
        reconstruct(mask, ~mask)


def test_zones_of_influence_cut_touching_disks_apart():
    y, x = np.mgrid[:40, :70]
    left, right = np.hypot(x - 20, y - 20) < 15, np.hypot(x - 46, y - 20) < 15
    mask = left | right
    mask[1, 1] = True
    markers = np.zeros(mask.shape, int)
    markers[20, 20], markers[20, 46] = 3, 8
    zones = zones_of_influence(mask, markers)
    assert zones[1, 1] == 0
    assert not zones[~mask].any()
    inside = mask & (x + y > 2)
    assert (zones[inside & (x < 33)] == 3).all()
    assert (zones[inside & (x > 33)] == 8).all()
    with pytest.raises(heat_igl.SourceError, match="marker 5 lies outside the mask"):
        zones_of_influence(mask, np.where(mask, 0, 5))
    with pytest.raises(heat_igl.SourceError, match="markers is 0 everywhere"):
        zones_of_influence(mask, np.zeros(mask.shape, int))
    with pytest.raises(heat_igl.SourceError, match="markers must be an image of integers"):
        zones_of_influence(mask, mask)


def test_length_of_a_hook_and_of_a_bar():
    bar = np.zeros((5, 40), bool)
    bar[2, 3:33] = True
    length, first, second = particle_length(bar, method="sweep")
    assert length == pytest.approx(np.hypot(30, 1))
    assert {first, second} == {(2, 3), (2, 32)}
    hook = np.zeros((12, 30), bool)
    hook[2:4], hook[8:10], hook[2:10, 28:] = True, True, True
    # From a far corner to the next inner corner, down, and back: the band is two wide.
    length, first, second = particle_length(hook, method="exact")
    assert length == pytest.approx(2 * np.hypot(28, 2) + 4, rel=1e-4)
    assert {first, second} == {(2, 0), (9, 0)}
    with pytest.raises(heat_igl.MeshError, match="mask holds 2 particles"):
        particle_length(np.array([[True, False, True]]))


def comb(bump: int) -> np.ndarray:
    """A bar nine wide with a bump `bump` high in its middle, and a long tooth."""
    mask = np.zeros((80, 100), bool)
    mask[50:59, 10:90] = True
    mask[50 - bump : 50, 42:45] = True
    mask[15:50, 60:67] = True
    return mask


def test_skeleton_keeps_long_branches_and_drops_short_ones():
    pytest.importorskip("skimage")
    whole = skeleton(comb(8), 0.0)
    pruned = skeleton(comb(8), 20.0)
    assert (whole[:50, 37:50]).any()
    assert not (pruned[:48, 37:50]).any()
    assert pruned[15:50, 60:67].any(axis=1)[5:].all()  # the tooth
    assert pruned[50:59, 10:90].any(axis=0)[10:-10].all()  # the bar
    assert (pruned <= comb(8)).all()


@pytest.mark.parametrize("seed", range(4))
def test_skeleton_keeps_pieces_and_holes(seed):
    measure = pytest.importorskip("skimage.measure")
    mask = blobs(seed)
    for shortest in (0.0, 4.0, 8.0, 1000.0):
        thin = skeleton(mask, shortest)
        assert measure.label(thin, connectivity=2).max() == measure.label(mask, connectivity=2).max()
        assert measure.euler_number(thin, connectivity=2) == measure.euler_number(mask, connectivity=2)
        assert (thin <= mask).all()


# The offset of a curve drawn on a surface.


def test_offset_of_a_curve_drawn_on_the_plane():
    """Around a segment: two sides and two half circles, by a distance that is off by less than an edge on average."""
    mesh = shapes.grid(60)
    solver = heat_igl.HeatMethodSolver(mesh)
    first, last = 20 * 61 + 20, 30 * 61 + 40
    drawn = heat_igl.shortest_paths(mesh, last, first)[0]
    length = np.linalg.norm(mesh.V[first] - mesh.V[last])
    assert drawn.lengths(mesh).sum() == pytest.approx(length, rel=1e-9)
    (curve,) = heat_igl.curves.offset_curves(mesh, solver, drawn, 0.2)
    assert curve.is_closed
    assert curve.lengths(mesh).sum() == pytest.approx(2 * length + 2 * np.pi * 0.2, abs=2 * np.pi / 60)
    points = curve.positions(mesh)
    along = np.clip((points - mesh.V[first]) @ (mesh.V[last] - mesh.V[first]) / length**2, 0, 1)[:, None]
    nearest = mesh.V[first] + along * (mesh.V[last] - mesh.V[first])
    off = np.abs(np.linalg.norm(points - nearest, axis=1) - 0.2)
    assert off.mean() < 1 / 60
    assert off.max() < 2 / 60
