"""The code blocks of the pages that newcomers read first: they run as they stand."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heat_igl
from heat_igl import shapes

DOCS = Path(__file__).resolve().parents[1] / "docs"
BLOCK = re.compile(r"^```python\n(.*?)```$", re.DOTALL | re.MULTILINE)


def blocks(page: str) -> list[str]:
    return BLOCK.findall((DOCS / page).read_text(encoding="utf8"))


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    heat_igl.write_mesh("bunny.ply", shapes.torus(40, 24))


def test_the_quick_start_runs_from_top_to_bottom(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("heat_igl.validation.samples.bunny_path", lambda: None)  # the smaller sample
    names: dict[str, Any] = {}
    for block in blocks("quickstart.md"):
        exec(compile(block, "quickstart.md", "exec"), names)
    assert Path("distance.png").read_bytes().startswith(b"\x89PNG")
    assert "<html" in Path("distance.html").read_text(encoding="utf8")
    assert heat_igl.read_attributes("distance.ply")["distance"][1234] == 0
    assert names["many"].shape == (3, names["mesh"].n_vertices)


@pytest.mark.parametrize("block", blocks("coming_from.md"), ids=lambda block: re.search(r"= (\w+)\.", block)[1])
def test_coming_from_another_library(block: str) -> None:
    library = re.search(r"= (\w+)\.", block)[1]
    if importlib.util.find_spec(library) is None:
        pytest.skip(f"needs {library}")
    peer = pytest.importorskip(library, exc_type=ImportError)

    class Scan:
        points = shapes.icosphere(3).V

    names: dict[str, Any] = {library: peer, "heat_igl": heat_igl, "np": np, "scan": Scan}
    exec(compile(block, "coming_from.md", "exec"), names)
    assert any(key in names for key in ("phi", "line"))
