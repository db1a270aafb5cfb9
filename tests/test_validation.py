"""Error norms by hand, and reports that tell good methods from broken ones and survive methods that fail."""

import dataclasses
import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import zoo
from surfaces import twice

import heat_igl
from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, cli, reference, shapes, validate, validation
from heat_igl.heat.steps import NormalizedDivergence
from heat_igl.operators import Operators, operators
from heat_igl.validation import closed_forms, draw_sources, metrics
from heat_igl.validation.report import error_figure


def with_changed_operators(**changes: Callable[[Operators], Any]) -> Callable[[Mesh], HeatMethodSolver]:
    def prepare(mesh: Mesh) -> HeatMethodSolver:
        good = operators(mesh, "intrinsic-delaunay")
        return HeatMethodSolver(dataclasses.replace(good, **{name: change(good) for name, change in changes.items()}))

    return prepare


BROKEN: dict[str, Callable[[Mesh], HeatMethodSolver]] = {
    "t ten times too large": lambda mesh: HeatMethodSolver(mesh, t_coef=10.0),
    "no time": lambda mesh: HeatMethodSolver(mesh, t_coef=0.01, magnitude="unit"),
    "no mass": with_changed_operators(M=lambda good: sp.identity(good.n, format="csc")),
    "sign of the Laplacian": with_changed_operators(L=lambda good: -good.L),
}


@pytest.mark.parametrize(("mesh", "percent"), [(shapes.grid(40), 3.0), (shapes.disk(20), 2.3)], ids=["grid", "disk"])
def test_threshold_catches_broken_heat_steps(mesh, percent):
    # Heat is at 1.8 % on the grid and 2.1 % on the disk, the best of the broken ones at 4.7 and 2.5 %.
    report = validate(mesh, draw_sources(mesh, 3), ["heat", *BROKEN.items()])
    assert [row.method for row in report.exceeding(percent)] == list(BROKEN)
    assert [row.method for row in report.exceeding(0.5)] == ["heat", *BROKEN]


def test_threshold_catches_a_field_that_points_to_the_source(monkeypatch):
    # Not flat: there a wrong answer is raised to straight lines, which are right.
    mesh, right = shapes.icosphere(3), NormalizedDivergence.divergence
    assert not validate(mesh, 0, ["heat"]).exceeding(3.5)
    monkeypatch.setattr(NormalizedDivergence, "divergence", lambda self, u: -right(self, u))
    assert validate(mesh, 0, ["heat"]).exceeding(3.5)


@pytest.mark.usefixtures("in_this_process")
def test_report_on_the_cow(cow):
    steps = []
    methods = ("heat", "meshlab", "meshlab_heat", "igl", "potpourri3d", "exact")
    report = validate(cow, [[5], [1000], [2000]], methods, name="cow", progress=lambda *step: steps.append(step))
    assert [row.method for row in report.rows] == list(methods)
    by_name = {row.method: row for row in report.rows}
    for row in report.rows:
        assert row.failure is None
        assert row.errors.n_compared == 3 * (cow.n_vertices - 1)
        assert row.errors.median <= row.errors.percentile_95 <= row.errors.maximum
        assert row.precompute_seconds >= 0
        assert row.solve_seconds > 0
    exact = by_name["exact"]
    assert exact.errors.maximum == 0
    assert (exact.bounds.n_below, exact.bounds.n_above) == (0, 0)
    assert exact.bounds.largest_above < 1e-12
    assert exact.asymmetry < 1e-12
    assert exact.triangle_excess < 1e-12
    assert 0 < by_name["meshlab"].errors.mean < by_name["heat"].errors.mean < by_name["igl"].errors.mean
    assert by_name["heat"].parameters["t"] > 0
    assert by_name["exact"].parameters == {"solver": "windows"}
    # One step per distance: three of the reference, three of each other method; then the end.
    assert [done for _, done, _ in steps] == [*range(18), 21]
    assert {total for _, _, total in steps} == {21}
    assert steps[0][0] == "exact"
    assert steps[-1] == ("done", 21, 21)


