"""Pages: complete in themselves, drawn as the colour bar says, turned and asked in a real browser."""

import html
import io
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import mean_error, relative_error, zoo
from surfaces import arcs, nearest_vertex, square, twice

import heat_igl
from heat_igl import shapes
from heat_igl.drawing.plots import Page, page
from heat_igl.drawing.scene import LINE_INK, STRIPE_INK, UNREACHABLE, colours

read_image = pytest.importorskip("matplotlib.image").imread


def sphere() -> tuple[heat_igl.Mesh, int, int, np.ndarray]:
    """The unit sphere, its vertices nearest and farthest to the viewer, and the distance from the nearest."""
    mesh = shapes.icosphere(4)
    front, back = int(np.argmax(mesh.V[:, 2])), int(np.argmin(mesh.V[:, 2]))
    return mesh, front, back, arcs(mesh.V, front)


# ---- the file


def test_the_file_is_complete_and_loads_nothing():
    mesh, x = square()
    text = page(mesh, x).html
    assert not re.findall(r"https?:|//cdn|@import|\bimport\s*\(|\bfetch\s*\(|XMLHttpRequest", text)
    assert set(re.findall(r"\b(?:src|href)=\"([^\"]*)\"", text)) == {"data:,"}
    assert "default-src 'none'" in text


def test_titles_and_labels_cannot_become_markup():
    mesh, x = square(3)
    text = page(mesh, x, title="</title><i>&", label="</script><!--<script>", method="<b>").html
    assert "<title>&lt;/title&gt;&lt;i&gt;&amp;</title>" in text
    assert text.count("<script") == text.count("</script>") == 3
    assert "<b>" not in text


def test_a_notebook_gets_the_page_in_a_frame():
    mesh, x = square(3)
    shown = page(mesh, x, title='"quoted"')
    frame = re.fullmatch(
        r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts allow-downloads" style="[^"]*"></iframe>', shown._repr_html_()
    )
    assert frame
    assert html.unescape(frame[1]) == shown.html


# ---- the browser


class Browser:
    """A page in headless Chromium, in the browser's own pixels."""

    def __init__(self, driver: Any, folder: Path) -> None:
        self.driver, self._folder = driver, folder

    def open(self, shown: Page) -> None:
        shown.save(self._folder / "page.html")
        self.driver.get((self._folder / "page.html").as_uri())
        self.wait(lambda: self.run("return !!window.heatIgl"))
        box = self.run("const b = document.getElementById('surface').getBoundingClientRect(); return [b.x, b.y]")
        self.corner = np.array(box)

    def run(self, script: str, *arguments: Any) -> Any:
        return self.driver.execute_script(script, *arguments)

    def wait(self, happened: Callable[[], bool]) -> None:
        end = time.monotonic() + 10
        while not happened():
            assert time.monotonic() < end, "the page does not answer"
            time.sleep(0.02)

    def enter(self, identity: str, value: str | float, event: str = "change") -> None:
        script = "const e = document.getElementById(arguments[0]); e.value = arguments[1];"
        self.run(f"{script} e.dispatchEvent(new Event(arguments[2]))", identity, value, event)

    def text(self, identity: str) -> str:
        return str(self.run("return document.getElementById(arguments[0]).textContent", identity))

    def image(self) -> np.ndarray:
        """The canvas as it is on the screen, (rows, columns, 3), after the next frame."""
        self.driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => setTimeout(done, 60))")
        canvas = self.driver.find_element("id", "surface")
        return np.asarray(read_image(io.BytesIO(canvas.screenshot_as_png)))[..., :3]

    def on_canvas(self, vertex: int) -> np.ndarray:
        return np.array(self.run("return window.heatIgl.onCanvas(arguments[0])", vertex))

    def distance(self) -> np.ndarray:
        # JSON has no infinity.
        values = self.run("return window.heatIgl.distance()")
        return np.array([np.inf if value is None else value for value in values])

    def sources(self) -> list[int]:
        return list(self.run("return window.heatIgl.sources()"))

    def mouse(self, kind: str, at: np.ndarray, buttons: int = 1, modifiers: int = 0) -> None:
        x, y = (self.corner + at[:2]).tolist()
        options = {"type": kind, "x": x, "y": y, "modifiers": modifiers, "buttons": buttons, "clickCount": 1}
        button = "left" if buttons or kind == "mouseReleased" else "none"
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {**options, "button": button})

    def click(self, at: np.ndarray, modifiers: int = 0) -> None:
        self.mouse("mousePressed", at, modifiers=modifiers)
        self.mouse("mouseReleased", at, buttons=0, modifiers=modifiers)

    def drag(self, start: np.ndarray, end: np.ndarray, modifiers: int = 0) -> None:
        self.mouse("mousePressed", start, modifiers=modifiers)
        for share in np.linspace(0.1, 1, 10):
            self.mouse("mouseMoved", start + share * (end - start), modifiers=modifiers)
        self.mouse("mouseReleased", end, buttons=0, modifiers=modifiers)

    def touch(self, kind: str, *fingers: np.ndarray) -> None:
        points = [
            {"x": float(x), "y": float(y), "id": i} for i, (x, y) in enumerate(self.corner + f[:2] for f in fingers)
        ]
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    binary, driver = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
    if binary is None or driver is None:
        pytest.skip("no chromium with chromedriver on this machine")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    # WebGL in software, so that no graphics card is needed; no sandbox, which root may not have.
    given = "headless=new no-sandbox use-angle=swiftshader enable-unsafe-swiftshader window-size=560,560"
    for argument in given.split():
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    try:
        started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    except Exception as error:
        pytest.skip(f"chromium does not start: {str(error).splitlines()[0]}")
    try:
        yield Browser(started, tmp_path_factory.mktemp("pages"))
    finally:
        started.quit()


