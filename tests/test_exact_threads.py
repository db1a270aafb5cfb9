"""One exact search on two threads: the same bits, whatever the surface and the sources."""

import numpy as np
import pytest
from conftest import perturbed
from surfaces import bent_pages, on
from test_paths import MESHES

from heat_igl import Mesh, OffsetSources, SurfacePoints, isolines, shapes
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.kernels.windows import windows
from heat_igl.sources import Sources
from heat_igl.windows import exact
from heat_igl.windows.exact import ExactSurface


def pinched() -> Mesh:
    """Two bumpy grids with one vertex in common, and a third without."""
    one = perturbed(shapes.grid(14), 0.4, 3)
    V = np.concatenate([one.V, 2 * one.V[-1] - one.V[:-1], one.V + np.array([0, 0, 9])])
    second = one.F + one.n_vertices
    second[one.n_vertices - 1 == one.F] = one.n_vertices - 1
    return Mesh(V, np.concatenate([one.F, second, one.F + 2 * one.n_vertices - 1]))


ZOO = {
    **MESHES,
    "edges of three faces": bent_pages,
    "pinched, and components": pinched,
    "strip": lambda: shapes.strip(200, 2),
    "needles": lambda: Mesh(shapes.icosphere(3).V * [1, 30, 1], shapes.icosphere(3).F),
}


@pytest.fixture(autouse=True)
def shared_from_the_start(monkeypatch):
    monkeypatch.setattr(exact, "_FEWEST_SHARED", 0)
    monkeypatch.setattr(exact, "_PLENTY", 30)
    monkeypatch.setattr(exact, "_ROUND", 0.3)


def both_ways(mesh: Mesh, sources: Sources, cutoff: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Distances, and from which source, by one thread and by two."""
    surface, chosen = ExactSurface(intrinsic_triangulation(mesh)), on(mesh, sources)
    found = (surface.solve(chosen, cutoff=cutoff, threads=threads) for threads in (1, 2))
    return tuple(np.stack([each.distance, each.origin.label]) for each in found)


@pytest.mark.parametrize("name", ZOO)
def test_two_threads_find_what_one_finds(name):
    mesh = ZOO[name]()
    rng = np.random.default_rng(0)
    for source in rng.choice(np.unique(mesh.F), 5):
        np.testing.assert_array_equal(*both_ways(mesh, source))
    several, offsets = rng.choice(np.unique(mesh.F), 7, replace=False), rng.random(7) * mesh.edge_lengths.mean()
    np.testing.assert_array_equal(*both_ways(mesh, OffsetSources(several, offsets)))
    cutoff = float(np.median(both_ways(mesh, several[:1])[0][0]))
    np.testing.assert_array_equal(*both_ways(mesh, several, cutoff))
    points = SurfacePoints(rng.integers(mesh.n_faces, size=3), rng.dirichlet(np.ones(3), 3))
    np.testing.assert_array_equal(*both_ways(mesh, points))


def test_two_threads_find_the_same_sources_in_long_rounds(monkeypatch):
    """A vertex that both had reached was counted to the source of the longer path, on half of such meshes."""
    monkeypatch.setattr(exact, "_ROUND", 3.0)
    for seed in range(12):
        mesh = perturbed(shapes.blob(3), 0.1, seed)
        sources = np.random.default_rng(seed).choice(mesh.n_vertices, 3, replace=False)
        np.testing.assert_array_equal(*both_ways(mesh, sources))


def test_two_threads_find_what_one_finds_from_curves():
    for mesh in (shapes.grid(16), perturbed(shapes.icosphere(3), 0.3, 1)):
        curve = isolines(mesh, mesh.V[:, 0] + 0.3 * mesh.V[:, 1], 0.4)[0][0]
        np.testing.assert_array_equal(*both_ways(mesh, curve))


def counted(monkeypatch) -> list[np.ndarray]:
    """Takes the statistics of each search on each thread."""
    counts, alone = [], windows.search

    def search(*arguments):
        counts.append(arguments[-1])
        return alone(*arguments)

    monkeypatch.setattr(windows, "search", search)
    return counts


def test_the_second_thread_has_a_share(monkeypatch):
    """Without this, equal distances could be those of one thread that did all."""
    counts = counted(monkeypatch)
    mesh = ZOO["rough sphere"]()
    found = ExactSurface(intrinsic_triangulation(mesh)).solve(on(mesh, 0), threads=2)
    shares = [count[1] for count in counts]
    assert len(shares) == 2
    assert sum(shares) == found.n_windows
    assert min(shares) > 0.1 * found.n_windows
