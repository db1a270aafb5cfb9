"""VTP, GIFTI and FreeSurfer surfaces, files packed by gzip, and point clouds: nothing is lost, and damage is named."""

from __future__ import annotations

import base64
import gzip
import importlib.util
import lzma
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, MissingExtraError, PointCloud
from heat_igl.io import write_point_cloud

needs_nibabel = pytest.mark.skipif(importlib.util.find_spec("nibabel") is None, reason="needs nibabel")
neuro = [pytest.param(name, marks=needs_nibabel) for name in ("lh.pial.surf.gii", "lh.white", "rh.inflated")]


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return heat_igl.shapes.torus(9, 6)


def rewritten(path: Path, change: Callable[[bytes], bytes]) -> Path:
    path.write_bytes(change(path.read_bytes()))
    return path


# --- gzip -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".mesh", ".msh"])
def test_a_packed_file_is_the_plain_one(tmp_path: Path, mesh: Mesh, suffix: str) -> None:
    packed, plain = tmp_path / f"a{suffix}.gz", tmp_path / f"a{suffix}"
    heat_igl.write_mesh(packed, mesh)
    heat_igl.write_mesh(plain, mesh)
    assert gzip.decompress(packed.read_bytes()) == plain.read_bytes()
    back = heat_igl.read_mesh(packed)
    assert (back.V.tobytes(), back.F.tobytes()) == (mesh.V.tobytes(), mesh.F.tobytes())


def test_packed_files_have_the_same_bytes_each_time(tmp_path: Path, mesh: Mesh) -> None:
    for name in ("a.PLY.GZ", "b.ply.gz"):
        heat_igl.write_mesh(tmp_path / name, mesh, distance=mesh.V[:, 0])
    assert (tmp_path / "a.PLY.GZ").read_bytes() == (tmp_path / "b.ply.gz").read_bytes()
    assert (tmp_path / "a.PLY.GZ").read_bytes()[4:8] == bytes(4)  # the time of packing, in seconds
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "a.PLY.GZ")["distance"], mesh.V[:, 0])


@pytest.mark.parametrize("change", [lambda data: data[:-20], lambda _: b"v 0 0 0\n", lambda data: data[:40] + b"x"])
def test_a_damaged_packed_file_is_named(tmp_path: Path, mesh: Mesh, change: Callable[[bytes], bytes]) -> None:
    heat_igl.write_mesh(tmp_path / "a.obj.gz", mesh)
    with pytest.raises(MeshError, match=r"a.obj.gz cannot be unpacked .*damaged, cut short"):
        heat_igl.read_mesh(rewritten(tmp_path / "a.obj.gz", change))


@pytest.mark.parametrize("name", ["a.vtp.gz", "a.white.gz", "a.gz", "a.txt.gz"])
def test_what_is_not_packed_is_said(tmp_path: Path, mesh: Mesh, name: str) -> None:
    with pytest.raises(MeshError, match=rf"{name}: '.*' is not read or written with .gz; .off, .obj"):
        heat_igl.write_mesh(tmp_path / name, mesh)


# --- VTP --------------------------------------------------------------------------------------------------------------

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 1]])
POLYGONS = [[0, 1, 2, 3], [1, 4, 2]]


def vtp(arrays: dict[str, str], attributes: str, appended: bytes = b"") -> bytes:
    """A file with one square and one triangle."""
    text = f"""<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" {attributes}><PolyData>
    <Piece NumberOfPoints="5" NumberOfPolys="2"><PointData>{arrays["height"]}</PointData>
    <Points>{arrays["points"]}</Points><Polys>{arrays["connectivity"]}{arrays["offsets"]}</Polys></Piece></PolyData>"""
    return text.encode() + appended + b"</VTKFile>"


VALUES = {
    "height": CORNERS[:, 2].astype("f4"),
    "points": CORNERS,
    "connectivity": np.concatenate(POLYGONS).astype("i4"),
    "offsets": np.array([4, 7], "u1"),
}
TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "u1": "UInt8"}


def element(name: str, content: str, form: str) -> str:
    values = VALUES[name]
    return (
        f'<DataArray type="{TYPES[values.dtype.str[1:]]}" Name="{name}" {form} '
        f'NumberOfComponents="{3 if values.ndim == 2 else 1}">{content}</DataArray>'
    )


