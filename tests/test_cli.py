"""The command line: what it prints, what it leaves behind, and how it fails."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from conftest import ENVIRONMENT, run_python
from surfaces import twice

import heat_igl
from heat_igl import cli, drawing, io, shapes
from heat_igl.cli import distances, views
from heat_igl.cli.program import EXAMPLES, application
from heat_igl.io import read_attributes, read_mesh, read_polylines, write_curves, write_mesh


def command(*arguments: str | Path | float, cwd: Path) -> subprocess.CompletedProcess[str]:
    return run_python("-m", "heat_igl", *map(str, arguments), cwd=cwd)


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def assert_one_line(stderr: str, *words: str) -> None:
    assert stderr.startswith("heat-igl: "), stderr
    assert stderr.count("\n") == 1, stderr
    for word in words:
        assert word in stderr


@pytest.fixture(autouse=True)
def _small(monkeypatch):
    """Pictures of few pixels."""
    monkeypatch.setattr("heat_igl.drawing.figure.DPI", 40)


@pytest.fixture
def ball(tmp_path):
    io.write_mesh(tmp_path / "sphere.off", shapes.icosphere(2))
    return tmp_path / "sphere.off"


@pytest.fixture
def two_spheres(tmp_path):
    io.write_mesh(tmp_path / "two.off", twice(shapes.icosphere(1)))
    return tmp_path / "two.off"


def test_distance_writes_what_the_library_returns_and_a_picture(ball, capsys, monkeypatch):
    monkeypatch.chdir(ball.parent)
    arguments = "--source 12 --source 40 --output out.ply --picture out.png"
    assert cli.run(["distance", str(ball), *arguments.split()]) == 0
    printed, said = capsys.readouterr()
    assert said == ""
    written = io.read_attributes(ball.parent / "out.ply")["distance"]
    np.testing.assert_array_equal(written, heat_igl.geodesic_distance(shapes.icosphere(2), [12, 40]))
    assert written[[12, 40]].tolist() == [0, 0]
    assert (ball.parent / "out.png").read_bytes().startswith(b"\x89PNG")
    assert f"{written.max():.6g} at vertex {written.argmax()}" in printed
    assert files(ball.parent) == {"sphere.off", "out.ply", "out.png"}


def test_distance_from_positions_in_space(ball, capsys):
    output = ball.with_name("out.ply")
    options = ["--source=12", "--at=0.3,-2,0.1", "--cutoff=0.5", f"--output={output}"]
    assert cli.run(["distance", str(ball), *options]) == 0
    mesh = shapes.icosphere(2)
    points, gap = heat_igl.closest_points(mesh, [0.3, -2, 0.1])
    expected = heat_igl.geodesic_distance(mesh, [12, points], cutoff=0.5)
    np.testing.assert_array_equal(io.read_attributes(output)["distance"], expected)
    assert np.isinf(expected).any()
    assert f"{gap[0]:.6g}" in capsys.readouterr().out


def test_paths_and_traces_are_those_of_the_library(ball, capsys, monkeypatch):
    monkeypatch.chdir(ball.parent)
    mesh = shapes.icosphere(2)
    place = heat_igl.closest_points(mesh, [0.3, 2, 0.1]).points
    expected = {
        ("path", "12", "0.3,2,0.1", "40"): heat_igl.geodesic_path(mesh, [12, place, 40]),
        ("path", "--from=12", "--to=40"): heat_igl.shortest_paths(mesh, 12, 40)[0],
        ("trace", "--from=12", "--direction=1,2,3", "--length=0.7"): heat_igl.trace_geodesic(mesh, 12, [1, 2, 3], 0.7),
    }
    for (name, *arguments), curve in expected.items():
        assert cli.run([name, str(ball), *arguments, "--output=curve.svg"]) == 0  # from one side, as of isolines
        assert cli.run([name, str(ball), *arguments, "--output=curve.obj"]) == 0
        printed = capsys.readouterr().out
        assert f"{curve.lengths(mesh).sum():.6g}" in printed
        # The position is told how far it is from the surface.
        gap = heat_igl.closest_points(mesh, [0.3, 2, 0.1]).gap[0]
        assert (f"off the surface  {gap:.6g}" in printed) == ("0.3,2,0.1" in arguments)
        written = [line.split()[1:] for line in Path("curve.obj").read_text().splitlines() if line.startswith("v ")]
        np.testing.assert_allclose(np.array(written, float), curve.positions(mesh), atol=1e-6)


def test_without_typer_one_line_names_the_extra(tmp_path):
    code = "import sys; sys.modules['typer'] = None; from heat_igl.__main__ import main; sys.exit(main())"
    done = run_python("-c", code, cwd=tmp_path)
    assert done.returncode == 1
    assert_one_line(done.stderr, "pip install typer rich")


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
def test_an_interrupt_ends_the_command_without_a_traceback(tmp_path):
    code = (
        # A process started in the background inherits that interrupts are ignored; a user's is not.
        "import signal, sys, time; from heat_igl import cli; from heat_igl.cli import views\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def read_mesh_or_cloud(path, points):\n    print('ready', flush=True)\n    time.sleep(60)\n"
        "views.read_mesh_or_cloud = read_mesh_or_cloud; sys.exit(cli.run(['info', 'a.off']))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, env=ENVIRONMENT, stdout=-1, stderr=-1, text=True
    ) as running:
        assert running.stdout.readline() == "ready\n"
        running.send_signal(signal.SIGINT)
        _, stderr = running.communicate(timeout=30)
    assert running.returncode == 130
    assert stderr == "heat-igl: interrupted\n"


@pytest.mark.skipif(os.name != "posix", reason="needs a shell with pipes")
def test_a_closed_pipe_is_no_traceback(ball):
    with subprocess.Popen(
        [sys.executable, "-m", "heat_igl", "info", str(ball)], env=ENVIRONMENT, stdout=-1, stderr=-1, text=True
    ) as running:
        running.stdout.close()
        assert "Traceback" not in running.stderr.read()
    assert running.returncode == 1


@pytest.mark.slow
def test_demo_does_the_whole_job(tmp_path):
    done = command("demo", "--out", "made/results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    name = "bunny" if shapes.bunny_path() else "sphere"
    assert files(tmp_path / "made/results") == {f"{name}.ply", f"{name}.png"}
    mesh = io.read_mesh(tmp_path / "made/results" / f"{name}.ply")
    distance = io.read_attributes(tmp_path / "made/results" / f"{name}.ply")["distance"]
    np.testing.assert_array_equal(distance, heat_igl.geodesic_distance(mesh, 1234))
    assert f"{mesh.n_vertices} vertices" in done.stdout
    error = re.search(r"^heat .* error (\S+) %", done.stdout, re.MULTILINE)
    assert 0.1 < float(error[1]) < 1.5


@pytest.mark.parametrize("method", ["windows", "sweep", "heat"])
def test_the_method_is_that_of_the_front_door(ball, capsys, method):
    output = ball.with_name("out.ply")
    assert cli.run(["distance", str(ball), "--source=3", f"--output={output}", f"--method={method}"]) == 0
    expected = heat_igl.geodesic_distance(ball, 3, method=method)
    np.testing.assert_array_equal(io.read_attributes(output)["distance"], expected)
    engine = heat_igl.geodesic.SolverChoice(method).on(heat_igl.read_mesh(ball)).plan.engine
    assert re.search(rf"^plan +{engine}\b", capsys.readouterr().out, re.MULTILINE)


def test_options_reach_the_solver(ball, capsys):
    output = ball.with_name("out.ply")
    options = {"t_coef": 7.0, "laplacian": "cotan", "boundary": "dirichlet", "magnitude": "damped", "backend": "scipy"}
    arguments = [f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    assert cli.run(["distance", str(ball), "--source", "3", "--output", str(output), *arguments]) == 0
    solver = heat_igl.HeatMethodSolver(shapes.icosphere(2), **options)
    np.testing.assert_array_equal(io.read_attributes(output)["distance"], solver.distance(3))
    assert f"{solver.t:.6g}" in capsys.readouterr().out


def test_a_warning_of_the_package_is_one_line(ball, capsys):
    assert cli.run(["distance", str(ball), "--source", "3", "--t", "1e-300"]) == 0
    first, *others = capsys.readouterr().err.splitlines()
    assert first.startswith("heat-igl: warning: t = 1e-300 is too small")
    assert all(line.startswith("heat-igl: warning: ") for line in others)


def test_tetrahedra_go_to_vtu_only(tmp_path, capsys):
    box = tmp_path / "box.mesh"
    io.write_mesh(box, shapes.box(2))
    assert cli.run(["distance", str(box), "--source", "0", "--output", str(tmp_path / "out.ply")]) == 1
    assert_one_line(capsys.readouterr().err, "tetrahedra with distances go to .vtu, .npy or .csv files")
    assert cli.run(["distance", str(box), "--source", "0", "--output", str(tmp_path / "out.vtu")]) == 0
    distance = io.read_attributes(tmp_path / "out.vtu")["distance"]
    np.testing.assert_array_equal(distance, heat_igl.GeodesicSolver(shapes.box(2)).distance(0))
    # Straight lines have no time step; an option of heat asks for heat.
    assert "time step" not in capsys.readouterr().out
    assert cli.run(["distance", str(box), "--source", "0", "--t-coef", "1"]) == 0
    assert "time step" in capsys.readouterr().out


def test_a_failure_while_drawing_leaves_old_files_alone(ball, capsys, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device", "out.png")

    monkeypatch.setattr(drawing, "plot", full)
    output = ball.with_name("out.ply")
    output.write_text("old")
    picture = ball.with_name("out.png")
    assert cli.run(["distance", str(ball), "--source", "0", f"--output={output}", f"--picture={picture}"]) == 1
    assert_one_line(capsys.readouterr().err, "out.png: No space left on device")
    assert output.read_text() == "old"
    assert files(ball.parent) == {"sphere.off", "out.ply"}


def test_a_fault_of_the_package_is_not_hidden(ball, monkeypatch):
    def broken(*_):
        raise TypeError("a bug")

    monkeypatch.setattr(views, "read_mesh_or_cloud", broken)
    with pytest.raises(TypeError, match="a bug"):
        cli.run(["info", str(ball)])


# --- JSON, arrays, help and completion --------------------------------------------------------------------------------


def commands() -> list[str]:
    return [each.name for each in application().registered_commands]


@pytest.mark.parametrize("name", commands())
def test_every_command_has_json_and_examples(capsys, name):
    assert cli.run([name, "--help"]) == 0
    out = capsys.readouterr().out
    assert "--json FILE" in out
    assert next(f"  heat-igl {example}\n" for example in EXAMPLES if example.split()[0] == name) in out


@pytest.mark.parametrize("example", EXAMPLES)
def test_examples_are_understood(example):
    command = typer.main.get_command(application())
    name, *arguments = example.split()
    context = command.commands[name].make_context(name, arguments)
    assert all(value is not None for key, value in context.params.items() if key in ("mesh", "folder", "store"))


def test_json_holds_what_the_lines_say(ball, capsys):
    arguments = [
        "distance",
        str(ball),
        "--source=12",
        "--method=heat",
        f"--output={ball.with_name('d.npy')}",
    ]
    assert cli.run([*arguments, "--json=-"]) == 0
    found = json.loads(capsys.readouterr().out)
    distance = heat_igl.HeatMethodSolver(ball).distance(12)
    assert np.array_equal(np.load(ball.with_name("d.npy")), distance)
    assert found["mesh"] == {"path": str(ball), "n_vertices": 162, "n_triangles": 320}
    assert found["farthest"] == {"distance": distance.max(), "vertex": distance.argmax()}
    assert (found["plan"]["engine"], found["mean"]) == ("heat", distance.mean())
    assert found["wrote"] == [str(ball.with_name("d.npy"))]
    assert found["seconds"]["per_distance"] > 0
    file = ball.with_name("d.json")
    assert cli.run([*arguments, f"--json={file}"]) == 0
    assert re.search(r"farthest +\S+ at vertex", capsys.readouterr().out)
    assert json.loads(file.read_text())["farthest"] == found["farthest"]


def test_json_of_the_other_commands(ball, capsys):
    def printed(*arguments):
        assert cli.run([arguments[0], str(ball), *arguments[1:], "--json=-"]) == 0
        return json.loads(capsys.readouterr().out)

    report = shapes.icosphere(2).report()
    assert printed("info")["mean_edge"] == report.mean_edge
    lines = printed("isolines", "--source=0", "--spacing=0.5", f"--output={ball.with_name('l.obj')}")
    assert (lines["lines"], lines["distances"]) == (6, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    assert lines["farthest"] == printed("distance", "--source=0")["farthest"]["distance"]
    by_heat = printed("isolines", "--source=0", "--spacing=0.5", "--method=heat", f"--output={ball.with_name('l.obj')}")
    assert by_heat["farthest"] == heat_igl.HeatMethodSolver(ball).distance(0).max()
    path = printed("path", "--from=0", "--to=5", f"--output={ball.with_name('p.obj')}")
    assert path["length"] == pytest.approx(heat_igl.geodesic_distance(ball, 0, method="exact")[5], rel=1e-12)
    page = printed("view", f"--html={ball.with_name('v.html')}")
    assert page["wrote"] == [str(ball.with_name("v.html"))]
    validation = printed("validate", "--methods=heat")
    assert validation["rows"][0]["errors"]["mean"] < 0.05


def test_distances_as_text(two_spheres):
    file = two_spheres.with_name("d.csv")
    assert cli.run(["distance", str(two_spheres), "--source=3", f"--output={file}"]) == 0
    first, *lines = file.read_text().splitlines()
    assert first == "vertex,distance"
    vertex, distance = np.array([line.split(",") for line in lines], float).T
    assert np.array_equal(vertex, np.arange(84))
    assert np.array_equal(distance, heat_igl.geodesic_distance(two_spheres, 3))


# --- The commands `signed` and `cut`, and the polylines that they read


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A sphere, and a circle around its pole."""
    monkeypatch.chdir(tmp_path)
    sphere = shapes.icosphere(3)
    write_mesh("sphere.ply", sphere)
    write_curves("circle.obj", sphere, heat_igl.isolines(sphere, -sphere.V[:, 2], -0.6)[0])
    return tmp_path


