"""Sparse matrices of exact distances in a zarr store, written and read in parts (extra ``cluster``)."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MissingExtraError, shown
from heat_igl.io.chunks import checksum, chunk_checksums, file_checksum, read_rows, zarr_module
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.sources import Sources
from heat_igl.typing import AnyArray
from heat_igl.windows.local import blocks_within

_FORMAT = "heat_igl distances within a radius, compressed sparse rows, 2"
_ARRAYS = {"indptr": "int64", "indices": "int32", "data": "float64"}
# Entries of a chunk of the store, 16 MiB of distances, and of the rows that are in memory at a time.
_CHUNK, _IN_MEMORY = 2**21, 2**22
_REMEDY = "restore it from a copy, or write the distances again"


def write_distances_within(
    path: str | os.PathLike[str], mesh: MeshLike, radius: float, sources: Sources | None = None
) -> None:
    """Write `distances_within` to a zarr store, block by block: the matrix need not fit into memory.

    Parameters
    ----------
    path : path-like
        A directory that does not exist. It appears when all is written.
    mesh, radius, sources
        As for `distances_within`.

    Raises
    ------
    FileExistsError
        If there is something at `path`, or at `path` with ".partial" behind it: another process writes there, or was
        stopped. Nothing is deleted that this call did not make.
    OSError
        If the store cannot be written; nothing is left of it then.
    MissingExtraError
        If zarr is not installed.
    ValueError, MeshError, SourceError
        As for `distances_within`.

    Notes
    -----
    The store is a group with the arrays ``indptr`` (k + 1,), ``indices`` and ``data`` (entries,) of a matrix in
    compressed sparse rows, and the attribute ``shape``. Each chunk ends with a checksum; the attributes hold the
    checksums of all chunks and of the arrays' metadata, and one of themselves.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(20, 1)
    >>> heat_igl.write_distances_within("near.zarr", mesh, 2.5)
    >>> stored = heat_igl.read_distances_within("near.zarr")
    >>> abs(stored - heat_igl.distances_within(mesh, 2.5)).nnz
    0
    """
    zarr, target = zarr_module(), _path(path)
    if target.exists():
        raise FileExistsError(f"{target} exists: name a new directory for the distances")
    triangles = as_simplices(mesh)
    blocks = blocks_within(triangles, radius, sources, _IN_MEMORY)
    partial = target.with_name(f"{target.name}.partial")
    try:
        # Only one process can make it, so it is the lock as well.
        partial.mkdir(parents=True)
    except FileExistsError:
        raise FileExistsError(
            f"{partial} exists: another process writes {target}, or was stopped, or the folder serves another purpose: "
            "wait for the process, or remove the folder, or name another path"
        ) from None
    try:
        group = zarr.create_group(partial, zarr_format=3)
        arrays = {
            # zarr does not write a chunk of fill values alone, and distances may all be 0.
            name: group.create_array(
                name, shape=(0,), chunks=(_CHUNK,), dtype=dtype, fill_value=-1, compressors=[zarr.codecs.Crc32cCodec()]
            )
            for name, dtype in _ARRAYS.items()
        }
        arrays["indptr"].append(np.zeros(1, np.int64))
        n_entries, n_rows = 0, 0
        for block in blocks:
            arrays["indptr"].append(n_entries + block.indptr[1:].astype(np.int64))
            arrays["indices"].append(block.indices.astype(np.int32))
            arrays["data"].append(block.data)
            n_entries, n_rows = n_entries + block.nnz, n_rows + block.shape[0]
        attributes = {
            "format": _FORMAT,
            "shape": [n_rows, triangles.n_vertices],
            "radius": float(radius),
            "metadata": {name: file_checksum(partial / name / "zarr.json") for name in _ARRAYS},
            "chunks": {name: chunk_checksums(partial / name, arrays[name]) for name in _ARRAYS},
        }
        group.update_attributes({**attributes, "checksum": checksum(attributes)})
        if target.exists():
            raise FileExistsError(f"{target} was made by somebody else meanwhile: name a new directory")
        partial.rename(target)
    except BaseException as error:
        _remove(partial)
        if isinstance(error, OSError) and not isinstance(error, FileExistsError):
            raise OSError(error.errno, f"{target} cannot be written: {error.strerror or error}") from error
        raise


def read_distances_within(path: str | os.PathLike[str], rows: slice | None = None) -> sp.csr_array:
    """Rows of a matrix that `write_distances_within` wrote.

    Parameters
    ----------
    path : path-like
        The store.
    rows : slice, optional
        Consecutive rows; all if not given.

    Returns
    -------
    scipy.sparse.csr_array
        Shape (rows, n), as `distances_within` returns it.

    Raises
    ------
    ValueError
        If `path` is no such store, `rows` has a step, or a file that holds the rows is missing or damaged; the message
        names the file.
    MissingExtraError
        If zarr is not installed.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.write_distances_within("rows.zarr", heat_igl.shapes.strip(20, 1), 1.0)
    >>> heat_igl.read_distances_within("rows.zarr", slice(5, 6)).indices.tolist()  # the neighbours of vertex 5
    [4, 5, 6, 26]
    """
    target = _path(path)
    group, attributes = _opened(target)
    k, n = attributes["shape"]
    if rows is not None and not (isinstance(rows, slice) and rows.step in (None, 1)):
        raise ValueError(f"rows must be a slice of consecutive rows, not {shown(rows)}: read them all, and select")
    start, stop, _ = (slice(None) if rows is None else rows).indices(k)
    stop = max(start, stop)

    def entries(name: str, among: slice) -> AnyArray:
        metadata = target / name / "zarr.json"
        if file_checksum(metadata) != attributes["metadata"][name]:
            raise ValueError(f"{metadata} is {'damaged' if metadata.exists() else 'missing'}: {_REMEDY}")
        try:
            return read_rows(target / name, group[name], attributes["chunks"][name], among)
        except ValueError as error:
            raise ValueError(f"{error}: {_REMEDY}") from None

    indptr = entries("indptr", slice(start, stop + 1))
    among = slice(int(indptr[0]), int(indptr[-1]))
    return sp.csr_array(
        (entries("data", among), entries("indices", among), indptr - indptr[0]), shape=(stop - start, n)
    )


def _opened(path: Path) -> tuple[Any, dict[str, Any]]:
    """The group of a store, and its attributes, which are as they were written."""
    file = path / "zarr.json"
    try:
        group = zarr_module().open_group(path, mode="r", zarr_format=3, use_consolidated=False)
        attributes = dict(group.attrs)
    except MissingExtraError:
        raise
    except Exception as error:  # zarr has many for metadata that are missing, of another format or damaged
        reason = f" ({error})" if file.exists() else ""
        raise ValueError(f"{path} holds no distances of write_distances_within, or {file} is damaged{reason}") from None
    seal = attributes.pop("checksum", None)
    if attributes.get("format") != _FORMAT:
        raise ValueError(f"{path} holds no distances of this version of write_distances_within, or {file} is damaged")
    if seal != checksum(attributes):
        raise ValueError(f"{file} is damaged: {_REMEDY}")
    return group, attributes


def _remove(folder: Path) -> None:
    """Remove a folder into which zarr's threads may still write, or make it again, for a moment after a failure."""
    n_gone = 0
    for _ in range(100):
        n_gone = 0 if folder.exists() else n_gone + 1
        if n_gone == 5:
            return
        shutil.rmtree(folder, ignore_errors=True)
        time.sleep(0.02)


def _path(path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"path must be a string or a path, not {shown(path)}")
    return Path(path)
