"""Compile the kernels; all other metadata stands in pyproject.toml, and packaging/build_kernels.py says how."""

import sys
from pathlib import Path

from setuptools import setup

sys.path.insert(0, str(Path(__file__).resolve().parent / "packaging"))

from build_kernels import BuildKernels, extensions

setup(ext_modules=extensions(), cmdclass={"build_ext": BuildKernels})