FAILURES = {
    "signed sphere.ply --curves=none.obj": "none.obj",
    "signed sphere.ply --curves=sphere.ply": "a zero byte",
    "signed sphere.ply --curves=far.obj": "far.obj, polyline 1: the polyline leaves the surface by",
    "cut sphere.ply --curves=circle.obj --output=cut.png": "--output cut.png: meshes go to",
    "isolines sphere.ply --source=5 --spacing=0.5 --output=a.png": "curves go to",
    "isolines sphere.ply --source=5 --spacing=1e-9 --output=a.obj": "over 10000",
    "path sphere.ply --from=0 --to=642 --output=p.obj": "--to 642 is no vertex: the mesh has 642, counted from 0",
    "path sphere.ply --from=-1 --to=0 --output=p.obj": "--from -1 is no vertex",
    "path sphere.ply --output=p.obj": "name two waypoints or more",
    "distance sphere.ply": "no source: name vertices",
    "distance sphere.ply --at 1,2": "--at 1,2: three numbers",
    "distance sphere.ply --source=0 --region=wall": "--region wall: no NPY file, and no vertex attribute",
    "distance sphere.ply --source=0 --output=/proc/out.ply": "/proc/out.ply cannot be written",
    "distance sphere.ply --source=0 --picture=/proc/out.png": "/proc/out.png cannot be written",
    "validate noise.off": "noise.off",
    "validate sphere.ply --methods heat,magic": "'magic' is unknown",
    "validate sphere.ply --sources 1000": "1000 sources cannot be drawn",
    "validate sphere.ply --picture errors.gif": "errors.gif",
    "validate sphere.ply --json nowhere/report.json": "nowhere",
    "view sphere.ply --html shown.pdf": "pages go to .html or .htm files",
    "view sphere.ply --html nowhere/a.html": "there is no directory nowhere",
}
# Known to be wrong before anything is solved.
MISUSES = {
    "distance sphere.ply --source=0 --t-coef=-1": "-1 is not a positive number",
    "distance sphere.ply --source=0 --t=nan": "nan is not a positive number",
    "distance sphere.ply --source=0 --laplacian=graph": "auto, intrinsic-delaunay, intrinsic-delaunay-refined, cotan",
}


