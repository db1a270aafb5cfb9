"""Calls in a child process: it may crash, hang or run out of memory without harm to the caller.

Each call has a Python process of its own, which takes .1 s to start. The request and the reply are files in a temporary
folder.

A child started with `multiprocessing` would import the caller's main script again and, on some systems, inherit the
threads and locks; a plain Python process does neither.
"""

from __future__ import annotations

import contextlib
import importlib
import pickle
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from heat_igl.errors import ReferenceSolverError
from heat_igl.runtime import PeakMemory

#: Seconds that a call may take, and bytes by which it may let the child's address space grow, unless told otherwise.
TIMEOUT = 600.0
MEMORY = 8 * 2**30

# The longest time, in seconds, that both the system's alarm and a wait of Python take.
_LONGEST = 2.0**20
# More bytes than any address space has, in place of infinity, which is no integer.
_NO_BOUND = 2.0**62
# Seconds that a child outlives the timeout if the caller was killed.
_GRACE = 5.0

_START = "import sys; sys.path[:] = sys.argv[2:]; from heat_igl.reference.guarded import answer; answer(sys.argv[1])"


class Reply(NamedTuple):
    """What the function returned, and the bytes by which the child's resident memory grew at most during the call."""

    values: dict[str, Any]
    peak_memory: int | None


def call(
    function: str, arguments: Mapping[str, Any], *, library: str = "", timeout: float = TIMEOUT, memory: float = MEMORY
) -> Reply:
    """Call a function in a child process, and wait until it returns.

    `function` is ``"module:name"``, imported in the child. It is called with the arguments as keywords, and returns a
    mapping of names to values. `library` is a module that is imported before memory is measured. The child is killed
    after `timeout` seconds. Its address space may grow by `memory` bytes during the call: held on Linux; other systems
    have no bound that a process can set for itself.

    A ReferenceSolverError if the function raised, if the child died, or if the time is over.
    """
    with tempfile.TemporaryDirectory(prefix="heat_igl_") as name:
        folder = Path(name)
        seconds = min(timeout, _LONGEST)
        request = function, dict(arguments), library, seconds, int(min(memory, _NO_BOUND))
        with (folder / "request").open("wb") as file:  # in which arrays are not copied first
            pickle.dump(request, file, protocol=5)
        try:
            done = subprocess.run(
                [sys.executable, "-c", _START, name, *sys.path],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise ReferenceSolverError(
                f"{function} was stopped after {timeout:g} s: raise timeout, or use a smaller mesh"
            ) from None
        except OSError as error:
            raise ReferenceSolverError(
                f"no child process could be started with sys.executable = {sys.executable!r} ({error}): set it to "
                "a Python interpreter"
            ) from error
        answered = folder / "reply"
        if done.returncode or not answered.exists():
            lines = done.stdout.decode(errors="replace").strip().splitlines()
            said = f" ({lines[-1].strip()[:200]})" if lines else ""
            raise ReferenceSolverError(
                f"{function} died with {_status_name(done.returncode)}{said}: look for defects with mesh.report(), "
                f"or raise memory (now {memory / 2**30:.3g} GiB)"
            )
        reply = pickle.loads(answered.read_bytes())
        if not isinstance(reply, Reply):
            raise ReferenceSolverError(_explained(function, memory, *reply))
        return reply


def _status_name(status: int) -> str:
    if status < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-status).name
    return f"exit status {status:#x}" if abs(status) > 255 else f"exit status {status}"


def _explained(function: str, memory: float, kind: str, text: str) -> str:
    if kind == "MemoryError":
        return f"{function} needs more than {memory / 2**30:.3g} GiB: raise memory, or use a smaller mesh"
    if kind in ("ImportError", "ModuleNotFoundError"):
        return f"{function} cannot be loaded: {text}; install what the message names"
    return f"{function} failed with {kind}: {text}"


def answer(name: str) -> None:
    """In the child: call the function of the request in a folder, and write the reply, or the error, beside it."""
    folder = Path(name)
    called, arguments, library, seconds, memory = pickle.loads((folder / "request").read_bytes())
    if hasattr(signal, "alarm"):
        # If the caller was killed. A thread could not end the child, since a native function may hold the interpreter.
        signal.alarm(int(min(seconds + _GRACE, _LONGEST)))
    module, function = called.split(":")
    _bound_memory(memory)
    try:
        call_it = getattr(importlib.import_module(module), function)
        if library:
            importlib.import_module(library)
        with PeakMemory() as peak:
            result = call_it(**arguments)
        reply: Any = Reply(dict(result) if isinstance(result, Mapping) else {}, peak.bytes)
    except Exception as error:  # whatever a native library raises belongs to the caller
        reply = type(error).__name__, " ".join(str(error).split())[:500]
    (folder / "reply").write_bytes(pickle.dumps(reply))


def _bound_memory(extra: int) -> None:
    """Let the address space of this process grow by at most `extra` bytes from now on."""
    try:
        resource = importlib.import_module("resource")
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except (ImportError, OSError):
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    bound = pages * resource.getpagesize() + extra
    if hard != resource.RLIM_INFINITY:
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_AS, (bound, hard))
