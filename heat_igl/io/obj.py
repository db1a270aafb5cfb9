"""OBJ: vertices and polygons; materials, normals and lines are ignored.

meshio is not used, since it rejects polygons of mixed degree and negative indices, and accepts arbitrary text.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError
from heat_igl.io.contents import Cells, Contents, Text, check, format_rows, integers, of_corner, warn_if_cut
from heat_igl.mesh import Mesh
from heat_igl.mesh.connectivity import mask_of
from heat_igl.runtime import warn_caller
from heat_igl.typing import FloatArray

# Records that are ignored. Any other word is an error: ignoring a damaged "v" would shift all indices after it.
_PASSED_OVER = (
    b"vt vn vp vc l p g o s mg usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj ctech "
    b"stech cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con call csh"
).split()


def read(path: Path, data: bytes) -> Contents:
    """Parse an OBJ file."""
    text = Text(path, data, comment="#", continued=True)
    word = text.words(12)
    is_v, is_f = word == b"v", word == b"f"
    other = np.flatnonzero(~(is_v | is_f))
    unknown = other[~np.isin(word[other], _PASSED_OVER)]
    if len(unknown):
        raise text.error(unknown[0], f"no OBJ record starts like this ({len(unknown)} lines): remove or repair it")
    V_lines, F_lines = np.flatnonzero(is_v), np.flatnonzero(is_f)
    for lines, name in ((V_lines, "vertices (lines that start with v)"), (F_lines, "faces (lines that start with f)")):
        if not len(lines):
            raise MeshError(
                f"{path}: the file has no {name}, so it is no mesh; it may be cut short, and read_point_cloud, or "
                "--points on the command line, reads points"
            )
    V = text.positions(V_lines, skip=1)
    short = text.count[F_lines] < 4
    text.refuse(F_lines, short, f"a face needs three corners or more ({int(short.sum())} lines have fewer)")
    values, _ = text.numbers(F_lines, skip=1, up_to_slash=True)
    degree = text.count[F_lines] - 1
    number = integers(values, of_corner(degree, lambda i: text.where(F_lines[i])))
    zero = number == 0
    text.refuse(
        np.repeat(F_lines, degree), zero, f"vertex 0 ({int(zero.sum())} such indices): OBJ counts vertices from 1"
    )
    if (number < 0).any():
        # -1 is the last vertex before this line.
        above = np.repeat(np.cumsum(is_v)[F_lines], degree)
        corners = np.where(number < 0, above + number, number - 1)
    else:
        corners = number - 1
    cells = Cells(corners, degree)
    check(V, cells, lambda i: text.where(V_lines[i]), lambda i: text.where(F_lines[i]), base=1)
    used = mask_of(corners, len(V))
    if not used.all():  # OBJ has no counts, so nothing else tells that the last faces are lost
        warn_caller(
            f"{path}: no face uses {int((~used).sum())} of the {len(V)} vertices, such as vertex "
            f"{int(np.argmin(used)) + 1} (counted from 1): the file may be cut short; distances there are inf",
            AccuracyWarning,
        )
    warn_if_cut(path, data, 0, len(V))
    return Contents(V, cells, {})


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles as OBJ."""
    path.write_text(format_rows("v %r %r %r\n", mesh.V) + format_rows("f %d %d %d\n", mesh.F + 1))