@pytest.mark.parametrize("arguments", [*FAILURES, *MISUSES])
def test_failures_are_one_line_and_leave_nothing(folder, capsys, monkeypatch, arguments):
    if "/proc" in arguments and not Path("/proc/self").exists():
        pytest.skip("needs a directory in which even root cannot write")
    circle = (folder / "circle.obj").read_text()
    n = circle.count("v ")
    (folder / "far.obj").write_text(f"{circle}v 9 0 0\nv 9 1 0\nl {n + 1} {n + 2}\n")
    (folder / "noise.off").write_text("OFF\n3 1 0\n0 0 zero\n")
    before = files(folder)
    if arguments in MISUSES:
        monkeypatch.setattr(distances.SolverChoice, "on", lambda *_: pytest.fail("solved before it checked"))
    assert cli.run(arguments.split()) == (2 if arguments in MISUSES else 1)
    printed = capsys.readouterr()
    assert not printed.out
    assert_one_line(printed.err, {**FAILURES, **MISUSES}[arguments])
    assert files(folder) == before


def test_signed_draws_a_mesh_of_which_curves_reach_a_part(two_spheres):
    mesh = read_mesh(two_spheres)
    loops = two_spheres.with_name("loops.obj")
    write_curves(loops, mesh, heat_igl.isolines(mesh, mesh.V[:, 2], [0.1])[0])
    drawn = two_spheres.with_name("signed.png")
    assert cli.run(["signed", str(two_spheres), f"--curves={loops}", f"--picture={drawn}"]) == 0
    assert drawn.read_bytes().startswith(b"\x89PNG")


