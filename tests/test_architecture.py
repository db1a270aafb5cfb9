"""Imports run one way, and optional libraries are loaded only where they are used."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import load_script

import heat_igl

PACKAGE = Path(heat_igl.__file__).parent

ROOT = PACKAGE.parent
structure = load_script("structure")
# From the lowest room to the highest, as ARCHITECTURE.md lists them.
ORDER = structure.table_order((ROOT / "ARCHITECTURE.md").read_text(encoding="utf8"))

EXTRAS = """
Xlib
colorspacious
dask
distributed
ezdxf
gdist
matplotlib
meshio
nibabel
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


def modules() -> list[str]:
    return list(structure.room_files(PACKAGE))


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return structure.measured(ROOT, 3)


def test_every_module_has_its_place():
    assert set(modules()) <= set(ORDER)


@pytest.mark.parametrize("name", modules())
def test_imports_run_one_way(found, name):
    allowed = set(ORDER[: ORDER.index(name)])
    assert set(found["arrows"][name]) <= allowed


def test_the_table_of_rooms_says_what_their_docstrings_say():
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf8")
    assert structure.room_table(PACKAGE, ORDER) in page, "run: python scripts/structure.py --write"


@pytest.mark.parametrize("name", structure.BOUNDS)
def test_the_package_keeps_to_its_bounds(found, name):
    assert found["counts"][name] <= structure.BOUNDS[name], found.get(name)


def loaded(statement: str, names: list[str]) -> list[str]:
    """Which of these modules a statement loads in a new interpreter."""
    code = f"{statement}\nimport sys; print(*[name for name in {names!r} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_import_loads_no_extra():
    assert loaded("import heat_igl", EXTRAS) == []
    assert loaded("from heat_igl import *", EXTRAS) == []


def test_import_loads_what_a_distance_needs_and_little_else():
    others = [
        f"heat_igl.{name}"
        for name in ("cluster", "reference", "reference.baselines", "validation", "validation.metrics")
    ] + ["ssl"]
    assert loaded("import heat_igl", others) == []
    assert loaded("from heat_igl import *", others) == others[:-1]


def test_names_loaded_on_first_use_are_those_of_their_modules():
    from heat_igl import validation

    assert heat_igl.validate is validation.validate
    assert heat_igl.metrics.__name__ == "heat_igl.validation.metrics"
    assert set(heat_igl.__all__) <= set(dir(heat_igl))
    with pytest.raises(AttributeError, match="module 'heat_igl' has no attribute 'valdate'"):
        _ = heat_igl.valdate


def test_public_names_exist_and_are_documented():
    for name in heat_igl.__all__:
        assert getattr(heat_igl, name).__doc__, name
