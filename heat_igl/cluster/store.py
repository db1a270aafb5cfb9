"""What a batch writes: one zarr group per mesh, distances in blocks of rows, and which blocks are finished."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import zlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from heat_igl.errors import BatchError, MissingExtraError
from heat_igl.typing import AnyArray, IntArray

__all__ = ["MeshGroup", "Store", "rows_per_block"]

# Rows of a block: whole blocks of right-hand sides of the solver, so that a row's bits depend on no other block.
_ROWS = 8
_MOST_ROWS = 64
_ENTRIES = 2**22
# Longest row of one zarr chunk.
_COLUMNS = 2**20
_FORMAT = 2
# A chunk ends in its CRC-32C.
_CHECKSUM_BYTES = 4
_METADATA = "zarr.json"
# What a writer leaves that was killed, zarr's own or this one.
_PARTIAL = ".partial"


def rows_per_block(n: int) -> int:
    """Rows that are solved, written and resumed as one, on a mesh of `n` vertices: 64 at most, less on large meshes."""
    return int(min(_MOST_ROWS, max(_ROWS, _ROWS * (_ENTRIES // (_ROWS * n)))))


class Store:
    """The zarr group of a batch.

    Parameters
    ----------
    path : path-like
        A directory; made if missing.
    options : mapping
        What every distance in the store depends on, JSON values only. A store that was begun with others is refused.

    Raises
    ------
    ValueError
        If `path` holds something else, or distances with other options.
    BatchError
        If it cannot be written.
    MissingExtraError
        If zarr is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], options: Mapping[str, Any] | None = None) -> None:
        _zarr()
        self.path = Path(path)
        is_group = (self.path / _METADATA).is_file()
        begun = _read(self.path).get("attributes", {}).get("heat_igl") if is_group else None
        if options is None:
            if begun is None:
                raise ValueError(f"store {self.path} is not a zarr group of distances")
            return
        if not is_group and self._is_occupied():
            raise ValueError(f"store {self.path} is not a zarr group of distances: name a new or an empty directory")
        if begun is None and self.names():
            raise ValueError(f"store {self.path} holds other data: name a new or an empty directory")
        wanted = {"format": _FORMAT, **options}
        if begun is None:
            with _writing(self.path):
                _write(self.path / _METADATA, _group({"heat_igl": wanted}))
        elif begun != wanted:
            name = next(key for key in [*wanted, *begun] if begun.get(key) != wanted.get(key))
            raise ValueError(
                f"store {self.path} was begun with {name}={begun.get(name)!r}, not {wanted.get(name)!r}: "
                "continue it with the same, or name a new store"
            )

    def _is_occupied(self) -> bool:
        if not self.path.is_dir():
            return self.path.exists()
        return any(entry.suffix != _PARTIAL for entry in self.path.iterdir())

    def names(self) -> list[str]:
        """Names of the meshes that the store knows, sorted."""
        return sorted(metadata.parent.name for metadata in self.path.glob(f"*/{_METADATA}"))

    def attributes(self, name: str) -> dict[str, Any]:
        """What is known of a mesh: status, t, versions, checksum, report; empty if it was not begun."""
        try:
            return dict(_read(self.path / name)["attributes"])
        except FileNotFoundError:
            return {}

    def update(self, name: str, attributes: Mapping[str, Any]) -> None:
        """Change some of what is known of a mesh that was begun."""
        with _writing(self.path):
            _write(self.path / name / _METADATA, _group({**self.attributes(name), **attributes}))

    def fail(self, name: str, mesh: str, reason: str) -> None:
        """Record that a mesh has no distances, or not all, and why. Those that it has stay."""
        self.update(name, {"mesh": mesh, "status": "failed", "reason": reason})

    def begin(
        self, name: str, source_sets: Sequence[IntArray], n: int, dtype: str, attributes: Mapping[str, Any]
    ) -> MeshGroup:
        """The group of a mesh with empty distances; replaces what was there."""
        k = len(source_sets)
        chunk = (min(rows_per_block(n), k), min(n, _COLUMNS))
        sources = {
            # The vertices of all source sets in one list, each with the row of `distance` that starts at it.
            "source_vertex": np.concatenate(source_sets),
            "source_row": np.repeat(np.arange(k), [len(one) for one in source_sets]),
        }
        path = self.path / name
        with _writing(self.path):
            # Its metadata goes first and comes last: without them there is no group, only what a crash has left of one.
            (path / _METADATA).unlink(missing_ok=True)
            shutil.rmtree(path, ignore_errors=True)
            for label, entries in sources.items():
                array = _array(entries.shape, entries.shape, "int64", 0, ("source_entry",))
                _write(path / label / _METADATA, _json(array))
                _write(path / label / "c" / "0", entries.astype("<i8").data)
            array = _array((k, n), chunk, dtype, "NaN", ("source", "vertex"), {"name": "crc32c"})
            _write(path / "distance" / _METADATA, _json(array))
            _write(path / _METADATA, _group({**attributes, "status": "running"}))
        return self.group(name)

    def group(self, name: str) -> MeshGroup:
        """The group of a mesh that was begun."""
        return MeshGroup(self, name)


