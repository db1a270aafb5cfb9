"""Surfaces of FreeSurfer (``lh.white``, ``rh.pial``), by nibabel: triangles in single precision."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Contents, check, select
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray

__all__ = ["SUFFIXES", "read", "write"]

# FreeSurfer's files have no extension; these names of surfaces stand in its place.
SUFFIXES = (".white", ".pial", ".inflated", ".sphere", ".smoothwm", ".midthickness")


def _freesurfer(purpose: str) -> Any:
    with MissingExtraError.guard(f"{purpose} FreeSurfer's surfaces", "nibabel", "neuro"):
        from nibabel import freesurfer
    return freesurfer


def read(path: Path, data: bytes) -> Contents:
    """Read a surface, in the coordinates of the file (those of the surface, without the centre of the volume)."""
    freesurfer = _freesurfer("reading")
    if len(data) < 3:
        raise MeshError(f"{path}: the file is empty")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            positions, triangles = freesurfer.read_geometry(str(path))
    except Exception as error:  # of the magic number, of shapes, of memory for wrong counts
        raise MeshError(
            f"{path}: nibabel cannot read this FreeSurfer surface ({error}): it is damaged, cut short, or another file"
        ) from error
    V: FloatArray = np.asarray(positions, np.float64).reshape(-1, 3)
    cells = select(path, [("triangle", np.asarray(triangles, np.int64).reshape(-1, 3))])
    check(V, cells, lambda i: f"{path}, vertex {i} (counted from 0)", lambda i: f"{path}, face {i} (counted from 0)", 0)
    return Contents(V, cells, {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles."""
    # The stamp is part of the file: without it, nibabel writes the name of the user and the time.
    _freesurfer("writing").write_geometry(str(path), mesh.V, mesh.F, create_stamp="created by heat_igl")
