"""The command line ``heat-igl`` and the demonstration: the package's words, one line per error, no half-written files.

Typer and rich (extra ``cli``) are loaded by `run`, and `heat_igl.cli.demo` is there without them.
"""

import sys
from collections.abc import Sequence

from heat_igl.errors import MissingExtraError

__all__ = ["run"]


def run(arguments: Sequence[str]) -> int:
    """Run one command and return the exit status: 0, 1 for errors, 2 for wrong usage, 130 when interrupted."""
    try:
        from heat_igl.cli.program import run_program
    except ImportError as error:
        # Any other import error is a fault of the installation; the traceback identifies it.
        if (error.name or "").split(".")[0] not in ("typer", "rich", "click"):
            raise
        print(f"heat-igl: {MissingExtraError.of('the command line', 'typer and rich', 'cli')}", file=sys.stderr)
        return 1
    return run_program(arguments)
