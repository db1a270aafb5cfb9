"""The notebooks run unedited, from a fresh kernel, and are stored without their results."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import ENVIRONMENT

pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")
pytest.importorskip("matplotlib")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))

NO_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND")

# Apart from pytest, which would turn warnings of Jupyter's libraries into errors.
RUN = """
import sys, nbclient, nbformat
notebook = nbformat.read(sys.argv[1], as_version=4)
nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
nbformat.write(notebook, sys.argv[2])
"""


def cells(path: Path) -> list[dict[str, Any]]:
    return list(json.loads(path.read_text(encoding="utf8"))["cells"])


def code(cell: dict[str, Any]) -> str:
    return "".join(line for line in cell["source"] if not line.startswith("%"))


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path, tmp_path):
    environment = {
        **{name: value for name, value in ENVIRONMENT.items() if name not in NO_DISPLAY},
        **dict.fromkeys(("http_proxy", "https_proxy"), "http://127.0.0.1:9"),  # nothing listens there
        "IPYTHONDIR": str(tmp_path / "ipython"),
        "JUPYTER_PLATFORM_DIRS": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(path), str(tmp_path / "done.ipynb")],
        cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    outputs = [output for cell in cells(tmp_path / "done.ipynb") for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    # A kernel writes warnings to stderr, and a story should have none.
    assert [output["text"] for output in outputs if output.get("name") == "stderr"] == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_stored_without_results(path):
    for cell in cells(path):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_uses_public_names_only(path):
    for cell in cells(path):
        if cell["cell_type"] != "code":
            continue
        for node in ast.walk(ast.parse(code(cell))):
            if isinstance(node, ast.Attribute):
                assert not node.attr.startswith("_"), node.attr
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("heat_igl"):
                exported = __import__(str(node.module), fromlist=["*"]).__all__
                assert {alias.name for alias in node.names} <= set(exported)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_opens_in_colab_and_installs_the_package_there(path):
    opening, install = cells(path)[:2]
    assert f"/github/heat-igl/heat_igl/blob/main/notebooks/{path.name})" in "".join(opening["source"])
    said = []
    shell = type("Shell", (), {"run_line_magic": lambda _, *line: said.append(" ".join(line))})
    # Where the package is installed, as here, the cell does nothing.
    for spec in (object(), None):
        names = {"get_ipython": shell}
        source = code(install).replace("importlib.util.find_spec(", "find(")
        exec(source, {**names, "find": lambda name, spec=spec: spec if name == "heat_igl" else object()})
    assert len(said) == 1
    assert re.fullmatch(r"pip install -q 'heat-igl\[all\] @ git\+https://github.com/heat-igl/heat_igl'", said[0])
