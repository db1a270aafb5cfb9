"""Compile the kernels: every module of heat_igl/kernels is Cython in pure Python mode and becomes an extension.

All other metadata stands in pyproject.toml. On a machine without a C compiler the build backend
(packaging/build_backend.py) has installed `ziglang`, and its compiler is used here.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
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
# Where the sources are copied to that are compiled, and where Cython writes C.
BUILD = Path("build/checked" if CHECKED else "build")
COPIES, C_FILES = BUILD / "kernels", BUILD / "cython"
DIRECTIVES = {
    "language_level": 3,
    "boundscheck": CHECKED,
    "wraparound": False,
    "initializedcheck": CHECKED,
    "cdivision": True,
    "freethreading_compatible": True,
    "show_performance_hints": not CHECKED,
}
# Kernels that are compiled once more for each set of wide vectors; `heat_igl.kernels` chooses among them at run time.
# Only here may sums be taken in any order and products fused.
WIDE = ("multifrontal", "substitution")
REORDER = ["-fassociative-math", "-fno-signed-zeros", "-ffp-contract=fast"]
VECTORS = {
    "avx2": (["-mavx2", "-mfma"], ["/arch:AVX2"]),
    "avx512": (["-mavx512f", "-mavx512vl", "-mavx512dq", "-mfma", "-mprefer-vector-width=512"], ["/arch:AVX512"]),
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
            # The compiler in the ziglang wheel, for any processor of this kind: by default it takes this one's.
            zig = f"{sys.executable} -m ziglang cc -mcpu=baseline -Wno-unused-command-line-argument"
            os.environ["CC"] = zig
            os.environ["LDSHARED"] = f"{zig} -shared"
        super().run()

    def build_extensions(self) -> None:
        """Compile all kernels, several at once."""
        self.parallel = self.parallel or os.cpu_count() or 1
        for extension in self.extensions:
            extension.extra_compile_args = self._options(extension.name.rpartition(".")[2])
        super().build_extensions()

    def _options(self, name: str) -> list[str]:
        kernel, _, vectors = name.partition("_")
        if self.compiler.compiler_type == "msvc":
            return ["/O2", "/fp:precise", *(VECTORS[vectors][1] if vectors else [])]
        # The same bits on every processor: no fused multiplications. Square roots set no errno, so they are one
        # instruction.
        options = ["-O3", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-g0", "-Wno-unused-function"]
        if kernel in WIDE:
            options += REORDER
        return options + (VECTORS[vectors][0] if vectors else [])


def sources() -> list[Path]:
    """Copies of all kernels, and one more of those in WIDE for each set of vectors that this machine may have."""
    into = COPIES / KERNELS
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    vectors = VECTORS if platform.machine().lower() in ("x86_64", "amd64") else {}
    modules = []
    for path in sorted(KERNELS.glob("*.p*")):
        suffixes = ["", *(f"_{name}" for name in vectors if path.stem in WIDE)]
        for copy in (into / f"{path.stem}{suffix}{path.suffix}" for suffix in suffixes):
            text = path.read_text(encoding="utf8")
            if CHECKED:
                # What such a function raises would be printed and forgotten.
                text = re.sub(r"^@cython\.exceptval\(check=False\)\n| noexcept\b", "", text, flags=re.MULTILINE)
            copy.write_text(text, encoding="utf8")
            shutil.copystat(path, copy)
            if path.suffix == ".py" and path.stem != "__init__":
                modules.append(copy)
    shutil.copy(KERNELS.parent / "__init__.py", COPIES / KERNELS.parent)
    return modules


extensions = [
    Extension(".".join(path.relative_to(COPIES).with_suffix("").parts), [path.as_posix()]) for path in sources()
]
setup(
    ext_modules=cythonize(extensions, compiler_directives=DIRECTIVES, build_dir=str(C_FILES), quiet=True),
    cmdclass={"build_ext": BuildKernels},
)
