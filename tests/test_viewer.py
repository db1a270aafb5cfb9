"""The command `view`: the page that it writes, and opens."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from conftest import run_python

import heat_igl
from heat_igl import cli, shapes


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    pytest.importorskip("typer")
    pytest.importorskip("matplotlib")
    heat_igl.write_mesh(tmp_path / "ball.off", shapes.icosphere(2))
    return tmp_path


@pytest.mark.parametrize("display", ["", ":0"])
def test_the_page_is_opened_where_there_is_a_display(
    display: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
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


def test_the_command_writes_the_page_that_it_is_told_to(folder: Path) -> None:
    done = run_python("-m", "heat_igl", "view", "ball.off", "--html", "shown.html", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in folder.iterdir()} == {"ball.off", "shown.html"}
    for name, message in (("shown.pdf", "pages go to .html or .htm files"), ("no/a.html", "there is no directory no")):
        done = run_python("-m", "heat_igl", "view", "ball.off", "--html", name, cwd=folder)
        assert done.returncode == 1
        assert message in done.stderr
        assert done.stderr.count("\n") == 1
    assert {path.name for path in folder.iterdir()} == {"ball.off", "shown.html"}


def test_the_command_writes_exact_signed_and_points(folder: Path) -> None:
    sphere = shapes.icosphere(2)
    heat_igl.write_curves(folder / "loops.obj", sphere, heat_igl.isolines(sphere, sphere.V[:, 2], 0.1)[0])
    done = run_python(
        "-m", "heat_igl", "view", "ball.off", "--html", "a.html", "--exact", "--curves", "loops.obj", cwd=folder
    )
    assert (done.returncode, done.stderr) == (0, "")
    text = (folder / "a.html").read_text(encoding="utf8")
    assert '"fields": [["exact", 1], ["signed distance", 1]]' in text
    assert '"beside": "exact"' in text
    heat_igl.write_point_cloud(folder / "scan.ply", heat_igl.PointCloud(sphere.V))
    done = run_python("-m", "heat_igl", "view", "scan.ply", "--html", "b.html", "--points", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert '"points": true' in (folder / "b.html").read_text(encoding="utf8")