def stored(name: str, order: str, word: str, compress: Callable[[bytes], bytes] | None, encode: bool) -> bytes:
    """The bytes of an array behind their header, as VTK lays them out."""
    code = base64.b64encode if encode else bytes
    data = VALUES[name].astype(VALUES[name].dtype.newbyteorder(order)).tobytes()
    if compress is None:
        return code(np.array(len(data), order + word).tobytes() + data)
    half = len(data) // 2 + 1
    blocks = [compress(data[:half]), compress(data[half:])]
    header = np.array([2, half, len(data) - half, *map(len, blocks)], order + word).tobytes()
    return code(header) + code(b"".join(blocks))


@pytest.mark.parametrize(("order", "endian"), [("<", "LittleEndian"), (">", "BigEndian")])
@pytest.mark.parametrize(
    ("compress", "compressor"), [(None, ""), (zlib.compress, "ZLib"), (lzma.compress, "LZMA")], ids=["", "zlib", "lzma"]
)
@pytest.mark.parametrize("form", ["ascii", "binary", "raw", "base64"])
def test_every_way_to_store_arrays(
    tmp_path: Path, order: str, endian: str, compress: Callable[[bytes], bytes] | None, compressor: str, form: str
) -> None:
    word = "u8" if compressor else "u4"
    attributes = f'byte_order="{endian}" header_type="{"UInt64" if compressor else "UInt32"}"'
    attributes += f' compressor="vtk{compressor}DataCompressor"' if compressor else ""
    appended, arrays = b"", {}
    for name, values in VALUES.items():
        if form == "ascii":
            arrays[name] = element(name, " ".join(map(str, values.ravel())), 'format="ascii"')
        elif form == "binary":
            arrays[name] = element(name, stored(name, order, word, compress, True).decode(), 'format="binary"')
        else:
            arrays[name] = element(name, "", f'format="appended" offset="{len(appended)}"')
            appended += stored(name, order, word, compress, form == "base64")
    if appended:
        appended = f'<AppendedData encoding="{form}">_'.encode() + appended + b"</AppendedData>"
    (tmp_path / "a.vtp").write_bytes(vtp(arrays, attributes, appended))
    polygons = heat_igl.read_polygon_mesh(tmp_path / "a.vtp")
    assert np.array_equal(polygons.V, CORNERS)
    assert [face.tolist() for face in polygons.polygons] == POLYGONS
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "a.vtp")["height"], VALUES["height"])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda _: b"  ", "empty"),
        (lambda data: data[:-200], "not valid XML"),
        (lambda data: data.replace(b'"PolyData"', b'"ImageData"'), "holds ImageData, not PolyData"),
        (lambda data: data.replace(b"ZLib", b"LZ4"), "compressed by vtkLZ4DataCompressor"),
        (lambda data: data.replace(b'NumberOfPoints="54"', b'NumberOfPoints="53"'), "announces 53 points"),
        (lambda data: data.replace(b'NumberOfPolys="108"', b'NumberOfPolys="107"'), "the offsets do not divide"),
        (lambda data: data.replace(b'NumberOfStrips="0"', b'NumberOfStrips="1"'), "strips"),
        (lambda data: data.replace(b'"connectivity"', b'"corners"'), "connectivity and offsets"),
        (lambda data: data.replace(b'"Float64"', b'"String"'), "type String"),
        (lambda data: data.replace(b"eJ", b"e_", 1), "array 'Points' is damaged"),
        (lambda data: data.replace(b"</Piece>", b"</Piece><Piece/>"), "2 pieces"),
    ],
)
def test_a_damaged_vtp_file_is_named(tmp_path: Path, mesh: Mesh, change: Callable[[bytes], bytes], said: str) -> None:
    heat_igl.write_mesh(tmp_path / "a.vtp", mesh)
    assert heat_igl.read_mesh(tmp_path / "a.vtp").n_faces == 108
    with pytest.raises(MeshError, match=rf"a.vtp: .*{said}"):
        heat_igl.read_mesh(rewritten(tmp_path / "a.vtp", change))


def test_pyvista_reads_what_is_written_and_writes_what_is_read(tmp_path: Path, mesh: Mesh) -> None:
    pyvista = pytest.importorskip("pyvista")
    heat_igl.write_mesh(tmp_path / "a.vtp", mesh, distance=mesh.V[:, 0], normal=mesh.V)
    surface = pyvista.read(tmp_path / "a.vtp")
    assert np.array_equal(surface.points, mesh.V)
    assert np.array_equal(surface["distance"], mesh.V[:, 0])
    surface.save(tmp_path / "b.vtp")
    back = heat_igl.read_mesh(tmp_path / "b.vtp")
    assert np.array_equal(back.V, mesh.V)
    assert np.array_equal(back.F, mesh.F)
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "b.vtp")["normal"], mesh.V)


