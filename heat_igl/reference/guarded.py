"""Calls in a child process: it may crash, hang or run out of memory without harm to the caller.

One child serves all calls, one after the other, until it fails; the next call starts another. Requests and replies
are single lines of JSON on the child's standard streams. Arrays cross as ``.npy`` files that the child maps into
memory: written once by the caller, shared through the page cache, never pickled. `child` is the other side.

A child started with `multiprocessing` would import the caller's main script again and, on some systems, inherit the
threads and locks; a plain Python process does neither.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from heat_igl.errors import ReferenceSolverError
from heat_igl.reference.child import LONGEST_ALARM
from heat_igl.typing import AnyArray

__all__ = ["MEMORY", "TIMEOUT", "GuardedProcess", "Reply", "call", "close"]

#: Seconds that a call may take, and bytes by which it may let the child's address space grow, unless told otherwise.
TIMEOUT = 600.0
MEMORY = 8 * 2**30

# More bytes than any address space has, in place of infinity, which JSON does not have.
_NO_BOUND = 2.0**62

_START = "import sys; sys.path[:] = sys.argv[1:]; from heat_igl.reference.child import serve; serve()"


class Reply(NamedTuple):
    """The reply of the child to one call.

    Attributes
    ----------
    values : dict
        The values that the function returned: arrays, and values that JSON can carry.
    peak_memory : int or None
        Bytes by which the child's resident memory grew at most during the call.
    """

    values: dict[str, Any]
    peak_memory: int | None


class GuardedProcess:
    """A child process that is started at the first `call` and serves until it fails or is closed.

    Several threads may use it; they wait for each other. After a fork, each process has a child of its own.

    Parameters
    ----------
    growth : float
        Bytes of resident memory beyond those after the first call with which a child is replaced: MeshLab's filters
        leak some 30 to 600 bytes per vertex and call.
    """

    def __init__(self, growth: float = 2**28) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._messages: IO[bytes] | None = None
        self._growth = growth
        self._resident_at_first: int | None = None

    @property
    def pid(self) -> int | None:
        """Process id of the child, None while there is none."""
        return None if self._process is None else self._process.pid

    def call(
        self,
        function: str,
        arrays: Mapping[str, AnyArray],
        parameters: Mapping[str, Any] | None = None,
        *,
        timeout: float = TIMEOUT,
        memory: float = MEMORY,
    ) -> Reply:
        """Call a function in the child, and wait until it returns.

        Parameters
        ----------
        function : str
            ``"module:name"``, imported in the child. It is called with all arrays (read-only) and parameters as
            keyword arguments, and returns a mapping of names to arrays or values that JSON can carry.
        arrays : mapping of str to array
            Passed through files; none is pickled.
        parameters : mapping of str, optional
            Values that JSON can carry.
        timeout : float
            Seconds after which the child is killed.
        memory : float
            Bytes by which the child's address space may grow during the call. Held on Linux; other systems have no
            bound that a process can set for itself.

        Returns
        -------
        Reply

        Raises
        ------
        ReferenceSolverError
            If the function raised, if the child died, or if the time is over. Later calls are not affected.
        """
        with self._lock, tempfile.TemporaryDirectory(prefix="heat_igl_") as folder:
            for name, array in arrays.items():
                np.save(Path(folder, f"{name}.npy"), array, allow_pickle=False)
            request = {
                "function": function,
                "folder": folder,
                "arrays": list(arrays),
                "parameters": dict(parameters or {}),
                "memory": int(min(memory, _NO_BOUND)),
                "timeout": timeout,
            }
            try:
                reply = self._exchange(request, timeout)
            except BaseException:
                # Interrupted or failed half-way: the next reply would belong to this request.
                self._stop()
                raise
            self._replace_if_grown(reply.pop("resident"))
            if "error" in reply:
                raise ReferenceSolverError(_explained(function, reply["error"], memory))
            values = reply["values"]
            values.update((name, np.load(Path(folder, f"result_{name}.npy"))) for name in reply["arrays"])
            return Reply(values, reply["peak_memory"])

    def close(self) -> None:
        """End the child, if there is one. It ends by itself when Python does; the next call starts a new one."""
        with self._lock:
            self._stop()

    def _exchange(self, request: dict[str, Any], timeout: float) -> Any:
        process = self._running()
        stdin, stdout = process.stdin, process.stdout
        late = threading.Event()

        def stop() -> None:
            late.set()
            process.kill()

        timer = threading.Timer(min(timeout, LONGEST_ALARM), stop)
        timer.daemon = True
        timer.start()
        try:
            if stdin is None or stdout is None:
                raise ReferenceSolverError("the child process has no standard streams: report this as a bug")
            with contextlib.suppress(BrokenPipeError):
                stdin.write(json.dumps(request).encode() + b"\n")
                stdin.flush()
            line = stdout.readline()
        finally:
            timer.cancel()
        if line.endswith(b"\n"):
            return json.loads(line)
        status, said = process.wait(), self._said()
        if late.is_set():
            raise ReferenceSolverError(
                f"{request['function']} was stopped after {timeout:g} s: raise timeout, or use a smaller mesh"
            )
        raise ReferenceSolverError(
            f"{request['function']} died with {_status_name(status)}{said}: look for defects with mesh.report(), "
            f"or raise memory (now {request['memory'] / 2**30:.3g} GiB)"
        )

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is not None:
            self._stop()
        if self._process is None:
            self._messages = tempfile.TemporaryFile(prefix="heat_igl_")  # noqa: SIM115 (closed with the child)
            try:
                self._process = subprocess.Popen(
                    [sys.executable, "-c", _START, *sys.path],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._messages,
                )
            except OSError as error:
                raise ReferenceSolverError(
                    f"no child process could be started with sys.executable = {sys.executable!r} ({error}): set it to "
                    "a Python interpreter"
                ) from error
        elif self._messages is not None:
            self._messages.seek(0)
            self._messages.truncate()
        return self._process

    def _replace_if_grown(self, resident: int | None) -> None:
        if self._resident_at_first is None:
            self._resident_at_first = resident
        elif resident is not None and resident > self._resident_at_first + self._growth:
            self._stop()

    def _said(self) -> str:
        """The last line that the child wrote before it died, for the error message."""
        if self._messages is None:
            return ""
        self._messages.seek(0)
        lines = self._messages.read().decode(errors="replace").strip().splitlines()
        return f" ({lines[-1].strip()[:200]})" if lines else ""

    def _stop(self) -> None:
        process, self._process = self._process, None
        messages, self._messages = self._messages, None
        self._resident_at_first = None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with contextlib.suppress(OSError):
                        stream.close()
        if messages is not None:
            messages.close()

    def _after_fork(self) -> None:
        """Replace the lock in a forked process: a thread of the parent, which does not exist here, may have held it.

        The child belongs to the other process; `_running` finds that it cannot be waited for, and starts another.
        """
        self._lock = threading.Lock()


def _status_name(status: int) -> str:
    if status < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-status).name
    return f"exit status {status:#x}" if abs(status) > 255 else f"exit status {status}"


def _explained(function: str, error: Mapping[str, str], memory: float) -> str:
    if error["kind"] == "MemoryError":
        return f"{function} needs more than {memory / 2**30:.3g} GiB: raise memory, or use a smaller mesh"
    if error["kind"] in ("ImportError", "ModuleNotFoundError"):
        return f"{function} cannot be loaded: {error['text']}; install what the message names"
    return f"{function} failed with {error['kind']}: {error['text']}"


_shared = GuardedProcess()
call = _shared.call
close = _shared.close
atexit.register(close)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_shared._after_fork)