@pytest.mark.usefixtures("in_this_process")
def test_report_in_every_format():
    mesh = shapes.icosphere(3)
    report = validate(mesh, [[5], [7]], ["heat", "meshlab"], name="ball")
    again = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert again["sources"] == [[5], [7]]
    assert again["n_vertices"] == mesh.n_vertices
    errors = report.rows[0].errors
    assert again["rows"][0]["errors"]["mean"] == errors.mean
    lines = report.to_markdown().splitlines()
    assert lines[0].startswith("**ball**: 642 vertices, 1280 faces, 2 sets of sources, errors against exact")
    assert len({line.count("|") for line in lines[2:]}) == 1
    assert f"| heat | {100 * errors.mean:.3g} |" in lines[4]
    assert len(lines) == 6
    figure = report.plot(case=1)
    assert len(figure.axes) == 2 * 2 + 1  # a surface and a scatter for each method, and a colour bar for all


def test_the_figure_shows_the_surface_upright_and_where_the_errors_are():
    pytest.importorskip("matplotlib")
    from matplotlib import colormaps

    sphere = shapes.icosphere(4)
    mesh = Mesh(sphere.V * [1, 3, 1], sphere.F)  # three times as tall, y upwards
    truth = 1 + mesh.V[:, 1] - mesh.V[:, 1].min()
    source = int(np.argmin(truth))
    truth[source] = 0
    # An error of 10 % in the upper half and none in the lower.
    figure = error_figure("tall", mesh, truth, {"method": truth * np.where(mesh.V[:, 1] > 0, 1.1, 1.0)})
    image = np.asarray(figure.axes[0].images[0].get_array())
    row, column = np.nonzero(image[..., 3] > 0.5)
    assert np.ptp(row) == pytest.approx(3 * np.ptp(column), rel=0.1)
    dark, light = (np.array(colormaps["viridis"](end)[:3]) for end in (0.0, 1.0))
    top, bottom = (image[row.min() + round(share * np.ptp(row)), int(np.median(column)), :3] for share in (0.3, 0.7))
    # Shading makes colours darker and leaves the hue.
    for found, colour, other in ((top, light, dark), (bottom, dark, light)):
        cosine = [found @ each / np.linalg.norm(found) / np.linalg.norm(each) for each in (colour, other)]
        assert cosine[0] > 0.99 > 0.9 > cosine[1]


def test_infinite_errors_reach_json_as_text():
    class Lost:
        def __init__(self, mesh: Mesh) -> None:
            self.distance = lambda _: np.full(mesh.n_vertices, np.nan)

    report = validate(shapes.grid(4), 0, [("lost", Lost)])
    assert json.loads(json.dumps(report.to_dict(), allow_nan=False))["rows"][0]["errors"]["mean"] == "inf"
    assert report.exceeding(1e6) == report.rows


def test_a_method_that_fails_is_a_row_that_says_why(monkeypatch):
    monkeypatch.setattr(reference.solvers, "find_spec", lambda name: None if name == "pymeshlab" else object())
    mesh = shapes.grid(5)
    steps = []
    report = validate(mesh, [[0], [7]], ["meshlab", "heat"], progress=lambda *step: steps.append(step[1]))
    failed, fine = report.rows
    assert failed.failure == (
        "the reference meshlab needs pymeshlab: pip install pymeshlab (or install heat-igl with its extra 'validate')"
    )
    assert fine.failure is None
    assert report.exceeding(50) == (failed,)
    assert "meshlab" not in report.distances
    assert f"- meshlab: {failed.failure}" in report.to_markdown()
    assert steps == [0, 1, 2, 4, 5, 6]
    assert report.plot().axes


@pytest.mark.parametrize("name", ["voxel blob", "pinched", "dust"])
def test_no_reference_brings_the_process_down(name):
    mesh = zoo(name)
    report = validate(mesh, draw_sources(mesh, 1), validation.METHODS, reference=None)
    assert [row.method for row in report.rows] == list(validation.METHODS)
    for row in report.rows:
        assert (row.failure is None) == (row.method in report.distances)
    failed = {row.method: row.failure or "" for row in report.rows}
    assert not failed["exact"]
    assert not failed["meshlab"]


def test_warnings_about_accuracy_are_notes_and_others_pass():
    def that_says(words: str, category: type[Warning]) -> type[HeatMethodSolver]:
        class Saying(HeatMethodSolver):
            def distance(self, sources: Any) -> Any:
                warnings.warn(words, category, stacklevel=1)
                return super().distance(sources)

        return Saying

    mesh = shapes.grid(5)
    report = validate(mesh, [[0], [7]], [("doubtful", that_says("not so sure", AccuracyWarning)), "heat"])
    assert [row.notes for row in report.rows] == [("not so sure",), ()]
    assert report.to_markdown().endswith("\n\n- doubtful: not so sure\n")
    with pytest.warns(DeprecationWarning, match="ask for less"):
        validate(mesh, 0, [("old", that_says("ask for less", DeprecationWarning))])


