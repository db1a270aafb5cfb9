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

_SAMPLE_SECONDS = 0.005  # a sample takes 15 us, where the system keeps no maximum


def memory_field(file: str, field: str) -> int | None:
    """A field of a file below ``/proc`` (Linux) in bytes; None on other systems."""
    try:
        text = Path("/proc", file).read_text()
    except OSError:
        return None
    found = re.search(rf"^{field}:\s+(\d+) kB$", text, re.MULTILINE)
    return None if found is None else int(found[1]) * 1024


def available_memory() -> float:
    """Bytes that can be allocated without swapping, as far as the system tells; infinite if it does not."""
    known = memory_field("meminfo", "MemAvailable")
    if known is not None:
        return float(known)
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
        self._start = memory_field("self/status", "VmRSS") or 0
        try:
            Path("/proc/self/clear_refs").write_text("5")  # resets VmHWM
        except OSError:
            with contextlib.suppress(ImportError):
                process = importlib.import_module("psutil").Process()
                self._start = self._highest = int(process.memory_info().rss)
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
        elif (highest := memory_field("self/status", "VmHWM")) is not None:
            self.bytes = max(0, highest - self._start)

    def _sample(self, process: Any) -> None:
        while not self._done.wait(_SAMPLE_SECONDS):
            self._highest = max(self._highest, int(process.memory_info().rss))


def release_free_memory() -> None:
    """Return freed memory to the system (glibc only). Reuse of such memory would not count as growth."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