@pytest.fixture
def browser(chromium):
    """The browser; what a page wrote to the console fails the test."""
    yield chromium
    assert chromium.driver.get_log("browser") == []


def assert_agree(found: np.ndarray, expected: np.ndarray) -> None:
    """The same, but for single vertices that depend on which of two is visited first.

    Python's sweep does not pass on changes below 3e-4 either, and the page's all above 1e-7.
    """
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    np.testing.assert_array_equal(found[expected == 0], 0)
    relative = relative_error(found, expected)
    assert relative.mean() < 1e-4
    assert np.percentile(relative, 99) < 1e-3
    assert relative.max() < 1e-2


def colour_at(image: np.ndarray, at: np.ndarray) -> np.ndarray:
    return image[int(at[1]), int(at[0])]


def test_colours_are_those_of_the_colour_bar(browser):
    mesh, x = square()
    browser.open(page(mesh, x, style="plain"))
    image = browser.image()
    for vertex in (5 * 21 + 3, 10 * 21 + 10, 15 * 21 + 18):
        expected = colours("viridis_r")(x[vertex])[:3]
        np.testing.assert_allclose(colour_at(image, browser.on_canvas(vertex)), expected, atol=0.02)
    assert colour_at(image, np.array([3, 3])).tolist() == [1, 1, 1]
    ticks = browser.run("return [...document.querySelectorAll('#ticks span')].map((s) => [s.textContent, s.style.top])")
    assert all(float(top.rstrip("%")) == pytest.approx(100 * (1 - float(text)), abs=1e-3) for text, top in ticks)
    assert len(ticks) >= 4
    assert browser.text("label") == "distance, in the mesh's unit"


