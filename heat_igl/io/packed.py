"""Files packed by gzip: ``bunny.obj.gz`` is the file ``bunny.obj``."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from heat_igl.errors import MeshError

_SUFFIX = ".gz"


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
