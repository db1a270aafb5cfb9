"""From heat_igl/kernels to extensions: every module there is Cython in pure Python mode.

A few kernels are compiled once more for each set of wide vectors that the processor may have; `heat_igl.kernels`
chooses among them at run time. ``HEAT_IGL_CHECKED=1`` makes a build that checks every index and
every assertion and raises, for tests: the usual one has neither, as callers pass arrays whose sizes they have checked.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from importlib.metadata import version
from importlib.util import find_spec, source_hash
from pathlib import Path

from build_backend import has_compiler
from setuptools import Extension
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError

__all__ = ["BuildKernels", "extensions"]

KERNELS = Path("heat_igl/kernels")
CHECKED = os.environ.get("HEAT_IGL_CHECKED") == "1"
# Where the sources are copied to that are compiled, and where Cython writes C.
BUILD = Path("build/checked" if CHECKED else "build/kernels")
COPIES, C_FILES = BUILD / "python", BUILD / "c"
# What all kernels need to take arrays is compiled once.
SHARED = "_memoryviews"
DIRECTIVES = {
    "language_level": 3,
    "boundscheck": CHECKED,
    "wraparound": False,
    "initializedcheck": CHECKED,
    "cdivision": True,
    "infer_types": True,
    "freethreading_compatible": True,
    # C functions raise nothing, unless they say `exceptval`; in the checked build each call asks whether one did.
    "legacy_implicit_noexcept": not CHECKED,
    # What Cython writes to pickle each of its classes takes a tenth of the compiler's time, and none is pickled.
    "auto_pickle": False,
    "show_performance_hints": not CHECKED,
}
# Kernels of long loops over numbers, for which vectors pay. Only here may sums be taken in any order, products fused.
WIDE = ("linear/multifrontal", "linear/substitution")
VECTORS = {"avx2": "-mavx2 -mfma", "avx512": "-mavx512f -mavx512dq -mavx512vl -mfma -mprefer-vector-width=512"}
VECTORS_MSVC = {"avx2": "/arch:AVX2", "avx512": "/arch:AVX512"}
# The same bits on every processor: no fused multiplications. Square roots set no errno, so they are one instruction.
# -O3, and the lines of C in tracebacks, took 13 % more of the compiler's time, and no less at run time but in `WIDE`
# and `UNROLLED`, which have many loops over a few numbers.
OPTIONS = (
    "-O2 -g0 -DCYTHON_CLINE_IN_TRACEBACK=0 -fno-math-errno -fno-trapping-math -ffp-contract=off "
    "-Wno-unused-function -Wno-sign-compare"
)
UNROLLED = ("sweep/facets", "sweep/hopf_lax", "sweep/simplex_metrics", "sweep/simplex_updates")
ANY_ORDER = "-O3 -fassociative-math -fno-signed-zeros -ffp-contract=fast"
OPTIONS_MSVC = "/O2 /fp:precise"

NO_COMPILER = (
    "heat_igl: compiling needs a C compiler: install one (Debian: apt-get install gcc; macOS: xcode-select --install; "
    "Windows: Visual Studio Build Tools), or `pip install ziglang`, which brings one"
)
NO_HEADERS = (
    "heat_igl: compiling needs the headers of this Python ({0} is missing): install them (Debian: apt-get install "
    "python3-dev), or take another Python"
)


def extensions() -> list[Extension]:
    """The extensions to build; their sources are still Python."""
    # That of the target, which `_PYTHON_HOST_PLATFORM` names where another system compiles.
    processor = sysconfig.get_platform().rpartition("-")[2].lower()
    vectors = list(VECTORS) if processor in ("x86_64", "amd64") else []
    found = [Extension(_module(SHARED), [])]
    for path in _sources():
        if path.suffix == ".py" and path.stem != "__init__":
            name = _name(path)
            names = [name, *(f"{name}_{one}" for one in vectors if name in WIDE)]
            found += [Extension(_module(each), [path.as_posix()]) for each in names]
    return found


def _sources() -> list[Path]:
    """Every kernel and what it declares to others, and the packages that they are in."""
    return sorted(path for path in KERNELS.rglob("*.p*") if path.suffix in (".py", ".pxd"))


def _name(path: Path) -> str:
    """A kernel's folder and name, as "linear/substitution"."""
    return path.relative_to(KERNELS).with_suffix("").as_posix()


def _module(name: str) -> str:
    return ".".join([*KERNELS.parts, *name.split("/")])


def _of_module(module: str) -> str:
    return "/".join(module.split(".")[len(KERNELS.parts) :])


