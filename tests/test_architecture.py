"""Imports run one way, and optional libraries are loaded only where they are used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import heat_igl

PACKAGE = Path(heat_igl.__file__).parent

# A module imports only from those before it.
ORDER = """
typing
errors
kernels
runtime
mesh
intrinsic
shapes
operators
linear
sources
steps
unfolding
heat_method
sampling
curves
io
reference
validation
baselines
applications
drawing
demo
cluster
cli
__main__
""".split()

EXTRAS = """
Xlib
colorspacious
dask
distributed
ezdxf
gdist
google_crc32c
matplotlib
meshio
numba
polyscope
potpourri3d
psutil
pyamg
pygeodesic
pymeshlab
pytest
rich
selenium
skfmm
skimage
typer
zarr
""".split()


def files(name: str) -> list[Path]:
    """The source of a module, or of every module of a subpackage."""
    return sorted((PACKAGE / name).glob("*.py")) or [PACKAGE / f"{name}.py"]


def modules() -> list[str]:
    paths = [*PACKAGE.glob("*.py"), *(path.parent for path in PACKAGE.glob("*/__init__.py"))]
    return sorted(path.stem for path in paths if path.stem != "__init__")


def imported_modules(name: str) -> set[str]:
    found = set()
    nodes = [node for file in files(name) for node in ast.walk(ast.parse(file.read_text(encoding="utf8")))]
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module == "heat_igl":
            found |= {alias.name for alias in node.names} & set(modules())
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("heat_igl."):
            found.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            found |= {alias.name.split(".")[1] for alias in node.names if alias.name.startswith("heat_igl.")}
    return found - {name}


def test_every_module_has_its_place():
    assert set(modules()) <= set(ORDER)


@pytest.mark.parametrize("name", modules())
def test_imports_run_one_way(name):
    allowed = set(ORDER[: ORDER.index(name)])
    assert imported_modules(name) <= allowed


def loaded(statement: str, names: list[str]) -> list[str]:
    """Which of these modules a statement loads in a new interpreter."""
    code = f"{statement}\nimport sys; print(*[name for name in {names!r} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_import_loads_no_extra():
    assert loaded("import heat_igl", EXTRAS) == []
    assert loaded("from heat_igl import *", EXTRAS) == []


def test_import_loads_what_a_distance_needs_and_little_else():
    others = [f"heat_igl.{name}" for name in ("baselines", "cluster", "metrics", "reference", "validation")] + ["ssl"]
    assert loaded("import heat_igl", others) == []
    assert loaded("from heat_igl import *", others) == others[:-1]


def test_names_loaded_on_first_use_are_those_of_their_modules():
    from heat_igl import validation

    assert heat_igl.validate is validation.validate
    assert heat_igl.metrics.__name__ == "heat_igl.metrics"
    assert set(heat_igl.__all__) <= set(dir(heat_igl))
    with pytest.raises(AttributeError, match="module 'heat_igl' has no attribute 'valdate'"):
        _ = heat_igl.valdate


def test_public_names_exist_and_are_documented():
    for name in heat_igl.__all__:
        assert getattr(heat_igl, name).__doc__, name
