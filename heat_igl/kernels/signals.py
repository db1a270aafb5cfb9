"""Interrupting compiled loops: these run without the interpreter, which handles signals only between instructions."""

import threading

import cython
from cython.cimports.cpython.exc import PyErr_CheckSignals

# Exceptions of signal handlers, kept until the interrupted loop has ended.
_caught = []
# Holds the event that ends loops on a thread, see `obey`.
_thread = threading.local()


def is_interrupted():
    """Whether a loop must end: a signal handler has raised (main thread), or the event of `obey` is set (others)."""
    with cython.gil:
        try:
            PyErr_CheckSignals()
        except BaseException as raised:
            _caught.append(raised)
            return True
        stop = getattr(_thread, "stop", None)
        return stop is not None and stop.is_set()


def obey(stop) -> None:
    """End loops on this thread once `stop`, an event, is set."""
    _thread.stop = stop


def raise_caught() -> None:
    """Raise the exception of a signal handler that interrupted a loop, if there is one, on the main thread."""
    if _caught and threading.current_thread() is threading.main_thread():
        raise _caught.pop()
