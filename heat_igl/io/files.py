"""Reading and writing mesh files and point clouds, chosen by the extension.

OFF, OBJ and PLY are read here, and XYZ and NPY for points, other formats by meshio and nibabel. Every defect of a file
raises a `MeshError` that names the file, the position and the remedy. Counts in headers are compared with the size of
the file before memory is allocated.
"""

from __future__ import annotations

import io
import os
import re
import stat
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError, as_array, errors_at, names_guessed, shown
from heat_igl.io import by_meshio, by_nibabel, obj, off, ply
from heat_igl.io.contents import Contents, Text, format_rows
from heat_igl.io.storage import form_suffix, is_packed, pack, replacing, unpacked
from heat_igl.mesh import Mesh, MeshLike, PointCloud, PolygonMesh, as_simplices, usable_normals, warn_of_seams
from heat_igl.typing import AnyArray, ArrayLike, FloatArray

# Formats of points alone.
POINT_SUFFIXES = (".xyz", ".npy")
# Formats of other libraries, whose objects `as_mesh` takes.
_READ_ELSEWHERE = {".vtp": "pass pyvista.read(path), or write .vtu", ".pcd": "pass open3d.io.read_point_cloud(path)"}
_ATTRIBUTE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
# Largest value of a colour, and the largest difference from length 1 of a normal: two digits are enough.
_BRIGHTEST = 255
_NOT_OF_LENGTH_1 = 0.01
_Points = tuple[FloatArray, FloatArray | None]
_Attributes = Mapping[str, FloatArray]


class _Format(NamedTuple):
    read: Callable[[Path, bytes], Contents]
    write: Callable[[Path, Mesh, dict[str, FloatArray]], None]
    tetrahedra: bool = False
    attributes: bool = False
    packed: bool = True  # whether a further .gz is understood


_FORMATS = {
    ".off": _Format(off.read, off.write),
    ".obj": _Format(obj.read, obj.write),
    ".ply": _Format(ply.read, ply.write, attributes=True),
    ".stl": _Format(by_meshio.read, by_meshio.write),
    ".mesh": _Format(by_meshio.read, by_meshio.write, tetrahedra=True),
    ".msh": _Format(by_meshio.read, by_meshio.write, tetrahedra=True),
    ".vtu": _Format(by_meshio.read, by_meshio.write, tetrahedra=True, attributes=True, packed=False),
    ".gii": _Format(by_nibabel.read, by_nibabel.write, attributes=True),
} | dict.fromkeys(by_nibabel.FREESURFER_SUFFIXES, _Format(by_nibabel.read, by_nibabel.write, packed=False))

MESH_SUFFIXES = tuple(_FORMATS)
_PACKED = tuple(suffix for suffix, form in _FORMATS.items() if form.packed)


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    r"""Read a triangle or tetrahedral mesh from a file.

    Parameters
    ----------
    path : path-like
        The extension, in upper or lower case, selects the format: .off, .obj, .ply, .stl, .mesh, .msh, .vtu, .gii
        (GIFTI), or the name of a FreeSurfer surface: .white, .pial, .inflated, .sphere, .smoothwm, .midthickness.
        A further .gz stands for a file packed by gzip, in all of these but VTU and FreeSurfer's.

    Returns
    -------
    Mesh
        Vertices in the order of the file, including unreferenced ones (STL: in the order of first use). If the file
        contains tetrahedra, the mesh consists of these, without the triangles of the boundary.

    Raises
    ------
    MeshError
        If the file is missing, unreadable or damaged, or contains no mesh. ``__cause__`` is the error of the operating
        system, if there is one.
    MissingExtraError
        For STL, MESH, MSH and VTU without meshio, for GIFTI and FreeSurfer without nibabel.

    Warns
    -----
    AccuracyWarning
        If boundary edges or parts lie on each other, as at texture seams: see `as_mesh`.

    Notes
    -----
    A polygon is split into the fan of triangles around the first corner, a concave one by clipping ears;
    `read_polygon_mesh` keeps polygons. STL has no shared vertices: equal positions are merged, and triangles
    that collapse by this are removed. Materials, normals, texture coordinates, colours and line elements are ignored.
    OBJ has neither counts nor an end mark: a file that may be cut short is an `AccuracyWarning`.

    Examples
    --------
    >>> import heat_igl
    >>> from pathlib import Path
    >>> _ = Path("triangle.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    >>> heat_igl.read_mesh("triangle.off")
    Mesh(3 vertices, 1 triangles)
    """
    path, contents = _load(path)
    mesh = contents.mesh(path)
    warn_of_seams(mesh)
    return mesh


