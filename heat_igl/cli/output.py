"""Output of commands, and the checks of files before any work is done for them."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from heat_igl.drawing.output import PAGE_SUFFIXES, PICTURE_SUFFIXES
from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io import CURVE_SUFFIXES
from heat_igl.mesh import Mesh

__all__ = ["check_curves", "check_outputs", "check_page", "check_writable", "print_rows", "say"]


def say(message: str) -> None:
    """Print one line to standard error."""
    print(f"heat-igl: {' '.join(message.split())}", file=sys.stderr)


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Print names and values as two columns."""
    width = max(len(name) for name, _ in rows)
    console = Console(highlight=False, soft_wrap=True)  # no wrapping, so that pipes receive one line per row
    for name, value in rows:
        console.print(Text.assemble((f"{name:{width}}", "bold"), f"  {value}"))


def check_writable(path: Path) -> None:
    """Check that a file can be written to `path`, before it is computed.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a directory: name a file in it")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path} cannot be written: there is no directory {path.parent}")
    try:
        # Permissions do not suffice: the file system may be read-only.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OSError(f"{path} cannot be written: {error.strerror}") from error


def check_page(path: Path) -> None:
    """Check that a page can be written to `path`."""
    if path.suffix.lower() not in PAGE_SUFFIXES:
        raise ValueError(f"--html {path}: pages go to {' or '.join(PAGE_SUFFIXES)} files")
    MissingExtraError.check("a page", "matplotlib", "view")
    check_writable(path)


def check_outputs(mesh: Mesh, output: Path | None, picture: Path | None) -> None:
    """Check that mesh and distance can be written to `output`, and a picture to `picture`."""
    if output is not None:
        accepted = (".vtu",) if mesh.is_tetrahedral else (".ply", ".vtu")
        if output.suffix.lower() not in accepted:
            kind = "tetrahedra with distances" if mesh.is_tetrahedral else "distances"
            raise MeshError(f"--output {output}: {kind} go to {' or '.join(accepted)} files")
        if output.suffix.lower() == ".vtu":
            MissingExtraError.check("a .vtu file", "meshio", "io")
        check_writable(output)
    if picture is not None:
        if picture.suffix.lower() not in PICTURE_SUFFIXES:
            raise ValueError(f"--picture {picture}: pictures go to {', '.join(PICTURE_SUFFIXES)} files")
        MissingExtraError.check("a picture", "matplotlib", "view")
        check_writable(picture)


def check_curves(output: Path) -> None:
    """Check that curves can be written to `output`."""
    if output.suffix.lower() not in CURVE_SUFFIXES:
        raise ValueError(f"--output {output}: curves go to {', '.join(CURVE_SUFFIXES)} files")
    if output.suffix.lower() == ".dxf":
        MissingExtraError.check("a .dxf file", "ezdxf", "io")
    check_writable(output)
