"""Conversion of meshes from and to other libraries. Their types are recognized by attributes, without imports."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from typing import Any, Literal

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError, as_array, names_guessed, require_choice
from heat_igl.mesh.cloud_objects import cloud_of_cells, cloud_of_points, cloud_of_poly_data, refuse_other_cells
from heat_igl.mesh.connectivity import first_copies
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.point_cloud import PointCloud
from heat_igl.mesh.polygons import PolygonMesh
from heat_igl.mesh.rasters import ImageDomain
from heat_igl.mesh.seams import copies_apart, seam_originals, seam_pairs
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, ArrayLike, IntArray

MeshLike = Any
"""`Mesh`, `PolygonMesh`, `PointCloud`, a pair (V, F), a path, or a mesh of another library, see `as_mesh`."""

_UNDERSTOOD = (
    "a Mesh, PolygonMesh or PointCloud, a pair (V, F), a path, or a mesh or points of trimesh, pyvista or vtk, open3d, "
    "meshio, pymeshlab, vedo or nibabel"
)
# Cells by the names of meshio and by the numbers of VTK.
_TRIANGLES, _QUADS, _POLYGONS, _TETRAHEDRA = ("triangle", 5), ("quad", 9), ("polygon", 7), ("tetra", 10)


# What else might be taken for a mesh, by the end of the name of the class.
_NOT_MESHES = {
    "Operators": "GeodesicSolver and HeatMethodSolver take operators, and the solver answers what is asked of a mesh",
    "Solver": "a solver is asked itself, as in solver.distance(sources)",
    "Scene": "pass .to_mesh() of it",
    "MultiBlock": "pass .combine().extract_surface() of it",
    "SurfaceImage": "pass one of mesh.parts",
    **dict.fromkeys(
        ("StructuredGrid", "RectilinearGrid", "ImageData"),
        "pass .cast_to_unstructured_grid().triangulate() of it, tetrahedra, or triangles if it is flat",
    ),
}

# The beginnings of the warnings that `merge` answers, behind a number.
_SEAMS = "boundary edges of the mesh lie on others"
_PLACES = "places on the boundary of the mesh"


@names_guessed
def as_mesh(
    mesh: MeshLike, F: ArrayLike | None = None, *, merge: Literal["seams", "vertices"] | None = None
) -> Mesh | PolygonMesh | PointCloud:
    """A mesh of any library as a mesh of this one.

    Parameters
    ----------
    mesh : mesh or array_like
        `Mesh`, `PolygonMesh` and `PointCloud` are returned as they are, and of an `ImageDomain` the mesh. Besides: a
        pair (V, F); a path, read by `read_mesh`, or by `read_point_cloud` if the format holds points only; meshes of
        trimesh, pyvista and vtk (PolyData, UnstructuredGrid), open3d, meshio, pymeshlab (also a MeshSet: the current
        mesh), vedo, and nibabel (surfaces in GIFTI). The point clouds of trimesh, open3d and vedo, and objects of
        pyvista, vtk and meshio that hold points alone, become a `PointCloud`, with the normals of open3d, pyvista and
        vtk. With `F`, the positions V (n, 3).
    F : (m, 3) or (m, 4) array_like of int, optional
        Triangles or tetrahedra, when `mesh` is V.
    merge : {"seams", "vertices"}, optional
        "seams" joins the boundary edges of a surface that lie on each other. Loaders of textured models split vertices
        where the texture has a seam, so that distance across it is ``inf``, or leads around it. "vertices" joins all
        vertices in one place, as `read_mesh` does for STL: for triangles without common vertices.

    Returns
    -------
    Mesh, PolygonMesh or PointCloud
        In the vertices' own order and unit. Polygons with more than three corners give a `PolygonMesh`; a mesh with
        tetrahedra gives those, without the triangles of their boundary. With merged seams, all vertices are kept and
        may be asked for, and those that became one have the same values; polygons with seams become triangles. With
        merged vertices, triangles with two corners in one place are left out.

    Raises
    ------
    MeshError
        If the object is not understood (the message lists the known kinds), or the mesh cannot be used.

    Warns
    -----
    AccuracyWarning
        If `merge` is not given, and boundary edges of a mesh that is none of this package lie on each other, or
        boundary vertices in one place belong to parts that no edge joins, as in triangles without common vertices. If
        vertices at the boundary lie on each other and are no seam, with ``merge="seams"``.

    Notes
    -----
    Objects are recognized by the attributes that hold positions and faces. An array (m, 4) in a pair (V, F) holds
    tetrahedra, as everywhere in this package; `PolygonMesh` takes quadrilaterals.

    Two boundary edges are joined if their ends have the same positions, bit for bit, if the faces on both sides have
    the same orientation, and if no third boundary edge lies there. Cuts with a gap, however small, T-junctions, and a
    sheet that lies on another are left alone. A cut without a gap cannot be told from a seam, so that nothing is joined
    unasked.

    Examples
    --------
    >>> import heat_igl
    >>> from types import SimpleNamespace
    >>> heat_igl.as_mesh(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    Mesh(3 vertices, 1 triangles)
    >>> theirs = SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]])  # as in trimesh
    >>> heat_igl.as_mesh(theirs)
    Mesh(3 vertices, 1 triangles)
    >>> V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> square = heat_igl.as_mesh(V, [[0, 1, 2], [3, 4, 5]], merge="seams")  # split along the diagonal
    >>> heat_igl.geodesic_distance(square, 0).round(3).tolist()
    [0.0, 1.0, 1.0, 1.0, 1.414, 1.0]
    """
    if merge is not None:
        require_choice("merge", merge, ("seams", "vertices"))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", rf"\d+ ({_SEAMS}|{_PLACES})", AccuracyWarning)
            found = _converted(mesh, F)
        return found if isinstance(found, PointCloud) else _merged(found, merge)
    found = _converted(mesh, F)
    # The reader of a file has warned.
    if not isinstance(mesh, (Mesh, PolygonMesh, PointCloud, ImageDomain, str, os.PathLike)):
        warn_of_seams(found)
    return found


def _merged(found: Mesh | PolygonMesh, merge: str) -> Mesh | PolygonMesh:
    mesh = found if isinstance(found, Mesh) else found.triangles
    originals = seam_originals(mesh) if merge == "seams" else first_copies(mesh.V)
    apart = copies_apart(mesh, originals)
    if apart:
        warn_caller(
            "vertices of the boundary that lie on each other are not joined where they are no seam (number of places: "
            f"{apart}): parts touch in a point, three or more edges meet, or one face lies on another; "
            'as_mesh(mesh, merge="vertices") joins all vertices in one place',
            AccuracyWarning,
        )
    if (originals == np.arange(mesh.n_vertices)).all():
        return found
    F = originals[mesh.F]
    F = F[(np.diff(np.sort(F, axis=1), axis=1) > 0).all(axis=1)]
    if not len(F):
        raise MeshError("all faces have two corners in one place, so none is left when vertices are merged")
    return Mesh(mesh.V, F).with_originals(originals[mesh.originals])


def warn_of_seams(mesh: Mesh | PolygonMesh | PointCloud) -> None:
    """Warn if boundary edges lie on each other, or boundary vertices in one place belong to different components."""
    if isinstance(mesh, PointCloud):
        return
    surface = mesh if isinstance(mesh, Mesh) else mesh.triangles
    if n := len(seam_pairs(surface)):
        warn_caller(
            f"{n} {_SEAMS}, as where a loader has split vertices at texture seams, and distance does not cross there: "
            'heat_igl.as_mesh(mesh, merge="seams") joins them',
            AccuracyWarning,
        )
    elif n := copies_apart(surface, surface.components):
        warn_caller(
            f"{n} {_PLACES} hold vertices of parts that no edge joins, so the distance between them is inf: "
            'heat_igl.as_mesh(mesh, merge="vertices") joins all vertices in one place',
            AccuracyWarning,
        )


def _converted(mesh: MeshLike, F: ArrayLike | None) -> Mesh | PolygonMesh | PointCloud:
    if F is not None:
        if isinstance(mesh, (Mesh, PolygonMesh, PointCloud)):
            raise MeshError(f"F is given beside a {type(mesh).__name__}: pass a mesh alone, or positions V and faces F")
        return Mesh(mesh, F)
    if isinstance(mesh, (Mesh, PolygonMesh, PointCloud)):
        return mesh
    if isinstance(mesh, ImageDomain):
        return mesh.mesh
    if isinstance(mesh, (str, os.PathLike)):
        # Files are the business of a room above this one.
        read: Callable[..., Mesh | PointCloud] = import_module("heat_igl.io").read_mesh_or_cloud
        return read(mesh)
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return Mesh(*mesh)
    if isinstance(mesh, np.ndarray) and mesh.dtype == bool:
        raise MeshError(
            "a mask is no mesh: domain = image_domain(mask) is one, domain.index[row, column] a source on it, and "
            "domain.image(distance) an image again"
        )
    if isinstance(mesh, np.ndarray):
        raise MeshError(
            "faces F are missing: pass a mesh, positions V and faces F, or a pair (V, F); PointCloud(P) takes points, "
            "image_domain(mask) pixels, and terrain(heights) heights"
        )
    # In the wrapper of brainspace, whose other attributes may not be asked for by names that it does not know.
    mesh = getattr(mesh, "__dict__", {}).get("VTKObject", mesh)
    for convert in _CONVERSIONS:
        found = convert(mesh)
        if found is not None:
            return found
    for kind, remedy in _NOT_MESHES.items():
        if type(mesh).__name__.endswith(kind):
            raise MeshError(f"mesh is {_named(mesh)}: {remedy}")
    raise MeshError(f"mesh is {_named(mesh)}, which is not understood: pass {_UNDERSTOOD}")


def as_simplices(mesh: MeshLike) -> Mesh:
    """A mesh of any library as triangles or tetrahedra: `as_mesh`, with the triangles of polygons and of point clouds.

    The vertices are those of `as_mesh`, and so are the errors.
    """
    found = as_mesh(mesh)
    return found if isinstance(found, Mesh) else found.triangles


def as_triangles(mesh: MeshLike, what: str, error: type[ValueError] = MeshError) -> Mesh:
    """`as_simplices`; an `error` if they are tetrahedra: `what` needs triangles."""
    found = as_simplices(mesh)
    if found.is_tetrahedral:
        raise error(f"{what} triangles, but the mesh is tetrahedral")
    return found


def tangent_surface(mesh: MeshLike) -> Mesh:
    """The surface that tangent vectors live on: `as_simplices`, or the `cover` of a `PointCloud` that has one."""
    found = as_mesh(mesh)
    return as_simplices(found) if not isinstance(found, PointCloud) or found.cover is None else found.cover


def one_sided(mesh: MeshLike, what: str) -> Mesh:
    """`as_simplices`, of a domain whose triangles have a common orientation.

    A MeshError if it is a `PointCloud` without one; `what` needs it.
    """
    found = as_mesh(mesh)
    surface = as_simplices(found)
    if isinstance(found, PointCloud) and found.cover is not None:
        raise MeshError(
            f"the triangles between the points are no oriented manifold: {what} one, and in places the points do not "
            "tell on which side of the surface they are: pass PointCloud(P, normals), or a mesh"
        )
    return surface


def _named(mesh: object) -> str:
    kind = next(each for each in type(mesh).__mro__ if not each.__name__.startswith("_"))
    return (
        f"of type {kind.__qualname__}" if kind.__module__ == "builtins" else f"a {kind.__module__}.{kind.__qualname__}"
    )


def _pymeshlab(mesh: Any) -> Mesh | PolygonMesh | None:
    """pymeshlab: Mesh, and MeshSet with a current mesh."""
    if hasattr(mesh, "current_mesh"):
        mesh = mesh.current_mesh()
    if not (hasattr(mesh, "vertex_matrix") and hasattr(mesh, "face_matrix")):
        return None
    return Mesh(mesh.vertex_matrix(), np.asarray(mesh.face_matrix(), np.int64))


def _cells(mesh: Any) -> Mesh | PolygonMesh | PointCloud | None:
    """Meshio's Mesh and pyvista's UnstructuredGrid: blocks of cells, each of one type."""
    if not (hasattr(mesh, "points") and isinstance(getattr(mesh, "cells_dict", None), Mapping)):
        return None
    refuse_other_cells(mesh, (*_TRIANGLES, *_QUADS, *_POLYGONS, *_TETRAHEDRA))
    cells: Mapping[Any, AnyArray] = mesh.cells_dict

    def of(kinds: tuple[str, int]) -> list[AnyArray]:
        return [np.asarray(cells[kind]) for kind in kinds if kind in cells]

    tetrahedra = of(_TETRAHEDRA)
    if tetrahedra:
        return Mesh(mesh.points, tetrahedra[0])
    polygons = [*of(_TRIANGLES), *of(_QUADS), *of(_POLYGONS)]
    return (None if polygons else cloud_of_cells(mesh)) or _of_polygons(mesh.points, polygons)


def _poly_data(mesh: Any) -> Mesh | PolygonMesh | PointCloud | None:
    """PolyData of pyvista and vtk: polygons one after the other, each after the number of corners."""
    if hasattr(mesh, "points") and hasattr(mesh, "faces") and hasattr(mesh, "n_points"):
        P, polygons = mesh.points, _unpadded(np.asarray(mesh.faces))
    elif hasattr(mesh, "GetPoints") and hasattr(mesh, "GetPolys"):
        P, polygons = np.asarray(mesh.GetPoints().GetData()), _split(mesh.GetPolys())
    else:
        return None
    if getattr(mesh, "n_strips", 0):
        raise MeshError("the mesh holds strips of triangles: pass mesh.triangulate()")
    return (None if len(polygons) else cloud_of_poly_data(mesh)) or _of_polygons(P, [polygons])


def _vertices_and_faces(mesh: Any) -> Mesh | PolygonMesh | None:
    """Trimesh (faces), open3d (triangles), vedo (cells), nilearn (coordinates): arrays of positions and indices."""
    for positions in ("vertices", "points", "coordinates"):
        for faces in ("faces", "triangles", "cells"):
            V, polygons = getattr(mesh, positions, None), getattr(mesh, faces, None)
            if V is not None and polygons is not None and not callable(V) and not callable(polygons):
                return _of_polygons(np.asarray(V), [_rows(polygons)])
    return None


def _tensors(mesh: Any) -> Mesh | PolygonMesh | None:
    """open3d's mesh of tensors."""
    if not (hasattr(mesh, "vertex") and hasattr(mesh, "triangle")):
        return None
    return Mesh(mesh.vertex.positions.cpu().numpy(), mesh.triangle.indices.cpu().numpy())