class MeshGroup:
    """The distances of one mesh in a store.

    A block of rows is a row of zarr's chunks. Each chunk ends in its checksum, so that one that was not written to its
    end does not read back.
    """

    def __init__(self, store: Store, name: str) -> None:
        self._store = store
        self._name = name
        self._path = store.path / name / "distance"
        metadata = _read(self._path)
        self.n_rows, self.n_columns = metadata["shape"]  # source sets, vertices
        self._height, self._width = metadata["chunk_grid"]["configuration"]["chunk_shape"]
        self._dtype = np.dtype(metadata["data_type"]).newbyteorder("<")
        self._n_blocks = -(-self.n_rows // self._height)

    @cached_property
    def _distance(self) -> Any:
        return _zarr().open_array(self._path, mode="r+")

    def source_sets(self) -> list[IntArray]:
        """The source vertices of each row."""
        vertices, row = (
            _zarr().open_array(self._path.with_name(label), mode="r")[:] for label in ("source_vertex", "source_row")
        )
        return list(np.split(vertices, np.searchsorted(row, np.arange(1, self.n_rows))))

    def rows(self, block: int) -> slice:
        """The rows of a block."""
        return slice(block * self._height, min((block + 1) * self._height, self.n_rows))

    def missing(self) -> list[int]:
        """Blocks that were not finished, or do not read back with the checksum that they were written with."""
        return [block for block in range(self._n_blocks) if not self._is_finished(block)]

    def _is_finished(self, block: int) -> bool:
        if not (self._path / "c" / str(block)).is_dir():
            return False
        try:
            # Where a chunk is missing zarr reads NaN, which no distance is.
            return not np.isnan(self._distance[self.rows(block)]).any()
        except Exception:
            # Each of zarr's codecs has its own exception for bytes that it cannot decode.
            return False

    def write(self, block: int, distances: AnyArray) -> None:
        """Write one block."""
        with _writing(self._store.path):
            for column, first in enumerate(range(0, self.n_columns, self._width)):
                chunk = distances[:, first : first + self._width]
                beyond = self._height - chunk.shape[0], self._width - chunk.shape[1]
                if any(beyond):
                    chunk = np.pad(chunk, [(0, k) for k in beyond])  # all chunks of an array are equally large
                chunk = np.ascontiguousarray(chunk, dtype=self._dtype)
                _write(self._path / "c" / str(block) / str(column), chunk.data, _crc32c(chunk))

    def finish(self) -> None:
        """Mark a mesh whose blocks are all written, with one checksum over those of the chunks."""
        whole = 0
        for block in range(self._n_blocks):
            for column in range(-(-self.n_columns // self._width)):
                with (self._path / "c" / str(block) / str(column)).open("rb") as chunk:
                    chunk.seek(-_CHECKSUM_BYTES, os.SEEK_END)
                    whole = zlib.crc32(chunk.read(), whole)
        self._store.update(self._name, {"checksum": f"{whole:08x}", "status": "done"})
        for partial in self._path.rglob(f"*{_PARTIAL}"):
            partial.unlink(missing_ok=True)


def _read(path: Path) -> dict[str, Any]:
    """Metadata of a group or an array."""
    return dict(json.loads((path / _METADATA).read_bytes()))


def _write(path: Path, *contents: bytes | memoryview) -> None:
    """A file of the store, whole or not at all. Zarr takes several times as long and copies what is large."""
    # Several writers may be at it, with the same bytes, where Dask took a worker for dead.
    partial = path.with_name(f"{path.name}.{uuid4().hex}{_PARTIAL}")
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with partial.open("wb") as file:
            for content in contents:
                file.write(content)
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def _json(metadata: Mapping[str, Any]) -> bytes:
    return json.dumps(metadata).encode()


def _group(attributes: Mapping[str, Any]) -> bytes:
    return _json({"zarr_format": 3, "node_type": "group", "attributes": attributes})


def _crc32c(chunk: AnyArray) -> bytes:
    """What zarr's codec puts at the end of a chunk."""
    import google_crc32c  # zarr needs it too

    return int(google_crc32c.value(chunk)).to_bytes(_CHECKSUM_BYTES, "little")


def _array(
    shape: tuple[int, ...],
    chunk: tuple[int, ...],
    dtype: str,
    fill_value: Any,
    dimensions: tuple[str, ...],
    *codecs: dict[str, Any],
) -> dict[str, Any]:
    """Metadata of an array. Uncompressed: zstd saves an eighth of the space and doubles the time to write."""
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": shape,
        "data_type": dtype,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": fill_value,
        "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, *codecs],
        "dimension_names": dimensions,
        "attributes": {},
        "storage_transformers": [],
    }


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        remedy = "free some space" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "make it writable"
        raise BatchError(
            f"store {path} cannot be written: {reason}. What is finished stays; {remedy} and run the same again"
        ) from None


def _zarr() -> Any:
    try:
        import zarr
    except ImportError:
        raise MissingExtraError.of("a store of distances", "zarr", "cluster") from None
    return zarr
