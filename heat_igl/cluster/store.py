"""The zarr store of a batch: one group for each mesh, with distances in blocks of rows.

zarr writes all metadata, chunks and checksums. This module defines what a group holds, which blocks are finished, and
in which order things are written, so that a crash at any moment leaves nothing wrong. The attributes of a group hold
checksums of all its files and of themselves, so that damage to any file is found.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import BatchError, MissingExtraError
from heat_igl.io.chunks import checksum, chunk_checksums, damaged_chunk, file_checksum, read_rows, zarr_module
from heat_igl.runtime.threads import BLOCK
from heat_igl.typing import AnyArray, IntArray

# Most rows of a block, whose work is lost if the worker dies, and most values of a chunk, 16 MiB in single precision. A
# block of `BLOCK` rows that hold more has several chunks.
_MOST_ROWS, _ENTRIES = 64, 2**22
# Formats 1 to 3 have no checksums of metadata.
_FORMAT = 4
# The files of a group. The small ones, which `begin` writes, are under the checksum of the attributes.
_ARRAYS = ("distance", "source_vertex", "source_row")
_SMALL_FILES = (*(f"{name}/zarr.json" for name in _ARRAYS), "source_vertex/c/0", "source_row/c/0")
# Zarr writes a file under a name that ends like this, and renames it when it is complete.
_PARTIAL = ".partial"


def rows_per_block(n: int) -> int:
    """Rows that are solved, written and resumed together on a mesh of `n` vertices: 64, fewer on large meshes.

    A multiple of the solver's blocks of right-hand sides, so that the bits of a row do not depend on this number.
    """
    return int(min(_MOST_ROWS, max(BLOCK, BLOCK * (_ENTRIES // (BLOCK * n)))))


class Store:
    """The zarr group of a batch at a directory, which is made if it is missing.

    `options` is everything that all distances in the store depend on, as JSON values; without it the store must exist.
    A ValueError if `path` holds something else, distances of other options, or a format that this version cannot read;
    a BatchError if the store cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], options: Mapping[str, Any] | None = None) -> None:
        zarr = zarr_module()
        self.path = Path(path)
        try:
            self._root = zarr.open_group(self.path, mode="r+", zarr_format=3, use_consolidated=False)
            begun = self._root.attrs.get("heat_igl")
        except Exception:  # zarr has many for metadata that are missing or damaged, or another's
            self._root = begun = None
        if begun is not None:
            self._require_same(begun, options)
            return
        if options is None:
            raise ValueError(f"store {self.path} is not a zarr group of distances, or its zarr.json is damaged")
        self._require_empty()
        with _writing(self.path):
            if self._root is None:
                self._root = zarr.create_group(self.path, zarr_format=3)
            begun = {"format": _FORMAT, **options}
            # As JSON gives it back, with lists for tuples.
            self._root.update_attributes({"heat_igl": {**begun, "checksum": checksum(begun)}})

    def _require_same(self, begun: Mapping[str, Any], options: Mapping[str, Any] | None) -> None:
        """Refuse a store whose format cannot be read, or that was begun with other options."""
        begun = dict(begun)
        seal = begun.pop("checksum", None)
        if begun.get("format") != _FORMAT:
            raise ValueError(
                f"store {self.path} has format {begun.get('format')!r}, and this version of heat_igl reads {_FORMAT}: "
                f"name a new store, or continue it with the version that began it"
            )
        if seal != checksum(begun):
            raise ValueError(f"store {self.path}: zarr.json is damaged: restore it from a copy, or name a new store")
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
            raise ValueError(
                f"store {self.path} is not a zarr group of distances, or its zarr.json is damaged: name a new or an "
                "empty directory"
            )

    def names(self) -> list[str]:
        """Names of the meshes that the store holds, damaged ones included, sorted."""
        known = ("zarr.json", *_ARRAYS)
        return sorted(entry.name for entry in self.path.iterdir() if any((entry / name).exists() for name in known))

    def attributes(self, name: str) -> dict[str, Any]:
        """The attributes of a mesh: status, t, versions, checksum, report; empty if the mesh was not begun.

        A ValueError names the place if the group is damaged.
        """
        folder = self.path / name
        if not any((folder / part).exists() for part in ("zarr.json", *_ARRAYS)):
            return {}
        if not (folder / "zarr.json").exists():
            raise ValueError(f"{folder / 'zarr.json'} is missing")
        try:
            found = dict(self._root[name].attrs)
        except Exception as error:  # zarr has many for metadata that are damaged
            raise ValueError(f"{folder / 'zarr.json'} is damaged: {error}") from None
        if found.pop("seal", None) != self._seal(name, found):
            raise ValueError(f"{folder}: one of {', '.join(('zarr.json', *_SMALL_FILES))} is missing or damaged")
        return found

    def _seal(self, name: str, attributes: Mapping[str, Any]) -> str:
        """A checksum of the attributes of a mesh and of the small files beside them."""
        return checksum([dict(attributes), [file_checksum(self.path / name / file) for file in _SMALL_FILES]])

    def update(self, name: str, attributes: Mapping[str, Any]) -> None:
        """Change some attributes of a mesh that was begun."""
        now = {**self.attributes(name), **attributes}
        with _writing(self.path):
            self._root[name].attrs.put({**now, "seal": self._seal(name, now)})

    def fail(self, name: str, mesh: str, reason: str) -> None:
        """Record that a mesh has no distances, or not all, and why. Finished blocks stay."""
        with _writing(self.path):
            metadata = self.path / name / "zarr.json"
            try:
                found = self.attributes(name)
            except ValueError:
                metadata.unlink(missing_ok=True)
                found = {}
            if not metadata.exists():
                self._root.create_group(name)
            now = {**found, "mesh": mesh, "status": "failed", "reason": reason}
            self._root[name].attrs.put({**now, "seal": self._seal(name, now)})

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
        zarr, path = zarr_module(), self.path / name

        def made(label: str, shape: Any, chunks: Any, dtype: str, fill: float, axes: tuple[str, ...]) -> Any:
            # By the path: through the group, zarr would look at the metadata of all groups above it.
            how = {"shape": shape, "chunks": chunks, "dtype": dtype, "fill_value": fill, "dimension_names": axes}
            # Chunks end with a checksum. zstd would save an eighth of the space and double the time to write.
            return zarr.create_array(path / label, **how, zarr_format=3, compressors=[zarr.codecs.Crc32cCodec()])

        with _writing(self.path):
            if path.is_dir():
                foreign = {entry.name for entry in path.iterdir()} - {"zarr.json", *_ARRAYS}
                if any(not entry.endswith(_PARTIAL) for entry in foreign):
                    raise ValueError(f"{path} holds {min(foreign)}, which no batch has written: move it elsewhere")
                # First, since a crash while the files are deleted must not leave a group that calls itself done.
                (path / "zarr.json").unlink(missing_ok=True)
                shutil.rmtree(path)
            for label, entries in sources.items():
                made(label, entries.shape, entries.shape, "int64", -1, ("source_entry",))[:] = entries
            rows = min(rows_per_block(n), k)
            chunks = rows, min(n, _ENTRIES // rows)
            distance = made("distance", (k, n), chunks, dtype, np.nan, ("source", "vertex"))
            now = {**attributes, "status": "running"}
            # Last, since without it the mesh counts as not begun.
            group = zarr.create_group(path, zarr_format=3, attributes={**now, "seal": self._seal(name, now)})
        return MeshGroup(self, name, group, distance)

    def group(self, name: str) -> MeshGroup:
        """The group of a mesh that was begun."""
        group = self._root[name]
        return MeshGroup(self, name, group, group["distance"])


class MeshGroup:
    """The distances of one mesh in a store, `n_rows` source sets by `n_columns` vertices, in blocks of rows.

    A block is one row of zarr's chunks. zarr appends a checksum to each chunk and replaces files only by complete ones,
    so a block is finished when all chunks of it can be read.
    """

    def __init__(self, store: Store, name: str, group: Any, distance: Any) -> None:
        self._store = store
        self._name = name
        self._group = group
        self._distance = distance
        self.n_rows, self.n_columns = self._distance.shape
        self._height, _ = self._distance.chunks
        self._folder = store.path / name / "distance"
        # Known when the mesh has been done.
        self._checksums: list[str] = group.attrs.get("chunks", [])
        self._n_blocks = -(-self.n_rows // self._height)

    def source_sets(self) -> list[IntArray]:
        """The source vertices of each row; a ValueError if they cannot be read back as they were written."""
        vertices, row = self._group["source_vertex"][:], self._group["source_row"][:]
        if (vertices < 0).any() or (row < 0).any():  # the fill value of a missing chunk
            raise ValueError(f"the sources of {self._name} are missing in store {self._store.path}")
        return list(np.split(vertices, np.searchsorted(row, np.arange(1, self.n_rows))))

    def rows(self, block: int) -> slice:
        """The rows of a block."""
        return slice(block * self._height, min((block + 1) * self._height, self.n_rows))

    def missing(self) -> list[int]:
        """Blocks with a chunk that is missing, incomplete or damaged, or that of another place."""
        sources = self.source_sets()
        checksums = self._checksums or chunk_checksums(self._folder, self._distance)
        return [block for block in range(self._n_blocks) if not self._is_finished(block, sources, checksums)]

    def _is_finished(self, block: int, sources: Sequence[IntArray], checksums: Sequence[str]) -> bool:
        rows = self.rows(block)
        try:
            distances = read_rows(self._folder, self._distance, checksums, rows)
        except ValueError:
            return False
        # Nothing but the distances themselves tells rows apart until the mesh is done: a source has distance 0.
        return all((row[vertices] == 0).all() for row, vertices in zip(distances, sources[rows], strict=True))

    def read(self, rows: slice) -> AnyArray:
        """Rows of the distances of a mesh that is done; errors are those of `heat_igl.io.chunks.read_rows`."""
        return read_rows(self._folder, self._distance, self._checksums, rows)

    def damaged_chunk(self) -> str:
        """What is wrong with the first chunk of a mesh that is done; empty if nothing is.

        Of each chunk, only the checksum at its end is read.
        """
        return damaged_chunk(self._folder, self._distance, self._checksums)

    def write(self, block: int, distances: AnyArray) -> None:
        """Write one block, whole chunks only, so that nothing is read and several writers of the same rows agree."""
        with _writing(self._store.path):
            self._distance[self.rows(block)] = distances

    def finish(self) -> None:
        """Mark a mesh whose blocks are all written as done, with the checksums of the chunks, and one over them."""
        chunks = chunk_checksums(self._folder, self._distance)
        self._store.update(self._name, {"chunks": chunks, "checksum": checksum(chunks), "status": "done", "reason": ""})
        for partial in (self._store.path / self._name).rglob(f"*{_PARTIAL}"):  # of writers that were killed
            partial.unlink(missing_ok=True)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """A context that only one process at a time can be in, for a store at `path`; a BatchError if another one is.

    The lock is one of the operating system, on the file ``NAME.lock`` beside the store: it ends with the process, and
    the empty file stays.
    """
    lock = Path(os.path.realpath(path.with_name(f"{path.name}.lock")))
    with contextlib.ExitStack() as stack:
        with MissingExtraError.guard("a batch", "distributed", "cluster"):
            import locket
        with _writing(path):
            lock.parent.mkdir(parents=True, exist_ok=True)
            try:
                stack.enter_context(locket.lock_file(str(lock), timeout=0))
            except locket.LockError:
                raise BatchError(
                    f"another batch writes to store {path} (it holds {lock}): wait until it ends, or name a new store"
                ) from None
        yield


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