def test_signed_writes_what_the_library_returns(folder, capsys):
    arguments = ["signed", "sphere.ply", "--curves=circle.obj", "--output=out.ply"]
    assert cli.run([*arguments, "--picture=out.png"]) == 0
    sphere = read_mesh("sphere.ply")
    circle = read_polylines("circle.obj")[0]
    curve = heat_igl.curve_on(sphere, circle.positions, closed=True)
    phi = heat_igl.SignedHeatSolver(sphere).distance(curve)
    np.testing.assert_array_equal(read_attributes("out.ply")["distance"], phi)
    assert (folder / "out.png").stat().st_size > 1000
    # The cap of the north pole is on the left.
    np.testing.assert_array_equal(phi < 0, sphere.V[:, 2] > 0.6)
    assert f"{(phi < 0).sum()} vertices, down to" in capsys.readouterr().out


def test_cut_writes_the_pieces(folder, capsys):
    assert cli.run(["cut", "sphere.ply", "--curves=circle.obj", "--output=part.ply", "--split"]) == 0
    parts = [read_mesh(folder / f"part_{i}.ply") for i in (0, 1)]
    assert not (folder / "part.ply").exists()
    assert sum(part.measures.sum() for part in parts) == pytest.approx(read_mesh("sphere.ply").measures.sum())
    assert all(part.boundary.any() for part in parts)
    assert "pieces" in capsys.readouterr().out
    assert cli.run(["cut", "sphere.ply", "--curves=circle.obj", "--output=whole.ply"]) == 0
    assert read_mesh("whole.ply").n_faces == sum(part.n_faces for part in parts)


