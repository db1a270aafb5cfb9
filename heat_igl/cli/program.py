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
from heat_igl.cli.options import say
from heat_igl.errors import AccuracyWarning, BatchError, FactorizationError, MissingExtraError, ReferenceSolverError

# Errors that a user can cause. Any other exception is a fault of the package and shows a traceback.
_EXPECTED = (OSError, ValueError, BatchError, FactorizationError, ReferenceSolverError, MissingExtraError, MemoryError)

# Set by the shell that asks for completions.
_COMPLETION = "_HEAT_IGL_COMPLETE"

# The module of each command. Only the module of the requested command is imported, which saves a third of the time.
_MODULES = {
    "info": "views",
    "validate": "views",
    "distance": "distances",
    "matrix": "matrices",
    "isolines": "distances",
    "path": "distances",
    "trace": "distances",
    "signed": "distances",
    "cut": "distances",
    "view": "views",
    "demo": "views",
    "batch": "matrices",
    "dataset": "matrices",
}

#: Examples for the help of the commands.
EXAMPLES = """
info bunny.obj
info lh.pial --json -
validate bunny.obj
validate bunny.obj --methods heat,exact --sources 10 --picture errors.png
distance bunny.obj --source 1234 --output distance.ply --picture distance.png
distance bunny.obj --source 12 --source 40 --cutoff 0.1 --output distance.npy
distance bunny.obj --at 0.3,0.1,0 --method exact --json -
distance scan.xyz --source 1234 --output distance.ply --picture distance.png
matrix lh.midthickness --radius 20 --region cortex.npy --output within.npz
matrix lh.gii --parcels atlas.dlabel.nii::cortex_left --output parcels.csv
matrix bunny.obj --normalize --dtype float16 --output all.npy
isolines bunny.obj --source 1234 --spacing 0.05 --output lines.obj
isolines bunny.obj --source 1234 --spacing 0.05 --output lines.svg
path bunny.obj --from 12 --to 2000 --output path.obj
path bunny.obj 12 2000 0.1,0.2,0.05 --output path.obj
trace bunny.obj --from 12 --direction 1,0,0 --length 0.1 --output line.obj
signed bunny.obj --curves loops.obj --output signed.ply
cut bunny.obj --curves loops.obj --output cut.ply
cut bunny.obj --curves loops.obj --output part.ply --split
view bunny.obj --source 1234
view bunny.obj --html bunny.html --exact
view bunny.obj --html signed.html --curves loops.obj
view scan.ply --points
demo
demo --out results
batch meshes --store distances.zarr --sources farthest:200
dataset meshes truth --normalize --format mat
""".strip().splitlines()


def application(asked: str | None = None) -> typer.Typer:
    """The command line with the command that was asked for, or with all if it is none of them."""
    app = typer.Typer(
        help="Geodesic distance on meshes by the heat method.", pretty_exceptions_enable=False, rich_markup_mode=None
    )
    app.callback(invoke_without_command=True)(_version)
    for name in [asked] if asked in _MODULES else _MODULES:
        examples = [f"  heat-igl {example}" for example in EXAMPLES if example.split()[0] == name]
        # click keeps the lines of a paragraph that begins with this character.
        epilog = "\n".join(["\b", "Examples:", *examples])
        app.command(name, epilog=epilog)(getattr(import_module(f"heat_igl.cli.{_MODULES[name]}"), name))
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
        with _warnings_on_one_line(), command.make_context("heat-igl", list(arguments) or ["--help"]) as context:
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
