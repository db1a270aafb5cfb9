"""The window: what it shows follows what was clicked and set, with and without a display."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heat_igl
from heat_igl import shapes
from heat_igl.drawing import exploration, viewer
from heat_igl.drawing.viewer import Exploration
from heat_igl.geodesic import SolverChoice
from heat_igl.heat_method import SolverOptions


@pytest.fixture
def sphere() -> heat_igl.Mesh:
    return shapes.icosphere(3)


def test_the_distance_follows_the_click(sphere: heat_igl.Mesh) -> None:
    now = Exploration(sphere, 5)
    solver = heat_igl.GeodesicSolver(sphere)
    np.testing.assert_array_equal(now.distance, solver.distance(5))
    now.choose(17)
    assert now.sources.tolist() == [17]
    np.testing.assert_array_equal(now.distance, solver.distance(17))
    now.choose(40, add=True)
    assert now.sources.tolist() == [17, 40]
    np.testing.assert_array_equal(now.distance, solver.distance([17, 40]))
    now.choose(17, add=True)
    assert now.sources.tolist() == [40]
    now.choose(40, add=True)  # the last one stays
    assert now.sources.tolist() == [40]
    farthest = int(solver.distance(40).argmax())
    assert now.message.endswith(f"farthest {solver.distance(40).max():.6g} at vertex {farthest}")


def test_options_change_the_distance_as_they_change_the_solver(sphere: heat_igl.Mesh) -> None:
    half = heat_igl.Mesh(sphere.V, sphere.F[sphere.V[sphere.F].mean(axis=1)[:, 2] > 0])
    source = int(half.F[0, 0])
    now = Exploration(half, source)
    for options in ({"method": "heat"}, {"t_coef": 4.0}, {"boundary": "dirichlet"}, {"method": "sweep"}):
        now.change(**options)
        expected = now.options.on(half).distance(source)
        np.testing.assert_array_equal(now.distance, expected)
        assert "prepared anew" in now.message
    assert now.options == SolverChoice("sweep", heat=SolverOptions(4.0, boundary="dirichlet"))
    now.change(method="heat")
    assert "prepared anew" not in now.message
    assert "out of reach" in now.message


def test_few_solvers_are_kept(sphere: heat_igl.Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    build = heat_igl.HeatMethodSolver.from_options

    def counting(mesh: heat_igl.Mesh, options: SolverOptions, *others: object) -> heat_igl.HeatMethodSolver:
        made.append(options.t_coef)
        return build(mesh, options, *others)

    monkeypatch.setattr(exploration.HeatMethodSolver, "from_options", counting)
    now = Exploration(sphere, 0, SolverChoice("heat"))
    for t_coef in (2.0, 1.0, 3.0, 4.0, 1.0, 5.0, 2.0):
        now.change(t_coef=t_coef)
    assert made == [None, 2.0, 1.0, 3.0, 4.0, 5.0, 2.0]  # 1 was used in between, so 2 was the one to go


def test_what_cannot_be_solved_changes_nothing(sphere: heat_igl.Mesh) -> None:
    now = Exploration(sphere, 3)
    before = now.distance
    now.change(t_coef=-1.0)
    assert now.message == "t_coef must be a positive number, not -1.0"
    assert now.options == SolverChoice()
    assert now.distance is before
    with pytest.raises(heat_igl.SourceError, match=r"sources\[0\] = 9999"):
        now.choose(9999)


def test_the_error_is_that_against_exact_until_something_changes() -> None:
    mesh = shapes.grid(12)
    now = Exploration(mesh, 0)
    straight = np.linalg.norm(mesh.V - mesh.V[0], axis=1)
    now.compare()
    away = straight > 0
    assert now.error is not None
    np.testing.assert_allclose(now.error[away], 100 * (now.distance[away] / straight[away] - 1), atol=1e-6)
    assert now.error[0] == 0
    mean = np.abs(now.error[away]).mean()
    assert now.message.startswith(f"error {mean:.3g} % in the mean")
    now.choose(5)
    assert now.error is None


def test_no_exact_distance_is_said_not_raised() -> None:
    now = Exploration(shapes.box(2), 0)
    now.compare()
    assert now.message.startswith("no exact distance: ")
    assert now.error is None


def test_directions_and_log_maps_follow_the_source(sphere: heat_igl.Mesh) -> None:
    now = Exploration(sphere, 5)
    for source in (5, 17):
        now.choose(source)
        found = now.directions()
        assert found is not None
        expected = heat_igl.GeodesicSolver(sphere, method="exact").directions(source)
        np.testing.assert_array_equal(found.gradient, expected.gradient)
        np.testing.assert_allclose(now.log_map(), heat_igl.log_map(sphere, source), atol=0.02)
    tetrahedra = Exploration(shapes.box(2), 0)
    assert tetrahedra.log_map() is None
    assert tetrahedra.message.startswith("no directions: ")


def test_a_cloud_is_measured_as_a_cloud(sphere: heat_igl.Mesh) -> None:
    cloud = heat_igl.PointCloud(sphere.V[sphere.V[:, 2] > -0.5])
    now = Exploration(cloud, 3)
    np.testing.assert_array_equal(now.distance, heat_igl.GeodesicSolver(cloud).distance(3))
    assert now.is_cloud
    assert '"points": true' in now.page("cloud").html
    assert '"points": false' in Exploration(cloud.triangles, 3).page("triangles").html


def test_the_page_of_an_exploration_has_what_is_known(sphere: heat_igl.Mesh) -> None:
    now = Exploration(sphere, 3, fields={"height": sphere.V[:, 2]})
    assert '"fields": [["height", 1]]' in now.page("sphere").html
    now.compare()
    text = now.page("sphere").html
    assert '"fields": [["exact", 1], ["height", 1]]' in text
    assert '"beside": "exact"' in text
    assert now.message in text
    now.choose(4)
    assert now.exact is None


def test_a_display_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert viewer.display_problem() == "there is no display"
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "polyscope" else name)
    assert "pip install polyscope" in str(viewer.display_problem())


# ---- under a virtual display

# Apart from pytest, which would turn warnings into errors, and because polyscope lives as long as its process.
CLICK = """
import json, sys, time
import numpy as np
import polyscope
import polyscope as ps
import polyscope.imgui
from Xlib import X, display
from Xlib.ext import xtest
from heat_igl import shapes
from heat_igl.drawing.viewer import Exploration, Window
from heat_igl.geodesic import SolverChoice