def read_polygon_mesh(path: str | os.PathLike[str]) -> PolygonMesh:
    r"""Read a mesh from a file without splitting polygons.

    Parameters
    ----------
    path : path-like
        As for `read_mesh`.

    Returns
    -------
    PolygonMesh
        The vertices are those of `read_mesh`.

    Raises
    ------
    MeshError
        As `read_mesh`; also if the file holds tetrahedra.
    MissingExtraError
        For STL, MESH, MSH and VTU without meshio, for GIFTI and FreeSurfer without nibabel.

    Examples
    --------
    >>> import heat_igl
    >>> from pathlib import Path
    >>> _ = Path("square.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    >>> heat_igl.read_polygon_mesh("square.obj")
    PolygonMesh(4 vertices, 1 polygons)
    >>> heat_igl.read_mesh("square.obj")
    Mesh(4 vertices, 2 triangles)
    """
    path, contents = _load(path)
    cells = contents.cells
    if cells.tetrahedra:
        raise MeshError(f"{path}: the file holds tetrahedra, not polygons: read it with read_mesh")
    with errors_at(str(path)):
        return PolygonMesh(contents.V, np.split(cells.corners, np.cumsum(cells.degree)[:-1]))


def read_attributes(path: str | os.PathLike[str]) -> dict[str, AnyArray]:
    """Read the vertex attributes of a PLY, VTU or GIFTI file, or the maps of a GIFTI or CIFTI file without a surface.

    Parameters
    ----------
    path : path-like
        A file that holds a valid mesh; or labels, scalars or shapes (.gii, .nii). In CIFTI files the maps of each
        surface are called "cortex_left NAME", and are NaN at vertices that the file leaves out.

    Returns
    -------
    dict of str to (n,) or (n, k) array
        Arrays in the type of the file. Arrays written by `write_mesh` are read back bit for bit.

    Raises
    ------
    MeshError
        As `read_mesh`, and for formats without attributes.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(2)
    >>> heat_igl.write_mesh("square.ply", mesh, height=mesh.V[:, 1])
    >>> heat_igl.read_attributes("square.ply")["height"].tolist()
    [0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0]
    """
    path = checked_path(path, (*MESH_SUFFIXES, *by_nibabel.MAP_SUFFIXES), (*_PACKED, *by_nibabel.MAP_SUFFIXES))
    if form_suffix(path) in by_nibabel.MAP_SUFFIXES:
        return by_nibabel.read_maps(path, file_bytes(path))
    if not _FORMATS[form_suffix(path)].attributes:
        raise MeshError(f"{path}: this format holds no vertex attributes; {_those_with('attributes')} do")
    path, contents = _load(path)
    contents.mesh(path)
    return contents.attributes


