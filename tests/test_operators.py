"""Identities that hold to rounding, on every kind of domain."""

import igl
import numpy as np
import pytest
from conftest import perturbed
from scipy.spatial import Delaunay
from surfaces import bent_pages, pressed

from heat_igl import Mesh, MeshError, PointCloud, shapes, speed_operators
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.operators import Operators, TriangleElements, intrinsic_operators, operators, point_cloud_operators
from heat_igl.operators.triangles import cotangent_laplacian

DOMAINS = {
    "own triangles": lambda: operators(pressed(0.2), "cotan"),
    "intrinsic Delaunay": lambda: operators(pressed(0.2)),
    "with boundary": lambda: operators(perturbed(shapes.disk(8), 0.3)),
    "tetrahedra": lambda: operators(perturbed(shapes.box(4), 0.2)),
    "flat torus": lambda: intrinsic_operators(shapes.flat_torus(9)),
    "unreferenced vertices": lambda: operators(
        Mesh(np.vstack([[[9, 9, 9]], pressed(0.2).V, [[8, 8, 8]]]), pressed(0.2).F + 1)
    ),
    "edges of three faces": lambda: operators(bent_pages()),
    "points": lambda: point_cloud_operators(PointCloud(shapes.icosphere(2).V)),
    "speeds on triangles": lambda: with_speeds(perturbed(shapes.torus(12, 30))),
    "speeds in tetrahedra": lambda: with_speeds(perturbed(shapes.box(4))),
}


def with_speeds(mesh: Mesh) -> Operators:
    return speed_operators(mesh, np.random.default_rng(0).choice([0.5, 1, 3], mesh.n_faces))


@pytest.fixture(params=DOMAINS, ids=str, scope="module")
def domain(request):
    return DOMAINS[request.param]()


def test_divergence_of_gradient_is_the_laplacian(domain):
    assert abs(domain.D @ domain.G - domain.L).max() <= 1e-12 * abs(domain.L).max()


def test_divergence_is_the_negative_adjoint_of_the_gradient(domain):
    rng = np.random.default_rng(0)
    u, X = rng.standard_normal(domain.n), rng.standard_normal(domain.G.shape[0])
    W = np.tile(domain.weights, domain.dimension)
    inner = (domain.G @ u) @ (W * X)
    assert -(u @ (domain.D @ X)) == pytest.approx(inner, rel=1e-12, abs=1e-12 * np.abs(W * X).sum())


def test_constants_have_no_laplacian(domain):
    assert np.abs(domain.L @ np.ones(domain.n)).max() <= 1e-12 * abs(domain.L).max()


def test_laplacian_is_symmetric_and_negative_semidefinite(domain):
    assert abs(domain.L - domain.L.T).max() <= 1e-12 * abs(domain.L).max()
    largest = np.linalg.eigvalsh(domain.L.toarray())[-1]
    assert largest <= 1e-10 * abs(domain.L).max()


def test_mass_is_the_area(domain):
    assert domain.M.sum() == pytest.approx(domain.weights.sum(), rel=1e-12)
    assert (domain.M.diagonal()[domain.referenced] > 0).all()
    assert (domain.M.diagonal()[~domain.referenced] == 0).all()


def test_gradient_of_a_linear_function_in_space_is_exact():
    slope = np.array([1.0, -2.0, 3.0])
    mesh = perturbed(shapes.box(3), 0.2)
    gradient = (operators(mesh).G @ (mesh.V @ slope)).reshape(3, -1)
    np.testing.assert_allclose(gradient, np.tile(slope[:, None], mesh.n_faces), rtol=0, atol=1e-12)

    surface = pressed(0.2)
    gradient = (operators(surface, "cotan").G @ (surface.V @ slope)).reshape(3, -1).T
    corner = surface.V[surface.F]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangential = slope - (normal @ slope)[:, None] * normal
    np.testing.assert_allclose(gradient, tangential, rtol=0, atol=1e-11)


def test_intrinsic_gradient_of_a_linear_function_is_exact():
    """On a planar mesh a linear function has the same slope in each flipped triangle, seen from its frame."""
    mesh = perturbed(shapes.disk(8), 0.4, seed=1)
    mesh = Mesh(mesh.V * [1.0, 0.3, 0.0], mesh.F)
    triangulation = intrinsic_delaunay(intrinsic_triangulation(mesh))
    assert triangulation.n_flips > 20
    slope = np.array([2.0, -1.0])
    gradient = (TriangleElements(triangulation).matrix() @ (mesh.V[:, :2] @ slope)).reshape(2, -1)
    corner = mesh.V[triangulation.F][:, :, :2]
    along = corner[:, 1] - corner[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    across *= np.sign(np.einsum("fk,fk->f", across, corner[:, 2] - corner[:, 0]))[:, None]
    np.testing.assert_allclose(gradient, [along @ slope, across @ slope], rtol=0, atol=1e-11)


def test_delaunay_mesh_keeps_its_own_operators():
    mesh = shapes.icosphere(2)
    by_default, plain = operators(mesh), operators(mesh, "cotan")
    assert by_default.dimension == 3
    assert (by_default.L != plain.L).nnz == 0


def test_degenerate_triangles_are_mollified_and_stay_finite():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0]], [[0, 1, 3], [1, 2, 3], [0, 2, 1], [2, 0, 4]])
    for laplacian in ("intrinsic-delaunay", "cotan"):
        domain = operators(mesh, laplacian)
        assert domain.surface.triangulation.lengthening > 0
        assert np.isfinite(domain.L.data).all()
        assert abs(domain.D @ domain.G - domain.L).max() <= 1e-10 * abs(domain.L).max()


