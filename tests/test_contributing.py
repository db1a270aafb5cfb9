"""The examples of CONTRIBUTING.md are all that has to be written: each is applied to a copy of the package."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
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
