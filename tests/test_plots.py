"""Pictures: every pixel shows the nearest triangle and the right distance, lines lie where they should."""

import re
from pathlib import Path

import numpy as np
import pytest
from surfaces import arcs, square, twice

import heat_igl
from heat_igl import shapes
from heat_igl.drawing import figure, plots, raster
from heat_igl.drawing.figure import LINE, stripe_coverage
from heat_igl.drawing.plots import Picture, plot, plot_field, plot_labels, write_line_drawing
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    """The same picture with fewer pixels."""
    monkeypatch.setattr(figure, "DPI", 120)


def surface_image(drawn: Picture) -> np.ndarray:
    return np.asarray(drawn.figure.axes[0].get_images()[0].get_array())


def middle_row(drawn: Picture) -> np.ndarray:
    """The colours of the pixels that the surface covers wholly."""
    image = surface_image(drawn)
    row = image[image.shape[0] // 2]
    return row[row[:, 3] > 0.99, :3]


def legend_texts(drawn: Picture) -> list[str]:
    return [text.get_text() for text in drawn.figure.legends[0].get_texts()]


def test_each_pixel_shows_the_nearest_triangle_and_interpolates_exactly():
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 40, (60, 3))
    F = np.arange(60).reshape(20, 3)
    pixels = raster.rasterize(points, F, 40, 40)
    # A slow second opinion: every triangle against every pixel.
    depth = np.full((40, 40), -np.inf)
    face = np.full((40, 40), -1)
    for f, corners in enumerate(points[F]):
        system = np.concatenate([corners[:, :2].T, np.ones((1, 3))])
        for row in range(40):
            for column in range(40):
                weights = np.linalg.solve(system, [column, row, 1])
                if (weights >= 0).all() and weights @ corners[:, 2] > depth[row, column]:
                    depth[row, column], face[row, column] = weights @ corners[:, 2], f
    np.testing.assert_array_equal(pixels.place, np.flatnonzero(face.ravel() >= 0))
    np.testing.assert_array_equal(pixels.face, face.ravel()[pixels.place])
    np.testing.assert_allclose(pixels.depth, depth, atol=1e-9)
    where = np.einsum("pk,pkd->pd", pixels.weights, points[F[pixels.face]])
    np.testing.assert_allclose(where[:, 0] + 40 * where[:, 1], pixels.place, atol=1e-6)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (90, 0), (33, -70), (0, 90)])
def test_rotations_keep_shapes_and_handedness(azimuth, elevation):
    turn = raster.rotation(azimuth, elevation)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1)
    viewer = np.radians([azimuth, elevation])
    assert turn[2, 1] == pytest.approx(np.sin(viewer[1]))


def test_isolines_lie_at_the_levels_and_have_the_width_asked_for():
    """Distance x, on a square seen face on: dark columns at multiples of the spacing and nowhere else."""
    mesh, x = square()
    lined, plain = (middle_row(plot(mesh, x, spacing=spacing)) for spacing in (0.3, 100.0))
    ratio = lined.sum(axis=1) / plain.sum(axis=1)
    expected = len(ratio) * np.array([0.3, 0.6, 0.9]) - 0.5
    away = np.abs(np.arange(len(ratio))[:, None] - expected).min(axis=1)
    np.testing.assert_allclose(ratio[away > LINE / 2 + 2], 1, atol=1e-12)
    ink = (1 - ratio).sum() / LINE_INK
    assert ink == pytest.approx(3 * LINE, rel=0.3)


def test_colours_follow_the_colour_bar():
    mesh, x = square()
    drawn = plot(mesh, x, spacing=10.0 / 3)  # no line on the way
    row = middle_row(drawn)
    bar = drawn.figure.axes[1].get_images()[0]
    expected = bar.cmap(np.linspace(0, 1, len(row)))[:, :3]
    assert np.abs(row - expected).max() < 0.02
    # Perceptually uniform: brightness falls steadily from the source.
    luminance = row @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) < 0.01).all()
    assert luminance[0] - luminance[-1] > 0.5