TOUCHING = Mesh(  # two tetrahedra's surfaces, with one vertex in common
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]],
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 5, 4], [0, 4, 6], [0, 6, 5], [4, 5, 6]],
)


def test_without_a_reference_the_rest_of_the_report_stands(monkeypatch):
    def refusing(*_, **__):
        raise heat_igl.errors.ReferenceSolverError(
            "at 1 vertices connected with the sources two surfaces touch in a point"
        )

    monkeypatch.setattr(reference, "measured", refusing)
    report = validate(TOUCHING, 1, ["heat", "sweep", "exact"])
    assert "two surfaces touch in a point" in report.failure
    assert (report.reference, report.truths) == ("exact", None)
    for row in report.rows[:2]:
        assert row.errors is None
        assert row.failure is None
        assert row.bounds is not None
        assert row.solve_seconds is not None
    assert report.rows[2].failure == report.failure
    text = report.to_markdown()
    assert "no errors, since exact failed" in text
    assert f"- reference exact: {report.failure}" in text
    assert report.to_dict()["reference_failure"] == report.failure
    assert report.exceeding(50) == report.rows
    with pytest.raises(ValueError, match="no errors to draw: at 1 vertices connected with the sources two surfaces"):
        report.plot()
    monkeypatch.undo()
    assert validate(TOUCHING, 1, ["heat"]).failure is None


def test_no_reference():
    report = validate(TOUCHING, 1, ["heat"], reference=None)
    assert report.reference is None
    assert report.rows[0].errors is None
    assert report.rows[0].bounds is not None
    assert report.exceeding(50) == report.rows
    assert "no reference" in report.to_markdown()
    with pytest.raises(ValueError, match="no errors to draw: the report has no reference"):
        report.plot()


def test_references_of_ones_own():
    mesh = shapes.grid(10)
    known = np.stack([closed_forms.plane(mesh, source) for source in (0, 50)])
    by_array = validate(mesh, [[0], [50]], ["heat"], reference=known)
    by_function = validate(mesh, [[0], [50]], ["heat"], reference=closed_forms.plane)
    by_exact = validate(mesh, [[0], [50]], ["heat"])
    assert (by_array.reference, by_function.reference, by_exact.reference) == ("given distances", "plane", "exact")
    assert by_array.rows[0].errors == by_function.rows[0].errors
    assert by_array.rows[0].errors.mean == pytest.approx(by_exact.rows[0].errors.mean, rel=1e-9)
    box = shapes.box(4)
    report = validate(box, 0, ["heat", "exact"], reference=closed_forms.convex_solid)
    assert report.rows[0].errors is not None
    assert "works on triangles" in str(report.rows[1].failure)
    assert report.plot().axes


def test_rows_of_other_domains():
    """Methods of this package take the points of a cloud, not its triangles; lines are right in a solid."""
    P = np.random.default_rng(0).standard_normal((1500, 3))
    cloud = heat_igl.PointCloud(P / np.linalg.norm(P, axis=1, keepdims=True))
    report = validate(cloud, [[0], [9]], ["heat", "exact"], reference=closed_forms.sphere)
    by_heat = HeatMethodSolver(cloud, magnitude="damped")
    assert report.rows[0].parameters["t"] == by_heat.t
    np.testing.assert_array_equal(report.distances["heat"], by_heat.distances([0, 9]))
    errors = [row.errors.mean for row in report.rows if row.errors is not None]
    assert errors[1] < 0.4 * errors[0] < 0.01
    box = shapes.box(6)
    heat, lines = validate(box, [[0], [100, 7]], ["heat", "sweep"], reference=closed_forms.convex_solid).rows
    assert lines.errors.mean < 1e-6 < heat.errors.mean < 0.1


def test_drawn_sources_are_on_the_largest_component_and_repeat_with_the_seed():
    small, large = shapes.grid(2), shapes.grid(6)
    mesh = Mesh(np.vstack([small.V, large.V + 5, [[9, 9, 9]]]), np.vstack([small.F, large.F + small.n_vertices]))
    drawn = draw_sources(mesh, 10, seed=4)
    assert drawn == draw_sources(mesh, 10, seed=4) != draw_sources(mesh, 10, seed=5)
    assert len({vertex for (vertex,) in drawn}) == 10
    assert all(9 <= vertex < 9 + large.n_vertices for (vertex,) in drawn)


