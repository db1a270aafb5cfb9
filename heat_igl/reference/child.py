"""The child process of `guarded`: answer requests one after the other, each within bounds on memory and time."""

from __future__ import annotations

import importlib
import json
import os
import signal
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.runtime import PeakMemory, release_free_memory, resident_memory

__all__ = ["LONGEST_ALARM", "serve"]

#: The longest time, in seconds, that both the system's alarm and a timer of Python take.
LONGEST_ALARM = 2.0**20

# Seconds that an abandoned child outlives the timeout.
_GRACE = 5.0


def serve() -> None:
    """Answer requests until the caller closes the pipe; the child's main loop."""
    # Native libraries print to standard output, which must carry replies only.
    replies = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    for line in sys.stdin.buffer:
        request = json.loads(line)
        _bound_time(request["timeout"] + _GRACE)
        reply = _handle(request)
        _bound_time(0)
        release_free_memory()
        reply["resident"] = resident_memory()
        replies.write(json.dumps(reply).encode() + b"\n")


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


def _bound_time(seconds: float) -> None:
    """End this process after so many seconds; never if 0.

    The caller ends a late child itself, unless it was killed. A thread of this process could not, since a native
    function may hold the interpreter. The system's alarm needs neither.
    """
    if hasattr(signal, "alarm"):
        signal.alarm(int(min(seconds, LONGEST_ALARM)))


def _handle(request: Mapping[str, Any]) -> dict[str, Any]:
    """Call the function of a request; returns the reply, which names the error if there was one."""
    folder = Path(request["folder"])
    module, name = request["function"].split(":")
    _bound_memory(request["memory"])
    try:
        arrays = {key: np.load(folder / f"{key}.npy", mmap_mode="r").view(np.ndarray) for key in request["arrays"]}
        function = getattr(importlib.import_module(module), name)
        with PeakMemory() as peak:
            result = function(**arrays, **request["parameters"])
        values = dict(result) if isinstance(result, Mapping) else {}
        saved = [key for key, value in values.items() if isinstance(value, np.ndarray)]
        for key in saved:
            np.save(folder / f"result_{key}.npy", values.pop(key), allow_pickle=False)
    except Exception as error:  # whatever a native library raises belongs to the caller, not to this loop
        text = " ".join(str(error).split())[:500]
        return {"error": {"kind": type(error).__name__, "text": text}}
    return {"values": values, "arrays": saved, "peak_memory": peak.bytes}
