"""Checks of zarr arrays on disk: what is read is what was written, or an error names the file.

zarr reads a missing chunk as the fill value, and chunks that changed places without an error. So the writer of an array
keeps the checksums that the codec ``crc32c`` appends to the chunks, and readers compare. The codec itself protects the
contents of a chunk.
"""

from __future__ import annotations

import itertools
import json
import os
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MissingExtraError
from heat_igl.typing import AnyArray

# The codec crc32c appends this many bytes to a chunk (zarr specification, version 3).
_CHECKSUM_BYTES = 4


def zarr_module() -> Any:
    """The library zarr with its codecs; a MissingExtraError if it is not installed."""
    with MissingExtraError.guard("a store of distances", "zarr", "cluster"):
        import zarr
        import zarr.codecs
    return zarr


def checksum(value: Any) -> str:
    """The checksum of a value that JSON can carry."""
    return f"{zlib.crc32(json.dumps(value, sort_keys=True).encode()):08x}"


def file_checksum(file: Path) -> str:
    """The checksum of a small file; empty if it cannot be read."""
    try:
        return f"{zlib.crc32(file.read_bytes()):08x}"
    except OSError:
        return ""


def chunk_files(folder: Path, array: Any, rows: slice = slice(None)) -> Iterator[tuple[int, Path]]:
    """The chunks of an array in `folder` that hold the given rows: each with its number in row-major order and file."""
    counts = [-(-n // width) for n, width in zip(array.shape, array.chunks, strict=True)]
    start, stop, _ = rows.indices(array.shape[0])
    height = array.chunks[0]
    touched = range(start // height, -(-stop // height) if stop > start else start // height)
    for index in itertools.product(touched, *map(range, counts[1:])):
        yield int(np.ravel_multi_index(index, counts)), folder / array.metadata.encode_chunk_key(index)


def chunk_checksum(file: Path) -> str:
    """The checksum at the end of a chunk; empty if the file is missing or too short."""
    try:
        with file.open("rb") as chunk:
            chunk.seek(-_CHECKSUM_BYTES, os.SEEK_END)
            return chunk.read().hex()
    except OSError:
        return ""


def chunk_checksums(folder: Path, array: Any) -> list[str]:
    """The checksums of all chunks of an array in `folder`."""
    return [chunk_checksum(file) for _, file in chunk_files(folder, array)]


def damaged_chunk(folder: Path, array: Any, checksums: Sequence[str], rows: slice = slice(None)) -> str:
    """What is wrong with the first chunk that is missing or ends with another checksum; empty if there is none."""
    for i, file in chunk_files(folder, array, rows):
        if not checksums[i] or chunk_checksum(file) != checksums[i]:
            return f"chunk {file} is {'damaged' if file.exists() else 'missing'}"
    return ""


def read_rows(folder: Path, array: Any, checksums: Sequence[str], rows: slice) -> AnyArray:
    """Rows of an array in `folder`.

    A ValueError names a chunk that is missing or damaged, or is that of another place.
    """
    problem = damaged_chunk(folder, array, checksums, rows)
    if problem:
        raise ValueError(problem)
    try:
        return np.asarray(array[rows])
    except Exception:  # each codec of zarr has an exception of its own
        for i, file in chunk_files(folder, array, rows):
            try:
                array.get_block_selection(np.unravel_index(i, array.cdata_shape))
            except Exception as error:
                raise ValueError(f"chunk {file} is damaged: {error}") from None
        raise