def test_isolines_and_stripes_lie_at_the_levels(browser):
    """Distance x on a square seen face on: dark columns at multiples of the spacing and nowhere else."""
    mesh, x = square()
    rows = {}
    for style in ("plain", "lines", "stripes"):
        browser.open(page(mesh, x, style=style, spacing=0.25))
        image = browser.image()
        rows[style] = image[image.shape[0] // 2]
    left, right = browser.on_canvas(0)[0], browser.on_canvas(20)[0]
    columns = np.arange(int(left) + 3, int(right) - 3)
    level = (columns + 0.5 - left) / (right - left) / 0.25
    away = np.abs(level - np.rint(level)) * 0.25 * (right - left)
    line = rows["lines"][columns].sum(axis=1) / rows["plain"][columns].sum(axis=1)
    np.testing.assert_allclose(line[away > 2.5], 1, atol=0.02)
    assert ((1 - line).sum() / LINE_INK) == pytest.approx(3 * 1.3, rel=0.3)
    stripe = rows["stripes"][columns] - rows["plain"][columns]
    odd = np.floor(level) % 2 == 1
    assert np.abs(stripe[~odd & (away > 2)]).max() < 0.02
    expected = 0.5 * (1 - rows["plain"][columns])
    np.testing.assert_allclose(stripe[odd & (away > 2)], expected[odd & (away > 2)], atol=0.02)


def test_what_is_not_reached_is_grey(browser):
    mesh, x = square()
    both = twice(mesh, np.array([1.5, 0, 0]))
    browser.open(page(both, np.concatenate([x, np.full_like(x, np.inf)])))
    middle = 10 * 21 + 10
    other = middle + mesh.n_vertices
    np.testing.assert_allclose(colour_at(browser.image(), browser.on_canvas(other)), UNREACHABLE, atol=0.02)
    browser.click(browser.on_canvas(other))
    assert browser.sources() == [other]
    assert np.isinf(browser.distance()[: mesh.n_vertices]).all()
    np.testing.assert_allclose(colour_at(browser.image(), browser.on_canvas(middle)), UNREACHABLE, atol=0.02)


def test_a_source_inside_a_face_is_marked_there_until_a_click(browser):
    mesh = heat_igl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    inside = heat_igl.SurfacePoints([0], [[0.5, 0.25, 0.25]])
    browser.open(page(mesh, [0.35, 0.8, 0.8], sources=inside))
    at = 0.5 * browser.on_canvas(0) + 0.25 * browser.on_canvas(1) + 0.25 * browser.on_canvas(2)
    red = [0.91, 0.0, 0.043]
    np.testing.assert_allclose(colour_at(browser.image(), at), red, atol=0.02)
    browser.click(0.1 * browser.on_canvas(0) + 0.8 * browser.on_canvas(1) + 0.1 * browser.on_canvas(2))
    assert browser.sources() == [1]
    assert np.abs(colour_at(browser.image(), at) - red).max() > 0.2


def test_the_page_works_in_the_frame_that_a_notebook_shows(browser):
    mesh, x = square(4)
    (browser._folder / "notebook.html").write_text(page(mesh, x)._repr_html_(), encoding="utf8")
    browser.driver.get((browser._folder / "notebook.html").as_uri())
    browser.driver.switch_to.frame(0)
    browser.wait(lambda: browser.run("return !!window.heatIgl"))
    np.testing.assert_allclose(browser.distance(), x, atol=1e-7)


def test_a_drag_turns_the_surface_with_the_hand(browser):
    mesh, front, _, distance = sphere()
    browser.open(page(mesh, distance, sources=front, view=(0, 0)))
    before, image = browser.on_canvas(front), browser.image()
    browser.drag(before, before + np.array([100, 0, 0]))
    after = browser.on_canvas(front)
    radius = (browser.on_canvas(int(np.argmax(mesh.V[:, 1])))[1] - before[1]) / -1
    assert after[0] - before[0] == pytest.approx(radius * np.sin(0.008 * 100), rel=0.05)
    assert after[1] == pytest.approx(before[1], abs=1)
    assert after[2] == pytest.approx(np.cos(0.008 * 100), abs=0.05)
    assert (np.abs(browser.image() - image).max(axis=2) > 0.1).mean() > 0.05
    assert browser.sources() == [front]  # a drag is no click


def test_the_wheel_zooms_about_the_pointer_and_shift_moves(browser):
    mesh, x = square()
    browser.open(page(mesh, x))
    fixed, other = 5 * 21 + 5, 15 * 21 + 15
    at, before = browser.on_canvas(fixed), browser.on_canvas(other)
    position = (browser.corner + at[:2]).tolist()
    wheel = {"type": "mouseWheel", "x": position[0], "y": position[1], "deltaX": 0, "deltaY": -200}
    browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", wheel)
    browser.wait(lambda: bool(np.abs(browser.on_canvas(other) - before).max() > 1))
    # The browser takes whole pixels of the pointer.
    np.testing.assert_allclose(browser.on_canvas(fixed)[:2], at[:2], atol=1.5)
    np.testing.assert_allclose((browser.on_canvas(other) - at)[:2], np.exp(0.3) * (before - at)[:2], rtol=0.02)
    start = browser.on_canvas(other)
    browser.drag(at, at + np.array([30, 20, 0]), modifiers=8)
    np.testing.assert_allclose(browser.on_canvas(other)[:2] - start[:2], [30, 20], atol=5)


def test_a_click_moves_the_source_and_the_distance_follows(browser, bunny):
    browser.open(page(bunny, np.zeros(bunny.n_vertices), method="nothing yet"))
    assert browser.text("method") == "nothing yet"
    image = browser.image()
    height, width = image.shape[:2]
    browser.click(np.array([0.5 * width, 0.6 * height]))
    (source,) = browser.sources()
    np.testing.assert_allclose(browser.on_canvas(source)[:2], [0.5 * width, 0.6 * height], atol=6)
    assert browser.text("readout").startswith(f"vertex {source} at (")
    assert browser.text("readout").endswith("): 0")
    assert "sweep" in browser.text("method")
    assert (np.abs(browser.image() - image).max(axis=2) > 0.1).mean() > 0.1
    sweep = heat_igl.GeodesicSolver(bunny, method="sweep")
    assert_agree(browser.distance(), sweep.distance(source))

    browser.click(np.array([0.4 * width, 0.5 * height]), modifiers=8)
    both = browser.sources()
    assert both[0] == source
    assert len(both) == 2
    assert_agree(browser.distance(), sweep.distance(both))
    browser.mouse("mouseMoved", browser.on_canvas(source) + np.array([0, -40, 0]), buttons=0)
    browser.wait(lambda: f"vertex {both[1]} " not in browser.text("readout"))
    vertex, value = re.fullmatch(r"vertex (\d+) at \(.*\): (\S+)", browser.text("readout")).groups()
    assert float(value) == pytest.approx(browser.distance()[int(vertex)], rel=1e-5)

    browser.driver.find_element("id", "reset").click()
    assert browser.sources() == []
    assert browser.distance().max() == 0


@pytest.mark.parametrize("name", ["voxel blob", "sphere with slivers", "dust"])
def test_bad_meshes_are_measured_too(browser, name):
    """More than two faces at an edge, slivers, pieces."""
    mesh = zoo(name)
    browser.open(page(mesh, np.zeros(mesh.n_vertices)))
    browser.run("window.heatIgl.setSources([7])")
    exact = heat_igl.GeodesicSolver(mesh, tolerance=0).distance(7)
    found = browser.distance()
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(exact))
    assert mean_error(found, exact) < 0.02


