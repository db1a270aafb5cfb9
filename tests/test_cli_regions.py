"""The commands `signed` and `cut`, and the polylines that they read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import heat_igl
from heat_igl import MeshError, cli, shapes
from heat_igl.io import read_attributes, read_mesh, read_polylines, write_curves, write_mesh


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sphere, and a circle around its pole."""
    monkeypatch.chdir(tmp_path)
    sphere = shapes.icosphere(3)
    write_mesh("sphere.ply", sphere)
    write_curves("circle.obj", sphere, heat_igl.isolines(sphere, -sphere.V[:, 2], -0.6)[0])
    return tmp_path


def test_signed_writes_what_the_library_returns(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_cut_writes_the_pieces(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["cut", "sphere.ply", "--curves=circle.obj", "--output=part.ply", "--split"]) == 0
    parts = [read_mesh(folder / f"part_{i}.ply") for i in (0, 1)]
    assert not (folder / "part.ply").exists()
    assert sum(part.measures.sum() for part in parts) == pytest.approx(read_mesh("sphere.ply").measures.sum())
    assert all(part.boundary.any() for part in parts)
    assert "pieces" in capsys.readouterr().out
    assert cli.run(["cut", "sphere.ply", "--curves=circle.obj", "--output=whole.ply"]) == 0
    assert read_mesh("whole.ply").n_faces == sum(part.n_faces for part in parts)


def test_polylines_are_those_that_were_written(folder: Path) -> None:
    sphere = read_mesh("sphere.ply")
    curves = heat_igl.isolines(sphere, sphere.V[:, 2], [0.1, 0.5])
    path = heat_igl.edge_curve(sphere, [0, int(sphere.edges[sphere.edges[:, 0] == 0][0, 1])])
    write_curves("lines.obj", sphere, [*curves, path])
    found = read_polylines(folder / "lines.obj")
    assert [line.is_closed for line in found] == [True, True, False]
    for line, curve in zip(found, [curves[0][0], curves[1][0], path], strict=True):
        expected = curve.positions(sphere)
        np.testing.assert_array_equal(line.positions, expected[:-1] if line.is_closed else expected)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("v 0 0 0\nv 1 0 0\n", "holds no curve"),
        ("v 0 0 0\nl 1 2\n", "line 2: vertex 2 is not one of the 1 in the file"),
        ("v 0 zero 0\nl 1 1\n", "line 1: 'v 0 zero 0' is no vertex or line"),
        ("v 0 0 0\nl 1\n", "line 2: a curve needs two vertices or more"),
    ],
)
def test_files_without_curves(tmp_path: Path, text: str, match: str) -> None:
    (tmp_path / "bad.obj").write_text(text)
    with pytest.raises(MeshError, match=match):
        read_polylines(tmp_path / "bad.obj")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["signed", "sphere.ply", "--curves=none.obj"], "none.obj"),
        (["signed", "sphere.ply", "--curves=sphere.ply"], "holds no curve"),
        (["signed", "sphere.ply", "--curves=far.obj"], "far.obj, polyline 1: the polyline leaves the surface by"),
        (["cut", "sphere.ply", "--curves=circle.obj", "--output=cut.png"], "--output cut.png: meshes go to"),
    ],
)
def test_failures_are_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    circle = (folder / "circle.obj").read_text()
    n = circle.count("v ")
    (folder / "far.obj").write_text(f"{circle}v 9 0 0\nv 9 1 0\nl {n + 1} {n + 2}\n")
    before = sorted(folder.iterdir())
    assert cli.run(arguments) == 1
    message = capsys.readouterr().err
    assert message.startswith("heat-igl: ")
    assert words in message
    assert message.count("\n") == 1
    assert sorted(folder.iterdir()) == before


@pytest.mark.usefixtures("folder")
def test_commands_for_curves_take_point_clouds(capsys: pytest.CaptureFixture[str]) -> None:
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
