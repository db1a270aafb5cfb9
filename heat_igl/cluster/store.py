"""What a batch writes: one zarr group per mesh, distances in blocks of rows, and which blocks are finished."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

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
        zarr = _zarr()
        self.path = Path(path)
        if self.path.exists() and not (self.path / "zarr.json").is_file() and (self._is_occupied()):
            raise ValueError(f"store {self.path} is not a zarr group of distances: name a new or an empty directory")
        if options is None:
            self._root = zarr.open_group(self.path, mode="r+")
            return
        with _writing(self.path):
            self._root = zarr.open_group(self.path, mode="a")
            begun = self._root.attrs.get("heat_igl")
            if begun is None and len(list(self._root.keys())):
                raise ValueError(f"store {self.path} holds other data: name a new or an empty directory")
            wanted = {"format": _FORMAT, **options}
            if begun is None:
                self._root.attrs["heat_igl"] = wanted
            elif begun != wanted:
                name = next(key for key in [*wanted, *begun] if begun.get(key) != wanted.get(key))
                raise ValueError(
                    f"store {self.path} was begun with {name}={begun.get(name)!r}, not {wanted.get(name)!r}: "
                    "continue it with the same, or name a new store"
                )

    def _is_occupied(self) -> bool:
        return not self.path.is_dir() or any(self.path.iterdir())

    @property
    def options(self) -> dict[str, Any]:
        """What the store was begun with."""
        return dict(self._root.attrs["heat_igl"])

    def names(self) -> list[str]:
        """Names of the meshes that the store knows, sorted."""
        return sorted(metadata.parent.name for metadata in self.path.glob("*/zarr.json"))

    def attributes(self, name: str) -> dict[str, Any]:
        """What is known of a mesh: status, t, versions, checksum, report; empty if it was not begun."""
        return dict(self._root[name].attrs) if (self.path / name / "zarr.json").is_file() else {}

    def update(self, name: str, attributes: Mapping[str, Any]) -> None:
        """Change some of what is known of a mesh that was begun."""
        with _writing(self.path):
            self._root[name].update_attributes(dict(attributes))

    def fail(self, name: str, mesh: str, reason: str) -> None:
        """Record that a mesh has no distances, or not all, and why. Those that it has stay."""
        failure = {"mesh": mesh, "status": "failed", "reason": reason}
        if self.attributes(name):
            self.update(name, failure)
        else:
            self._make(name, {}, failure)

    def begin(
        self, name: str, source_sets: Sequence[IntArray], n: int, dtype: str, attributes: Mapping[str, Any]
    ) -> MeshGroup:
        """The group of a mesh with empty distances; replaces what was there."""
        k = len(source_sets)
        chunk = (min(rows_per_block(n), k), min(n, _COLUMNS))
        # The vertices of all source sets in one list, each with the row of `distance` that starts at it.
        vertices = np.concatenate(source_sets).astype("<i8", copy=False)
        row = np.repeat(np.arange(k, dtype="<i8"), [len(one) for one in source_sets])
        distance = _array((k, n), chunk, dtype, "NaN", ("source", "vertex"), {"name": "crc32c"})
        sources = _array(row.shape, row.shape, "int64", 0, ("source_entry",))
        files = {
            "distance/zarr.json": _json(distance),
            "source_vertex/zarr.json": _json(sources),
            "source_vertex/c/0": vertices.tobytes(),
            "source_row/zarr.json": _json(sources),
            "source_row/c/0": row.tobytes(),
        }
        self._make(name, files, {**attributes, "status": "running"})
        return MeshGroup(self, name, _zarr().Array.from_dict(self._root.store_path / name / "distance", distance))

    def _make(self, name: str, files: Mapping[str, bytes], attributes: Mapping[str, Any]) -> None:
        """Make a group, by hand: a few small files, for which zarr takes several times as long."""
        path = self.path / name
        metadata = path / "zarr.json"
        with _writing(self.path):
            # Removed first and written last, whole: without it there is no group, only what a crash has left of one.
            metadata.unlink(missing_ok=True)
            shutil.rmtree(path, ignore_errors=True)
            for key, content in files.items():
                (path / key).parent.mkdir(parents=True, exist_ok=True)
                (path / key).write_bytes(content)
            path.mkdir(exist_ok=True)
            whole = metadata.with_suffix(".partial")
            whole.write_bytes(_json({"zarr_format": 3, "node_type": "group", "attributes": dict(attributes)}))
            whole.replace(metadata)

    def group(self, name: str) -> MeshGroup:
        """The group of a mesh that was begun."""
        return MeshGroup(self, name, self._root[name]["distance"])


class MeshGroup:
    """The distances of one mesh in a store.

    A block of rows is a row of zarr's chunks. Each chunk ends in its checksum, and its file is renamed into place: it
    is there whole, or not finished.
    """

    def __init__(self, store: Store, name: str, distance: Any) -> None:
        self.name = name
        self._store = store
        self._distance = distance
        self._path = store.path / name

    @property
    def n_rows(self) -> int:
        """Number of source sets."""
        return int(self._distance.shape[0])

    @property
    def n_columns(self) -> int:
        """Number of vertices."""
        return int(self._distance.shape[1])

    def source_sets(self) -> list[IntArray]:
        """The source vertices of each row."""
        zarr = _zarr()
        vertices, row = (zarr.open_array(self._path / f"source_{label}", mode="r")[:] for label in ("vertex", "row"))
        return list(np.split(vertices, np.searchsorted(row, np.arange(1, self.n_rows))))

    def rows(self, block: int) -> slice:
        """The rows of a block."""
        height = self._distance.chunks[0]
        return slice(block * height, min((block + 1) * height, self.n_rows))

    def missing(self) -> list[int]:
        """Blocks that were not finished, or do not read back with the checksum that they were written with."""
        n_blocks = -(-self.n_rows // self._distance.chunks[0])
        return [block for block in range(n_blocks) if not self._is_finished(block)]

    def _is_finished(self, block: int) -> bool:
        if not (self._path / "distance" / "c" / str(block)).is_dir():
            return False
        try:
            # No distance is NaN, as what lies in a chunk that is missing.
            return not np.isnan(self._distance[self.rows(block)]).any()
        except Exception:
            # Each of zarr's codecs has its own exception for bytes that it cannot decode.
            return False

    def write(self, block: int, distances: AnyArray) -> None:
        """Write one block."""
        with _writing(self._store.path):
            self._distance[self.rows(block)] = distances

    def finish(self) -> None:
        """Mark a mesh whose blocks are all written, with one checksum over those of the chunks."""
        whole = 0
        for block in range(-(-self.n_rows // self._distance.chunks[0])):
            for column in range(-(-self.n_columns // self._distance.chunks[1])):
                with (self._path / "distance" / "c" / str(block) / str(column)).open("rb") as chunk:
                    chunk.seek(-_CHECKSUM_BYTES, os.SEEK_END)
                    whole = zlib.crc32(chunk.read(), whole)
        self._store.update(self.name, {"checksum": f"{whole:08x}", "status": "done"})
        for partial in self._path.rglob("*.partial"):  # of writers that were killed
            partial.unlink(missing_ok=True)


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


def _json(metadata: Mapping[str, Any]) -> bytes:
    return json.dumps(metadata).encode()


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
