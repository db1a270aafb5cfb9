"""What a release says of itself agrees: versions, supported Pythons, extras, and the files that workflows name."""

import importlib.util
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import heat_igl

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf8"))["project"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def loaded(path: str | Path) -> dict[Any, Any]:
    return yaml.safe_load((ROOT / path).read_text(encoding="utf8"))


def test_versions_agree():
    assert loaded("CITATION.cff")["version"] == heat_igl.__version__
    assert loaded("packaging/conda/recipe.yaml")["context"]["version"] == heat_igl.__version__


def test_every_supported_python_is_tested():
    tested = loaded(".github/workflows/tests.yml")["jobs"]["tests"]["strategy"]["matrix"]["python"]
    classified = [text.rpartition(" ")[2] for text in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", text)]
    assert tested == classified
    assert PROJECT["requires-python"] == f">={tested[0]}"


def test_all_brings_every_extra_but_the_largest():
    extras = PROJECT["optional-dependencies"]
    (everything,) = extras["all"]
    assert set(re.search(r"\[(.*)\]", everything)[1].split(",")) == extras.keys() - {"all", "torch"}


def test_the_recipe_needs_what_the_package_needs():
    needed = {re.split(r"[>=]", text)[0] for text in PROJECT["dependencies"]}
    names = {text.split()[0] for text in loaded("packaging/conda/recipe.yaml")["requirements"]["run"]}
    run = {"libigl" if name == "igl" else name for name in names}  # its name on conda-forge
    assert run == needed | {"python"}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_may_do_no_more_than_they_need(path):
    workflow = loaded(path)
    assert workflow["permissions"] == {"contents": "read"}
    granted = [job["permissions"] for job in workflow["jobs"].values() if "permissions" in job]
    assert granted == ([{"id-token": "write"}] if path.name == "publish.yml" else [])
    for name in re.findall(r"(?:scripts|tests)/\w+\.py", path.read_text(encoding="utf8")):
        assert (ROOT / name).is_file(), name
    for extras in re.findall(r'"\.\[([\w,]+)\]"', path.read_text(encoding="utf8")):
        assert set(extras.split(",")) <= PROJECT["optional-dependencies"].keys()


def test_pages_and_ci_name_tests_and_scripts_that_exist():
    sources = "".join(path.read_text(encoding="utf8") for path in (ROOT / "tests").glob("*.py"))
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *ROOT.glob(".ci/run")):
        text = "" if page.name == "compat.md" else page.read_text(encoding="utf8")  # it names tests of other packages
        for name in re.findall(r"`(test_\w+)`", text):
            assert f"def {name}(" in sources, f"{page.name}: {name}"
        for name in re.findall(r"\b(?:scripts|tests)/\w+\.py", text):
            assert (ROOT / name).is_file(), f"{page.name}: {name}"


PAGES = ["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md", "SECURITY.md"]
LINK = r"\]\((?!https?:|mailto:)([^)#]*)#?([^)]*)\)"


@pytest.mark.parametrize("name", PAGES)
def test_relative_links_lead_to_files_and_headings(name):
    for path, heading in re.findall(LINK, (ROOT / name).read_text(encoding="utf8")):
        target = ROOT / (path or name)
        assert target.exists(), path
        text = target.read_text(encoding="utf8") if heading else ""
        headings = {re.sub(r"[^\w -]", "", line.lstrip("# ")).lower().replace(" ", "-") for line in text.splitlines()}
        assert not heading or heading in headings, f"{path}#{heading}"


def test_an_index_of_packages_shows_no_relative_link():
    spec = importlib.util.spec_from_file_location("setup_script", ROOT / "setup.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    text = script.index_page()
    assert re.search(LINK, (ROOT / "README.md").read_text(encoding="utf8"))
    assert not re.search(LINK, text)
    assert f"({PROJECT['urls']['Repository']}/blob/main/docs/exact.md)" in text


def test_contributing_names_what_exists():
    """Files between backticks, in the repository or in the package; commands begin with something that is there."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf8")
    for name in re.findall(r"`([\w./]+(?:\.(?:py|toml|md|yml|yaml|cff)|/))`", text):
        places = [ROOT / name, *(ROOT / "heat_igl").rglob(name)]
        assert name == "utils.py" or any(place.exists() for place in places), name
    for script in re.findall(r"python ((?:scripts|docs)/\S+\.py)", text):
        assert (ROOT / script).is_file(), script
