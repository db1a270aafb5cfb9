"""The drop-ins for gdist and pygeodesic: the numbers of these libraries, from their calls."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from heat_igl import Mesh, MeshError, SourceError, shapes
from heat_igl.compat import gdist, pygeodesic


def bumpy() -> Mesh:
    """A sphere with spikes in and out, from a named seed."""
    mesh = shapes.icosphere(2)
    return Mesh(mesh.V * np.random.default_rng(7).uniform(0.6, 1.4, (mesh.n_vertices, 1)), mesh.F)


def two_parts() -> Mesh:
    square = shapes.grid(4)
    return Mesh(np.concatenate([square.V, square.V + 3]), np.concatenate([square.F, square.F + square.n_vertices]))


@pytest.fixture(params=[bumpy, two_parts, lambda: shapes.torus(14, 9)], ids=["bumpy", "two parts", "torus"])
def mesh(request: pytest.FixtureRequest) -> Mesh:
    made: Mesh = request.param()
    return made


def arrays(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    return np.array(mesh.V), mesh.F.astype(np.int32)


def indices(*values: int) -> np.ndarray:
    return np.array(values, np.int32)


# --- gdist ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        (indices(3),),
        (indices(3, 20),),
        (indices(3, 20), indices(7, 1, 3, 7)),
        (None, indices(9)),
        (indices(2), None),
    ],
)
def test_gdist_distances(mesh: Mesh, arguments: tuple[Any, ...]) -> None:
    theirs = pytest.importorskip("gdist").compute_gdist(*arrays(mesh), *arguments)
    ours = gdist.compute_gdist(*arrays(mesh), *arguments)
    assert ours.dtype == np.float64
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_gdist_counts_from_one_and_stops_at_the_largest_distance(mesh: Mesh) -> None:
    V, F = arrays(mesh)
    whole = gdist.compute_gdist(V, F, [5])
    np.testing.assert_array_equal(gdist.compute_gdist(V, F + 1, [5], is_one_indexed=True), whole)
    radius = float(np.median(whole))
    near = gdist.compute_gdist(V, F, [5], max_distance=radius)
    np.testing.assert_allclose(near, np.where(whole <= radius, whole, np.inf), rtol=1e-14)
    assert gdist.compute_gdist(V, F, [5], []).shape == (0,)


@pytest.mark.parametrize("radius", [0.7, None])
def test_gdist_matrices(mesh: Mesh, radius: float | None) -> None:
    peer = pytest.importorskip("gdist")
    limit = () if radius is None else (radius,)
    ours, theirs = (module.local_gdist_matrix(*arrays(mesh), *limit) for module in (gdist, peer))
    assert isinstance(ours, sp.csc_matrix)
    if radius is None:  # gdist stores 1e100 between components
        theirs.data[theirs.data > 1e99] = 0
        theirs.eliminate_zeros()
    assert ours.nnz == theirs.nnz
    np.testing.assert_allclose(ours.toarray(), theirs.toarray(), atol=1e-12)
    chosen = indices(4, 0, 17, 30)
    ours, theirs = (module.distance_matrix_of_selected_points(*arrays(mesh), chosen) for module in (gdist, peer))
    np.testing.assert_allclose(ours.toarray(), theirs.toarray(), atol=1e-12)
    within = gdist.distance_matrix_of_selected_points(*arrays(mesh), chosen, 1.0)
    assert within.nnz == (ours.data <= 1.0).sum()
    assert abs(within - within.T).max() == 0


# --- pygeodesic -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [(), ([3],), ([20, 3, 20],), ([3, 20], [7, 1, 3, 7]), (None, [9])])
def test_pygeodesic_distances(mesh: Mesh, arguments: tuple[Any, ...]) -> None:
    peer = pytest.importorskip("pygeodesic.geodesic")
    theirs, their_best = peer.PyGeodesicAlgorithmExact(*arrays(mesh)).geodesicDistances(*arguments)
    ours, best = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh)).geodesicDistances(*arguments)
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert best.dtype == their_best.dtype
    assert len(best) == len(their_best)
    # Of equally near sources, either is right: the distance from the named one alone is the distance.
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh))
    sources = [0] if not arguments or arguments[0] is None else arguments[0]
    each = np.stack([algorithm.geodesicDistances([s], *arguments[1:])[0] for s in sources])
    np.testing.assert_allclose(each[best, np.arange(len(best))], ours, atol=1e-12)


def test_pygeodesic_stops_at_the_largest_distance() -> None:
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(shapes.strip(5, 1)))
    distance, _ = algorithm.geodesicDistances([0], None, 2.5)
    np.testing.assert_allclose(distance, [0, 1, 2, np.inf, np.inf, np.inf, 1, 2**0.5, 5**0.5, np.inf, np.inf, np.inf])
    assert algorithm.geodesicDistances([0], [5, 1], 2.5)[0].tolist() == [np.inf, 1.0]


def test_pygeodesic_path(mesh: Mesh) -> None:
    peer = pytest.importorskip("pygeodesic.geodesic").PyGeodesicAlgorithmExact(*arrays(mesh))
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh))
    for source, target in pairwise([0, 7, 22, 13, 2]):
        length, path = algorithm.geodesicDistance(source, target)
        their_length, their_path = peer.geodesicDistance(source, target)
        assert length == pytest.approx(their_length, rel=1e-12)
        assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() == pytest.approx(length, rel=1e-12)
        np.testing.assert_allclose(path[[0, -1]], their_path[[0, -1]], atol=1e-12)
    assert algorithm.geodesicDistance(3, 3)[1].tolist() == mesh.V[[3]].tolist()


def test_pygeodesic_raises_instead_of_printing() -> None:
    V, F = arrays(two_parts())
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(V, F)
    with pytest.raises(SourceError, match=r"targetIndex\[0\] = 50 is no vertex"):
        algorithm.geodesicDistance(0, 50)
    with pytest.raises(SourceError, match="no source can be reached"):
        algorithm.geodesicDistance(0, 30)
    with pytest.raises(SourceError, match=r"source_indices\[0\] = -1 is no vertex"):
        algorithm.geodesicDistances([-1])
    with pytest.raises(MeshError, match="must have shape"):
        pygeodesic.PyGeodesicAlgorithmExact(V, F[:, :2])


def test_pygeodesic_reads_its_files(tmp_path: Any) -> None:
    V, F = arrays(shapes.grid(2))
    path = tmp_path / "mesh.txt"
    lines = [f"{len(V)} {len(F)}", *(" ".join(map(repr, row)) for row in [*V.tolist(), *F.tolist()])]
    path.write_text("\n".join(lines))
    points, faces = pygeodesic.read_mesh_from_file(path)
    np.testing.assert_array_equal(points, V)
    np.testing.assert_array_equal(faces, F)
    path.write_text("\n".join(lines[:-1]))
    with pytest.raises(MeshError, match="ends before"):
        pygeodesic.read_mesh_from_file(path)
    path.write_text("solid")
    with pytest.raises(MeshError, match="expected a line"):
        pygeodesic.read_mesh_from_file(path)