def test_stripes_are_light_in_every_second_interval():
    mesh, x = square()
    striped, plain = (middle_row(plot(mesh, x, spacing=0.25, style=style)) for style in ("stripes", "plain"))
    level = (np.arange(len(plain)) + 0.5) / len(plain) / 0.25
    inside = np.abs(level - np.rint(level)) * 0.25 * len(plain) > 2
    lighter = (striped - plain) / (1 - plain)
    odd = np.floor(level) % 2 == 1
    np.testing.assert_allclose(lighter[inside & ~odd], 0, atol=1e-12)
    np.testing.assert_allclose(lighter[inside & odd], STRIPE_INK, atol=1e-9)
    assert "stripes of 0.25" in legend_texts(plot(mesh, x, spacing=0.25, style="stripes"))


def test_stripes_too_narrow_to_be_seen_become_an_even_tone():
    values = np.random.default_rng(0).uniform(0, 1, 500)
    share = stripe_coverage(values, np.full(500, 10.0), 0.01)
    np.testing.assert_allclose(share, 0.5, atol=1e-3)
    # A pixel's mean over the values in it, by a slow second opinion.
    fine = values[:, None] + 0.15 * (np.arange(2000) + 0.5 - 1000) / 2000
    slow = (np.floor(fine / 0.2) % 2 == 1).mean(axis=1)
    np.testing.assert_allclose(stripe_coverage(values, np.full(500, 0.15), 0.2), slow, atol=2e-3)


def test_curves_are_drawn_where_they_are_seen_and_dotted_where_they_are_not():
    """Two parallel squares, a straight line across each: the far one is hidden as far as the near one reaches."""
    V = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 1], [2, 0, 1], [0, 2, 1]], float)
    mesh = heat_igl.Mesh(V, [[0, 1, 2], [3, 4, 5]])
    # Along y = 0.5: in the far triangle from x = 0 to 3.5, in the near one from x = 0 to 1.5.
    far = heat_igl.SurfaceCurve([0], [[0.875, 0, 0.125]], [[0, 0.875, 0.125]])
    near = heat_igl.SurfaceCurve([1], [[0.75, 0, 0.25]], [[0, 0.75, 0.25]])
    drawn = plot(mesh, V[:, 0], curves=[[far], near], view=(0, 0))  # nested, as isolines are
    axes = drawn.figure.axes[0]
    columns = surface_image(drawn).shape[1]
    spans = {"dotted": [], "solid": []}
    for lines in axes.collections:
        kind = "solid" if lines.get_linestyle()[0][1] is None else "dotted"
        spans[kind] += [segment[:, 0] for segment in lines.get_segments()]
    # Pixels per unit, from the whole picture: 4 units wide.
    far_ends = np.array([min(x.min() for x in spans["dotted"]), max(x.max() for x in spans["solid"])])
    per_unit = (far_ends[1] - far_ends[0]) / 3.5
    assert per_unit == pytest.approx(columns / 4, rel=0.2)
    assert max(x.max() for x in spans["dotted"]) - far_ends[0] == pytest.approx(1.5 * per_unit, abs=3)
    seen = sorted({round(float(np.ptp(x) / per_unit), 1) for x in spans["solid"]})
    assert seen == [1.5, 2.0]
    assert "curves" in legend_texts(drawn)


