"""Run the test files of other libraries against the drop-in modules: how many of their tests pass, and why others fail.

    python scripts/peer_tests.py potpourri3d=FILE.py igl=FILE.py --only exact_geodesic heat_geodesics
    python scripts/peer_tests.py gdist=tvb-gdist/tests/test_gdist.py pygeodesic=pygeodesic/tests/test_pygeodesic.py

A test file is run where it lies, unchanged; ``import potpourri3d`` in it finds `heat_igl.compat.potpourri3d`, and
``import igl`` finds `heat_igl.compat.igl`; gdist and pygeodesic likewise. Tests run in the folder above
theirs, whose data they may read. With ``--only``, tests that mention none of these words in their source are
left out. The exit status is 1 if a test fails that is not in the list of known differences below.
"""

from __future__ import annotations

import inspect
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import heat_igl

from scaffold import add_json, add_output, environment, option_parser, publish, table

# Test -> why it cannot pass, or does not yet.
KNOWN = {
    "test_write_read_mesh": "five faces of its mesh repeat a vertex, which files of this package must not hold",
    "test_point_cloud_vector_heat": "its points fill a cube: their triangles are no surface that could be oriented",
    "test_octree": "it fails with libigl 2.6.3 itself, whose marching_cubes returns another number of arrays",
}

_NAMES = ("potpourri3d", "igl", "gdist", "pygeodesic")

# Run by the interpreter of the tests: puts the drop-in in the place of the library, and reports in JSON.
_RUNNER = """
import importlib, inspect, json, sys
import pytest

name, path, words, out = sys.argv[1], sys.argv[2], json.loads(sys.argv[3]), sys.argv[4]
module = importlib.import_module(f"heat_igl.compat.{name}")
if name in sys.modules:  # libigl, whose submodules stay
    module.__path__ = sys.modules[name].__path__
sys.modules[name] = module
if name == "pygeodesic":  # the drop-in stands for pygeodesic.geodesic
    module.geodesic, module.__version__, module.__path__ = module, "", []
    sys.modules["pygeodesic.geodesic"] = module


class Reports:
    def __init__(self):
        self.found = []

    def pytest_collection_modifyitems(self, items):
        if words:
            items[:] = [item for item in items if any(word in inspect.getsource(item.function) for word in words)]

    def pytest_runtest_logreport(self, report):
        if report.when == "call" or report.outcome != "passed":
            crash = getattr(report.longrepr, "reprcrash", None)
            said = crash.message.splitlines()[0] if crash else ""
            self.found.append({"test": report.nodeid.split("::")[-1], "outcome": report.outcome, "said": said})


reports = Reports()
pytest.main(["-q", "-p", "no:cacheprovider", "-W", "ignore", path], plugins=[reports])
json.dump(reports.found, open(out, "w"))
"""


def outcomes(name: str, path: Path, words: Sequence[str]) -> list[dict[str, str]]:
    """Test, outcome and message of every test in a file, with `heat_igl.compat.<name>` in the place of `name`."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "found.json"
        arguments = [name, str(path), json.dumps(list(words)), str(out)]
        done = subprocess.run(
            [sys.executable, "-c", _RUNNER, *arguments], capture_output=True, text=True, cwd=path.parents[1],
            env={**os.environ, "PYTHONPATH": str(Path(heat_igl.__file__).parents[1])},
        )  # fmt: skip
        if not out.exists():
            raise RuntimeError(f"the tests of {path} did not run: {done.stderr.strip() or done.stdout.strip()}")
        found: list[dict[str, str]] = json.loads(out.read_text(encoding="utf8"))
        return found


def markdown(results: dict[str, list[dict[str, str]]]) -> str:
    """Counts of each library, and a reason for every test that did not pass."""
    rows, reasons = [], []
    for name, found in results.items():
        counts = [sum(each["outcome"] == outcome for each in found) for outcome in ("passed", "skipped", "failed")]
        rows.append((name, *map(str, counts)))
        for each in found:
            if each["outcome"] != "passed":
                reasons.append((name, each["test"], KNOWN.get(each["test"]) or f"not known: {each['said']}"))
    parts = [table(["tests of", "passed", "skipped", "failed"], rows)]
    if reasons:
        parts.append(table(["tests of", "test", "reason"], reasons, (0, 1, 2)))
    return "\n\n".join("\n".join(lines) for lines in parts)


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(inspect.getdoc(sys.modules[__name__]))
    parser.add_argument("files", nargs="+", metavar="NAME=FILE", help="a drop-in, and a test file of its library")
    parser.add_argument("--only", nargs="+", default=[], metavar="WORD", help="tests with one of these in their source")
    add_json(parser)
    add_output(parser, "peer_tests")
    options = parser.parse_args(argv)
    results: dict[str, list[dict[str, str]]] = {}
    for given in options.files:
        name, _, path = given.partition("=")
        if name not in _NAMES or not Path(path).is_file():
            parser.error(f"{given}: expected NAME=FILE, with one of {', '.join(_NAMES)} and a file that exists")
        results[name] = results.get(name, []) + outcomes(name, Path(path).resolve(), options.only)
    result: dict[str, Any] = {"environment": environment(), "tests": results}
    publish(result, markdown(results), folder=options.output, name="peer_tests", json_file=options.json)
    failed = [each["test"] for found in results.values() for each in found if each["outcome"] == "failed"]
    return int(any(test not in KNOWN for test in failed))


if __name__ == "__main__":
    sys.exit(main())