# --- heat-igl validate -----------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    heat_igl.write_mesh("disk.off", shapes.disk(8))
    return tmp_path


@pytest.mark.usefixtures("in_this_process")
def test_command_prints_and_writes_the_report(folder, capsys):
    written = {"report.json", "errors.png"}
    before = {path.name for path in folder.iterdir()}
    arguments = "validate disk.off --sources 2 --seed 7 --methods heat,meshlab --json report.json --picture errors.png"
    assert cli.run([*arguments.split(), "--fail-above", "20"]) == 0
    printed = capsys.readouterr()
    assert not printed.err
    mesh = heat_igl.read_mesh("disk.off")
    report = validate(mesh, draw_sources(mesh, 2, 7), ["heat", "meshlab"], name="disk")
    found = json.loads(Path("report.json").read_text())
    assert found["sources"] == report.to_dict()["sources"]
    assert [row["errors"] for row in found["rows"]] == [row["errors"] for row in report.to_dict()["rows"]]
    # Up to the times and memory at the end, and the eikonal residual, that is all of the line.
    assert printed.out.splitlines()[4].split("|")[:12] == report.to_markdown().splitlines()[4].split("|")[:12]
    assert Path("errors.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in folder.iterdir()} == before | written


# --- Error norms on cases that can be worked out by hand, and bounds that a true distance keeps and a wrong one break


def test_relative_error_entry_by_entry():
    error = metrics.relative_error([0, 1, 2, np.inf, 7, np.nan], [0, 2, 2, 3, np.inf, 4])
    np.testing.assert_array_equal(error, [np.nan, 0.5, 0, np.inf, np.nan, np.inf])


def test_a_distance_too_long_by_one_percent():
    mesh = shapes.grid(8)
    sources = [0, 40]
    truths = np.stack([closed_forms.plane(mesh, source) for source in sources])
    found = metrics.error_summary(mesh, 1.01 * truths, truths, sources)
    for value in (found.mean, found.median, found.percentile_95, found.maximum, found.near_field, found.l_infinity):
        assert value == pytest.approx(0.01)
    # Over the unit square, the mean distance from a corner is (sqrt 2 + asinh 1) / 3 and from the middle half of
    # that; their mean squares are 2/3 and 1/6. Lumping on 8 by 8 cells is within 2 %.
    corner = (np.sqrt(2) + np.arcsinh(1)) / 3
    assert found.l1 == pytest.approx(0.01 * np.mean([corner / np.sqrt(2), (corner / 2) / np.sqrt(0.5)]), rel=0.02)
    assert found.l2 == pytest.approx(0.01 * np.sqrt(np.mean([1 / 3, 1 / 3])), rel=0.02)
    assert found.n_compared == 2 * (mesh.n_vertices - 1)
    assert found.n_wrong_reach == 0


def test_norms_do_not_depend_on_the_unit():
    mesh = shapes.grid(6)
    truth = closed_forms.plane(mesh, 3)[None]
    noisy = truth + 0.01 * np.random.default_rng(0).uniform(size=truth.shape)
    one = metrics.error_summary(mesh, noisy, truth, [3])
    thousand = metrics.error_summary(Mesh(mesh.V * 1e3, mesh.F), noisy * 1e3, truth * 1e3, [3])
    for name in ("mean", "median", "percentile_95", "maximum", "l1", "l2", "l_infinity", "near_field"):
        assert getattr(thousand, name) == pytest.approx(getattr(one, name), rel=1e-12)
        assert getattr(one, name) > 0


def test_area_counts_and_the_number_of_vertices_does_not():
    # A fine and a coarse half: all error on the fine half of the vertices is on half of the area only.
    x = np.concatenate([np.linspace(0, 1, 21), [2.0]])
    V = np.array([[a, b, 0] for a in x for b in (0.0, 1.0)])
    F = [t for i in range(21) for t in ([2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 2, 2 * i + 3, 2 * i + 1])]
    mesh = Mesh(V, F)
    truth = np.ones(mesh.n_vertices)
    distance = np.where(V[:, 0] < 1, 2.0, 1.0)
    found = metrics.error_summary(mesh, distance[None], truth[None], [0])
    assert found.l1 == pytest.approx(0.5, abs=0.03)
    assert found.mean == pytest.approx(40 / 44)


def test_near_field_is_the_one_ring():
    mesh = shapes.disk(4)
    truth = closed_forms.plane(mesh, 0)
    distance = truth.copy()
    distance[1:7] *= 1.2  # the first ring of the disk
    assert metrics.error_summary(mesh, distance[None], truth[None], [0]).near_field == pytest.approx(0.2)
    distance = truth.copy()
    distance[7:] *= 1.2
    assert metrics.error_summary(mesh, distance[None], truth[None], [0]).near_field == 0


def test_wrong_reach_is_counted():
    one = shapes.grid(2)
    mesh = twice(one)
    truth = closed_forms.plane(one, 0)
    truth = np.concatenate([truth, np.full(9, np.inf)])
    plausible = np.where(np.isinf(truth), 1.0, truth)
    assert metrics.error_summary(mesh, plausible[None], truth[None], [0]).n_wrong_reach == 9
    broken = np.where(np.arange(18) == 5, np.nan, truth)
    found = metrics.error_summary(mesh, broken[None], truth[None], [0])
    assert found.n_wrong_reach == 1
    assert found.mean == found.maximum == found.l1 == found.l_infinity == np.inf
    assert found.median == 0


def test_eikonal_residual_of_a_linear_function_is_its_slope_less_one():
    mesh = shapes.grid(5)
    assert metrics.eikonal_residual(mesh, mesh.V[:, 0]).max() < 1e-12
    np.testing.assert_allclose(metrics.eikonal_residual(mesh, 3 * mesh.V[:, 0]), 2)
    box = shapes.box(2)
    np.testing.assert_allclose(metrics.eikonal_residual(box, box.V @ [0.6, 0, 0.8]), 0, atol=1e-12)
    part = mesh.V[:, 0].copy()
    part[0] = np.inf
    assert np.isnan(metrics.eikonal_residual(mesh, part)).sum() == (mesh.F == 0).any(axis=1).sum()


def test_true_distances_are_symmetric_and_keep_the_triangle_inequality():
    mesh = shapes.icosphere(2)
    sources = [0, 50, 100]
    distances = np.stack([closed_forms.sphere(mesh, source) for source in sources])
    assert np.abs(metrics.asymmetry(distances, sources)).max() < 1e-12
    assert metrics.triangle_violations(distances, sources).count == 0
    # Squared distances break it: (1 + 1)^2 > 1^2 + 1^2.
    squared = metrics.triangle_violations(distances**2, sources)
    assert squared.count > 0
    assert 0 < squared.fraction <= 1
    assert 0 < squared.largest <= 0.5 + 1e-12
    distances[0] *= 1.1
    found = metrics.asymmetry(distances, sources)
    assert found[0, 1] == pytest.approx(0.1 * distances[1, 0])
    np.testing.assert_array_equal(found, -found.T)


def test_pairs_in_different_components_are_left_out():
    apart = np.array([[0.0, 1, np.inf], [np.inf, np.inf, 0]])
    assert not metrics.asymmetry(apart, [0, 2]).any()
    assert metrics.triangle_violations(apart, [0, 2]) == metrics.TriangleViolations(0, 0.0, 0.0)
    together = np.array([[0.0, 1, np.inf], [1, 0, np.inf]])
    assert metrics.triangle_violations(together, [0, 1]) == metrics.TriangleViolations(0, 0.0, 0.0)


@pytest.mark.parametrize("mesh", [shapes.icosphere(2), shapes.box(3)], ids=["triangles", "tetrahedra"])
def test_bounds_hold_for_a_true_distance_and_break_for_a_scaled_one(mesh):
    lines = np.linalg.norm(mesh.V - mesh.V[5], axis=1)
    truth = lines if mesh.is_tetrahedral else closed_forms.sphere(mesh, 5)
    held = metrics.bound_violations(mesh, truth, 5)
    assert (held.n_below, held.largest_below) == (0, 0)
    short = metrics.bound_violations(mesh, 0.8 * lines, 5)
    assert short.n_below == mesh.n_vertices - 1
    assert short.largest_below == pytest.approx(0.2)
    long = metrics.bound_violations(mesh, 2 * truth, 5)
    assert long.n_above > mesh.n_vertices / 2
    assert 0.3 < long.largest_above < 1.01  # an arc is longer than the edges below it by h^2 / 24
    assert metrics.bound_violations(mesh, np.full(mesh.n_vertices, np.inf), 5).n_above == 0