def test_errors_of_both_signs_are_white_in_the_middle():
    mesh, x = square()
    drawn = plot_field(mesh, x - 0.25, label="error, %")
    assert drawn.figure.axes[1].get_ylim() == (-0.75, 0.75)
    assert drawn.figure.axes[1].get_ylabel() == "error, %"
    row = middle_row(drawn)
    zero = row[len(row) // 4]
    assert zero.min() > 0.93
    assert row[0, 2] > row[0, 0] + 0.1  # blue where it is too small
    assert row[-1, 0] > row[-1, 2] + 0.2  # red where it is too large
    bar = drawn.figure.axes[1].get_images()[0]
    np.testing.assert_allclose(row[-1], bar.cmap(1.0)[:3], atol=0.02)


def test_isolines_of_a_field_are_also_at_zero_and_below():
    mesh, x = square()
    lined, plain = (
        middle_row(plot_field(mesh, x - 0.5, label="height", spacing=spacing, colormap="viridis"))
        for spacing in (0.2, None)
    )
    ratio = lined.sum(axis=1) / plain.sum(axis=1)
    found = np.split(np.flatnonzero(ratio < 0.9), np.flatnonzero(np.diff(np.flatnonzero(ratio < 0.9)) > 1) + 1)
    levels = [(line.mean() + 0.5) / len(ratio) - 0.5 for line in found]
    np.testing.assert_allclose(levels, [-0.4, -0.2, 0, 0.2, 0.4], atol=0.005)


def test_fields_of_one_sign_start_at_zero_and_end_where_they_are_told():
    mesh, x = square()
    assert plot_field(mesh, x, label="heat").figure.axes[1].get_ylim() == (0, 1)
    drawn = plot_field(mesh, x, label="heat", limits=(0, 0.5))
    row = middle_row(drawn)
    np.testing.assert_allclose(row[-1], row[len(row) * 3 // 5], atol=1e-12)
    assert not drawn.figure.legends


def test_unreachable_is_grey_and_the_legend_says_so():
    mesh, x = square()
    both = twice(mesh, np.array([1.5, 0, 0]))
    drawn = plot(both, np.concatenate([x, np.full_like(x, np.inf)]), sources=[0], style="plain")
    image = surface_image(drawn)
    right = image[image.shape[0] // 2, image.shape[1] * 3 // 4]
    left = image[image.shape[0] // 2, image.shape[1] // 8]
    assert np.ptp(right[:3]) < 1e-6
    assert np.ptp(left[:3]) > 0.2
    assert "unreachable" in legend_texts(drawn)
    assert "unreachable" not in legend_texts(plot(mesh, x))


def test_sources_in_front_are_dots_and_those_behind_are_rings():
    sphere = shapes.icosphere(3)
    front, back = int(np.argmax(sphere.V[:, 2])), int(np.argmin(sphere.V[:, 2]))
    distance = np.minimum(*(arcs(sphere.V, s) for s in (front, back)))
    drawn = plot(sphere, distance, sources=[front, back], view=(0, 0))
    assert legend_texts(drawn)[:2] == ["source", "source behind"]
    seen, hidden = drawn.figure.axes[0].collections
    rows, columns = surface_image(drawn).shape[:2]
    for marks in (seen, hidden):
        np.testing.assert_allclose(marks.get_offsets(), [[columns / 2, rows / 2]], atol=0.05 * columns)
    assert len(hidden.get_facecolors()) == 0


def test_sources_in_faces_and_on_curves_are_marked_where_they_are():
    mesh = heat_igl.Mesh([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    inside = heat_igl.SurfacePoints([0], [[0.5, 0.25, 0.25]])
    along = heat_igl.SurfaceCurve([0], [[0.75, 0, 0.25]], [[0, 0.75, 0.25]])
    drawn = plot(mesh, [0.0, 1, 1], sources=[inside, along], view=(0, 0))
    axes = drawn.figure.axes[0]
    (dots,) = [marks for marks in axes.collections if len(marks.get_offsets()) and marks.get_offsets().any()][:1]
    line = next(lines for lines in axes.collections if hasattr(lines, "get_segments"))
    start, end = line.get_segments()[0][[0, -1]]
    # The point lies at (0.5, 0.5), the curve runs from there to the left and right along y = 0.5: x from 0 to 1.5.
    (dot,) = dots.get_offsets()
    np.testing.assert_allclose(dot, start + (end - start) / 3, atol=0.01)
    assert legend_texts(drawn)[:2] == ["source", "source curve"]


def test_the_default_view_shows_the_source():
    sphere = shapes.icosphere(3)
    for axis in (0, 2):
        for source in (int(np.argmax(sphere.V[:, axis])), int(np.argmin(sphere.V[:, axis]))):
            distance = arcs(sphere.V, source)
            assert legend_texts(plot(sphere, distance, sources=source))[0] == "source"


@pytest.mark.parametrize("axes", [[0, 1, 2], [2, 0, 1], [1, 2, 0]])
def test_a_flat_mesh_is_seen_face_on(axes):
    mesh, x = square()
    image = surface_image(plot(heat_igl.Mesh(mesh.V[:, axes], mesh.F), x))
    rows, columns = np.nonzero(image[..., 3] > 0.5)
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=4)


@pytest.mark.parametrize(("scale", "offset"), [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)])
def test_scale_and_place_do_not_change_the_picture(scale, offset):
    mesh = shapes.icosphere(2)
    distance = arcs(mesh.V, 0)
    moved = heat_igl.Mesh(mesh.V * scale + offset, mesh.F)
    spacing = 0.25
    a = surface_image(plot(mesh, distance, spacing=spacing))
    b = surface_image(plot(moved, distance * scale, spacing=spacing * scale))
    assert np.abs(a - b).mean() < 1e-4


def test_nothing_overlaps_and_nothing_is_cut_off():
    mesh, x = square()
    for values in (x * 1e-9, x * 12345.0):
        drawn = plot(mesh, values, sources=[0, 441 - 1])
        figure = drawn.figure
        renderer = figure.canvas.get_renderer()
        figure.draw(renderer)
        surface, bar = figure.axes
        boxes = [
            surface.get_window_extent(renderer),
            bar.get_tightbbox(renderer),
            figure.legends[0].get_window_extent(),
        ]
        for i, box in enumerate(boxes):
            assert box.x0 >= 0
            assert box.y0 >= -1
            assert box.x1 <= figure.bbox.x1
            assert box.y1 <= figure.bbox.y1
            assert not any(box.shrunk(0.99, 0.97).overlaps(other) for other in boxes[i + 1 :])


def test_save_writes_the_format_that_the_suffix_names_and_the_same_bytes(tmp_path):
    mesh, x = square(4)
    drawn = plot(mesh, x)
    for suffix, start in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        path, again = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
        plot(mesh, x).save(path)
        assert path.read_bytes().startswith(start)
        drawn.save(again)
        assert path.read_bytes() == again.read_bytes()
    assert drawn._repr_png_().startswith(b"\x89PNG")


# --- labels -----------------------------------------------------------------------------------------------------------


def test_labels_have_one_colour_each_and_neighbours_others():
    mesh = shapes.grid(12)
    cells = heat_igl.voronoi_cells(heat_igl.HeatMethodSolver(mesh), [0, 12, 84, 100, 168])
    numbers = plots._colour_numbers(cells.labels, mesh.edges, 10)
    assert len({(label, number) for label, number in zip(cells.labels, numbers, strict=True)}) == 5
    across = cells.labels[mesh.edges[:, 0]] != cells.labels[mesh.edges[:, 1]]
    assert across.any()
    assert (numbers[mesh.edges[across, 0]] != numbers[mesh.edges[across, 1]]).all()
    # On a flat mesh the light is the same everywhere: no other colours than those of the labels.
    drawn = plot_labels(mesh, cells.labels)
    assert len(drawn.figure.axes) == 1  # no colour bar
    image = surface_image(drawn)
    inside = image[image[..., 3] == 1][:, :3].round(4)
    _, counts = np.unique(inside, axis=0, return_counts=True)
    assert counts[np.argsort(counts)][-len(set(numbers)) :].sum() > 0.95 * len(inside)


def test_between_two_labels_is_no_third():
    """A square of two triangles; each corner of a triangle has a third of it."""
    mesh = shapes.grid(1)
    diagonal = [v for v in range(4) if (v == mesh.F).sum() == 2]
    labels = np.zeros(4, int)
    labels[[diagonal[1], np.setdiff1d(mesh.F[1], diagonal)[0]]] = [2, 1]
    image = surface_image(plot_labels(mesh, labels))
    inside = image[image[..., 3] == 1][:, :3].round(3)
    counts = np.sort(np.unique(inside, axis=0, return_counts=True)[1])[-3:]
    assert np.allclose(counts / len(inside), [1 / 6, 1 / 3, 1 / 2], atol=0.03)


def test_borders_of_cells_are_where_distances_are_equal():
    """In the plane the border of two cells is the bisector of the sites, which crosses the triangles here."""
    mesh, _ = square(12)
    away = np.linalg.norm(mesh.V[:, None] - mesh.V[[30, 120]], axis=2)
    middle, across = mesh.V[[30, 120]].mean(axis=0), mesh.V[120] - mesh.V[30]
    wrong = []
    for distance in (away.min(axis=1), None):
        image = surface_image(plot_labels(mesh, away.argmin(axis=1), distance=distance))
        is_first = np.linalg.norm(image[..., :3] - image[..., :3][image.shape[0] - 25, 25], axis=2) < 0.05
        rows, columns = np.nonzero(image[..., 3] == 1)
        low, high = (
            np.array([columns, rows]).T[index] for index in (np.argmin(columns - rows), np.argmax(columns - rows))
        )
        place = (np.array([columns, rows]).T - low) / (high - low)
        side = (place - middle[:2]) @ across[:2]
        inside = np.abs(side) > 2 * np.linalg.norm(across) / abs(high - low)[0]  # but for two pixels at the border
        wrong.append((is_first[rows, columns] != (side < 0))[inside].mean())
    # Of second order in the edge, while thirds of triangles are off by a share of it.
    assert wrong[0] < 0.2 * wrong[1]
    assert wrong[1] > 0.01
    # Where no site leads there is no label, and distance is infinite: borders beside stay where they are.
    labels = np.where(mesh.V[:, 0] < 0.9, away.argmin(axis=1), -1)
    masks = []
    for given in (away.argmin(axis=1), labels):
        image = surface_image(plot_labels(mesh, given, distance=np.where(given < 0, np.inf, away.min(axis=1))))
        left = image[:, : image.shape[1] // 2, :3]
        masks.append(np.linalg.norm(left - left[-25, 25], axis=2) < 0.05)
    assert 0 < masks[0].mean() < 1
    assert np.array_equal(*masks)


def test_vertices_without_a_label_are_grey():
    mesh = shapes.grid(4)
    image = surface_image(plot_labels(mesh, np.full(25, -1) + (mesh.V[:, 0] > mesh.V[:, 0].mean())))
    grey = np.ptp(image[..., :3], axis=2) < 1e-6
    assert 0.3 < (grey & (image[..., 3] == 1)).sum() / (image[..., 3] == 1).sum() < 0.95


# --- line drawings ----------------------------------------------------------------------------------------------------


def drawn_lines(path: Path) -> dict[str, list[np.ndarray]]:
    """The polylines of each group, with y upwards."""
    found = {}
    for name, group in re.findall(r'<g id="(\w+)"[^>]*>\n(.*?)</g>', path.read_text(), re.DOTALL):
        points = re.findall(r'points="([^"]*)"', group)
        found[name] = [np.array([pair.split(",") for pair in text.split()], float) * [1, -1] for text in points]
    return found


@pytest.mark.parametrize("hidden", ["dotted", "omitted"])
def test_lines_behind_the_surface_are_hidden(tmp_path, hidden):
    """Circles of latitude on a sphere, seen at right angles to the axis: the near half of each is visible."""
    sphere = shapes.icosphere(4)
    mesh = heat_igl.Mesh(10 * sphere.V + 3, sphere.F)
    levels = heat_igl.isolines(mesh, mesh.V[:, 1], [0.0, 3.0, 7.0])
    path = tmp_path / "a.svg"
    write_line_drawing(path, mesh, levels, hidden=hidden, view=(0, 0))
    found = drawn_lines(path)
    assert set(found) == ({"visible", "hidden"} if hidden == "dotted" else {"visible"})
    for group in found.values():
        across = sum(np.abs(np.diff(line[:, 0])).sum() for line in group)
        radii = np.sqrt(100 - np.array([-3.0, 0.0, 4.0]) ** 2)
        assert across == pytest.approx(2 * radii.sum(), rel=0.03)
        heights = np.concatenate([line[:, 1] for line in group])
        assert np.abs(heights[:, None] - [-3, 0, 4]).min(axis=1).max() < 0.05
    assert ("stroke-dasharray" in path.read_text()) == (hidden == "dotted")
