"""Run the test files of other libraries against the drop-in modules: how many of their tests pass, and why others fail.

    python scripts/peer_tests.py potpourri3d=FILE.py igl=FILE.py --only exact_geodesic heat_geodesics
    python scripts/peer_tests.py gdist=tvb-gdist/tests/test_gdist.py pygeodesic=pygeodesic/tests/test_pygeodesic.py

A test file is run where it lies, unchanged; ``import potpourri3d`` in it finds `heat_igl.compat.potpourri3d`, and the
others likewise. Tests run in the folder above theirs, whose data they may read. With ``--only``, tests that mention
none of these words in their source are left out. The exit status is 1 if a test fails that is not among those known
below.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import heat_igl

from harness import Row, Table, parsed, publish

# Test -> why it cannot pass, or does not yet.
KNOWN = {
    "test_write_read_mesh": "five faces of its mesh repeat a vertex, which files of this package must not hold",
    "test_point_cloud_vector_heat": "its points fill a cube: their triangles are no surface that could be oriented",
    "test_octree": "it fails with libigl 2.6.3 itself, whose marching_cubes returns another number of arrays",
}
# Run by the interpreter of the tests: puts the drop-in in the place of the library, and leaves out other tests.
RUNNER = """
import importlib, inspect, sys
import pytest

name, path, out, *words = sys.argv[1:]
module = importlib.import_module(f"heat_igl.compat.{name}")
if name in sys.modules:  # libigl, whose submodules stay
    module.__path__ = sys.modules[name].__path__
sys.modules[name] = module
if name == "pygeodesic":  # the drop-in stands for pygeodesic.geodesic
    module.geodesic, module.__version__, module.__path__ = module, "", []
    sys.modules["pygeodesic.geodesic"] = module


class Chosen:
    def pytest_collection_modifyitems(self, items):
        items[:] = [item for item in items if any(word in inspect.getsource(item.function) for word in words or [""])]


pytest.main(["-q", "-p", "no:cacheprovider", "-W", "ignore", f"--junitxml={out}", path], plugins=[Chosen()])
"""


def outcomes(name: str, path: Path, words: Sequence[str]) -> Iterator[Row]:
    """Test, outcome and message of every test in a file, with `heat_igl.compat.<name>` in the place of `name`."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "found.xml"
        around = {**os.environ, "PYTHONPATH": str(Path(heat_igl.__file__).parents[1])}
        command = [sys.executable, "-c", RUNNER, name, str(path), str(out), *words]
        done = subprocess.run(command, capture_output=True, text=True, cwd=path.parents[1], env=around)
        cases = [*ElementTree.parse(out).iter("testcase")] if out.exists() else []
        if not cases:
            raise RuntimeError(f"the tests of {path} did not run: {done.stderr.strip() or done.stdout.strip()}")
        for case in cases:
            said = next((f"{each.tag}: {each.get('message')}".splitlines()[0] for each in case), "passed")
            outcome, test = said.partition(":")[0].replace("failure", "failed"), str(case.get("name"))
            yield {"tests of": name, "test": test, "outcome": outcome, "reason": KNOWN.get(test, f"not known, {said}")}


def main(argv: Sequence[str] | None = None) -> int:
    options = parsed(__doc__, argv, "+", only=[""])
    rows = []
    for given in options.meshes:
        name, _, path = str(given).partition("=")
        rows += list(outcomes(name, Path(path).resolve(), [word for word in options.only if word]))
    counts = [
        {"tests of": name}
        | {k: sum(r["outcome"] == k and r["tests of"] == name for r in rows) for k in ("passed", "skipped", "failed")}
        for name in dict.fromkeys(row["tests of"] for row in rows)
    ]
    tables = {"counts": Table(counts, {key: key for key in counts[0]})}
    others = [row for row in rows if row["outcome"] != "passed"]
    if others:
        tables["reasons"] = Table(others, {key: key for key in ("tests of", "test", "reason")})
    publish(options, tables)
    return int(any(row["outcome"] == "failed" and row["test"] not in KNOWN for row in rows))


if __name__ == "__main__":
    sys.exit(main())
