"""Compiled loops: Cython in pure Python mode, built with the package, plain arrays in and out, no interpreter lock.

A kernel checks nothing that it is given: the modules that call it pass contiguous arrays of the stated types and sizes.
"""

from __future__ import annotations

import json
import os
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec, source_hash
from pathlib import Path


def _require_extensions() -> None:
    """Refuse to go on if the kernels have not been compiled from the sources that stand here.

    In a fresh checkout Python would import the sources instead, and run them slowly or not at all. In a checkout that
    has changed since it was built, answers would come from earlier code. A build in place leaves the hash of each
    source that it compiled; an installed package has no such list and needs none.
    """
    here = Path(__file__).parent
    files = {(folder, name) for folder, _, names in os.walk(here) for name in names}
    compiled = {(folder, name.partition(".")[0]) for folder, name in files if name.endswith(tuple(EXTENSION_SUFFIXES))}
    sources = {(folder, name[:-3]) for folder, name in files if name.endswith(".py") and name != "__init__.py"}
    missing = sorted(name for _, name in sources - compiled)
    if missing:
        raise ImportError(
            f"heat_igl is imported from {here.parent}, where {len(missing)} of its kernels are not compiled "
            f"({missing[0]}): run `pip install -e .` in {here.parent.parent}, or start Python in another folder"
        )
    built = here / "compiled.json"
    if built.exists():
        hashes = json.loads(built.read_text(encoding="utf8"))
        found = {name: source_hash(file.read_bytes()).hex() for name in hashes if (file := here / name).exists()}
        changed = [name for name in hashes if found.get(name) != hashes[name]]
        if changed:
            raise ImportError(
                f"{len(changed)} sources of kernels in {here} have changed since they were compiled ({changed[0]}): "
                f"run `python setup.py -q build_ext --inplace` or `pip install -e .` in {here.parent.parent}"
            )


_require_extensions()


def builds(name: str) -> list[str]:
    """The modules of a kernel, as "linear.substitution", that this processor can run, widest vectors first."""
    from heat_igl.kernels.processor import vectors

    modules = [f"heat_igl.kernels.{name}_{one}" if one else f"heat_igl.kernels.{name}" for one in vectors()]
    return [module for module in modules if find_spec(module) is not None]