def test_polylines_are_those_that_were_written(folder):
    sphere = read_mesh("sphere.ply")
    curves = heat_igl.isolines(sphere, sphere.V[:, 2], [0.1, 0.5])
    path = heat_igl.edge_curve(sphere, [0, int(sphere.edges[sphere.edges[:, 0] == 0][0, 1])])
    write_curves("lines.obj", sphere, [*curves, path])
    found = read_polylines(folder / "lines.obj")
    assert [line.is_closed for line in found] == [True, True, False]
    for line, curve in zip(found, [curves[0][0], curves[1][0], path], strict=True):
        expected = curve.positions(sphere)
        np.testing.assert_array_equal(line.positions, expected[:-1] if line.is_closed else expected)


@pytest.mark.usefixtures("folder")
def test_commands_for_curves_take_point_clouds(capsys):
    """Lines of one command are those that another reads; they lie on the triangles between the points."""
    cloud = heat_igl.PointCloud(shapes.icosphere(3).V)
    heat_igl.write_point_cloud("cloud.xyz", cloud)
    assert cli.run(["isolines", "cloud.xyz", "--source=0", "--spacing=1.5", "--output=lines.obj"]) == 0
    expected = heat_igl.isolines(cloud, heat_igl.geodesic_distance(cloud, 0), [1.5, 3.0])
    np.testing.assert_array_equal(
        np.concatenate([line.positions for line in read_polylines("lines.obj")]),
        np.concatenate([curve.positions(cloud)[:-1] for level in expected for curve in level]),
    )
    assert cli.run(["path", "cloud.xyz", "--from=0", "--to=20", "--output=path.obj"]) == 0
    assert f"{heat_igl.geodesic_distance(cloud, 0)[20]:.6g}" in capsys.readouterr().out
    assert cli.run(["trace", "cloud.xyz", "--from=0", "--direction=1,0,0", "--length=1.5", "--output=line.obj"]) == 0
    assert cli.run(["signed", "cloud.xyz", "--curves=lines.obj", "--output=signed.npy"]) == 0
    assert (np.load("signed.npy") < 0).any()
    assert cli.run(["cut", "cloud.xyz", "--curves=circle.obj", "--output=cut.ply"]) == 0
    assert read_mesh("cut.ply").n_faces > cloud.n_faces
    assert cli.run(["info", "cloud.xyz"]) == 0
    assert "cloud.xyz: 642 points, 1280 triangles" in capsys.readouterr().out


