"""The command `view`: the page that it writes, and opens."""

import sys
from pathlib import Path

import pytest

import heat_igl
from heat_igl import cli, shapes


@pytest.fixture
def folder(tmp_path):
    pytest.importorskip("typer")
    pytest.importorskip("matplotlib")
    heat_igl.write_mesh(tmp_path / "ball.off", shapes.icosphere(2))
    return tmp_path


@pytest.mark.parametrize("display", ["", ":0"])
def test_the_page_is_opened_where_there_is_a_display(display, folder, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: not opened.append(address))
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    monkeypatch.chdir(folder)
    assert cli.run(["view", "ball.off", "--source", "7", "--source", "3", "--t-coef", "0.5"]) == 0
    page = folder / "ball-view.html"
    assert opened == ([page.as_uri()] if display else [])
    assert ("open it in a browser" in capsys.readouterr().out) == (not display)
    text = page.read_text(encoding="utf8")
    assert "<title>ball.off</title>" in text
    assert '"sources": [3, 7]' in text
    assert "with t = 0.5 h^2." in text


def test_the_command_writes_exact_signed_and_points(folder, monkeypatch):
    monkeypatch.chdir(folder)
    sphere = shapes.icosphere(2)
    heat_igl.write_curves("loops.obj", sphere, heat_igl.isolines(sphere, sphere.V[:, 2], [0.1])[0])
    assert cli.run(["view", "ball.off", "--html", "a.html", "--exact", "--curves", "loops.obj"]) == 0
    assert {path.name for path in folder.iterdir()} == {"ball.off", "loops.obj", "a.html"}
    text = Path("a.html").read_text(encoding="utf8")
    assert '"fields": [["exact", 1], ["signed distance", 1]]' in text
    assert '"beside": "exact"' in text
    heat_igl.write_point_cloud("scan.ply", heat_igl.PointCloud(sphere.V))
    assert cli.run(["view", "scan.ply", "--html", "b.html", "--points"]) == 0
    assert '"points": true' in Path("b.html").read_text(encoding="utf8")