def test_what_is_behind_is_not_picked(browser):
    mesh, front, back, distance = sphere()
    browser.open(page(mesh, distance, view=(0, 0)))
    np.testing.assert_allclose(browser.on_canvas(front)[:2], browser.on_canvas(back)[:2], atol=1e-3)
    browser.click(browser.on_canvas(back))
    assert browser.sources() == [front]
    browser.click(np.array([3.0, 3.0]))  # beside the surface
    assert browser.sources() == [front]


def test_fingers_pick_and_zoom(browser):
    mesh, front, _, distance = sphere()
    browser.open(page(mesh, distance, view=(0, 0)))
    at = browser.on_canvas(front)
    browser.touch("touchStart", at)
    browser.touch("touchEnd")
    browser.wait(lambda: browser.sources() == [front])
    top = int(np.argmax(mesh.V[:, 1]))
    before = browser.on_canvas(top)[1] - at[1]
    apart = np.array([40.0, 0, 0])
    browser.touch("touchStart", at - apart, at + apart)
    for step in np.linspace(1.1, 2.0, 10):
        browser.touch("touchMove", at - step * apart, at + step * apart)
    browser.touch("touchEnd")
    assert browser.on_canvas(top)[1] - browser.on_canvas(front)[1] == pytest.approx(2 * before, rel=0.1)


