"""Integrity checks of zarr arrays on disk: corrupted data raise an error that names the file.

Zarr fills a missing chunk with the fill value, and does not notice swapped chunks. The writer therefore records the
checksum that the codec ``crc32c`` appends to each chunk, and readers compare it. The codec itself detects changes of
the contents of a chunk.
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
    """The module zarr with its codecs; raises a MissingExtraError if it is not installed."""
    with MissingExtraError.guard("a store of distances", "zarr", "cluster"):
        import zarr
        import zarr.codecs
    return zarr


def checksum(value: Any) -> str:
    """CRC-32 of a JSON-serializable value, in hexadecimal."""
    return f"{zlib.crc32(json.dumps(value, sort_keys=True).encode()):08x}"


def file_checksum(file: Path) -> str:
    """CRC-32 of a small file, in hexadecimal; an empty string if the file cannot be read."""
    try:
        return f"{zlib.crc32(file.read_bytes()):08x}"
    except OSError:
        return ""


def chunk_files(folder: Path, array: Any, rows: slice = slice(None)) -> Iterator[tuple[int, Path]]:
    """Row-major number and file of each chunk that overlaps the given rows of an array in `folder`."""
    counts = [-(-n // width) for n, width in zip(array.shape, array.chunks, strict=True)]
    start, stop, _ = rows.indices(array.shape[0])
    height = array.chunks[0]
    touched = range(start // height, -(-stop // height) if stop > start else start // height)
    for index in itertools.product(touched, *map(range, counts[1:])):
        yield int(np.ravel_multi_index(index, counts)), folder / array.metadata.encode_chunk_key(index)


def chunk_checksum(file: Path) -> str:
    """CRC-32C at the end of a chunk, in hexadecimal; an empty string if the file is missing or too short."""
    try:
        with file.open("rb") as chunk:
            chunk.seek(-_CHECKSUM_BYTES, os.SEEK_END)
            return chunk.read().hex()
    except OSError:
        return ""


def chunk_checksums(folder: Path, array: Any) -> list[str]:
    """CRC-32C of all chunks of an array in `folder`, in row-major order."""
    return [chunk_checksum(file) for _, file in chunk_files(folder, array)]


def damaged_chunk(folder: Path, array: Any, checksums: Sequence[str], rows: slice = slice(None)) -> str:
    """Error message for the first chunk that is missing or has a wrong checksum; an empty string if there is none."""
    for i, file in chunk_files(folder, array, rows):
        if not checksums[i] or chunk_checksum(file) != checksums[i]:
            return f"chunk {file} is {'damaged' if file.exists() else 'missing'}"
    return ""


def read_rows(folder: Path, array: Any, checksums: Sequence[str], rows: slice) -> AnyArray:
    """Read rows of an array in `folder`; a ValueError names a chunk that is missing, damaged or misplaced."""
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
