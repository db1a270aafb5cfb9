"""Compile the kernels; all other metadata stands in pyproject.toml, and packaging/build_kernels.py says how."""

import re
import sys
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "packaging"))

from build_kernels import BuildKernels, extensions  # noqa: E402


def index_page() -> str:
    """README.md as an index of packages shows it: links to files of the repository by their whole address."""
    project = tomllib.loads((HERE / "pyproject.toml").read_text(encoding="utf8"))["project"]
    files = f"{project['urls']['Repository']}/blob/main/"
    return re.sub(r"(?<=\]\()(?!https?:|#)", files, (HERE / "README.md").read_text(encoding="utf8"))


if __name__ == "__main__":
    setup(
        ext_modules=extensions(),
        cmdclass={"build_ext": BuildKernels},
        long_description=index_page(),
        long_description_content_type="text/markdown",
    )
