"""Reading and writing point clouds: PLY, OBJ, XYZ and NPY, selected by the extension."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError, shown
from heat_igl.io import ply
from heat_igl.io.contents import Text, format_rows
from heat_igl.io.files import (
    MESH_SUFFIXES,
    POINT_SUFFIXES,
    checked_attributes,
    checked_path,
    file_bytes,
    is_mesh_path,
    read_mesh,
)
from heat_igl.io.storage import form_suffix, pack, replacing
from heat_igl.mesh import Mesh, PointCloud, usable_normals
from heat_igl.typing import AnyArray, ArrayLike, FloatArray

# Largest value of a colour, and the smallest difference from length 1 of what is no normal.
_BRIGHTEST = 255
_NOT_OF_LENGTH_1 = 0.01

_Points = tuple[FloatArray, FloatArray | None]
_Attributes = Mapping[str, FloatArray]


def read_point_cloud(path: str | os.PathLike[str]) -> PointCloud:
    r"""Read a point cloud from a file; the faces of a mesh are ignored.

    Parameters
    ----------
    path : path-like
        The extension, in upper or lower case, selects the format. .ply: the vertices, and their properties nx, ny, nz
        as normals. .obj: the lines v, and the lines vn as normals if there are as many. .xyz: a point in each line,
        three coordinates, or three and a normal or a colour, or two in the plane z = 0; separated by white space or
        commas, "#" starts a comment. .npy: an array (n, 3), (n, 6) with normals or colours, or (n, 2).
        A further .gz stands for a file packed by gzip.

    Returns
    -------
    PointCloud
        Points in the order of the file.

    Raises
    ------
    MeshError
        If the file is missing, unreadable or damaged, or the points cannot be used.

    Warns
    -----
    AccuracyWarning
        If some normals are 0 or not finite: then none are taken.

    Notes
    -----
    Normals that are all 0, as some programs write them, count as none. Three numbers from 0 to 255 after the
    coordinates that are not of length 1 are a colour.

    Examples
    --------
    >>> import heat_igl
    >>> from pathlib import Path
    >>> _ = Path("points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n1 1 0\n")
    >>> heat_igl.read_point_cloud("points.xyz").V[3].tolist()
    [1.0, 1.0, 0.0]
    """
    path = checked_path(path, POINT_CLOUD_SUFFIXES, POINT_CLOUD_SUFFIXES)
    P, normals = _FORMATS[form_suffix(path)][0](path, file_bytes(path))
    try:
        return PointCloud(P, None if normals is None else usable_normals(normals, f"{path}: "))
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def read_mesh_or_cloud(path: str | os.PathLike[str], points: bool = False) -> Mesh | PointCloud:
    """Read .xyz and .npy files, or with `points` all, by `read_point_cloud`, and others by `read_mesh`.

    Raises
    ------
    MeshError
        As `read_mesh` and `read_point_cloud`.
    MissingExtraError
        As `read_mesh`.
    """
    path = checked_path(path, (*MESH_SUFFIXES, *POINT_SUFFIXES), (*MESH_SUFFIXES, *POINT_CLOUD_SUFFIXES))
    return read_point_cloud(path) if points or form_suffix(path) in POINT_SUFFIXES else read_mesh(path)


def is_mesh_or_cloud_path(path: Path, points: bool = False) -> bool:
    """Whether `read_mesh_or_cloud` knows the extension of `path`, but for .npy, which may hold anything."""
    suffix = form_suffix(path)
    return suffix != ".npy" and (
        suffix in POINT_CLOUD_SUFFIXES if points else is_mesh_path(path) or suffix in POINT_SUFFIXES
    )


def write_point_cloud(path: str | os.PathLike[str], cloud: PointCloud, /, **attributes: ArrayLike) -> None:
    """Write a point cloud, with its normals if it has any, to a file.

    Parameters
    ----------
    path : path-like
        The extension selects the format, as for `read_point_cloud`: .ply, .obj, .xyz or .npy, or one of these and .gz.
        An existing file is replaced only when the new one is complete.
    cloud : PointCloud
        Points are read back exactly.
    **attributes : (n,) array_like of real numbers
        Further properties of each point, in .ply alone.

    Raises
    ------
    MeshError
        If the extension is another, the format holds no attributes, one of them has the wrong shape or type, or the
        file cannot be written.

    Examples
    --------
    >>> import heat_igl
    >>> cloud = heat_igl.PointCloud([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    >>> heat_igl.write_point_cloud("points.ply", cloud)
    >>> bool((heat_igl.read_point_cloud("points.ply").P == cloud.P).all())
    True
    """
    path = checked_path(path, POINT_CLOUD_SUFFIXES, POINT_CLOUD_SUFFIXES)
    suffix = form_suffix(path)
    if attributes and suffix != ".ply":
        raise MeshError(f"{path}: this format holds no attributes of points ({', '.join(attributes)}); .ply does")
    if not isinstance(cloud, PointCloud):
        raise MeshError(f"cloud must be a PointCloud, not {shown(cloud)}: write_mesh writes meshes")
    arrays = checked_attributes(attributes, cloud.n_vertices)
    with replacing(path) as temporary:
        _FORMATS[suffix][1](temporary, cloud, arrays)
        pack(path, temporary)


def _from_ply(path: Path, data: bytes) -> _Points:
    P, others = ply.read_vertices(path, data)
    names = ("nx", "ny", "nz")
    if not all(name in others for name in names):
        return P, None
    return P, np.stack([others[name].astype(np.float64) for name in names], axis=1)


def _from_obj(path: Path, data: bytes) -> _Points:
    text = Text(path, data, comment="#", continued=True)
    word = text.words(3)

    def rows(record: bytes) -> FloatArray:
        lines = np.flatnonzero(word == record)
        short = text.count[lines] < 4
        if short.any():
            raise text.error(int(lines[np.argmax(short)]), f"three numbers must follow {record.decode()}")
        values, start = text.numbers(lines, skip=1)
        return np.asarray(values[start[:, None] + np.arange(3)])

    if not (word == b"v").any():
        raise MeshError(f"{path}: the file has no points (lines that start with v)")
    P = rows(b"v")
    return P, rows(b"vn") if int((word == b"vn").sum()) == len(P) else None


def _from_xyz(path: Path, data: bytes) -> _Points:
    text = Text(path, data.replace(b",", b" "), comment="#")
    width = int(text.count[0])
    wrong = text.count != (width if width in (2, 3, 6) else 3)
    if wrong.any():
        line = int(np.argmax(wrong))
        raise text.error(
            line,
            "a point has 3 numbers, or 6 with a normal, or 2 in the plane, and all points as many "
            f"({int(wrong.sum())} lines differ); PointCloud(numpy.loadtxt(path)[:, :3]) takes the first three of more",
        )
    values = text.all_numbers().reshape(-1, width)
    return values[:, :3], _normals_or_colours(values[:, 3:])


def _from_npy(path: Path, data: bytes) -> _Points:
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise MeshError(f"{path}: not an array in the format of numpy.save: {error}") from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.shape[1] not in (2, 3, 6):
        shape = getattr(array, "shape", "none")
        raise MeshError(
            f"{path}: the array must have shape (n, 3), (n, 6) with normals, or (n, 2) in the plane, but its shape is "
            f"{shape}"
        )
    return array[:, :3], _normals_or_colours(array[:, 3:])


def _normals_or_colours(columns: AnyArray) -> AnyArray | None:
    """The columns (n, 3) after the coordinates if they are normals; None for colours, or if there are no columns."""
    if columns.shape[1] != 3:
        return None
    if columns.dtype.kind not in "iuf":
        return columns  # which is an error of the cloud
    length = np.linalg.norm(columns.astype(np.float64), axis=1)
    may_be_colours = bool(((columns >= 0) & (columns <= _BRIGHTEST)).all())
    return None if may_be_colours and (np.abs(length - 1) > _NOT_OF_LENGTH_1).any() else columns


def _to_ply(path: Path, cloud: PointCloud, attributes: _Attributes) -> None:
    columns = dict(zip(("x", "y", "z", "nx", "ny", "nz"), _rows(cloud).T, strict=False))
    for name, values in attributes.items():
        if name in columns or values.ndim != 1:
            raise MeshError(f"{path}: {name} must be another name than those of coordinates, and have shape (n,)")
        columns[name] = values
    ply.write_vertices(path, columns)


def _to_obj(path: Path, cloud: PointCloud, _: _Attributes) -> None:
    normals = "" if cloud.normals is None else format_rows("vn %r %r %r\n", cloud.normals)
    path.write_text(format_rows("v %r %r %r\n", cloud.P) + normals)


def _to_xyz(path: Path, cloud: PointCloud, _: _Attributes) -> None:
    rows = _rows(cloud)
    path.write_text(format_rows(" ".join(["%r"] * rows.shape[1]) + "\n", rows))


def _to_npy(path: Path, cloud: PointCloud, _: _Attributes) -> None:
    with path.open("wb") as file:
        np.save(file, _rows(cloud))


def _rows(cloud: PointCloud) -> FloatArray:
    """Positions (n, 3), or (n, 6) with normals."""
    return cloud.P if cloud.normals is None else np.hstack([cloud.P, cloud.normals])


# How each format is read and written.
_FORMATS: dict[str, tuple[Callable[[Path, bytes], _Points], Callable[[Path, PointCloud, _Attributes], None]]] = {
    ".ply": (_from_ply, _to_ply),
    ".obj": (_from_obj, _to_obj),
    ".xyz": (_from_xyz, _to_xyz),
    ".npy": (_from_npy, _to_npy),
}

POINT_CLOUD_SUFFIXES = tuple(_FORMATS)
