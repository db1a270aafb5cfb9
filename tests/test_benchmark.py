"""The benchmark script measures what it says; how fast anything is, is no test."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import heat_igl

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "benchmark.py"


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("benchmark", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_noisy_spheres_are_closed_outward_and_seeded(benchmark: ModuleType) -> None:
    mesh = benchmark.noisy_sphere(500, np.random.default_rng(3))
    report = mesh.report()
    assert (report.n_vertices, report.euler_characteristic, report.n_boundary_loops) == (500, 2, 0)
    assert report.smallest_angle > 5
    corners = mesh.V[mesh.F]
    assert (np.linalg.det(corners) > 0).all()
    np.testing.assert_array_equal(mesh.V, benchmark.noisy_sphere(500, np.random.default_rng(3)).V)


def test_errors_are_percentages(benchmark: ModuleType) -> None:
    found = benchmark.errors(np.array([0.0, 1.01, 2.0, 4.08]), np.array([0.0, 1.0, 2.0, 4.0]))
    assert found == pytest.approx({"mean_error": 1.0, "max_error": 2.0})
    assert benchmark.errors(np.zeros(2), None) == {"mean_error": None, "max_error": None}


def test_measured_rows_and_their_table(benchmark: ModuleType) -> None:
    methods = ["heat_igl"]
    if importlib.util.find_spec("potpourri3d") is not None:
        methods.append("potpourri3d")
    mesh = benchmark.noisy_sphere(2000, np.random.default_rng(0))
    exact = benchmark.great_circles(mesh.V, 7)
    rows = benchmark.measure("sphere 2000", mesh, methods, 2, np.array([7, 8, 9]), exact)
    assert [row["method"] for row in rows] == methods
    own = rows[0]
    distance = heat_igl.HeatMethodSolver(mesh).distance(7)
    assert own["mean_error"] == benchmark.errors(distance, exact)["mean_error"]
    assert 0 < own["query"] < own["precomputation"]
    if len(rows) == 2:
        assert rows[1]["ratio"] == 1
        assert own["ratio"] > 0
    result = {
        "environment": benchmark.environment() | {"seed": "0"},
        "timings": rows,
        "accuracy": [{**own, "exact_largest": np.pi}],
    }
    table = benchmark.markdown(result)
    assert f"| sphere 2000 | heat_igl | {own['precomputation']:.3f} |" in table
    assert "seed 0" in table


def test_a_method_that_dies_is_named(benchmark: ModuleType, tmp_path: Path) -> None:
    child = benchmark.Child("heat_igl", tmp_path / "missing.npz")
    with pytest.raises(RuntimeError, match="heat_igl ended with status 1"):
        child.run()
    child.close()
