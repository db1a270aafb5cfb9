"""Isolines: where they run, what they enclose, and the files that they are written to."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import flat_perturbed, zoo
from surfaces import assert_connected, nearest_vertex, twice

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, MeshError, isolines, shapes, write_curves
from heat_igl.curves import offset_curves, sublevel_areas
from heat_igl.geodesic import SolverChoice

SQUARE = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def length(mesh, curves):
    return sum(curve.lengths(mesh).sum() for curve in curves)


def signed_area(mesh, curve):
    x, y, _ = curve.positions(mesh).T
    return (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2


@pytest.mark.parametrize("method", ["heat", "exact"])
def test_isolines_of_distance_on_a_plane_are_circles(method):
    mesh = flat_perturbed(shapes.grid(160))  # 51 200 triangles
    source = nearest_vertex(mesh, [0.5, 0.5, 0])
    radii = np.array([0.1, 0.25, 0.4])
    phi = SolverChoice(method).on(mesh).distance(source)
    for r, curves, area in zip(radii, isolines(mesh, phi, radii), sublevel_areas(mesh, phi, radii), strict=True):
        assert [curve.is_closed for curve in curves] == [True]
        assert_connected(mesh, curves[0])
        assert length(mesh, curves) == pytest.approx(2 * np.pi * r, rel=0.01)
        assert area == pytest.approx(np.pi * r**2, rel=0.01)
        # The polygon, with the low values on its left.
        assert signed_area(mesh, curves[0]) == pytest.approx(area, rel=1e-12)


def test_a_circle_that_leaves_the_plane_loses_nothing():
    mesh = shapes.grid(100)
    phi = np.hypot(mesh.V[:, 0], mesh.V[:, 1])
    inside, across = isolines(mesh, phi, [0.5, 1.2])
    assert [curve.is_closed for curve in inside] == [False]
    assert length(mesh, inside) == pytest.approx(np.pi / 4, rel=1e-3)
    # Past the corners of the square: two arcs are cut off, and one is left.
    angle = np.pi / 2 - 2 * np.arccos(1 / 1.2)
    assert len(across) == 1
    assert length(mesh, across) == pytest.approx(1.2 * angle, rel=1e-3)
    assert_connected(mesh, across[0])
    for curve in [*inside, *across]:
        ends = curve.positions(mesh)[[0, -1], :2]
        assert (np.isclose(ends, 0) | np.isclose(ends, 1)).any(axis=1).all()


def test_linear_values_have_straight_isolines_of_exact_length_and_area():
    mesh = flat_perturbed(shapes.grid(9))
    values = mesh.V @ [3.0, 4.0, 0.0]
    levels = np.array([1.0, 3.0, 3.5, 5.0])
    widths = np.array([5 / 12, 5 / 4, 5 / 4, 5 / 6])
    for level, width, curves in zip(levels, widths, isolines(mesh, values, levels), strict=True):
        assert len(curves) == 1
        assert length(mesh, curves) == pytest.approx(width, rel=1e-12)
        np.testing.assert_allclose(curves[0].positions(mesh) @ [3, 4, 0], level, rtol=1e-12)
    # Triangles and trapezoids cut off the unit square by 3 x + 4 y = level.
    expected = [1 / 24, 3 / 8, 1 / 2, 1 - 2 * 2 / 24]
    np.testing.assert_allclose(sublevel_areas(mesh, values, levels), expected, rtol=1e-12)


def test_a_level_through_vertices_and_along_edges_is_drawn_once():
    mesh = shapes.grid(8)
    for level in (0.25, 0.5, 1.0):
        (curve,) = isolines(mesh, mesh.V[:, 0], level)[0]
        assert curve.lengths(mesh).sum() == pytest.approx(1, rel=1e-14)
        assert (curve.lengths(mesh) > 0).all()
        np.testing.assert_array_equal(curve.positions(mesh)[:, 0], level)
    # The diagonal passes a vertex in every other triangle.
    (diagonal,) = isolines(mesh, mesh.V[:, 0] + mesh.V[:, 1], 1.0)[0]
    assert diagonal.lengths(mesh).sum() == pytest.approx(np.sqrt(2), rel=1e-14)


def test_a_plateau_has_its_lower_rim_and_no_other():
    mesh = shapes.grid(8)
    plateau = np.minimum(np.abs(mesh.V[:, :2] - 0.5).max(axis=1), 0.25)
    (rim,) = isolines(mesh, plateau, 0.25)[0]
    assert rim.is_closed
    # A square of side 1/2, but for the two corners that a triangle with no lower vertex cuts off.
    h = 1 / 8
    assert rim.lengths(mesh).sum() == pytest.approx(2 - 2 * h * (2 - np.sqrt(2)), rel=1e-14)
    assert sublevel_areas(mesh, plateau, 0.25)[0] == pytest.approx(0.25 - h**2, rel=1e-14)
    # The same turned upside down: now the plateau is the part below, which does not reach its own level.
    assert isolines(mesh, -plateau, -0.25) == [[]]
    assert isolines(mesh, np.zeros(mesh.n_vertices), 0.0) == [[]]


def test_extrema_at_the_level_have_no_curve_and_a_saddle_is_crossed():
    assert isolines(SQUARE, [0, 1, 2, 1], [0.0, 2.0])[0] == []
    assert length(SQUARE, isolines(SQUARE, [0, 1, 2, 1], [2.0])[0]) == 0
    mesh = shapes.grid(4)
    x, y = (mesh.V[:, :2] - 0.5).T
    curves = isolines(mesh, x * y, 0.0)[0]
    # Both axes, of which neither is lost at the vertex where they cross.
    assert length(mesh, curves) == pytest.approx(2, rel=1e-14)


def test_an_annulus_has_two_rims_that_share_its_area():
    mesh = shapes.disk(40)
    values = np.abs(np.linalg.norm(mesh.V, axis=1) - 0.6)
    curves = isolines(mesh, values, 0.2)[0]
    assert [curve.is_closed for curve in curves] == [True, True]
    (area,) = sublevel_areas(mesh, values, 0.2)
    assert area == pytest.approx(np.pi * (0.8**2 - 0.4**2), rel=5e-3)
    assert sum(signed_area(mesh, curve) for curve in curves) == pytest.approx(area, rel=1e-12)


def test_an_unreachable_component_is_left_out():
    one = shapes.icosphere(3)
    both = twice(one)
    phi = HeatMethodSolver(both).distance(0)
    assert np.isinf(phi[one.n_vertices :]).all()
    curves = isolines(both, phi, [1.0])[0]
    assert [curve.is_closed for curve in curves] == [True]
    assert (curves[0].faces < one.n_faces).all()
    assert sublevel_areas(both, phi, 1e9)[0] == pytest.approx(one.measures.sum(), rel=1e-12)


def test_faces_with_an_infinite_value_end_a_curve():
    mesh = shapes.grid(8)
    values = np.where(mesh.V[:, 0] > 0.8, np.inf, mesh.V[:, 1])
    (curve,) = isolines(mesh, values, 0.3)[0]
    assert not curve.is_closed
    assert curve.positions(mesh)[:, 0].max() == pytest.approx(0.75, rel=1e-12)
    np.testing.assert_allclose(curve.positions(mesh)[:, 1], 0.3, rtol=1e-12)


def test_curves_end_where_three_faces_meet():
    mesh = shapes.book(3, 4)
    spine = mesh.facets.vertices[mesh.facets.n_faces == 3]
    assert len(spine)
    axis = int(np.argmax(np.ptp(mesh.V[spine].reshape(-1, 3), axis=0)))
    middle = mesh.V[:, axis].mean() + 0.01
    curves = isolines(mesh, mesh.V[:, axis], middle)[0]
    assert len(curves) == 3
    assert not any(curve.is_closed for curve in curves)


def test_crossings_are_those_of_libigl(bunny):
    import igl

    phi = HeatMethodSolver(bunny).distance(0)
    levels = np.linspace(0.1, 0.9, 5) * phi.max()
    V, E, which = igl.isolines(bunny.V, bunny.F, phi, levels)
    theirs = np.bincount(which, weights=np.linalg.norm(V[E[:, 0]] - V[E[:, 1]], axis=1))
    ours = [length(bunny, curves) for curves in isolines(bunny, phi, levels)]
    np.testing.assert_allclose(ours, theirs, rtol=1e-10)
    for curves in isolines(bunny, phi, levels):
        for curve in curves:
            assert_connected(bunny, curve)


def test_an_offset_curve_on_a_part():
    mesh = zoo("pill")
    solver = GeodesicSolver(mesh, method="exact")
    radius = 0.05 * np.ptp(mesh.V, axis=0).max()
    curves = offset_curves(mesh, solver, [100, 200], radius)
    assert curves
    phi = solver.distance([100, 200])
    for curve in curves:
        assert curve.is_closed
        corners = phi[mesh.F[curve.faces]]
        np.testing.assert_allclose((curve.start * corners).sum(axis=1), radius, rtol=1e-10)
    assert offset_curves(mesh, solver, 100, 1e6) == []


def test_offset_of_a_curve_drawn_on_the_plane():
    """Around a segment: two sides and two half circles, by a distance that is off by less than an edge on average."""
    mesh = shapes.grid(60)
    solver = HeatMethodSolver(mesh)
    first, last = 20 * 61 + 20, 30 * 61 + 40
    drawn = heat_igl.shortest_paths(mesh, last, first)[0]
    length = np.linalg.norm(mesh.V[first] - mesh.V[last])
    assert drawn.lengths(mesh).sum() == pytest.approx(length, rel=1e-9)
    (curve,) = offset_curves(mesh, solver, drawn, 0.2)
    assert curve.is_closed
    assert curve.lengths(mesh).sum() == pytest.approx(2 * length + 2 * np.pi * 0.2, abs=2 * np.pi / 60)
    points = curve.positions(mesh)
    along = np.clip((points - mesh.V[first]) @ (mesh.V[last] - mesh.V[first]) / length**2, 0, 1)[:, None]
    nearest = mesh.V[first] + along * (mesh.V[last] - mesh.V[first])
    off = np.abs(np.linalg.norm(points - nearest, axis=1) - 0.2)
    assert off.mean() < 1 / 60
    assert off.max() < 2 / 60


def circle_and_arc():
    mesh = shapes.grid(20)
    near, far = isolines(mesh, np.linalg.norm(mesh.V - [0.4, 0.5, 0], axis=1), [0.2, 0.45])
    return mesh, {"near": near, "far": far}


def test_obj_lines_come_back(tmp_path):
    mesh, groups = circle_and_arc()
    write_curves(tmp_path / "lines.obj", mesh, groups)
    write_curves(tmp_path / "alone.obj", groups)  # the curves know their mesh
    assert (tmp_path / "alone.obj").read_text() == (tmp_path / "lines.obj").read_text()
    text = (tmp_path / "lines.obj").read_text()
    V = np.array([line.split()[1:] for line in text.splitlines() if line.startswith("v ")], float)
    lines = [np.array(line.split()[1:], int) - 1 for line in text.splitlines() if line.startswith("l ")]
    assert re.findall("^g (.*)$", text, re.MULTILINE) == ["near", "far"]
    for line, curve in zip(lines, [*groups["near"], *groups["far"]], strict=True):
        np.testing.assert_array_equal(V[line][:-1], curve.positions(mesh)[:-1])
        assert (line[0] == line[-1]) == curve.is_closed


def test_svg_shows_a_flat_domain_upright_and_at_its_size(tmp_path):
    mesh, groups = circle_and_arc()
    write_curves(tmp_path / "lines.svg", mesh, groups)
    import xml.etree.ElementTree as ET

    root = ET.parse(tmp_path / "lines.svg").getroot()
    name = "{http://www.w3.org/2000/svg}"
    drawn = [*root.iter(f"{name}polygon"), *root.iter(f"{name}polyline")]
    assert [element.tag for element in drawn] == [f"{name}polygon", f"{name}polyline"]
    points = np.array([pair.split(",") for pair in drawn[0].attrib["points"].split()], float)
    np.testing.assert_array_equal(points * [1, -1], groups["near"][0].positions(mesh)[:-1, :2])
    x, y, width, height = map(float, root.attrib["viewBox"].split())
    every = np.concatenate([curve.positions(mesh)[:, :2] * [1, -1] for group in groups.values() for curve in group])
    assert (every >= [x, y]).all()
    assert (every <= [x + width, y + height]).all()


def test_svg_of_a_tilted_plane_keeps_lengths_and_of_a_sphere_needs_a_projection(tmp_path):
    mesh, groups = circle_and_arc()
    tilted = Mesh(mesh.V @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0], mesh.F)
    write_curves(tmp_path / "tilted.svg", tilted, groups["near"])
    pairs = re.findall(r'<polygon points="([^"]*)"', (tmp_path / "tilted.svg").read_text())[0].split()
    points = np.array([pair.split(",") for pair in pairs], float)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(steps, groups["near"][0].lengths(mesh)[:-1], rtol=1e-9, atol=1e-14)

    sphere = shapes.icosphere(2)
    curves = isolines(sphere, sphere.V[:, 2], 0.3)[0]
    write_curves(tmp_path / "sphere.svg", sphere, curves, projection=np.eye(2, 3))
    assert "<polygon" in (tmp_path / "sphere.svg").read_text()


def test_dxf_comes_back_with_layers(tmp_path):
    ezdxf = pytest.importorskip("ezdxf.filemanagement")
    mesh, groups = circle_and_arc()
    write_curves(tmp_path / "lines.dxf", mesh, groups)
    found = list(ezdxf.readfile(tmp_path / "lines.dxf").modelspace())
    assert [(line.dxf.layer, line.is_closed) for line in found] == [("near", True), ("far", False)]
    points = np.array([tuple(vertex.dxf.location) for vertex in found[0].vertices])
    np.testing.assert_allclose(points, groups["near"][0].positions(mesh)[:-1], rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("suffix", [".ply", ".vtp", ".csv"])
def test_lines_for_other_programs_are_as_long_as_the_curves(tmp_path, suffix):
    mesh = shapes.icosphere(2)
    loops, path = heat_igl.isolines(mesh, mesh.V[:, 2], [0.1, 0.3]), heat_igl.shortest_path(mesh, 0, 50)
    write_curves(tmp_path / f"a{suffix}", mesh, {"levels": loops, "path": path})
    text = (tmp_path / f"a{suffix}").read_text()
    if suffix == ".csv":
        assert {row.partition(",")[0] for row in text.splitlines()[1:]} == {'"levels"', '"path"'}
        rows = np.genfromtxt(text.splitlines()[1:], delimiter=",", usecols=(1, 2, 3, 4))
        lines = [rows[rows[:, 0] == i, 1:] for i in range(3)]
    elif suffix == ".vtp":
        arrays = {
            each.get("Name"): np.array(each.text.split(), float) for each in ElementTree.XML(text).iter("DataArray")
        }
        numbers = np.split(arrays["connectivity"].astype(int), arrays["offsets"].astype(int)[:-1])
        lines = [arrays["points"].reshape(-1, 3)[each] for each in numbers]
    else:
        rows = [line.split() for line in text.partition("end_header\n")[2].splitlines()]
        points = np.array([row for row in rows if len(row) == 3], float)
        lines = list(points[np.array([row for row in rows if len(row) == 2], int)])
    found = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines)
    assert found == pytest.approx(sum(curve.length for curve in [*loops[0], *loops[1], path]), rel=1e-12)


def test_a_failed_write_leaves_the_old_file(tmp_path):
    mesh, groups = circle_and_arc()
    target = tmp_path / "lines.obj"
    target.write_text("old")
    with pytest.raises(heat_igl.SourceError, match="must be a face"):
        write_curves(target, SQUARE, groups)
    with pytest.raises(ValueError, match=r"curves go to .obj, .ply, .vtp, .csv, .svg, .dxf files"):
        write_curves(tmp_path / "lines.png", mesh, groups)
    with pytest.raises(ValueError, match=r"projection is for .svg"):
        write_curves(target, mesh, groups, projection=np.eye(2, 3))
    with pytest.raises(MeshError, match="cannot be written"):
        write_curves(tmp_path / "nowhere" / "lines.obj", mesh, groups)
    assert target.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["lines.obj"]


def test_curves_are_written_from_lists_of_any_depth(tmp_path):
    mesh = shapes.icosphere(2)
    levels = isolines(mesh, mesh.V[:, 2], [-0.5, 0.1, 0.5])
    flat = [curve for level in levels for curve in level]
    written = {}
    for name, curves in {"nested": levels, "flat": flat, "deep": [levels[:1], [[levels[1:]]]], "one": flat[0]}.items():
        write_curves(tmp_path / f"{name}.obj", mesh, curves)
        written[name] = (tmp_path / f"{name}.obj").read_text()
    assert written["nested"] == written["flat"] == written["deep"]
    assert written["flat"].count("\nl ") == len(flat)
    assert written["one"].count("\nl ") == 1
    write_curves(tmp_path / "named.obj", mesh, {"near": levels[:1], "far": levels[2]})
    assert "g near" in (tmp_path / "named.obj").read_text()
    for curves, message in (
        ([levels, [3]], r"curves\[1\]\[0\] must be a SurfaceCurve or a list of such, not int"),
        ({"a": mesh.V}, r"curves\['a'\] must be a SurfaceCurve or a list of such, not ndarray"),
    ):
        with pytest.raises(TypeError, match=message):
            write_curves(tmp_path / "wrong.obj", mesh, curves)
    assert not (tmp_path / "wrong.obj").exists()
