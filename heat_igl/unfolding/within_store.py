"""Sparse matrices of exact distances in a zarr store, written and read in parts (extra ``cluster``)."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MissingExtraError, shown
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.sources import Sources
from heat_igl.unfolding.local import blocks_within

__all__ = ["read_distances_within", "write_distances_within"]

_FORMAT = "heat_igl distances within a radius, compressed sparse rows, 1"
# Entries of a chunk of the store, 16 MiB of distances, and of the rows that are in memory at a time.
_CHUNK, _IN_MEMORY = 2**21, 2**22


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
        If there is something at `path`.
    MissingExtraError
        If zarr is not installed.
    ValueError, MeshError, SourceError
        As for `distances_within`.

    Notes
    -----
    The store is a group with the arrays ``indptr`` (k + 1,), ``indices`` and ``data`` (entries,) of a matrix in
    compressed sparse rows, and the attribute ``shape``.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(20, 1)
    >>> heat_igl.write_distances_within("near.zarr", mesh, 2.5)
    >>> stored = heat_igl.read_distances_within("near.zarr")
    >>> abs(stored - heat_igl.distances_within(mesh, 2.5)).nnz
    0
    """
    zarr, target = _zarr(), _path(path)
    if target.exists():
        raise FileExistsError(f"{target} exists: name a new directory for the distances")
    triangles = as_simplices(mesh)
    blocks = blocks_within(triangles, radius, sources, _IN_MEMORY)
    block = next(blocks)  # before anything is written, so that wrong arguments leave nothing behind
    partial = target.with_name(f"{target.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    try:
        group = zarr.create_group(partial, zarr_format=3)
        arrays = {
            name: group.create_array(name, shape=(0,), chunks=(_CHUNK,), dtype=dtype, compressors=None)
            for name, dtype in (("indptr", "int64"), ("indices", "int32"), ("data", "float64"))
        }
        arrays["indptr"].append(np.zeros(1, np.int64))
        n_entries, n_rows = 0, 0
        while block is not None:
            arrays["indptr"].append(n_entries + block.indptr[1:].astype(np.int64))
            arrays["indices"].append(block.indices.astype(np.int32))
            arrays["data"].append(block.data)
            n_entries, n_rows = n_entries + block.nnz, n_rows + block.shape[0]
            block = next(blocks, None)
        group.update_attributes({"format": _FORMAT, "shape": [n_rows, triangles.n_vertices], "radius": float(radius)})
        partial.rename(target)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
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
        If `path` is no such store, or `rows` has a step.
    MissingExtraError
        If zarr is not installed.

    Examples
    --------
    >>> import heat_igl
    >>> heat_igl.write_distances_within("rows.zarr", heat_igl.shapes.strip(20, 1), 1.0)
    >>> heat_igl.read_distances_within("rows.zarr", slice(5, 6)).indices.tolist()  # the neighbours of vertex 5
    [4, 5, 6, 26]
    """
    zarr = _zarr()
    try:
        group = zarr.open_group(_path(path), mode="r")
    except (FileNotFoundError, FileExistsError, NotADirectoryError, ValueError):
        group = None
    if group is None or group.attrs.get("format") != _FORMAT:
        raise ValueError(f"{path} holds no distances of write_distances_within")
    k, n = group.attrs["shape"]
    if rows is not None and not (isinstance(rows, slice) and rows.step in (None, 1)):
        raise ValueError(f"rows must be a slice of consecutive rows, not {shown(rows)}: read them all, and select")
    start, stop, _ = (slice(None) if rows is None else rows).indices(k)
    stop = max(start, stop)
    indptr = np.asarray(group["indptr"][start : stop + 1])
    entries = slice(int(indptr[0]), int(indptr[-1]))
    return sp.csr_array(
        (group["data"][entries], group["indices"][entries], indptr - indptr[0]), shape=(stop - start, n)
    )


def _path(path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"path must be a string or a path, not {shown(path)}")
    return Path(path)


def _zarr() -> Any:
    with MissingExtraError.guard("a store of distances", "zarr", "cluster"):
        import zarr
    return zarr
