"""Rows for kinds of domains: every kind has some, right answers pass, wrong ones fail and are named."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

import heat_igl
from heat_igl import HeatMethodSolver, cli
from heat_igl.validation import domains
from heat_igl.validation.domains import CASES, DOMAINS, body_cases, surface_cases
from heat_igl.validation.domains.case import METHODS


def test_every_kind_of_domain_passes():
    report = heat_igl.validate_domains(seed=5)
    assert [f"{row.case}, {row.method}: {row.mean}" for row in report.failed] == []
    assert {row.domain for row in report.rows} == set(DOMAINS)
    assert len(report.rows) == sum(len(case.bounds) for case in CASES)
    for row in report.rows:
        assert row.mean is not None
        assert row.maximum is not None
        assert row.shortest is not None
        assert 0 <= row.mean <= row.maximum
        assert 0 <= row.shortest <= row.maximum + 1e-15
    # No value in a body is below the straight line by more than one percent.
    bodies = [row for row in report.rows if row.domain == "tetrahedra"]
    assert all(row.shortest is not None and row.shortest < 0.01 for row in bodies)


IN_SPACE = [c for c in CASES if c.domain not in ("metric", "point cloud") and "tensor" not in c.name]


@pytest.mark.parametrize("case", IN_SPACE, ids=lambda case: case.name)
def test_exact_distances_obey_the_triangle_inequality_and_edges(case):
    """From one source, exact distance differs over an edge by no more than the length of the edge in space."""
    problem = case.problem(np.random.default_rng(1))
    mesh = heat_igl.mesh.as_simplices(problem.domain)
    i, j = mesh.edges.T
    assert (np.abs(problem.exact[i] - problem.exact[j]) <= np.linalg.norm(mesh.V[i] - mesh.V[j], axis=1) + 1e-12).all()
    assert (problem.exact[np.atleast_1d(np.arange(mesh.n_vertices)[problem.sources])] == 0).all()


def test_refracted_time_obeys_snells_law():
    """The ray at an angle of incidence a leaves at b with sin a / sin b the ratio of the speeds."""
    left, right = 1.0, 0.4
    incidence = np.radians([0.0, 20, 40, 60])
    refracted = np.arcsin(np.sin(incidence) * right / left)
    end = np.stack([0.5 + 0.3 * np.cos(refracted), 0.1 + 0.2 * np.tan(incidence) + 0.3 * np.sin(refracted)], axis=1)
    V = np.concatenate([[[0.3, 0.1]], end])
    time = surface_cases.by_fermat(np.column_stack([V, np.zeros(5)]), 0, left, right)
    np.testing.assert_allclose(time[1:], 0.2 / np.cos(incidence) / left + 0.3 / right, rtol=1e-6)


def test_a_wall_is_passed_at_both_corners():
    V = np.array([[0.0, 0, 0], [3.0, 1, 0], [5.0, 9, 0], [5.0, 4, 0], [5.0, 4, 3], [4.5, 6, 0]]) - [7, 8, 9]
    to_end = math.hypot(4, 6)
    expected = [0, math.hypot(3, 1), math.hypot(5, 9), to_end + 1 + 2, math.hypot(to_end + 3, 3), to_end + 0.5]
    np.testing.assert_allclose(body_cases._around_the_wall(V, 0, -3.0, -2.0), expected)


@pytest.mark.parametrize(
    "wrong", [lambda d: 1.08 * d, lambda d: 0.92 * d, lambda d: np.where(d > 0.5 * d.max(), np.inf, d)]
)
def test_wrong_distances_do_not_pass(wrong: Any, monkeypatch: pytest.MonkeyPatch):
    for solver in (HeatMethodSolver, heat_igl.GeodesicSolver):
        right = solver.distance
        monkeypatch.setattr(solver, "distance", lambda self, sources, right=right: wrong(right(self, sources)))
    report = heat_igl.validate_domains(["polygons", "tetrahedra"])
    assert report.failed == report.rows
    assert report.to_markdown().startswith(f"0 of {len(report.rows)} rows passed")


def test_a_method_that_fails_is_a_row_with_the_reason(monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: Any) -> HeatMethodSolver:
        raise heat_igl.MeshError("F[3] has no area")

    monkeypatch.setattr(domains, "solver_for", refuse)
    report = heat_igl.validate_domains(["image"])
    assert {row.failure for row in report.failed} == {"F[3] has no area"}
    assert len(report.failed) == len(report.rows)
    assert "- pixels of 1 by 2.5, heat: F[3] has no area" in report.to_markdown()


def test_the_report_in_every_format(capsys: pytest.CaptureFixture[str]):
    steps: list[tuple[str, int, int]] = []
    report = heat_igl.validate_domains(["polygons"], progress=lambda *step: steps.append(step))
    assert [done for _, done, _ in steps] == [*range(len(report.rows)), len(report.rows)]
    again = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert again["rows"][0]["mean"] == report.rows[0].mean
    assert again["rows"][0]["passed"] is True
    lines = report.to_markdown().splitlines()
    table = lines[2 : 4 + len(report.rows)]
    assert len({line.count("|") for line in table}) == 1
    assert lines[len(table) + 2] == ""
    assert "default, GeodesicSolver without options" in lines[len(table) + 3]
    assert cli.run(["validate-domains", "--domain", "polygons"]) == 0
    assert capsys.readouterr().out == report.to_markdown()
    assert cli.run(["validate-domains", "--domain=polygons", "--json=-"]) == 0
    assert [row["mean"] for row in json.loads(capsys.readouterr().out)["rows"]] == [row.mean for row in report.rows]


def test_a_row_that_does_not_pass_sets_the_status(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(METHODS, "default", "heat")  # type: ignore[arg-type]
    assert cli.run(["validate-domains", "--domain", "tetrahedra"]) == 1
    shown = capsys.readouterr()
    assert "| 1 | NO |" in shown.out
    assert "rows did not pass" in shown.err
    assert "cube of even tetrahedra, default" in shown.err


@pytest.mark.parametrize("asked", [["cloud"], "cloud", 3])
def test_unknown_kinds_are_refused(asked):
    with pytest.raises(ValueError, match=r"domains must be among 'point cloud', 'metric', .* not"):
        heat_igl.validate_domains(asked)
    with pytest.raises(ValueError, match="domains is empty: choose among 'point cloud', 'metric'"):
        heat_igl.validate_domains([])
    assert heat_igl.validate_domains("image").rows
