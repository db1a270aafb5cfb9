"""Files that replace existing ones only when they are complete, and files packed by gzip (``bunny.obj.gz``)."""

from __future__ import annotations

import contextlib
import gzip
import os
import secrets
import shutil
import zlib
from collections.abc import Iterator
from pathlib import Path

from heat_igl.errors import MeshError

_SUFFIX = ".gz"


@contextlib.contextmanager
def complete_file(path: Path) -> Iterator[Path]:
    """A temporary file in the folder of `path`; it replaces `path` if the block succeeds and is removed otherwise.

    An existing file keeps the permissions, and is unchanged if the new one cannot be written, which is an OSError. If
    `path` is a symbolic link, the file that it points to is replaced.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{secrets.token_hex(4)}.{target.name[-100:]}")  # with all suffixes
    if target.exists() and not target.is_file():
        raise OSError(f"{path} is not a regular file")
    try:
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Like `complete_file`, for meshes and curves: a file that cannot be written is a MeshError."""
    try:
        with complete_file(path) as temporary:
            yield temporary
    except OSError as error:
        raise MeshError(f"{path} cannot be written: {error.strerror or error}") from error


def is_packed(path: Path) -> bool:
    """Whether the name of a file says that it is packed."""
    return path.suffix.lower() == _SUFFIX


def form_suffix(path: Path) -> str:
    """The suffix that selects the format, in lower case and without .gz."""
    return (path.with_suffix("") if is_packed(path) else path).suffix.lower()


def unpacked(path: Path, data: bytes) -> bytes:
    """The contents of a file, unpacked if its name ends in .gz; a MeshError if it is damaged or cut short."""
    if not is_packed(path):
        return data
    try:
        return gzip.decompress(data)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise MeshError(f"{path} cannot be unpacked ({error}): it is damaged, cut short, or not of gzip") from error


def pack(path: Path, written: Path) -> None:
    """Pack the file `written` in place if the name `path` ends in .gz; the same contents give the same bytes."""
    if is_packed(path):
        written.write_bytes(gzip.compress(written.read_bytes(), mtime=0))
