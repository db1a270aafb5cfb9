"""Build backend: setuptools, with a C compiler from PyPI where the machine has none.

pip asks a backend for what a build requires before it runs the build. Where no C compiler is found, that list gets
`ziglang`, whose wheel holds a complete C compiler for Linux, macOS and Windows, and the build uses it. Everything else
is setuptools' own.
"""

from __future__ import annotations

import os
import shutil
import sys
import sysconfig
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403  (the hooks of PEP 517 and PEP 660)

_ZIG = "ziglang>=0.13"


def has_compiler() -> bool:
    """Whether setuptools will find a C compiler: the one of ``CC``, that of Python's own build, or Visual C++."""
    if sys.platform == "win32":
        from setuptools.msvc import msvc14_get_vc_env  # type: ignore[import-untyped]

        try:
            return bool(msvc14_get_vc_env("x86_amd64" if sys.maxsize > 2**32 else "x86"))
        except Exception:
            return False
    command = os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc"
    return shutil.which(command.split()[0]) is not None


def _required() -> list[str]:
    return [] if has_compiler() else [_ZIG]


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Requirements of a wheel build, beside those of pyproject.toml."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *_required()]


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """Requirements of an editable install, beside those of pyproject.toml."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *_required()]