def _gifti(mesh: Any) -> Mesh | PolygonMesh | None:
    """Nibabel's GiftiImage, with coordinates and triangles among the arrays."""
    if not hasattr(mesh, "agg_data"):
        return None
    V, F = mesh.agg_data(("pointset", "triangle"))
    if not len(V) or not len(F):
        raise MeshError("the GIFTI image holds no surface: it needs coordinates (POINTSET) and faces (TRIANGLE)")
    return Mesh(V, F)


# The more telling attributes first: pyvista's PolyData also has the attributes that the later ones look for.
_CONVERSIONS: tuple[Callable[[Any], Mesh | PolygonMesh | PointCloud | None], ...] = (
    cloud_of_points,
    _pymeshlab,
    _cells,
    _poly_data,
    _gifti,
    _tensors,
    _vertices_and_faces,
)


def _rows(faces: Any) -> AnyArray | list[IntArray]:
    """Faces as an array (m, d), or as a list if they differ in degree."""
    try:
        return np.asarray(faces)
    except ValueError:
        return [np.asarray(face) for face in faces]


def _split(polygons: Any) -> list[IntArray]:
    """The polygons of a vtkCellArray."""
    corners, ends = (np.asarray(part) for part in (polygons.GetConnectivityArray(), polygons.GetOffsetsArray()))
    return np.split(corners, ends[1:-1]) if len(corners) else []