class BuildKernels(build_ext):
    """`build_ext` that translates the kernels to C first."""

    def run(self) -> None:
        """Choose the compiler before setuptools does."""
        headers = Path(sysconfig.get_path("include"), "Python.h")
        if not headers.exists():
            raise CompileError(NO_HEADERS.format(headers))
        if not has_compiler():
            if find_spec("ziglang") is None:
                raise CompileError(NO_COMPILER)
            # The compiler in the ziglang wheel, for any processor of this kind: by default it takes the one at hand.
            zig = f"{sys.executable} -m ziglang cc -mcpu=baseline -Wno-unused-command-line-argument"
            os.environ["CC"] = zig
            os.environ["LDSHARED"] = f"{zig} -shared"
        sources = {
            path.relative_to(KERNELS).as_posix(): source_hash(path.read_bytes()).hex()
            for path in _sources()
            if path.stem != "__init__"
        }
        super().run()
        if self.inplace:
            # heat_igl.kernels compares: the extensions beside the sources are compiled from these.
            (KERNELS / "compiled.json").write_text(json.dumps(sources, indent=1), encoding="utf8")

    def build_extensions(self) -> None:
        """Translate and compile all kernels, several at once."""
        self.parallel = self.parallel or os.cpu_count() or 1
        _forget_other_options()
        _copy_sources()
        _translate([_of_module(extension.name) for extension in self.extensions], self.parallel)
        super().build_extensions()

    def build_extension(self, extension: Extension) -> None:
        """Compile one kernel."""
        name = _of_module(extension.name)
        extension.sources = [(C_FILES / f"{name}.c").as_posix()]
        kernel, _, vectors = name.partition("_")
        if self.compiler.compiler_type == "msvc":
            options = f"{OPTIONS_MSVC} {VECTORS_MSVC.get(vectors, '')}"
        else:
            order = ANY_ORDER if kernel in WIDE else "-O3 -fno-wrapv" if name in UNROLLED else ""
            options = f"{OPTIONS} {order} {VECTORS.get(vectors, '')}"
        extension.extra_compile_args = options.split()
        extension.define_macros = [] if CHECKED else [("CYTHON_WITHOUT_ASSERTIONS", None)]
        super().build_extension(extension)


def _forget_other_options() -> None:
    """Remove C files that another Cython, or other options, made."""
    stamp, options = BUILD / "options.json", [version("Cython"), DIRECTIVES, OPTIONS, OPTIONS_MSVC, ANY_ORDER, VECTORS]
    text = json.dumps(options)
    if stamp.exists() and stamp.read_text(encoding="utf8") != text:
        shutil.rmtree(C_FILES)
    BUILD.mkdir(parents=True, exist_ok=True)
    stamp.write_text(text, encoding="utf8")


def _copies() -> Iterator[tuple[Path, Path]]:
    """Each source of a kernel, and a copy of it for each module that is made of it."""
    for path in (KERNELS.parent / "__init__.py", *_sources()):
        is_wide = KERNELS in path.parents and _name(path) in WIDE
        suffixes = ["", *(f"_{name}" for name in VECTORS if is_wide)]
        for suffix in suffixes:
            yield path, COPIES / path.with_stem(path.stem + suffix)


def _copy_sources() -> None:
    for path, copy in _copies():
        copy.parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf8")
        if CHECKED:
            # What a function raises that is declared to raise nothing would be printed and forgotten.
            text = text.replace(" noexcept", " except *")
        if not copy.exists() or copy.read_text(encoding="utf8") != text:
            copy.write_text(text, encoding="utf8")


def _read_by(source: Path) -> set[Path]:
    """A kernel's source, its own declarations, and those that they take from other kernels, directly or not."""
    found, waiting = {source}, [source, source.with_suffix(".pxd")]
    while waiting:
        path = waiting.pop()
        if path.exists():
            found.add(path)
            modules = re.findall(r"heat_igl\.kernels\.[\w.]+", path.read_text(encoding="utf8"))
            declared = {COPIES / KERNELS / f"{_of_module(module)}.pxd" for module in modules}
            waiting += declared - found
            found |= {one for one in declared if one.exists()}
    return found


def _translate(names: list[str], n_processes: int) -> None:
    """Write anew the C files of which the source, or a declaration that it reads, is newer.

    A process that translates many kernels takes a quarter of the time of one for each: Cython reads its own
    definitions, and each declaration, once.
    """
    C_FILES.mkdir(parents=True, exist_ok=True)
    stale = [name for name in names if not _is_current(name)]
    command = [sys.executable, "-m", "cython"]
    options = [*(f"--directive={key}={value}" for key, value in DIRECTIVES.items()), "--shared", _module(SHARED)]
    shares = [
        [f"{KERNELS.as_posix()}/{name}.py" for name in stale if name != SHARED][k::n_processes]
        for k in range(n_processes)
    ]
    commands = [[*command, *options, *share] for share in shares if share]
    if SHARED in stale:
        commands.append(
            [*command, "--module-name", _module(SHARED), "--generate-shared", f"{KERNELS.as_posix()}/{SHARED}.c"]
        )
    running = [
        subprocess.Popen(each, cwd=COPIES, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for each in commands
    ]
    said = [process.communicate()[0] for process in running]
    for process, text in zip(running, said, strict=True):
        if process.returncode:
            raise CompileError(f"heat_igl: Cython cannot translate the kernels:\n{text}")
    for name in stale:
        into = C_FILES / f"{name}.c"
        into.parent.mkdir(parents=True, exist_ok=True)
        (COPIES / KERNELS / f"{name}.c").replace(into)


def _is_current(name: str) -> bool:
    source, into = COPIES / KERNELS / f"{name}.py", C_FILES / f"{name}.c"
    read = _read_by(source) if name != SHARED else set()
    return into.exists() and all(into.stat().st_mtime > path.stat().st_mtime for path in read)
