"""The zarr store of a batch: one group for each mesh, with distances in blocks of rows.

zarr writes all metadata, chunks and checksums. This module defines what a group holds, which blocks are finished, and
in which order things are written, so that a crash at any moment leaves nothing wrong.
"""

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

# Rows of a block: a multiple of the solver's blocks of right-hand sides, so that a row's bits depend on no other block.
_ROWS = 8
_MOST_ROWS = 64
_ENTRIES = 2**22
# Longest row of one chunk.
_COLUMNS = 2**20
# Format 2 differs in two points: no checksum on the sources, and zeros instead of NaN as padding of the last chunks.
_FORMAT = 3
_READABLE_FORMATS = (2, 3)
# The crc32c codec appends the checksum to the chunk (zarr specification, version 3).
_CHECKSUM_BYTES = 4
# Zarr writes a file under a name that ends like this, and renames it when it is complete.
_PARTIAL = ".partial"


def rows_per_block(n: int) -> int:
    """Rows that are solved, written and resumed together on a mesh of `n` vertices: 64, fewer on large meshes."""
    return int(min(_MOST_ROWS, max(_ROWS, _ROWS * (_ENTRIES // (_ROWS * n)))))


class Store:
    """The zarr group of a batch.

    Parameters
    ----------
    path : path-like
        A directory; created if missing.
    options : mapping, optional
        Everything that all distances in the store depend on, as JSON values. Without it the store must exist.

    Raises
    ------
    ValueError
        If `path` holds something else, distances of other options, or a format that this version cannot read.
    BatchError
        If the store cannot be written.
    MissingExtraError
        If zarr is not installed.
    """

    def __init__(self, path: str | os.PathLike[str], options: Mapping[str, Any] | None = None) -> None:
        zarr = _zarr()
        self.path = Path(path)
        try:
            self._root = zarr.open_group(self.path, mode="r+", zarr_format=3, use_consolidated=False)
        except (FileNotFoundError, FileExistsError, NotADirectoryError, ValueError):
            self._root = None
        begun = None if self._root is None else self._root.attrs.get("heat_igl")
        if begun is not None:
            self._require_same(begun, options)
            return
        if options is None:
            raise ValueError(f"store {self.path} is not a zarr group of distances")
        self._require_empty()
        with _writing(self.path):
            if self._root is None:
                self._root = zarr.create_group(self.path, zarr_format=3)
            self._root.update_attributes({"heat_igl": {"format": _FORMAT, **options}})

    def _require_same(self, begun: Mapping[str, Any], options: Mapping[str, Any] | None) -> None:
        """Refuse a store whose format cannot be read, or that was begun with other options."""
        if begun.get("format") not in _READABLE_FORMATS:
            raise ValueError(
                f"store {self.path} has format {begun.get('format')!r}, and this version of heat_igl reads "
                f"{' and '.join(map(str, _READABLE_FORMATS))}: name a new store, or continue it with the version that "
                "began it"
            )
        if options is None:
            return
        for name in [*options, *begun]:
            if name != "format" and begun.get(name) != options.get(name):
                raise ValueError(
                    f"store {self.path} was begun with {name}={begun.get(name)!r}, not {options.get(name)!r}: "
                    "continue it with the same, or name a new store"
                )

    def _require_empty(self) -> None:
        """Refuse a path that holds anything but an empty group, or files that a crash left incomplete."""
        if self._root is not None:
            if any(entry.is_dir() for entry in self.path.iterdir()):
                raise ValueError(f"store {self.path} holds other data: name a new or an empty directory")
        elif self.path.exists() and not (
            self.path.is_dir() and all(entry.suffix == _PARTIAL for entry in self.path.iterdir())
        ):
            raise ValueError(f"store {self.path} is not a zarr group of distances: name a new or an empty directory")

    def names(self) -> list[str]:
        """Names of the meshes that the store holds, sorted."""
        folders = (entry.name for entry in self.path.iterdir() if entry.is_dir())
        return sorted(name for name in folders if self._group(name) is not None)

    def attributes(self, name: str) -> dict[str, Any]:
        """The attributes of a mesh: status, t, versions, checksum, report; empty if the mesh was not begun."""
        group = self._group(name)
        return {} if group is None else dict(group.attrs)

    def update(self, name: str, attributes: Mapping[str, Any]) -> None:
        """Change some attributes of a mesh that was begun."""
        with _writing(self.path):
            self._root[name].update_attributes(dict(attributes))

    def fail(self, name: str, mesh: str, reason: str) -> None:
        """Record that a mesh has no distances, or not all, and why. Finished blocks stay."""
        with _writing(self.path):
            group = self._group(name)
            if group is None:
                group = self._root.create_group(name, overwrite=True)
            group.update_attributes({"mesh": mesh, "status": "failed", "reason": reason})

    def begin(
        self, name: str, source_sets: Sequence[IntArray], n: int, dtype: str, attributes: Mapping[str, Any]
    ) -> MeshGroup:
        """The group of a mesh of `n` vertices, without any distances yet; replaces an earlier group of that name."""
        k = len(source_sets)
        sources = {
            # The vertices of all source sets in one list, each with the row of `distance` that starts at it.
            "source_vertex": np.concatenate(source_sets),
            "source_row": np.repeat(np.arange(k), [len(one) for one in source_sets]),
        }
        zarr, path = _zarr(), self.path / name
        # Not compressed: zstd saves an eighth of the space and doubles the time to write.
        settings = {"zarr_format": 3, "compressors": [zarr.codecs.Crc32cCodec()], "overwrite": True}
        with _writing(self.path):
            earlier = self._group(name)
            if earlier is not None:
                # A crash while the files are deleted must not leave a group that calls itself done.
                earlier.attrs.put({})
            shutil.rmtree(path, ignore_errors=True)
            for label, entries in sources.items():
                # By the path: through the group, zarr would look at the metadata of all groups above it.
                array = zarr.create_array(
                    path / label,
                    shape=entries.shape,
                    chunks=entries.shape,
                    dtype="int64",
                    fill_value=-1,
                    dimension_names=("source_entry",),
                    **settings,
                )
                array[:] = entries
            distance = zarr.create_array(
                path / "distance",
                shape=(k, n),
                chunks=(min(rows_per_block(n), k), min(n, _COLUMNS)),
                dtype=dtype,
                fill_value=np.nan,
                dimension_names=("source", "vertex"),
                **settings,
            )
            # Last, since without it the mesh counts as not begun.
            group = zarr.create_group(path, zarr_format=3, attributes={**attributes, "status": "running"})
        return MeshGroup(self, name, group, distance)

    def group(self, name: str) -> MeshGroup:
        """The group of a mesh that was begun."""
        group = self._root[name]
        return MeshGroup(self, name, group, group["distance"])

    def _group(self, name: str) -> Any:
        """The zarr group of a mesh; None if there is none, or the metadata are damaged."""
        try:
            return self._root[name]
        except (KeyError, ValueError):
            return None


class MeshGroup:
    """The distances of one mesh in a store, in blocks of rows.

    A block is one row of zarr's chunks. zarr appends a checksum to each chunk and replaces files only by complete ones,
    so a block is finished when all chunks of it can be read.

    Attributes
    ----------
    n_rows, n_columns : int
        Number of source sets and of vertices.
    """

    def __init__(self, store: Store, name: str, group: Any, distance: Any) -> None:
        self._store = store
        self._name = name
        self._group = group
        self._distance = distance
        self.n_rows, self.n_columns = self._distance.shape
        self._height, self._width = self._distance.chunks
        self._n_blocks = -(-self.n_rows // self._height)

    def source_sets(self) -> list[IntArray]:
        """The source vertices of each row.

        Raises
        ------
        ValueError
            If they cannot be read back as they were written.
        """
        vertices, row = self._group["source_vertex"][:], self._group["source_row"][:]
        if (vertices < 0).any() or (row < 0).any():  # the fill value of a missing chunk
            raise ValueError(f"the sources of {self._name} are missing in store {self._store.path}")
        return list(np.split(vertices, np.searchsorted(row, np.arange(1, self.n_rows))))

    def rows(self, block: int) -> slice:
        """The rows of a block."""
        return slice(block * self._height, min((block + 1) * self._height, self.n_rows))

    def missing(self) -> list[int]:
        """Blocks with a chunk that is missing, incomplete or damaged."""
        return [block for block in range(self._n_blocks) if not self._is_finished(block)]

    def _is_finished(self, block: int) -> bool:
        # Zarr reads a missing chunk as fill values, without an error.
        if not all(chunk.is_file() for chunk in self._chunks(block)):
            return False
        try:
            self._distance[self.rows(block)]
        except Exception:
            # Each of zarr's codecs has an exception of its own for bytes that it cannot decode.
            return False
        return True

    def _chunks(self, block: int) -> list[Path]:
        """The files of a block."""
        folder = self._store.path / self._name / "distance"
        columns = range(-(-self.n_columns // self._width))
        return [folder / self._distance.metadata.encode_chunk_key((block, column)) for column in columns]

    def write(self, block: int, distances: AnyArray) -> None:
        """Write one block, whole chunks only, so that nothing is read and several writers of the same rows agree."""
        with _writing(self._store.path):
            self._distance[self.rows(block)] = distances

    def finish(self) -> None:
        """Mark a mesh whose blocks are all written as done, with one checksum over the checksums of the chunks."""
        whole = 0
        for block in range(self._n_blocks):
            for path in self._chunks(block):
                with path.open("rb") as chunk:
                    chunk.seek(-_CHECKSUM_BYTES, os.SEEK_END)
                    whole = zlib.crc32(chunk.read(), whole)
        self._store.update(self._name, {"checksum": f"{whole:08x}", "status": "done"})
        for partial in (self._store.path / self._name).rglob(f"*{_PARTIAL}"):  # of writers that were killed
            partial.unlink(missing_ok=True)


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Turn an error of the system during a write into the error of the batch, with the remedy."""
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
        import zarr.codecs
    except ImportError:
        raise MissingExtraError.of("a store of distances", "zarr", "cluster") from None
    return zarr