# --- GIFTI and FreeSurfer ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", neuro)
def test_a_cortex_comes_back_in_single_precision(tmp_path: Path, mesh: Mesh, name: str) -> None:
    heat_igl.write_mesh(tmp_path / name, mesh)
    back = heat_igl.read_mesh(tmp_path / name)
    assert np.array_equal(back.V, mesh.V.astype(np.float32))
    assert np.array_equal(back.F, mesh.F)


@needs_nibabel
def test_nibabel_reads_what_is_written(tmp_path: Path, mesh: Mesh) -> None:
    import nibabel

    distance = np.where(mesh.V[:, 0] > 1, np.inf, mesh.V[:, 0])
    heat_igl.write_mesh(tmp_path / "a.gii.gz", mesh, distance=distance)
    image = nibabel.GiftiImage.from_bytes(gzip.decompress((tmp_path / "a.gii.gz").read_bytes()))
    V, F = image.agg_data(("pointset", "triangle"))
    assert np.array_equal(V, mesh.V.astype(np.float32))
    assert np.array_equal(F, mesh.F)
    assert np.array_equal(heat_igl.as_mesh(image).F, mesh.F)
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "a.gii.gz")["distance"], distance.astype(np.float32))
    heat_igl.write_mesh(tmp_path / "lh.pial", mesh)
    V, F = nibabel.freesurfer.read_geometry(tmp_path / "lh.pial")
    assert np.array_equal(V, mesh.V.astype(np.float32))
    assert np.array_equal(F, mesh.F)


@needs_nibabel
@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.gii", b" ", "empty"),
        ("a.gii", b"<GIFTI>", "nibabel cannot read this GIFTI file"),
        ("lh.pial", b"", "empty"),
        ("lh.pial", b"solid a", "nibabel cannot read this FreeSurfer surface"),
    ],
)
def test_a_damaged_cortex_is_named(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=rf"{name}: .*{said}"):
        heat_igl.read_mesh(tmp_path / name)


@needs_nibabel
def test_gifti_without_a_surface_lists_its_arrays(tmp_path: Path, mesh: Mesh) -> None:
    import nibabel

    shape = nibabel.gifti.GiftiDataArray(np.zeros(3, np.float32), "NIFTI_INTENT_SHAPE")
    nibabel.GiftiImage(darrays=[shape]).to_filename(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"holds no surface, .* its arrays are SHAPE"):
        heat_igl.read_mesh(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"GIFTI holds one number per vertex, and normal has several"):
        heat_igl.write_mesh(tmp_path / "b.gii", mesh, normal=mesh.V)
    assert not (tmp_path / "b.gii").exists()


@pytest.mark.parametrize(("name", "what"), [("a.gii", "GIFTI files"), ("lh.white", "FreeSurfer's surfaces")])
def test_without_nibabel_the_error_names_the_extra(
    tmp_path: Path, mesh: Mesh, monkeypatch: pytest.MonkeyPatch, name: str, what: str
) -> None:
    monkeypatch.setitem(sys.modules, "nibabel", None)
    with pytest.raises(MissingExtraError, match=f"writing {what} needs nibabel: .* extra 'neuro'"):
        heat_igl.write_mesh(tmp_path / name, mesh)


# --- point clouds -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".xyz", ".npy", ".xyz.gz", ".ply.gz"])
@pytest.mark.parametrize("with_normals", [False, True])
def test_point_clouds_come_back_exactly(tmp_path: Path, mesh: Mesh, suffix: str, with_normals: bool) -> None:
    normals = mesh.V / np.linalg.norm(mesh.V, axis=1, keepdims=True)
    cloud = PointCloud(mesh.V, normals if with_normals else None)
    write_point_cloud(tmp_path / f"a{suffix}", cloud)
    back = heat_igl.read_point_cloud(tmp_path / f"a{suffix}")
    assert np.array_equal(back.P, cloud.P)
    assert (back.normals is None) == (not with_normals)
    assert not with_normals or np.array_equal(back.normals, cloud.normals)


def test_point_clouds_go_to_formats_with_a_writer(tmp_path: Path, mesh: Mesh) -> None:
    with pytest.raises(MeshError, match=r"unknown extension '.pcd'; the formats are .ply, .obj, .xyz, .npy"):
        write_point_cloud(tmp_path / "a.pcd", PointCloud(mesh.V))