@pytest.mark.parametrize("laplacian", ["cotan", "intrinsic-delaunay"])
def test_laplacian_of_triangles_has_the_bits_of_libigls(laplacian):
    mesh = pressed(0.2)
    domain = operators(mesh, laplacian)
    triangulation = domain.surface.triangulation
    expected = (
        igl.cotmatrix(mesh.V, mesh.F)
        if laplacian == "cotan"
        else igl.cotmatrix_intrinsic(triangulation.l, triangulation.F)
    )
    assert np.array_equal(domain.L.indptr, expected.indptr)
    assert np.array_equal(domain.L.indices, expected.indices)
    assert np.array_equal(domain.L.data, expected.data)


def test_laplacian_of_glued_triangles_sums_what_belongs_together():
    rng = np.random.default_rng(5)
    for _ in range(100):
        n = int(rng.integers(2, 20))
        F = rng.integers(0, n, (int(rng.integers(1, 25)), 3))
        weight = rng.normal(size=F.shape)
        expected = np.zeros((n, n))
        # An edge may join a vertex with itself: what it adds off the diagonal it takes from the diagonal.
        for corner in range(3):
            i, j, w = F[:, (corner + 1) % 3], F[:, (corner + 2) % 3], weight[:, corner]
            for row, column, sign in ((i, j, 1), (j, i, 1), (i, i, -1), (j, j, -1)):
                np.add.at(expected, (row, column), sign * w)
        L = cotangent_laplacian(weight, F, n)
        np.testing.assert_allclose(L.toarray(), expected, atol=1e-13)
        assert L.has_canonical_format
        one, other = F.ravel().tolist(), np.roll(F, 1, axis=1).ravel().tolist()
        pattern = {*zip(one, other, strict=True), *zip(other, one, strict=True), *zip(one, one, strict=True)}
        assert {*zip(*(ends.tolist() for ends in L.nonzero()), strict=True)} <= pattern
        assert L.nnz == len(pattern)


def test_tetrahedral_laplacian_is_libigls_and_survives_flat_tetrahedra():
    good = perturbed(shapes.box(4), 0.2)
    expected = igl.cotmatrix(good.V, good.F)
    assert abs(operators(good).L - expected).max() <= 1e-12 * abs(expected).max()
    flat = Mesh(good.V * [1, 1, 1e-5], good.F)
    domain = operators(flat)
    assert abs(domain.D @ domain.G - domain.L).max() <= 1e-12 * abs(domain.L).max()
    scattered = np.random.default_rng(0).random((400, 3))
    F = Delaunay(scattered).simplices
    slivers = Mesh(scattered, F[np.abs(np.linalg.det(scattered[F[:, 1:]] - scattered[F[:, :1]])) > 1e-9])
    domain = operators(slivers)
    assert abs(domain.D @ domain.G - domain.L).max() <= 1e-12 * abs(domain.L).max()
    # A linear function is harmonic inside.
    x = slivers.V @ [1.0, 2.0, 3.0]
    residual = abs(domain.L @ (x - x.mean())) / (abs(domain.L) @ abs(x - x.mean()))
    assert residual[~domain.boundary].max() < 1e-13


def test_flat_tetrahedron_is_refused():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1]], [[0, 1, 2, 4], [0, 1, 2, 3]])
    with pytest.raises(MeshError, match=r"F\[1\] = \[0, 1, 2, 3\] has no volume \(1 of 2"):
        operators(mesh)
    assert operators(Mesh(mesh.V, mesh.F[:1])).n == 5


@pytest.mark.parametrize("laplacian", ["intrinsic-delaunay", "cotan"])
@pytest.mark.parametrize(
    "mesh",
    [shapes.icosphere(2), pressed(0.2), shapes.box(3), Mesh(shapes.disk(4).V, [*shapes.disk(4).F, [0, 1, 30]])],
    ids=["Delaunay", "bad", "tetrahedra", "three faces at an edge"],
)
def test_laplacian_is_handed_out_early(mesh, laplacian):
    """Once, and with the pattern that an order of elimination for the final one needs."""
    early = []
    final = operators(mesh, laplacian, early.append).L
    assert len(early) == 1
    assert np.array_equal(early[0].indptr, final.indptr)
    assert np.array_equal(early[0].indices, final.indices)
