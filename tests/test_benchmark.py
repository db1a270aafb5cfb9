"""The benchmark script measures what it says; how fast anything is, is no test."""

from __future__ import annotations

import importlib.util
import json
import os
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from conftest import load_script

import heat_igl
from heat_igl import shapes


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    return load_script("benchmark")


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
        assert set(own["over potpourri3d"].values()) != {1.0}
        assert own["ratio"] > 0
    result = {
        "environment": benchmark.environment() | {"seed": "0"},
        "timings": rows,
        "accuracy": [{**own, "exact_largest": np.pi}],
        "bandwidth": 1e10,
        "import": {"import heat_igl": 0.5},
    }
    table = benchmark.markdown(result)
    assert f"| sphere 2000 | heat_igl | 2 | {own['precomputation']:.3f} |" in table
    assert "seed 0" in table


def test_a_method_that_dies_is_named(benchmark: ModuleType, tmp_path: Path) -> None:
    child = benchmark.Child("heat_igl", tmp_path / "missing.npz")
    with pytest.raises(RuntimeError, match="heat_igl ended with status 1"):
        child.run()
    child.close()


def test_exponents_are_those_of_a_power_law_on_spheres(benchmark: ModuleType) -> None:
    rows = [
        {"mesh": f"sphere {n}", "n": n, "method": "heat_igl", "precomputation": 3e-6 * n**1.2, "later": 1e-7 * n}
        for n in (10_000, 100_000, 1_000_000)
    ]
    outlier = {"mesh": "bunny 30000", "n": 30_000, "method": "heat_igl", "precomputation": 99.0, "later": 99.0}
    found = benchmark.exponents([*rows, outlier, {**rows[0], "n": 3_000_000}])
    assert found["heat_igl"] == pytest.approx({"precomputation": 1.2, "later": 1.0})
    assert benchmark.exponents(rows[:1]) == {}


def test_floor_and_break_even(benchmark: ModuleType) -> None:
    own = {"mesh": "m", "method": "heat_igl", "precomputation": 2.0, "query": 0.2, "later": 0.1, "factor_bytes": 2e8}
    front = {"mesh": "m", "method": "MeshLab's front", "query": 0.6}
    slower = {"mesh": "m", "method": "pygeodesic", "query": 0.05}
    assert benchmark.floors([own, front], 1e10)[0]["floor"] == pytest.approx(0.04)
    assert benchmark.floors([own, front], 1e10)[0]["over_floor"] == pytest.approx(2.5)
    # 2 + 4 * 0.1 = 2.4 = 4 * 0.6
    assert [row["queries"] for row in benchmark.break_even([own, front, slower])] == [4, None]


def test_tables_are_put_between_their_marks() -> None:
    fill_in = load_script("scaffold").fill_in
    page = "a\n<!-- floor -->\nold\n<!-- /floor -->\nb <!-- timings --><!-- /timings -->\n"
    filled = fill_in(page, {"floor": "new | 1", "elsewhere": "x"})
    assert filled == "a\n<!-- floor -->\nnew | 1\n<!-- /floor -->\nb <!-- timings --><!-- /timings -->\n"
    assert fill_in(filled, {"floor": "new | 1"}) == filled


def test_a_huge_mesh_small(benchmark: ModuleType) -> None:
    pytest.importorskip("rich")
    found = benchmark.huge(2500, None)
    assert found["n"] == 2562
    sphere = heat_igl.shapes.icosphere(4)
    exact = benchmark.great_circles(sphere.V, 0)
    expected = benchmark.errors(heat_igl.HeatMethodSolver(sphere).distance(0), exact)
    assert found["mean_error"] == pytest.approx(expected["mean_error"])
    assert "| icosphere | 2562 |" in benchmark.tables({"timings": [], "huge": found})["huge"]


def test_subdivided_meshes_keep_their_exact_distances(benchmark: ModuleType, tmp_path: Path) -> None:
    cone = heat_igl.shapes.cone(20, 6)
    heat_igl.write_mesh(tmp_path / "cone.off", cone)
    meshes = benchmark.timed_meshes([2000], [tmp_path / "cone.off"], np.random.default_rng(0))
    name, mesh, first = meshes[-1]
    assert name == f"cone {mesh.n_vertices}"
    assert 1600 < mesh.n_vertices < 2500
    np.testing.assert_allclose(mesh.V[: first.n_vertices], cone.V, atol=1e-12)


@pytest.mark.skipif(os.name == "nt", reason="the stand-in for VTP is a shell script")
def test_vertices_that_vtp_merges_get_their_distance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    peers = load_script("peers")
    # VTP counts three places: the fourth vertex is where the second is.
    program = tmp_path / "vtp"
    program.write_text("#!/bin/sh\necho propagation step took 0.5 seconds\nprintf '2\\n%s\\n1e100\\n' $4 > $6\n")
    program.chmod(0o755)
    monkeypatch.setenv(peers.VTP, str(program))
    V = np.array([[1.0, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0, 0]])
    solve, batch, facts = peers.PREPARE["VTP"](V, np.array([[0, 1, 2], [2, 3, 0]]))
    assert solve(3).tolist() == [2, 1, np.inf, 1]  # asked for as number 1
    assert batch is None
    assert facts["query"] == 0.5


def test_the_page_on_peers_has_a_table_for_each_mesh() -> None:
    peers = load_script("peers")
    row = {"mesh": "cow", "n": 9, "precomputation": 0.25, "query": 0.5, "peak_memory": 2e6, "mean_error": 1.0}
    rows = [
        {**row, "method": "heat_igl", "later": 0.125, "max_error": 2.0},
        {**row, "method": "VTP", "later": None, "max_error": None, "peak_memory": None},
        {**row, "method": "heat_igl", "later": 0.125, "max_error": 2.0, "mesh": "bunny"},
    ]
    text = peers.parts({"peers": rows, "environment": {"python": "3"}})["peers"]
    assert text.count("### cow, 9 vertices") == text.count("### bunny, 9 vertices") == 1
    assert "| heat_igl | 0.250 | 0.5000 | 0.1250 | 2 | 1.000 | 2.000 |" in text
    assert "| VTP | - | 0.5000 | - | - | 1.000 | - |" in text


def test_large_meshes_in_processes_of_their_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    large = load_script("large_meshes")
    page = tmp_path / "page.md"
    page.write_text("<!-- large -->\n<!-- /large -->\n")
    assert large.main(["--level", "5", "--output", str(tmp_path), "--docs", str(page)]) == 0
    rows = json.loads((tmp_path / "large.json").read_text())["rows"]
    assert [(row["method"], row["vertices"]) for row in rows] == [("unfold", 10242), ("sweep", 10242)]
    for row in rows:
        assert 0 < row["mean_error"] < row["max_error"] < 0.01
        assert row["peak_memory"] is None or row["peak_memory"] > 1000 * row["vertices"]
    assert "| sweep | 10242 |" in page.read_text()
    assert "exit status -9 | - |" in large.markdown([{"method": "unfold", "failed": "exit status -9"}])
    assert "10242" in capsys.readouterr().out


def test_relative_errors_are_those_of_great_circles() -> None:
    large = load_script("large_meshes")
    V = shapes.icosphere(3).V
    exact = np.arccos(np.clip(V @ V[5], -1, 1))
    assert large.relative_errors(V, 5, exact) == pytest.approx((0, 0), abs=1e-7)
    mean, largest = large.relative_errors(V, 5, 1.01 * exact)
    assert mean == pytest.approx(0.01)
    assert largest == pytest.approx(0.01 * exact.max() / np.pi)
