"""VTU, the XML format of VTK, by meshio: triangles or tetrahedra with vertex attributes."""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Contents, check, select
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray

__all__ = ["read", "write"]


def _meshio(purpose: str) -> Any:
    with MissingExtraError.guard(f"{purpose} .vtu files", "meshio", "io"):
        import meshio
    return meshio


@contextlib.contextmanager
def _strict(path: Path, purpose: str) -> Iterator[None]:
    """A context that turns every failure of meshio into a `MeshError`: exceptions, `sys.exit`, printed warnings."""
    printed = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            warnings.simplefilter("ignore")
            yield
    except (Exception, SystemExit) as error:
        said = " ".join(f"{printed.getvalue()} {error}".split())[:300]
        raise MeshError(
            f"{path}: meshio cannot {purpose} this VTU file ({type(error).__name__}: {said}): it is damaged, cut "
            "short, or uses a feature that meshio lacks"
        ) from error
    if printed.getvalue().strip():
        raise MeshError(f"{path}: meshio left something out: {' '.join(printed.getvalue().split())[:300]}")


def read(path: Path, data: bytes) -> Contents:
    """Parse a VTU file."""
    if not data.strip():
        raise MeshError(f"{path}: the file is empty")
    pieces = len(re.findall(rb"<Piece\b", data))
    if pieces > 1:  # meshio keeps the cells of the last one only
        raise MeshError(f"{path}: the grid is in {pieces} pieces, and only one is supported: merge them before saving")
    meshio = _meshio("reading")
    with _strict(path, "read"):
        # meshio.read would print the error and end the program.
        found = meshio.vtu.read(str(path))
        V: FloatArray = np.asarray(found.points, np.float64).reshape(-1, 3)
        blocks = [(str(block.type), np.asarray(block.data, np.int64)) for block in found.cells]
        attributes = {str(name): np.asarray(values) for name, values in found.point_data.items()}
    announced = re.search(rb"<Piece\b[^>]*\bNumberOfPoints\s*=\s*[\"']([^\"']*)", data)
    if announced and announced[1].strip() != str(len(V)).encode():
        raise MeshError(
            f"{path}: the header announces {announced[1].decode('latin-1')[:20]} points, but the file holds {len(V)}"
        )
    cells = select(path, blocks)
    check(
        V,
        cells,
        lambda i: f"{path}, point {i} (counted from 0)",
        lambda i: f"{path}, {'tetrahedron' if cells.tetrahedra else 'polygon'} {i} (counted from 0)",
        base=0,
    )
    return Contents(V, cells, attributes)


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles or tetrahedra as compressed binary VTU."""
    meshio = _meshio("writing")
    kind = "tetra" if mesh.is_tetrahedral else "triangle"
    with _strict(path, "write"):
        meshio.vtu.write(str(path), meshio.Mesh(mesh.V, [(kind, mesh.F)], point_data=dict(attributes)))