@names_guessed
def write_mesh(path: str | os.PathLike[str], mesh: MeshLike, /, **attributes: ArrayLike) -> None:
    """Write a mesh, with attributes per vertex, to a file.

    Parameters
    ----------
    path : path-like
        The extension selects the format, as for `read_mesh`. An existing file is replaced only when the new one is
        complete; a failed write leaves the old file unchanged and no partial file.
    mesh : mesh
        Triangles, or (.mesh, .msh, .vtu) tetrahedra, as `as_mesh` takes them; polygons are written as triangles.
    **attributes : (n,) or (n, k) array_like of real numbers
        Arrays per vertex, stored in .ply and .vtu files in double precision, including infinite values. In PLY an
        array (n, k) becomes properties ``name_0``, ``name_1``, ..., which `read_attributes` combines again. GIFTI
        holds arrays (n,) in single precision.

    Raises
    ------
    MeshError
        If the format cannot hold the mesh or the attributes, an attribute has the wrong shape or type, or the file
        cannot be written.
    MissingExtraError
        For STL, MESH, MSH and VTU without meshio, for GIFTI and FreeSurfer without nibabel.

    Notes
    -----
    Coordinates are read back exactly: text formats contain the shortest decimal number that rounds to the same double.
    STL is written as text, since binary STL has single precision. STL files lose the order of the vertices and all
    unreferenced vertices. GIFTI and FreeSurfer have single precision: a mesh whose coordinates do not fit is rounded.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(3, 1)
    >>> heat_igl.write_mesh("strip.ply", mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> heat_igl.read_attributes("strip.ply")["distance"][:4].round(6).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    path = checked_path(path, MESH_SUFFIXES, _PACKED)
    form = _FORMATS[form_suffix(path)]
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral and not form.tetrahedra:
        raise MeshError(f"{path}: this format holds no tetrahedra; {_those_with('tetrahedra')} do")
    if attributes and not form.attributes:
        raise MeshError(
            f"{path}: this format holds no vertex attributes ({', '.join(attributes)}); {_those_with('attributes')} do"
        )
    arrays = checked_attributes(attributes, mesh.n_vertices)
    with replacing(path) as temporary:
        form.write(temporary, mesh, arrays)
        pack(path, temporary)


def write_attributes(path: str | os.PathLike[str], maps: Mapping[str, ArrayLike]) -> None:
    """Write maps on surfaces without the surfaces, to GIFTI or CIFTI, as `read_attributes` reads them.

    Parameters
    ----------
    path : path-like
        A file .gii of shapes, or .dscalar.nii of scalars on one surface or several; replaced when it is complete.
    maps : mapping from str to (n,) array_like
        In CIFTI the key is "cortex_left NAME"; every surface has the same names, and vertices that are NaN in all maps
        of a surface are left out. Values are stored in single precision.

    Raises
    ------
    MeshError
        If the format is another one, a map has the wrong shape or type, or a name is none of CIFTI's.
    MissingExtraError
        If nibabel is not installed.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(1)
    >>> heat_igl.write_attributes("lh.shape.gii", {"height": mesh.V[:, 2]})
    >>> list(heat_igl.read_attributes("lh.shape.gii"))
    ['height']
    """
    path = checked_path(path, by_nibabel.MAP_SUFFIXES, by_nibabel.MAP_SUFFIXES)
    if not maps:
        raise MeshError(f"{path}: there are no maps to write")
    arrays = {}
    for name, values in maps.items():
        checked = checked_attributes({"map": values}, np.shape(values)[0] if np.ndim(values) else 0)["map"]
        if checked.ndim > 1:
            raise MeshError(f"{path}: {name} has several numbers per vertex: write them apart")
        arrays[name] = checked
    with replacing(path) as temporary:
        by_nibabel.write_maps(temporary, arrays)
        pack(path, temporary)


def _those_with(capability: str) -> str:
    names = [suffix for suffix, form in _FORMATS.items() if getattr(form, capability)]
    return ", ".join(names[:-1]) + " and " + names[-1]


def checked_path(path: str | os.PathLike[str], suffixes: Collection[str], packed: Collection[str] = ()) -> Path:
    """`path` as a Path; a MeshError if it cannot be one, or has none of the suffixes, or of those `packed` and .gz."""
    try:
        found = Path(os.fspath(path))
    except TypeError:
        raise MeshError(f"path must be a string or a path, not {type(path).__name__}") from None
    try:
        printable = b"\0" not in os.fsencode(found)
    except UnicodeEncodeError:
        printable = False
    if not printable:
        raise MeshError(f"{str(path)!r} cannot be a path: it holds characters that no file name may have")
    suffix = form_suffix(found)
    if is_packed(found) and suffix not in packed:
        raise MeshError(f"{found}: '{suffix}' is not read or written with .gz; {', '.join(packed)} are")
    if suffix not in suffixes:
        if found.is_dir():
            raise MeshError(f"{found} is a directory: name a mesh file in it")
        of_points = "read_point_cloud and write_point_cloud take points" if suffix in POINT_SUFFIXES else ""
        remedy = of_points or _READ_ELSEWHERE.get(suffix, "pass meshio.read(path), or the mesh of another library")
        raise MeshError(
            f"{found}: unknown extension '{found.suffix}'; the formats are {', '.join(suffixes)}; for others, {remedy}"
        )
    return found


def _load(path: str | os.PathLike[str]) -> tuple[Path, Contents]:
    path = checked_path(path, MESH_SUFFIXES, _PACKED)
    return path, _FORMATS[form_suffix(path)].read(path, file_bytes(path))


def file_bytes(path: Path) -> bytes:
    """The contents of a regular file, unpacked if it ends in .gz; a MeshError if it cannot be read."""
    try:
        mode = path.stat().st_mode
        # Reading a pipe or a device might not terminate.
        if not stat.S_ISREG(mode):
            kind = "a directory" if stat.S_ISDIR(mode) else "not a regular file"
            raise MeshError(f"{path} is {kind}: pass the path of a mesh file")
        return unpacked(path, path.read_bytes())
    except FileNotFoundError as error:
        raise MeshError(f"{path}: no such file (looked in {path.absolute().parent})") from error
    except OSError as error:
        raise MeshError(f"{path} cannot be read: {error.strerror or error}") from error


def checked_attributes(attributes: Mapping[str, ArrayLike], n: int) -> dict[str, FloatArray]:
    """Attributes of n vertices as arrays of double precision; a MeshError that names the one that cannot be."""
    found = {}
    for name, values in attributes.items():
        if not _ATTRIBUTE_NAME.fullmatch(name) or name in ("x", "y", "z"):
            raise MeshError(f"{name!r} cannot name an attribute: use letters, digits and _, and not x, y or z")
        array = as_array(name, values, MeshError)
        if array.dtype.kind not in "biuf" or array.dtype.itemsize > 8:
            raise MeshError(f"{name} must hold real numbers that fit double precision, not {array.dtype}")
        if array.ndim not in (1, 2) or len(array) != n or not array.size:
            raise MeshError(
                f"{name} must have shape ({n},) or ({n}, k), a value for each vertex, but it has shape {array.shape}"
            )
        stored = array.astype(np.float64)
        if array.dtype.kind in "iu" and (np.abs(stored) > 2.0**53).any():
            raise MeshError(f"{name} holds integers beyond 2**53, which double precision cannot store exactly")
        found[name] = stored
    return found


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
    P, normals = _POINT_FORMATS[form_suffix(path)][0](path, file_bytes(path))
    with errors_at(str(path)):
        return PointCloud(P, None if normals is None else usable_normals(normals, f"{path}: "))


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
    known = _PACKED if is_packed(path) else MESH_SUFFIXES
    suffix = form_suffix(path)
    return suffix != ".npy" and suffix in (POINT_CLOUD_SUFFIXES if points else (*known, *POINT_SUFFIXES))


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
        _POINT_FORMATS[suffix][1](temporary, cloud, arrays)
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
    points, normals = (np.flatnonzero(word == record) for record in (b"v", b"vn"))
    if not len(points):
        raise MeshError(f"{path}: the file has no points (lines that start with v)")
    P = text.positions(points, skip=1)
    return P, text.positions(normals, skip=1) if len(normals) == len(points) else None


def _from_xyz(path: Path, data: bytes) -> _Points:
    text = Text(path, data.replace(b",", b" "), comment="#")
    width = int(text.count[0])
    wrong = text.count != (width if width in (2, 3, 6) else 3)
    text.refuse(
        np.arange(len(text)),
        wrong,
        "a point has 3 numbers, or 6 with a normal, or 2 in the plane, and all points as many "
        f"({int(wrong.sum())} lines differ); PointCloud(numpy.loadtxt(path)[:, :3]) takes the first three of more",
    )
    values = text.numbers(np.arange(len(text)))[0].reshape(-1, width)
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
    ply.write_columns(path, columns)


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
_POINT_FORMATS: dict[str, tuple[Callable[[Path, bytes], _Points], Callable[[Path, PointCloud, _Attributes], None]]] = {
    ".ply": (_from_ply, _to_ply),
    ".obj": (_from_obj, _to_obj),
    ".xyz": (_from_xyz, _to_xyz),
    ".npy": (_from_npy, _to_npy),
}

POINT_CLOUD_SUFFIXES = tuple(_POINT_FORMATS)
