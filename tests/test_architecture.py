"""Rooms stand in their order, optional libraries are loaded where they are used, examples of CONTRIBUTING.md work."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from pkgutil import resolve_name

import pytest

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, geodesic_distance, shapes

PACKAGE = Path(heat_igl.__file__).parent
ROOT = PACKAGE.parent

EXTRAS = """
colorspacious dask distributed ezdxf gdist jax matplotlib meshio nibabel numba polyscope potpourri3d
psutil pygeodesic pymeshlab pytest rich selenium skfmm torch typer zarr
""".split()


def test_rooms_import_only_from_those_below():
    """In a process of its own: the linter silences the loggers of this one."""
    pytest.importorskip("importlinter")
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_page_lists_the_rooms_in_the_order_of_the_contract():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf8"))
    (contract,) = settings["tool"]["importlinter"]["contracts"]
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf8")
    rooms = re.findall(
        r"^\| `(\w+)` \|", page.partition("<!-- rooms -->")[2].partition("<!-- /rooms -->")[0], re.MULTILINE
    )
    # "a : b" are two rooms that may import each other.
    assert rooms == [room for layer in contract["layers"][::-1] for room in layer.split(" : ")]


def loaded(statement: str, names: list[str]) -> list[str]:
    """Which of these modules a statement loads in a new interpreter."""
    code = f"{statement}\nimport sys; print(*[name for name in {names!r} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return result.stdout.split()


def test_import_loads_what_a_distance_needs_and_little_else():
    others = [f"heat_igl.{name}" for name in ("cluster", "reference.solvers", "validation", "validation.metrics")]
    assert loaded("import heat_igl, heat_igl.applications", [*EXTRAS, *others, "ssl"]) == []
    assert loaded("from heat_igl import *", [*EXTRAS, "ssl"]) == []


def test_a_distance_by_windows_loads_no_other_engine():
    others = [f"heat_igl.{name}" for name in ("heat.solver", "linear", "heat.steps", "sweep.sweep", "curves")]
    V, F = [[0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]], [[0, 1, 3], [1, 2, 3]]
    asked = f"import heat_igl; heat_igl.geodesic_distance(({V}, {F}), 0"
    assert loaded(f"{asked})", others) == []
    assert loaded(f"{asked}, method='heat')", others) == others[:-1]


def test_no_name_of_a_package_is_that_of_another_of_its_modules():
    """The import of the module would put it in place of the name."""
    for stub in PACKAGE.rglob("__init__.pyi"):
        for home, name in re.findall(r"^from (\S+) import (\w+)", stub.read_text(encoding="utf8"), re.MULTILINE):
            module = stub.with_name(f"{name}.py")
            assert not module.exists() or home.endswith(f".{stub.parent.name}"), module


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_any_public_name_may_be_the_first_to_be_asked_for():
    """Each in a process of its own, so that imports in a circle would not find each other loaded."""
    code = (
        "import os, numpy, scipy.sparse, heat_igl\n"
        "for name in heat_igl.__all__:\n"
        "    if not os.fork():\n"
        "        getattr(heat_igl, name); os._exit(0)\n"
        "    assert not os.wait()[1], name"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def test_names_loaded_on_first_use_are_those_of_their_modules():
    from heat_igl import validation

    assert heat_igl.validate is validation.validate
    assert heat_igl.validation.metrics.__name__ == "heat_igl.validation.metrics"
    assert set(heat_igl.__all__) <= set(dir(heat_igl))
    with pytest.raises(AttributeError, match=r"no attribute 'offset_curves': it is in heat_igl\.curves$"):
        heat_igl.offset_curves  # noqa: B018
    with pytest.raises(AttributeError, match="module 'heat_igl' has no attribute 'valdate'; did you mean validate"):
        _ = heat_igl.valdate
    with pytest.raises(AttributeError, match=r"did you mean geodesic_distance, or compat\.igl\.exact_geodesic\?$"):
        _ = heat_igl.exact_geodesic
    for words in heat_igl._OTHER_WORDS.values():
        assert all(resolve_name(f"heat_igl.{word}") for word in words.split(", or "))
    assert not {"Any", "TYPE_CHECKING", "import_module", "re", "Path"} & set(dir(heat_igl))


def entered(call) -> list[str]:
    """Files of the package that a call enters, in this order; kernels are compiled, and not among them."""
    found = {}

    def note(frame, event, _):
        path = Path(frame.f_code.co_filename)
        if event == "call" and path.is_relative_to(PACKAGE):
            found[path.relative_to(PACKAGE).as_posix()] = None

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return list(found)


def test_the_walks_of_the_page_are_the_files_that_calls_enter():
    mesh = shapes.icosphere(4)
    solver = HeatMethodSolver(mesh)
    solver.distances([1, 2, 3])  # the first three are compared with a sweep, which is not part of it
    geodesic_distance(mesh, 1)  # imports
    again = Mesh(mesh.V, mesh.F)
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf8")
    for name, call in {
        "HeatMethodSolver.distance": lambda: solver.distance(1234),
        "geodesic_distance": lambda: geodesic_distance(again, 1234),
    }.items():
        part, files = page.split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0], entered(call)
        assert set(re.findall(r"`([\w/]+\.py)`", part)) == set(files), ", ".join(f"`{file}`" for file in files)
        assert f"{len(files)} files: " in part


def test_extras_and_libraries_in_messages_are_those_of_the_project():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    code = "\n".join(path.read_text() for path in PACKAGE.rglob("*.py"))
    without_examples = re.sub(r"^ *(?:>>>|\.\.\. ).*$", "", code, flags=re.MULTILINE)
    calls = re.findall(
        r"MissingExtraError\.(?:of|guard|check)\(\s*f?(?:\"[^\"]*\"|'[^']*'),\s*[\"']([^\"']+)[\"'],\s*[\"'](\w+)[\"']",
        without_examples,
    )
    assert len(calls) > 10
    for packages, extra in calls:
        held = {re.split(r"[<>=\[;]", requirement)[0].strip().lower() for requirement in extras[extra]}
        assert set(packages.split(" and ")) <= held, (packages, extra)


TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf8")
EXAMPLES = re.findall(r"^\*\*(A [\w ]+): (\d) files?[.,]\*\*(.*?)^```python\n# check\n(.*?)^```", TEXT, re.M | re.S)


def changed(text: str, diff: str) -> str:
    """`text` with each line that begins with - replaced by the lines with + that follow."""
    for old, new in re.findall(r"^-(.*\n)((?:^\+.*\n)+)", diff, re.M):
        assert text.count(old) == 1, old
        text = text.replace(old, re.sub(r"^\+", "", new, flags=re.M))
    return text


@pytest.mark.parametrize(
    ("count", "example", "check"), [each[1:] for each in EXAMPLES], ids=[kind for kind, *_ in EXAMPLES]
)
def test_an_example_works_and_touches_so_many_files(count, example, check, tmp_path):
    shutil.copytree(
        ROOT / "heat_igl", tmp_path / "heat_igl", copy_function=os.symlink, ignore=shutil.ignore_patterns("__pycache__")
    )
    blocks = re.findall(r"^```(\w+)\n# (heat_igl/\S+)\n(.*?)^```", example, re.M | re.S)
    assert len({path for _, path, _ in blocks}) == int(count)
    for language, name, block in blocks:
        path = tmp_path / name
        assert path.exists() == (language == "diff")
        text = changed(path.read_text(encoding="utf8"), block) if language == "diff" else block
        path.unlink(missing_ok=True)
        path.write_text(text, encoding="utf8")
    command = [sys.executable, "-c", f"import heat_igl\nimport numpy as np\n{check}"]
    around = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, cwd=tmp_path, env=around, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_all_four_kinds_have_an_example():
    assert {kind: int(count) for kind, count, *_ in EXAMPLES} == {
        "A kind of domain": 1,
        "A linear solver": 2,
        "A file format": 2,
        "A kind of source": 2,
    }
