"""The command line ``heat-igl`` and the demonstration: the package's words, one line per error, no half-written files.

Typer and rich (extra ``cli``) are loaded by `run`, and `heat_igl.demo` is there without them.
"""

from collections.abc import Sequence

__all__ = ["run"]


def run(arguments: Sequence[str]) -> int:
    """Run one command and return the exit status: 0, 1 for errors, 2 for wrong usage, 130 when interrupted.

    Raises
    ------
    ImportError
        If typer or rich is not installed.
    """
    from heat_igl.cli.program import run_program

    return run_program(arguments)