@pytest.mark.parametrize("display", ["", ":0"])
def test_the_page_is_opened_where_there_is_a_display(display, ball, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: not opened.append(address))
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    monkeypatch.chdir(ball.parent)
    assert cli.run(["view", "sphere.off", "--source", "7", "--source", "3", "--t-coef", "0.5"]) == 0
    page = ball.with_name("sphere-view.html")
    assert opened == ([page.as_uri()] if display else [])
    assert ("open it in a browser" in capsys.readouterr().out) == (not display)
    text = page.read_text(encoding="utf8")
    assert "<title>sphere.off</title>" in text
    assert '"sources": [3, 7]' in text
    assert "with t = 0.5 h^2." in text


@pytest.mark.usefixtures("folder")
def test_view_shows_exact_and_signed_distance_and_points():
    assert cli.run(["view", "sphere.ply", "--html", "a.html", "--exact", "--curves", "circle.obj"]) == 0
    text = Path("a.html").read_text(encoding="utf8")
    assert '"fields": [["exact", 1], ["signed distance", 1]]' in text
    assert '"beside": "exact"' in text
    heat_igl.write_point_cloud("scan.ply", heat_igl.PointCloud(shapes.icosphere(2).V))
    assert cli.run(["view", "scan.ply", "--html", "b.html", "--points"]) == 0
    assert '"points": true' in Path("b.html").read_text(encoding="utf8")