def test_a_click_on_tetrahedra_reads_only(browser):
    box = shapes.box(3)
    distance = np.linalg.norm(box.V - box.V[0], axis=1)
    browser.open(page(box, distance, sources=0))
    corner = max(range(len(box.V)), key=lambda vertex: browser.on_canvas(vertex)[2])
    browser.click(browser.on_canvas(corner))
    assert browser.sources() == [0]
    readout = browser.text("readout")
    assert readout.startswith(f"vertex {corner} ")
    assert float(readout.split()[-1]) == pytest.approx(distance[corner], rel=1e-5)
    assert not browser.driver.find_element("id", "pick-label").is_displayed()


def set_to(browser: Browser, identity: str, value: bool) -> None:
    if browser.run("return document.getElementById(arguments[0]).checked", identity) != value:
        browser.driver.find_element("id", identity).click()


def halves(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    middle = image.shape[1] // 2
    return image[:, :middle], image[:, middle : 2 * middle]


def test_two_fields_stand_side_by_side(browser):
    """The same picture for the same numbers; a click in the right half is one on the same surface."""
    mesh, x = square()
    browser.open(page(mesh, x, fields={"exact": x, "half": x / 2}, beside="exact", style="plain"))
    left, right = halves(browser.image())
    np.testing.assert_allclose(left, right, atol=0.02)
    assert not browser.run("return document.getElementById('scale2').checkVisibility()")
    assert browser.run("return [...document.getElementById('beside').options].map((o) => o.value)") == [
        "", "distance", "exact", "half",
    ]  # fmt: skip
    browser.enter("beside", "half")
    left, right = halves(browser.image())
    vertex = 10 * 21 + 16
    at = browser.on_canvas(vertex)
    np.testing.assert_allclose(colour_at(left, at), colours("viridis_r")(x[vertex])[:3], atol=0.02)
    np.testing.assert_allclose(colour_at(right, at), colours("viridis_r")(x[vertex] / 2)[:3], atol=0.02)
    browser.click(at + np.array([left.shape[1], 0, 0]))
    assert browser.sources() == [vertex]
    assert browser.text("readout").endswith("): 0, exact 0.8, half 0.4")
    assert browser.text("method").endswith("Other fields keep their own source: exact, half.")
    browser.enter("beside", "")
    assert browser.on_canvas(vertex)[0] > at[0]


def test_a_field_that_does_not_follow_a_click_keeps_its_source(browser):
    """After a click, each half marks the place at which the field that it shows is least."""
    mesh, front, _, distance = sphere()
    browser.open(page(mesh, distance, sources=front, fields={"exact": distance}, beside="exact", view=(0, 0)))
    width = halves(browser.image())[0].shape[1]
    chosen = nearest_vertex(mesh, [0.6, 0.0, 0.8])
    browser.click(browser.on_canvas(chosen))
    for column, (least, field) in enumerate([(chosen, "distance"), (front, "exact")]):
        image = halves(browser.image())[column]
        panel = browser.run("return window.heatIgl.panels()")[column]
        assert panel["field"] == field
        assert panel["least"] == least
        red = np.abs(image - [0.91, 0.0, 0.043]).max(axis=2) < 0.1
        rows, columns = np.nonzero(red)
        np.testing.assert_allclose([columns.mean(), rows.mean()], browser.on_canvas(least)[:2], atol=2)
    assert browser.text("label2") == "exact, as given"
    assert browser.on_canvas(chosen)[0] < width
    browser.driver.find_element("id", "reset").click()
    assert not browser.run("return document.getElementById('scale2').checkVisibility()")


def test_a_signed_field_is_white_at_0(browser):
    mesh, x = square()
    signed = x - 0.25
    browser.open(page(mesh, x, fields={"signed": signed}, beside="signed", style="plain"))
    _, right = halves(browser.image())
    for vertex in (10 * 21 + 2, 10 * 21 + 5, 10 * 21 + 17):
        expected = colours("RdBu_r", is_trimmed=False)(0.5 + signed[vertex] / 1.5)[:3]
        np.testing.assert_allclose(colour_at(right, browser.on_canvas(vertex)), expected, atol=0.02)
    assert browser.text("label2") == "signed"
    # The isoline at 0 is wider than the others.
    browser.enter("style", "0")
    browser.enter("spacing", 0.25, "input")
    _, lined = halves(browser.image())
    (left, row, _), (end, _, _) = browser.on_canvas(10 * 21), browser.on_canvas(11 * 21 - 1)
    dark = (right - lined)[int(row)].max(axis=1)

    def ink(level):
        at = left + (level + 0.25) * (end - left)
        return float(dark[int(at) - 4 : int(at) + 5].sum())

    assert ink(0) > 1.7 * max(ink(0.25), ink(0.5)) > 0.3
    assert ink(0.125) < 0.1


def test_the_log_map_in_the_page_is_that_of_python(browser, bunny):
    """Up to the first axis: frames begin at another edge."""
    browser.open(page(bunny, np.zeros(bunny.n_vertices)))
    for source in (100, 2000):
        browser.run("window.heatIgl.setSources([arguments[0]])", source)
        found = np.reshape(browser.run("return window.heatIgl.logMap()"), (-1, 2)) @ [1, 1j]
        expected = heat_igl.log_map(bunny, source) @ [1, 1j]
        away = np.abs(expected) > 0
        np.testing.assert_allclose(np.abs(found[away]), np.abs(expected[away]), rtol=0.02)
        turn = (expected * found.conj()).sum()
        angle = np.abs(np.angle(found[away] * turn / expected[away]))
        assert np.degrees(np.median(angle)) < 1
        assert np.degrees(np.percentile(angle, 90)) < 5


def test_the_log_map_of_a_plane_is_a_checkerboard(browser):
    """Squares of the spacing: colours change along both axes, and not within a square."""
    mesh = shapes.grid(16)
    source = 8 * 17 + 8
    browser.open(page(mesh, np.linalg.norm(mesh.V - mesh.V[source], axis=1), sources=source, beside="log map"))
    found = np.reshape(browser.run("return window.heatIgl.logMap()"), (-1, 2))
    straight = mesh.V[:, :2] - mesh.V[source, :2]
    turn = (straight @ [1, 1j] * (found @ [1, -1j])).sum()
    np.testing.assert_allclose(found @ [1, 1j] * turn / abs(turn), straight @ [1, 1j], atol=1e-5)
    at = np.array([browser.on_canvas(v)[:2] for v in (source, source + 1)])
    per_unit = np.linalg.norm(at[1] - at[0]) / np.linalg.norm(mesh.V[source + 1] - mesh.V[source])
    farthest = float(np.linalg.norm(straight, axis=1).max())
    spacing = farthest / 10
    browser.enter("spacing", spacing, "input")
    _, right = halves(browser.image())
    axes = np.array([1, 1j]) * turn / abs(turn)
    for u, v in np.ndindex(4, 4):
        along = (np.array([u, v]) + 0.5) * spacing
        ink = np.array(colours("viridis_r")(np.linalg.norm(along) / farthest)[:3])
        expected = ink + 1.3 * STRIPE_INK * (1 - ink) if (u + v) % 2 else ink
        place = along @ axes * per_unit
        found_there = colour_at(right, at[0] + np.array([place.real, -place.imag]))
        np.testing.assert_allclose(found_there, expected, atol=0.04)


def test_needles_point_along_the_gradient(browser):
    """Of a linear function on a sphere: along the part of the slope in the plane of a triangle, upwards."""
    mesh, front, _, distance = sphere()
    browser.open(page(mesh, distance, sources=front, view=(0, 0), style="plain"))
    slope = np.array([1.0, -2.0, 0.5])
    needles = np.reshape(
        browser.run(
            "const x = arguments[2]; return Array.from(arrows(arguments[0], arguments[1], (v) => x[v]))",
            mesh.V.ravel().tolist(), mesh.F.ravel().tolist(), (mesh.V @ slope).tolist(),
        ), (-1, 3, 3),
    )  # fmt: skip
    assert 300 < len(needles) < mesh.n_faces / 2
    middle = (2 * needles[:, 0] + needles[:, 1] + needles[:, 2]) / 4
    along = needles[:, 0] - (needles[:, 1] + needles[:, 2]) / 2
    points = heat_igl.closest_points(mesh, middle).points
    assert np.abs(points.positions(mesh) - middle).max() < 1e-6
    normal = np.cross(*(mesh.V[mesh.F[points.faces, i]] - mesh.V[mesh.F[points.faces, 0]] for i in (1, 2)))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    expected = slope - (normal @ slope)[:, None] * normal
    cosine = (along * expected).sum(axis=1) / np.linalg.norm(along, axis=1) / np.linalg.norm(expected, axis=1)
    assert cosine.min() > 1 - 1e-6
    bare = browser.image()
    set_to(browser, "directions", True)
    dark = (bare - browser.image()).max(axis=2) > 0.3
    assert 0.005 < dark.mean() < 0.2
    set_to(browser, "directions", False)
    np.testing.assert_allclose(browser.image(), bare, atol=0.01)


def test_points_are_drawn_as_discs(browser):
    """A cloud begins with discs, which cover the surface and have the colours of their points."""
    mesh, front, _, distance = sphere()
    cloud = heat_igl.PointCloud(mesh.V)
    browser.open(page(cloud, distance, sources=front, view=(0, 0), style="plain"))
    assert browser.run("return document.getElementById('points').checked")
    image = browser.image()
    set_to(browser, "points", False)
    surface = browser.image()
    both = (image < 0.99).any(axis=2) & (surface < 0.99).any(axis=2)
    assert ((image < 0.99).any(axis=2) != (surface < 0.99).any(axis=2)).mean() < 0.02
    assert np.abs(image - surface)[both].mean() < 0.03
    assert (np.abs(image - surface).max(axis=2) > 0.02).mean() > 0.02  # discs have one colour each
    browser.click(browser.on_canvas(front) + np.array([60, 0, 0]))
    (source,) = browser.sources()
    assert_agree(browser.distance(), heat_igl.GeodesicSolver(cloud.triangles, method="sweep").distance(source))


def test_a_saved_scene_opens_as_it_was(browser):
    mesh, front, _, distance = sphere()
    shown = page(mesh, distance, sources=front, fields={"height </script>": mesh.V[:, 1]}, method="as given")
    browser.open(shown)
    source = int(browser.run("window.heatIgl.setSources([77]); return window.heatIgl.sources()[0]"))
    browser.enter("beside", "height </script>")
    set_to(browser, "directions", True)
    browser.drag(browser.on_canvas(front), browser.on_canvas(front) + np.array([40, 25, 0]))
    state, image, at = browser.run("return window.heatIgl.state()"), browser.image(), browser.on_canvas(front)
    found, text = browser.distance(), browser.run("return window.heatIgl.saved()")
    assert text.count("<script") == text.count("</script>") == 3
    browser.open(Page(text))
    assert browser.run("return window.heatIgl.state()") == state
    assert browser.sources() == [source]
    np.testing.assert_array_equal(browser.distance(), found)
    np.testing.assert_allclose(browser.on_canvas(front), at, atol=1e-9)
    np.testing.assert_allclose(browser.image(), image, atol=0.01)
    assert browser.run("return window.heatIgl.saved()") == text
    browser.driver.find_element("id", "reset").click()
    assert browser.sources() == [front]
    assert browser.text("method") == "as given"


def test_save_downloads_the_scene(browser, tmp_path):
    mesh, x = square(5)
    browser.open(page(mesh, x, title="A square: 5 x 5"))
    browser.driver.execute_cdp_cmd("Page.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    browser.driver.find_element("id", "save").click()
    browser.wait(lambda: (tmp_path / "A-square-5-x-5-scene.html").exists())
    saved = browser.run("return window.heatIgl.saved()")
    assert (tmp_path / "A-square-5-x-5-scene.html").read_text(encoding="utf8") == saved