mesh = shapes.icosphere(3)
now = Exploration(mesh, 100, SolverChoice("heat"), fields={"height": mesh.V[:, 2]})
ps.set_window_size(1000, 560)
window = Window(now)
screen = display.Display()

def frames(until=lambda: True):
    # At least two, and as many as it takes for what was typed to arrive.
    end = time.monotonic() + 20
    ps.frame_tick()
    while not until():
        assert time.monotonic() < end, "what was typed does not arrive"
        time.sleep(0.01)
        ps.frame_tick()
    ps.frame_tick()

def send(kind, detail, until):
    xtest.fake_input(screen, kind, detail)
    screen.sync()
    frames(until)

def click(x, y, shift=False):
    top = [w for w in screen.screen().root.query_tree().children if w.get_attributes().map_state == X.IsViewable][-1]
    corner, io = top.get_geometry(), polyscope.imgui.GetIO()
    xtest.fake_input(screen, X.MotionNotify, x=corner.x + x, y=corner.y + y)
    screen.sync()
    frames(lambda: np.abs(np.array(polyscope.imgui.GetMousePos()) - [x, y]).max() < 2)
    key = screen.keysym_to_keycode(0xFFE1)
    if shift:
        send(X.KeyPress, key, lambda: io.KeyShift)
    send(X.ButtonPress, 1, lambda: polyscope.imgui.IsMouseDown(0))
    send(X.ButtonRelease, 1, lambda: not polyscope.imgui.IsMouseDown(0))
    if shift:
        send(X.KeyRelease, key, lambda: not io.KeyShift)

frames()
camera = ps.get_view_camera_parameters()
out = {name: np.array(value, float).tolist() for name, value in (
    ("camera", camera.get_position()), ("look", camera.get_look_dir()))}
