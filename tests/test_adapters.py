"""Distance as a function of PyTorch and JAX; skipped where they are not installed."""

import importlib.util
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from surfaces import bumpy

from heat_igl import GeodesicSolver, HeatMethodSolver
from heat_igl.errors import MissingExtraError


def adapter(name: str) -> tuple[ModuleType, Any]:
    """A library, and distance as a function of it."""
    library = pytest.importorskip(name)
    return library, importlib.import_module(f"heat_igl.applications.{name}").geodesic_distance


@pytest.mark.parametrize("name", ["torch", "jax"])
def test_what_to_install_is_said(name):
    if importlib.util.find_spec(name) is not None:
        assert importlib.import_module(f"heat_igl.applications.{name}").geodesic_distance
        return
    with pytest.raises(MissingExtraError, match=rf"{name} needs {name}: pip install {name}"):
        importlib.import_module(f"heat_igl.applications.{name}")


class TestTorch:
    def test_gradients_are_those_of_differences(self):
        torch, geodesic_distance = adapter("torch")
        mesh = bumpy(2)
        V = torch.tensor(mesh.V, requires_grad=True)
        assert torch.autograd.gradcheck(
            lambda V: geodesic_distance(V, mesh.F, [0, 70], method="exact"), (V,), eps=1e-6, atol=1e-5, rtol=1e-4
        )

    def test_types_and_solver(self):
        torch, geodesic_distance = adapter("torch")
        mesh = bumpy(2)
        solver = GeodesicSolver(mesh, method="exact")
        expected, pull_back = solver.distance_vjp(3)
        V = torch.tensor(mesh.V, dtype=torch.float32, requires_grad=True)
        distance = geodesic_distance(V, torch.tensor(mesh.F), torch.tensor([3]), solver=solver)
        assert distance.dtype == torch.float32
        distance.sum().backward()
        np.testing.assert_allclose(distance.detach().numpy(), expected, rtol=1e-5)
        np.testing.assert_allclose(V.grad.numpy(), pull_back(np.ones(len(expected))), atol=1e-4)

    def test_what_cannot_be_used(self):
        torch, geodesic_distance = adapter("torch")
        mesh = bumpy(2)
        V = torch.tensor(mesh.V, requires_grad=True)
        with pytest.raises(
            TypeError, match=r"V must hold floating-point numbers to be differentiated, not torch\.int64"
        ):
            geodesic_distance(V.detach().long(), mesh.F, 0)
        with pytest.raises(TypeError, match="V must be a tensor, not ndarray"):
            geodesic_distance(mesh.V, mesh.F, 0)
        with pytest.raises(ValueError, match=r"V is on the device meta, and distance is found on the processor"):
            geodesic_distance(V.to("meta"), mesh.F, 0)
        with pytest.raises(ValueError, match=r"V must have shape \(n, 3\)"):
            geodesic_distance(V[:, :2], mesh.F, 0)
        with pytest.raises(ValueError, match="tolerance cannot be changed"):
            geodesic_distance(V, mesh.F, 0, solver=GeodesicSolver(mesh), tolerance=0.1)
        with pytest.raises(TypeError, match="must be a GeodesicSolver, which has derivatives, not HeatMethodSolver"):
            geodesic_distance(V, mesh.F, 0, solver=HeatMethodSolver(mesh))
        squares = (geodesic_distance(V, mesh.F, 0) ** 2).sum()
        (gradient,) = torch.autograd.grad(squares, V, create_graph=True)
        with pytest.raises(RuntimeError, match="differentiate twice a function that was marked"):
            gradient.sum().backward()


class TestJax:
    def test_gradients_under_jit(self):
        jax, geodesic_distance = adapter("jax")
        mesh = bumpy(2)
        expected, pull_back = GeodesicSolver(mesh, method="exact").distance_vjp(3)

        def loss(V):
            return (geodesic_distance(V, mesh.F, 3, method="exact") ** 2).sum()

        value, gradient = jax.jit(jax.value_and_grad(loss))(mesh.V)
        assert float(value) == pytest.approx((expected**2).sum(), rel=1e-4)
        np.testing.assert_allclose(np.asarray(gradient), pull_back(2 * expected), atol=1e-3)

    def test_what_cannot_be_used(self):
        _, geodesic_distance = adapter("jax")
        mesh = bumpy(2)
        with pytest.raises(TypeError, match="V must hold floating-point numbers to be differentiated, not int"):
            geodesic_distance(mesh.V.astype(int), mesh.F, 0)
        with pytest.raises(ValueError, match=r"V must have shape \(n, 3\)"):
            geodesic_distance(mesh.V[0], mesh.F, 0)
