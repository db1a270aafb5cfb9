"""What a batch writes: one zarr group per mesh, distances in blocks of rows, and which blocks are finished."""

from __future__ import annotations

import contextlib
import errno
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
_FORMAT = 1


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
        return sorted(self._root.group_keys())

    def attributes(self, name: str) -> dict[str, Any]:
        """What is known of a mesh; empty if it was not begun."""
        try:
            return dict(self._root[name].attrs)
        except KeyError:
            return {}

    def fail(self, name: str, mesh: str, reason: str) -> None:
        """Record that a mesh has no distances, or not all, and why. Those that it has stay."""
        failure = {"mesh": mesh, "status": "failed", "reason": reason}
        with _writing(self.path):
            if "status" in self.attributes(name):
                self._root[name].update_attributes(failure)
            else:
                self._remove(name)
                self._root.create_group(name, attributes=failure)

    def begin(
        self, name: str, source_sets: Sequence[IntArray], n: int, dtype: str, attributes: Mapping[str, Any]
    ) -> MeshGroup:
        """The group of a mesh with empty distances; replaces what was there."""
        rows = rows_per_block(n)
        k = len(source_sets)
        # The vertices of all source sets in one list, each with the row of `distance` that starts at it.
        entries = {
            "source_vertex": np.concatenate(source_sets),
            "source_row": np.repeat(np.arange(k), [len(vertices) for vertices in source_sets]),
        }
        chunk = (min(rows, k), min(n, _COLUMNS))
        arrays = {
            "distance": _array((k, n), chunk, dtype, "NaN", ("source", "vertex")),
            "block_checksum": _array((-(-k // rows),), (1,), "int64", -1, ("block",)),
        } | {label: _array(v.shape, v.shape, "int64", 0, ("source_entry",)) for label, v in entries.items()}
        with _writing(self.path):
            self._remove(name)
            # All at once takes half as long as one after the other.
            nodes = {name: _zarr().core.group.GroupMetadata()} | {f"{name}/{key}": node for key, node in arrays.items()}
            made = dict(_zarr().create_hierarchy(store=self._root.store, nodes=nodes))
            for label, values in entries.items():
                made[f"{name}/{label}"][:] = values
            # Last, all at once: a group without a status was not finished being made.
            group = made[name].update_attributes({**attributes, "rows_per_block": rows, "status": "running"})
        return MeshGroup(self, name, (group, made[f"{name}/distance"], made[f"{name}/block_checksum"]), source_sets)

    def _remove(self, name: str) -> None:
        if name in self._root:
            del self._root[name]
        shutil.rmtree(self.path / name, ignore_errors=True)  # what a crash left without metadata

    def group(self, name: str) -> MeshGroup:
        """The group of a mesh that was begun."""
        group = self._root[name]
        return MeshGroup(self, name, (group, group["distance"], group["block_checksum"]))


class MeshGroup:
    """The distances of one mesh in a store."""

    def __init__(
        self, store: Store, name: str, nodes: tuple[Any, Any, Any], source_sets: Sequence[IntArray] | None = None
    ) -> None:
        self.name = name
        self._path = store.path
        self._group, self._distance, self._checksum = nodes
        self._rows = int(self._group.attrs["rows_per_block"])
        self._source_sets = source_sets

    @property
    def attributes(self) -> dict[str, Any]:
        """Sources, t, versions, checksum, and the mesh's report."""
        return dict(self._group.attrs)

    @property
    def n_blocks(self) -> int:
        """Number of blocks of rows."""
        return int(self._checksum.shape[0])

    @property
    def n_rows(self) -> int:
        """Number of source sets."""
        return int(self._distance.shape[0])

    @property
    def n_columns(self) -> int:
        """Number of vertices."""
        return int(self._distance.shape[1])

    @property
    def source_sets(self) -> Sequence[IntArray]:
        """The source vertices of each row."""
        if self._source_sets is None:
            vertices, row = self._group["source_vertex"][:], self._group["source_row"][:]
            self._source_sets = list(np.split(vertices, np.searchsorted(row, np.arange(1, self.n_rows))))
        return self._source_sets

    def rows(self, block: int) -> slice:
        """The rows of a block."""
        return slice(block * self._rows, min((block + 1) * self._rows, self.n_rows))

    def resume(self) -> None:
        """Go on with a mesh that had failed, or was interrupted."""
        with _writing(self._path):
            self._group.update_attributes({"status": "running", "reason": ""})

    def missing(self) -> list[int]:
        """Blocks that were not finished, or do not read back with the checksum that they were written with."""
        return [
            block
            for block, checksum in enumerate(self._checksum[:].tolist())
            if checksum < 0 or not self._is_intact(block, checksum)
        ]

    def _is_intact(self, block: int, checksum: int) -> bool:
        try:
            return _checksum(self._distance[self.rows(block)]) == checksum
        except Exception:
            # Each of zarr's codecs has its own exception for bytes that it cannot decode.
            return False

    def write(self, block: int, distances: AnyArray) -> None:
        """Write one block; it counts as finished only once its checksum stands beside it."""
        with _writing(self._path):
            self._distance[self.rows(block)] = distances
            self._checksum[block] = _checksum(distances)

    def finish(self) -> None:
        """Mark a mesh whose blocks are all written, with one checksum over those of the blocks."""
        checksums = self._checksum[:]
        whole = f"{zlib.crc32(np.ascontiguousarray(checksums, dtype='<i8').tobytes()):08x}"
        with _writing(self._path):
            self._group.update_attributes({"checksum": whole, "status": "done"})
            for partial in (self._path / self.name).rglob("*.partial"):  # of writers that were killed
                partial.unlink(missing_ok=True)


def _checksum(distances: AnyArray) -> int:
    return zlib.crc32(np.ascontiguousarray(distances).data)


def _array(
    shape: tuple[int, ...], chunk: tuple[int, ...], dtype: str, fill_value: Any, dimensions: tuple[str, ...]
) -> Any:
    """Metadata of an array. Uncompressed: zstd saves an eighth of the space and doubles the time to write."""
    from zarr.core.metadata import ArrayV3Metadata

    return ArrayV3Metadata.from_dict(
        {
            "zarr_format": 3,
            "node_type": "array",
            "shape": shape,
            "data_type": dtype,
            "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk}},
            "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
            "fill_value": fill_value,
            "codecs": [{"name": "bytes", "configuration": {"endian": "little"}}],
            "dimension_names": dimensions,
            "attributes": {},
            "storage_transformers": [],
        }
    )


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