def _unpadded(faces: IntArray) -> list[IntArray] | IntArray:
    """The polygons of an array in which each stands after the number of corners."""
    if not len(faces):
        return np.empty((0, 3), np.int64)
    degree = int(faces[0])
    if degree > 0 and len(faces) % (degree + 1) == 0:
        rows = faces.reshape(-1, degree + 1)
        if (rows[:, 0] == degree).all():
            return rows[:, 1:]
    polygons, at = [], 0
    while at < len(faces):
        polygons.append(faces[at + 1 : at + 1 + faces[at]])
        at += int(faces[at]) + 1
    return polygons


def _of_polygons(V: AnyArray, blocks: Iterable[AnyArray | list[IntArray]]) -> Mesh | PolygonMesh:
    """Triangles if all faces are, polygons otherwise."""
    blocks = [block for block in blocks if len(block)]
    if not blocks:
        raise MeshError("the mesh has no faces: a distance needs triangles, polygons or tetrahedra, or a PointCloud")
    if all(isinstance(block, np.ndarray) and block.ndim == 2 and block.shape[1] == 3 for block in blocks):
        return Mesh(V, np.concatenate(blocks))
    polygons = [np.asarray(face, np.int64) for block in blocks for face in block]
    if all(len(face) == 3 for face in polygons):
        return Mesh(V, np.array(polygons))
    return PolygonMesh(V, polygons)


