"""The command `view`: the page that it writes, and opens."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import heat_igl
from heat_igl import cli, shapes


def run(code: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(Path(heat_igl.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=cwd, env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def view(*arguments: str) -> str:
    return f"import sys; sys.argv[1:] = {['view', *arguments]!r}; from heat_igl.__main__ import main; sys.exit(main())"


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
