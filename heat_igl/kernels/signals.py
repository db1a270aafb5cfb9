"""Ctrl-C in compiled loops: they hold no interpreter lock, and Python sees signals between its instructions only."""

import threading

import cython
from cython.cimports.cpython.exc import PyErr_CheckSignals

# What the handler of a signal raised, until the loop that asked has ended.
_caught = []
# What tells a thread to end, see `obey`.
_thread = threading.local()


def is_interrupted() -> cython.bint:
    """Whether a loop is to end: on the main thread if the handler of a signal has raised, on others as they `obey`."""
    with cython.gil:
        try:
            PyErr_CheckSignals()
        except BaseException as raised:
            _caught.append(raised)
            return True
        stop = getattr(_thread, "stop", None)
        return stop is not None and stop.is_set()


def obey(stop) -> None:
    """Let loops on this thread end once an event is set."""
    _thread.stop = stop


def raise_caught() -> None:
    """Raise, on the main thread, what the handler of a signal raised in a loop that has ended since, if it did."""
    if _caught and threading.current_thread() is threading.main_thread():
        raise _caught.pop()