def to_trimesh(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as a ``trimesh.Trimesh``; vertices keep their numbers.

    Parameters
    ----------
    mesh : mesh
        Triangles on n vertices, m faces: whatever `as_mesh` takes.
    **attributes : (n,) or (n, d), or (m,) or (m, d) array_like
        Values that become ``vertex_attributes``, or ``face_attributes``. Where n is m, of vertices.

    Returns
    -------
    trimesh.Trimesh

    Raises
    ------
    MeshError
        If the mesh cannot be used, or holds tetrahedra.
    ValueError
        If values have neither n nor m rows.
    ImportError
        If trimesh is not installed; no extra of this package installs it.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_trimesh(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.vertex_attributes["distance"].shape
    (162,)
    """
    triangles = as_triangles(mesh, "other libraries' surfaces need")
    import trimesh  # type: ignore[import-not-found]

    of_vertices, of_faces = _attributes(triangles, attributes)
    return trimesh.Trimesh(
        triangles.vertices, triangles.faces, vertex_attributes=of_vertices, face_attributes=of_faces, process=False
    )


def to_pyvista(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as a ``pyvista.PolyData``, values as ``point_data`` or ``cell_data``.

    Parameters, result and errors are those of `to_trimesh`, for pyvista.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_pyvista(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.point_data["distance"].shape
    (162,)
    """
    triangles = as_triangles(mesh, "other libraries' surfaces need")
    import pyvista  # type: ignore[import-not-found]

    of_vertices, of_faces = _attributes(triangles, attributes)
    surface = pyvista.PolyData.from_regular_faces(triangles.vertices, triangles.faces)
    surface.point_data.update(of_vertices)
    surface.cell_data.update(of_faces)
    return surface


def to_open3d(mesh: MeshLike, **attributes: ArrayLike) -> Any:
    """A mesh of triangles as an ``open3d.t.geometry.TriangleMesh``, values as ``.vertex`` or ``.triangle``.

    Parameters, result and errors are those of `to_trimesh`, for open3d; the older mesh of open3d, which has no
    attributes, is ``to_open3d(mesh).to_legacy()``. In open3d, values have two dimensions: (n,) becomes (n, 1).

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> surface = heat_igl.to_open3d(mesh, distance=heat_igl.geodesic_distance(mesh, 0))
    >>> surface.vertex["distance"].shape
    SizeVector[162, 1]
    """
    triangles = as_triangles(mesh, "other libraries' surfaces need")
    import open3d  # type: ignore[import-not-found]

    surface = open3d.t.geometry.TriangleMesh(
        open3d.core.Tensor(triangles.vertices), open3d.core.Tensor(triangles.faces)
    )
    for there, found in zip((surface.vertex, surface.triangle), _attributes(triangles, attributes), strict=True):
        for name, values in found.items():
            there[name] = open3d.core.Tensor(np.ascontiguousarray(values.reshape(len(values), -1)))
    return surface


def _attributes(mesh: Mesh, attributes: dict[str, ArrayLike]) -> tuple[dict[str, AnyArray], dict[str, AnyArray]]:
    """Copies of the values at vertices, and of those at faces."""
    of_vertices, of_faces = {}, {}
    for name, given in attributes.items():
        values = as_array(name, given).copy()
        if values.ndim and len(values) == mesh.n_vertices:
            of_vertices[name] = values
        elif values.ndim and len(values) == mesh.n_faces:
            of_faces[name] = values
        else:
            raise ValueError(
                f"{name} must have a row for each of {mesh.n_vertices} vertices or {mesh.n_faces} faces, not shape "
                f"{values.shape}"
            )
    return of_vertices, of_faces
