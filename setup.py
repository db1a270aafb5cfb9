"""Compile the kernels: every module of heat_igl/kernels is Cython in pure Python mode and becomes an extension.

All other metadata stands in pyproject.toml. On a machine without a C compiler the build backend
(packaging/build_backend.py) has installed `ziglang`, and its compiler is used here.
"""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from Cython.Build import cythonize
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError

sys.path.insert(0, str(Path(__file__).resolve().parent / "packaging"))

from build_backend import has_compiler

KERNELS = Path("heat_igl/kernels")
# Kernels index without checks: callers pass arrays whose sizes they have checked. HEAT_IGL_CHECKED=1 compiles the
# checks in, for the tests that look for indices out of range.
CHECKED = os.environ.get("HEAT_IGL_CHECKED") == "1"
DIRECTIVES = {
    "language_level": 3,
    "boundscheck": CHECKED,
    "wraparound": False,
    "initializedcheck": CHECKED,
    "cdivision": True,
    "freethreading_compatible": True,
}


NO_COMPILER = (
    "heat_igl: compiling needs a C compiler: install one (Debian: apt-get install gcc; macOS: xcode-select --install; "
    "Windows: Visual Studio Build Tools), or `pip install ziglang`, which brings one"
)


class BuildKernels(build_ext):
    """`build_ext` with this package's compiler and options."""

    def run(self) -> None:
        """Choose the compiler before setuptools does."""
        if not has_compiler():
            if find_spec("ziglang") is None:
                raise CompileError(NO_COMPILER)
            # The compiler in the ziglang wheel.
            os.environ["CC"] = f"{sys.executable} -m ziglang cc"
            os.environ["LDSHARED"] = f"{sys.executable} -m ziglang cc -shared"
        super().run()

    def build_extensions(self) -> None:
        """Compile all kernels, several at once."""
        self.parallel = self.parallel or os.cpu_count() or 1
        for extension in self.extensions:
            extension.extra_compile_args = [*self._options(), *extension.extra_compile_args]
        super().build_extensions()

    def _options(self) -> list[str]:
        if self.compiler.compiler_type == "msvc":
            return ["/O2", "/fp:precise"]
        # The same bits on every processor: no fused multiplications. Square roots set no errno, so they are one
        # instruction.
        return ["-O3", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-g0", "-Wno-unused-function"]


modules = sorted(path for path in KERNELS.glob("*.py") if path.stem != "__init__")
extensions = [Extension(".".join(path.with_suffix("").parts), [str(path)]) for path in modules]
setup(
    ext_modules=cythonize(extensions, compiler_directives=DIRECTIVES, build_dir="build/cython", quiet=True),
    cmdclass={"build_ext": BuildKernels},
)
