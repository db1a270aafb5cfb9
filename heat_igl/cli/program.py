"""The program: runs one command, prints errors and warnings in one line each."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Annotated, Any

import typer

import heat_igl
from heat_igl.cli.examples import epilog
from heat_igl.cli.output import say
from heat_igl.errors import (
    AccuracyWarning,
    BatchError,
    FactorizationError,
    MissingExtraError,
    ReferenceSolverError,
)

__all__ = ["application", "run_program"]

# Errors that a user can cause. Any other exception is a fault of the package and shows a traceback.
_EXPECTED = (OSError, ValueError, BatchError, FactorizationError, ReferenceSolverError, MissingExtraError, MemoryError)

# Set by the shell that asks for completions.
_COMPLETION = "_HEAT_IGL_COMPLETE"

# The module of each command: only that of the command asked for is imported, which saves a third of its time.
_MODULES = {
    "info": "comparison",
    "validate": "comparison",
    "distance": "distances",
    "matrix": "matrices",
    "isolines": "distances",
    "path": "paths",
    "trace": "paths",
    "signed": "regions",
    "cut": "regions",
    "view": "views",
    "demo": "views",
    "batch": "collections",
    "dataset": "collections",
}


def application(asked: str | None = None) -> typer.Typer:
    """The command line with the command that was asked for, or with all if it is none of them."""
    app = typer.Typer(
        help="Geodesic distance on meshes by the heat method.", pretty_exceptions_enable=False, rich_markup_mode=None
    )
    app.callback(invoke_without_command=True)(_version)
    for name in [asked] if asked in _MODULES else _MODULES:
        command = getattr(import_module(f"heat_igl.cli.{_MODULES[name]}"), name.replace("-", "_"))
        app.command(name, epilog=epilog(name))(command)
    return app


def run_program(arguments: Sequence[str]) -> int:
    """Run one command and return the exit status: 0, 1 for errors, 2 for wrong usage, 130 when interrupted."""
    is_completed = _COMPLETION in os.environ
    command = typer.main.get_command(application(None if is_completed or not arguments else arguments[0]))
    if is_completed:
        # A shell asks for completions, in the environment; this prints them and exits.
        command(prog_name="heat-igl")
    try:
        # command.main is not used: the handling of errors and of Ctrl-C differs between versions of typer.
        with (
            _warnings_on_one_line(),
            command.make_context("heat-igl", list(arguments) or ["--help"]) as context,
        ):
            command.invoke(context)
            sys.stdout.flush()
    except typer.Exit as error:
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):
        say("interrupted")
        return 130
    except BrokenPipeError:
        # The reader of the output is gone. Python flushes again at exit, which must not raise an error.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except _EXPECTED as error:
        say(_one_line(error))
        return 1
    except Exception as error:
        # Usage errors have no common public class over the versions of typer.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        say(f"{message()} (see heat-igl --help)")
        return int(getattr(error, "exit_code", 2))
    return 0


def _one_line(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return f"out of memory: {error}" if str(error) else "out of memory"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error) or type(error).__name__


@contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        say(f"warning: {message}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", AccuracyWarning)
        warnings.showwarning = show
        yield


def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    if version:
        print(heat_igl.__version__)
        raise typer.Exit
