"""Files that replace existing ones only when they are complete."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

from heat_igl.errors import MeshError


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
