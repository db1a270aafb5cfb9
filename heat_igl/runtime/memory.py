"""Peak and current memory of this process, and the memory that is available."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import re
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

_SAMPLE_SECONDS = 0.005


def _status(field: str) -> int | None:
    """A field of ``/proc/self/status`` (Linux) in bytes; None on other systems."""
    try:
        text = Path("/proc/self/status").read_text()
    except OSError:
        return None
    found = re.search(rf"^{field}:\s+(\d+) kB$", text, re.MULTILINE)
    return None if found is None else int(found[1]) * 1024


def _psutil_process() -> Any:
    try:
        return importlib.import_module("psutil").Process()
    except ImportError:
        return None


def resident_memory() -> int | None:
    """Physical memory of this process in bytes; None if it cannot be determined."""
    known = _status("VmRSS")
    if known is None and (process := _psutil_process()) is not None:
        known = int(process.memory_info().rss)
    return known


def available_memory() -> float:
    """Bytes that can be allocated without swapping, as far as the system tells; infinite if it does not."""
    try:
        with open("/proc/meminfo") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * int(line.split()[1])
    except OSError:
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return float("inf")


class PeakMemory:
    """A context that measures the growth of the resident memory of this process, in `bytes` once it is left.

    On Linux the peak is exact, since the kernel records a high-water mark. On other systems psutil samples the memory
    every 5 ms, which can miss a short peak. Without psutil `bytes` stays None.
    """

    def __init__(self) -> None:
        self.bytes: int | None = None
        self._start = 0
        self._highest = 0
        self._sampler: threading.Thread | None = None
        self._done = threading.Event()

    def __enter__(self) -> PeakMemory:
        release_free_memory()
        self._start = self._highest = resident_memory() or 0
        if not _reset_high_water() and (process := _psutil_process()) is not None:
            self._sampler = threading.Thread(target=self._sample, args=(process,), daemon=True)
            self._sampler.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._sampler is not None:
            self._done.set()
            self._sampler.join()
            self.bytes = self._highest - self._start
        elif (highest := _status("VmHWM")) is not None:
            self.bytes = max(0, highest - self._start)

    def _sample(self, process: Any) -> None:
        while not self._done.wait(_SAMPLE_SECONDS):
            self._highest = max(self._highest, int(process.memory_info().rss))


def release_free_memory() -> None:
    """Return freed memory to the system (glibc only). Reuse of such memory would not count as growth."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def _reset_high_water() -> bool:
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    return True