width, height = ps.get_window_size()
click(width // 2, height // 2)
out["first"] = now.sources.tolist()
out["message"] = now.message
click(width // 2 + 90, height // 2, shift=True)
out["both"] = now.sources.tolist()
ps.screenshot(sys.argv[1], include_UI=True)

# Where the controls are, by a layer between the window and imgui.
gui, places = window._gui, {}
class Watched:
    def __getattr__(self, name):
        found = getattr(gui, name)
        if name not in ("Button", "Checkbox", "Combo", "SliderFloat", "TreeNode"):
            return found
        def watched(label, *arguments, **options):
            result = found(label, *arguments, **options)
            places[label] = np.array([gui.GetItemRectMin(), gui.GetItemRectMax()])
            return result
        return watched
window._gui = Watched()
frames()
def middle(label, across=0.2):
    low, high = places[label]
    return int(low[0] + across * (high[0] - low[0])), int((low[1] + high[1]) / 2)
click(*middle("error against exact (takes seconds)"))
out["error"] = now.message
click(*middle("t / h^2", 0.6))
out["t_coef"] = now.options.heat.t_coef
out["error_gone"] = now.error is None
def pick(label, steps):
    click(*middle(label))
    x, y = middle(label)
    # The list opens below: its items are lines of text, with the usual distance between them.
    line, below = gui.GetTextLineHeightWithSpacing(), places[label][1][1] + gui.GetStyle().WindowPadding[1]
    click(x, int(below + (steps + 0.4) * line))
for label, steps in (("boundary", 1), ("method", 3)):
    pick(label, steps)
out["boundary"], out["method"] = now.options.heat.boundary, now.options.method
out["sources_at_end"] = now.sources.tolist()
click(3 * width // 4, height - 5)
out["beside"] = now.sources.tolist()
click(*middle("fields and scenes", 0.05))
out["shown"] = []
for label, steps in (("show", 1), ("show", 2), ("show", 0)):
    pick(label, steps)
    out["shown"].append(window._field)
click(*middle("directions"))
out["directions"] = window._shows_directions
click(*middle("exact beside it (takes seconds)", 0.05))
out["exact"], out["beside_it"] = now.exact.tolist(), ps.has_surface_mesh("exact")
click(*middle("exact beside it (takes seconds)", 0.05))
out["gone"] = not ps.has_surface_mesh("exact")
click(*middle("save the scene as a page"))
out["saved"] = now.message
print(json.dumps(out))
"""


@pytest.fixture
def virtual_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A display of its own for the processes that the test starts."""
    pytest.importorskip("polyscope", reason="polyscope is not installed")
    pytest.importorskip("Xlib", reason="python-xlib is not installed")
    binary = shutil.which("Xvfb")
    if binary is None:
        pytest.skip("no Xvfb on this machine")
    readable, writable = os.pipe()
    server = subprocess.Popen(
        [binary, "-displayfd", str(writable), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
        pass_fds=[writable], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(writable)
    try:
        with os.fdopen(readable) as stream:
            number = stream.readline().strip()
        if not number:
            pytest.skip("Xvfb does not start")
        monkeypatch.setenv("DISPLAY", f":{number}")
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        yield
    finally:
        server.terminate()
        server.wait()


def run(code: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(Path(heat_igl.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=cwd, env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.usefixtures("virtual_display")
def test_a_click_in_the_window_picks_a_vertex(tmp_path: Path) -> None:
    done = run(CLICK, str(tmp_path / "window.png"), cwd=tmp_path)
    if "could not initialize" in done.stderr.lower() or "glfw" in done.stderr.lower():
        pytest.skip(f"no OpenGL for a window: {done.stderr.splitlines()[-1]}")
    assert done.returncode == 0, done.stderr[-3000:]
    out = json.loads(done.stdout.splitlines()[-1])
    mesh = shapes.icosphere(3)
    # In the middle of the window is what the camera looks at: the vertex next to where its axis enters the sphere.
    camera, look = np.array(out["camera"]), np.array(out["look"]) / np.linalg.norm(out["look"])
    along = -camera @ look
    enters = camera + (along - np.sqrt(1 - (camera @ camera - along**2))) * look
    (first,) = out["first"]
    assert first != 100  # the source at the start
    assert np.linalg.norm(mesh.V[first] - enters) < mesh.edge_lengths.max()
    distance = heat_igl.HeatMethodSolver(mesh).distance(first)
    assert out["message"].endswith(f"farthest {distance.max():.6g} at vertex {distance.argmax()}")
    assert len(out["both"]) == 2
    assert first in out["both"]
    assert out["beside"] == out["sources_at_end"] == out["both"]
    assert out["error"].startswith(("error ", "no exact distance"))
    assert out["t_coef"] > 1.5
    assert out["error_gone"]
    assert (out["boundary"], out["method"]) == ("dirichlet", "sweep")
    assert out["shown"] == ["log map", "height", "distance"]
    assert out["directions"]
    np.testing.assert_allclose(out["exact"], heat_igl.geodesic_distance(mesh, out["both"], method="exact"), atol=1e-9)
    assert out["beside_it"]
    assert out["gone"]
    assert out["saved"] == f"saved {tmp_path / 'heat-igl-scene.html'}"
    assert '"fields": [["exact", 1], ["height", 1]]' in (tmp_path / "heat-igl-scene.html").read_text(encoding="utf8")
    # No settings are left behind.
    assert {path.name for path in tmp_path.iterdir()} == {"window.png", "heat-igl-scene.html"}
    shown = pytest.importorskip("matplotlib.image").imread(tmp_path / "window.png")
    assert len(np.unique(shown[..., :3].reshape(-1, 3).round(1), axis=0)) > 30


# ---- the command


def view(*arguments: str) -> str:
    return f"import sys; sys.argv[1:] = {['view', *arguments]!r}; from heat_igl.__main__ import main; sys.exit(main())"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    pytest.importorskip("typer")
    pytest.importorskip("matplotlib")
    heat_igl.write_mesh(tmp_path / "ball.off", shapes.icosphere(2))
    return tmp_path


def test_without_a_display_the_command_writes_a_page(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux tells whether there is a display")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    done = run(view("ball.off", "--source", "7", "--source", "3", "--t-coef", "0.5"), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "heat-igl: no window: there is no display\n"
    assert "ball-view.html" in done.stdout
    text = (folder / "ball-view.html").read_text(encoding="utf8")
    assert "<title>ball.off</title>" in text
    assert '"sources": [3, 7]' in text
    assert "with t = 0.5 h^2." in text


def test_the_command_writes_the_page_that_it_is_told_to(folder: Path) -> None:
    done = run(view("ball.off", "--html", "shown.html"), cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in folder.iterdir()} == {"ball.off", "shown.html"}
    for name, message in (("shown.pdf", "pages go to .html or .htm files"), ("no/a.html", "there is no directory no")):
        done = run(view("ball.off", "--html", name), cwd=folder)
        assert done.returncode == 1
        assert message in done.stderr
        assert done.stderr.count("\n") == 1
    assert {path.name for path in folder.iterdir()} == {"ball.off", "shown.html"}


def test_the_command_writes_exact_signed_and_points(folder: Path) -> None:
    sphere = shapes.icosphere(2)
    heat_igl.write_curves(folder / "loops.obj", sphere, heat_igl.isolines(sphere, sphere.V[:, 2], 0.1)[0])
    done = run(view("ball.off", "--html", "a.html", "--exact", "--curves", "loops.obj"), cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    text = (folder / "a.html").read_text(encoding="utf8")
    assert '"fields": [["exact", 1], ["signed distance", 1]]' in text
    assert '"beside": "exact"' in text
    heat_igl.write_point_cloud(folder / "scan.ply", heat_igl.PointCloud(sphere.V))
    done = run(view("scan.ply", "--html", "b.html", "--points"), cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert '"points": true' in (folder / "b.html").read_text(encoding="utf8")


# Waits for the window, and closes it as its own button would.
CLOSE = """
import sys, time
from Xlib import X, display
from Xlib.protocol import event
screen = display.Display()
end = time.monotonic() + 60
while True:
    found = [w for w in screen.screen().root.query_tree().children if w.get_wm_name() and w.get_wm_protocols()]
    if found:
        break
    assert time.monotonic() < end, "no window"
    time.sleep(0.1)
print(found[0].get_wm_name())
data = (32, [screen.intern_atom("WM_DELETE_WINDOW"), X.CurrentTime, 0, 0, 0])
found[0].send_event(event.ClientMessage(window=found[0], client_type=screen.intern_atom("WM_PROTOCOLS"), data=data))
screen.sync()
"""


@pytest.mark.usefixtures("virtual_display")
def test_with_a_display_the_command_opens_a_window(folder: Path) -> None:
    path = os.pathsep.join([str(Path(heat_igl.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    shown = subprocess.Popen(
        [sys.executable, "-c", view("ball.off", "--source", "7")], cwd=folder, env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        closed = run(CLOSE, cwd=folder)
        assert closed.stdout == "heat-igl: ball.off\n", closed.stderr
        output, errors = shown.communicate(timeout=60)
    finally:
        shown.kill()
        shown.wait()
    assert (shown.returncode, output, errors) == (0, "", "")
    assert {path.name for path in folder.iterdir()} == {"ball.off"}
