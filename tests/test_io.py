"""Reading and writing files: what a valid file means, that nothing is lost on the way, and that damage is named."""

import gzip
import importlib.util
import os
import re
import stat
import struct
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from conftest import wheel_path
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import heat_igl
from heat_igl import AccuracyWarning, Mesh, MeshError, PointCloud, cli, read_attributes, read_mesh, shapes, write_mesh
from heat_igl.io import files, write_point_cloud

needs_meshio = pytest.mark.skipif(importlib.util.find_spec("meshio") is None, reason="needs meshio")
MESH, MSH, VTU = (pytest.param(each, marks=needs_meshio) for each in (".mesh", ".msh", ".vtu"))
SURFACE_FORMATS = [".off", ".obj", ".ply", MESH, MSH, VTU]

V4 = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
F4 = np.array([[0, 1, 2], [0, 1, 3]])


def solid() -> Mesh:
    """Two tetrahedra that share a triangle."""
    return Mesh(np.concatenate([V4, [[1 / 3, 2 / 3, np.e]]]), [[0, 1, 2, 3], [1, 2, 3, 4]])


def save(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def same(mesh: Mesh, V: object, F: object) -> bool:
    """Equal to the last bit, signs of zero included."""
    V = np.asarray(V, np.float64)
    return mesh.V.tobytes() == V.tobytes() and np.array_equal(mesh.F, np.asarray(F))


# --- round trips ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("extension", [".mesh", ".msh", VTU])
def test_tetrahedra_come_back_exactly(tmp_path, extension):
    write_mesh(tmp_path / f"a{extension}", solid())
    assert same(read_mesh(tmp_path / f"a{extension}"), solid().V, solid().F)


def test_stl_keeps_the_triangles_but_not_the_numbering(tmp_path):
    mesh = Mesh(np.concatenate([shapes.grid(4).V[::-1] / 7, [[9, 9, 9]]]), 24 - shapes.grid(4).F)
    write_mesh(tmp_path / "a.stl", mesh)
    back = read_mesh(tmp_path / "a.stl")
    assert np.array_equal(back.V[back.F], mesh.V[mesh.F])
    assert back.n_vertices == 25  # the one that no face uses is gone
    first = np.unique(back.F, return_index=True)[1]
    assert (np.diff(first) > 0).all()  # numbered in the order of their first use


@pytest.mark.parametrize("extension", SURFACE_FORMATS)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(numbers=st.lists(st.floats(-1e50, 1e50, allow_subnormal=True), min_size=6, max_size=6))
def test_any_coordinate_comes_back_exactly(tmp_path, extension, numbers):
    V = np.array([[0, 0, 0], [1, 0, 0], numbers[:3], numbers[3:]])
    write_mesh(tmp_path / f"a{extension}", Mesh(V, F4))
    assert same(read_mesh(tmp_path / f"a{extension}"), V, F4)


@pytest.mark.parametrize("extension", [".ply", VTU])
def test_attributes_come_back_bit_for_bit(tmp_path, extension):
    mesh = shapes.grid(3)
    distance = np.linspace(0, np.pi, 16)
    distance[[3, 7]] = np.inf
    odd = np.array([-0.0, np.nan, -np.inf, 5e-324, np.finfo(float).max, np.pi, 1 / 3, -1e-300] * 2)
    several = np.stack([distance, odd, -odd], axis=1)
    label = mesh.components
    write_mesh(
        tmp_path / f"a{extension}", mesh, distance=distance, odd=odd, several=several, one=odd[:, None], label=label
    )
    back = read_attributes(tmp_path / f"a{extension}")
    assert set(back) == {"distance", "odd", "several", "one", "label"}
    for name, values in (("distance", distance), ("odd", odd), ("several", several), ("one", odd[:, None])):
        assert back[name].shape == values.shape
        assert back[name].dtype == np.float64
        assert np.ascontiguousarray(back[name]).tobytes() == np.ascontiguousarray(values).tobytes()
    assert np.array_equal(back["label"], label)
    assert same(read_mesh(tmp_path / f"a{extension}"), mesh.V, mesh.F)


@needs_meshio
def test_vtu_attributes_on_tetrahedra(tmp_path):
    write_mesh(tmp_path / "a.vtu", solid(), distance=[0, 1, 2, np.inf, 4])
    assert read_attributes(tmp_path / "a.vtu")["distance"].tolist() == [0, 1, 2, np.inf, 4]


# --- OFF --------------------------------------------------------------------------------------------------------------

VERTICES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
FACES = "3 0 1 2\n3 0 1 3\n"


@pytest.mark.parametrize(
    "content",
    [
        "OFF\n4 2 0\n" + VERTICES + FACES,
        "OFF 4 2 0\n" + VERTICES + FACES,
        "OFF 4 2\n" + VERTICES + FACES,
        "4 2 0\n" + VERTICES + FACES,
        "off\n4 2 0\n" + VERTICES + FACES,
        "OFF4 2 0\n" + VERTICES + FACES,
        "\ufeffOFF\n4 2 0\n" + VERTICES + FACES,
        "# made by hand\n\nOFF # really\n# counts\n4 2 0 # yes\n\n"
        + VERTICES.replace("\n", " # v\n\n")
        + "#\n"
        + FACES,
        "COFF\n4 2 0\n" + VERTICES.replace("\n", " 255 0 0 255\n") + FACES,
        "NOFF\n4 2 0\n" + VERTICES.replace("\n", " 0 0 1\n") + FACES,
        "STCNOFF\n4 2 0\n" + VERTICES.replace("\n", " 0 0 1 .5 .5 .5 1 0 0\n") + FACES,
        "OFF\n4 2 0\n" + VERTICES + "3 0 1 2 255 0 0\n3 0 1 3 0.5 0.5 0.5 1\n",
        "OFF\n4 2 0\n" + VERTICES + "3 0 1 2 7\n3 0 1 3\n",
        ("OFF\n4 2 0\n" + VERTICES + FACES).replace("\n", "\r\n"),
        ("OFF\n4 2 0\n" + VERTICES + FACES).replace("\n", "\r"),
        ("OFF\n4 2 0\n" + VERTICES + FACES).replace(" ", "\t  ").rstrip(),
        "OFF\n4 2 0\n" + VERTICES.replace("1", "+1.0E+00") + FACES,
    ],
)
def test_variants_of_off_are_read_alike(tmp_path, content):
    assert same(read_mesh(save(tmp_path / "a.off", content)), V4, F4)


# --- OBJ --------------------------------------------------------------------------------------------------------------

OBJ_VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


@pytest.mark.parametrize(
    "content",
    [
        OBJ_VERTICES + "f 1 2 3\nf 1 2 4\n",
        OBJ_VERTICES + "f 1/1 2/2 3/3\nf 1/1 2/2 4/4\n",
        OBJ_VERTICES + "f 1//1 2//2 3//3\nf 1//1 2//2 4//1\n",
        OBJ_VERTICES + "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\nf 1 2/1 4//1\n",
        OBJ_VERTICES + "f -4 -3 -2\nf -4 2 -1\n",
        OBJ_VERTICES + "f -4/-1/-1 -3/-1/-1 -2/-1/-1\nf -4 2 -1\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -3 -1\n",
        "f 1 2 3\nf 1 2 4\n" + OBJ_VERTICES,
        "v 0 0 \\\n 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 \\\r\n2 \\  \n 3\nf 1 2 4\n",
        OBJ_VERTICES.replace("\n", " 1.0\n") + "f 1 2 3\nf 1 2 4\n",
        OBJ_VERTICES.replace("\n", " 0.5 0.25 1\n", 2) + "f 1 2 3\nf 1 2 4\n",
        "# f 1 2 99\nmtllib a/b.mtl\no thing\ng a b\n"
        + OBJ_VERTICES
        + "usemtl x/y\ns off\nf 1 2 3 # yes\nl 1 2\np 1\nf 1 2 4\n",
        ("  " + OBJ_VERTICES + "\tf 1 2 3\nf 1 2 4\n").replace("\n", " \r\n"),
    ],
)
def test_variants_of_obj_are_read_alike(tmp_path, content):
    assert same(read_mesh(save(tmp_path / "a.obj", content)), V4, F4)


def test_obj_line_numbers_count_comments_and_continuations(tmp_path):
    path = save(tmp_path / "a.obj", "# one\n\n" + OBJ_VERTICES + "f 1 \\\n 2 3\n# nine\nf 1 2 44/5\n")
    with pytest.raises(
        MeshError, match=r"a.obj, line 10 \(f 1 2 44/5\): there is no vertex 44, the file has 4 vertices"
    ):
        read_mesh(path)
    with pytest.raises(MeshError, match=r"a.obj, line 4 \(v 1 0 zero\): 'zero' is not a number"):
        read_mesh(save(path, path.read_text().replace("v 1 0 0", "v 1 0 zero")))
    assert read_mesh(save(path, path.read_text().replace("zero", "0").replace("44", "4"))).n_faces == 2


# --- PLY --------------------------------------------------------------------------------------------------------------

PLY_TYPES = dict(zip("char uchar short ushort int uint float double".split(), "bBhHiIfd", strict=True))


@pytest.mark.parametrize("order", ["<", ">", ""])
@pytest.mark.parametrize("kind", PLY_TYPES)
@pytest.mark.parametrize("mixed", [False, True])
def test_ply_types_orders_and_further_elements(tmp_path, order, kind, mixed):
    """A camera before the vertices, a list and other types among their properties, and edges at the end."""
    name = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    index = kind if kind not in ("float", "double") else "int"
    header = f"ply\r\nformat {name} 1.0\ncomment made by hand\nobj_info 1\nelement camera 1\nproperty float fov\n"
    header += "property list ushort double matrix\nelement vertex 4\nproperty short before\nproperty double x\n"
    header += f"property float y\nproperty char z\nproperty {kind} value\n"
    header += "property list uchar short neighbours\nproperty uchar after\n" if mixed else "property uchar after\n"
    header += f"element face 2\nproperty uchar flag\nproperty list {index} {index} vertex_index\nproperty double area\n"
    header += "element edge 1\nproperty int a\nproperty int b\nend_header\n"

    def pack(types, *values):
        if order:
            return struct.pack(order + types, *values)
        return (" ".join(repr(value) for value in values) + " ").encode()

    def end():
        return b"" if order else b"\n"

    body = pack("fH2d", 60, 2, 0.5, 0.25) + end()
    for i, row in enumerate(V4.tolist()):
        body += pack("hdfb" + PLY_TYPES[kind], -i, row[0], row[1], int(row[2]), 100 + i)
        body += (pack("B" + "h" * i, i, *range(i)) if mixed else b"") + pack("B", 200 + i) + end()
    item = PLY_TYPES[index]
    for corners in ([0, 1, 2], [0, 1, 3, 2]) if mixed else F4.tolist():
        body += pack("B" + item * (1 + len(corners)) + "d", 1, len(corners), *corners, 0.5) + end()
    path = save(tmp_path / "a.ply", header.encode() + body + pack("2i", 0, 1) + end())
    assert same(read_mesh(path), V4, [[0, 1, 2], [0, 1, 3], [0, 3, 2]] if mixed else F4)
    attributes = read_attributes(path)
    assert {name: values.tolist() for name, values in attributes.items()} == {
        "before": [0, -1, -2, -3],
        "value": [100, 101, 102, 103],
        "after": [200, 201, 202, 203],
    }
    assert attributes["after"].dtype == np.uint8
    assert attributes["value"].dtype == np.dtype(PLY_TYPES[kind])


# --- VTU and meshio ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("failure", ["exit", "print", "exception"])
def test_every_failure_of_meshio_is_a_mesh_error(tmp_path, monkeypatch, capfd, failure):
    meshio = pytest.importorskip("meshio")
    write_mesh(tmp_path / "a.vtu", shapes.grid(1))
    real = meshio.vtu.read

    def failing(path):
        if failure == "exception":
            raise ZeroDivisionError("inside")
        print("something is wrong", file=sys.stderr)
        if failure == "exit":
            sys.exit(1)
        return real(path)

    monkeypatch.setattr(meshio.vtu, "read", failing)
    said = "inside" if failure == "exception" else "something is wrong"
    with pytest.raises(MeshError, match=rf"a.vtu: meshio .*{said}"):
        read_mesh(tmp_path / "a.vtu")
    assert capfd.readouterr() == ("", "")
    monkeypatch.undo()
    assert read_mesh(tmp_path / "a.vtu").n_faces == 2


def test_vtu_polygons_and_quadrilaterals(tmp_path):
    meshio = pytest.importorskip("meshio")
    meshio.vtu.write(str(tmp_path / "a.vtu"), meshio.Mesh(V4, [("quad", [[0, 1, 3, 2]]), ("line", [[0, 1]])]))
    assert same(read_mesh(tmp_path / "a.vtu"), V4, [[0, 1, 3], [0, 3, 2]])


# --- files that are cut short -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("extension", "lost"), [(".off", 2), (".ply", 2), (".obj", 1), (".obj", 2), (".obj", 4)])
def test_a_last_face_that_may_be_cut_is_a_warning(tmp_path, extension, lost):
    """Of "4 8 9 10 11", the beginning "4 8 9 10 1" is a face as well, and in OBJ, so is "9 10 11"."""
    vertices = "".join(f"{i} {i * i} 0\n" for i in range(12))
    header = "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    counted = vertices + "8 0 1 2 3 4 5 6 7\n4 8 9 10 11\n"
    content = {
        ".off": "OFF\n12 2 0\n" + counted,
        ".ply": header + counted,
        ".obj": "v " + vertices.replace("\n", "\nv ")[:-2] + "f 1 2 3 4 5 6 7 8\nf 9 10 11 12\n",
    }[extension]
    assert read_mesh(save(tmp_path / f"a{extension}", content)).n_vertices == 12
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_mesh(save(tmp_path / f"b{extension}", content[:-lost]))
    assert re.search(rf"b{extension}, last line \(.*\): no line break ends it", str(caught[-1].message))


@pytest.mark.parametrize("extension", SURFACE_FORMATS)
def test_no_file_is_cut_without_a_word(tmp_path, extension):
    """On a closed surface, the vertices of the last faces belong to other faces, too."""
    write_mesh(tmp_path / f"whole{extension}", heat_igl.shapes.torus(12, 9))
    whole = (tmp_path / f"whole{extension}").read_bytes()
    path = tmp_path / f"a{extension}"
    for tenth in range(1, 10):
        path.write_bytes(whole[: len(whole) * tenth // 10])
        with pytest.raises((MeshError, AccuracyWarning), match=f"a{extension}"):  # warnings are errors here
            heat_igl.as_mesh(path)


def test_an_obj_file_that_lost_faces_is_a_warning_and_one_without_any_an_error(tmp_path):
    write_mesh(tmp_path / "a.obj", shapes.grid(8))
    lines = (tmp_path / "a.obj").read_text().splitlines(keepends=True)
    with pytest.warns(AccuracyWarning, match=r"b.obj: no face uses \d+ of the 81 vertices, .*cut short"):
        read_mesh(save(tmp_path / "b.obj", "".join(lines[:140])))
    cut = save(tmp_path / "c.obj", "".join(lines[:58]))
    for read in (read_mesh, heat_igl.as_mesh):
        with pytest.raises(MeshError, match=r"c.obj: the file has no faces .* read_point_cloud, or --points"):
            read(cut)
    assert heat_igl.read_point_cloud(cut).n_vertices == 58


# --- replacing files --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stage", ["writer", "replace"])
@pytest.mark.parametrize("before", [b"precious", None])
@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt("stopped")])
def test_failed_write_leaves_everything_as_it_was(tmp_path, monkeypatch, stage, before, error):
    path = tmp_path / "a.off"
    if before is not None:
        path.write_bytes(before)

    def half(temporary, *_):
        temporary.write_bytes(b"OFF\n4")
        raise error

    def no_replace(*_):
        raise error

    if stage == "writer":
        form = files._FORMATS[".off"]
        monkeypatch.setitem(files._FORMATS, ".off", form._replace(write=half))
    else:
        monkeypatch.setattr(Path, "replace", no_replace)
    if isinstance(error, OSError):
        with pytest.raises(MeshError, match=r"a.off cannot be written: No space left on device"):
            write_mesh(path, shapes.grid(1))
    else:
        with pytest.raises(KeyboardInterrupt, match="stopped"):
            write_mesh(path, shapes.grid(1))
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == ([("a.off", before)] if before else [])
    monkeypatch.undo()
    write_mesh(path, shapes.grid(1))
    assert read_mesh(path).n_vertices == 4
    assert len(list(tmp_path.iterdir())) == 1


def test_refused_attribute_leaves_the_old_file(tmp_path):
    path = save(tmp_path / "a.ply", "precious")
    with pytest.raises(MeshError, match=r"distance must have shape \(4,\)"):
        write_mesh(path, shapes.grid(1), distance=[1, 2, 3])
    with pytest.raises(MeshError, match=r"^PLY would hold two properties named a_1"):
        write_mesh(path, shapes.grid(1), a=np.ones((4, 2)), a_1=np.ones(4))
    assert path.read_text() == "precious"
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(os.name != "posix", reason="permissions and links of POSIX")
def test_links_and_permissions_are_kept(tmp_path):
    (tmp_path / "real").mkdir()
    target = save(tmp_path / "real" / "b.off", "old")
    target.chmod(0o640)
    (tmp_path / "a.off").symlink_to(target)
    write_mesh(tmp_path / "a.off", shapes.grid(1))
    assert (tmp_path / "a.off").is_symlink()
    assert read_mesh(target).n_vertices == 4
    assert stat.S_IMODE(target.stat().st_mode) == 0o640
    ordinary = save(tmp_path / "ordinary", "")
    write_mesh(tmp_path / "new.off", shapes.grid(1))
    assert (tmp_path / "new.off").stat().st_mode == ordinary.stat().st_mode


# --- real meshes ------------------------------------------------------------------------------------------------------

REAL = {
    "airplane.obj": (7017, 10796),
    "bone.ply": (1872, 3022),
    "bunny.obj": (28088, 56172),
    "bunny10k_textured.obj": (5051, 9999),
    "colored_airplane.ply": (7017, 10796),
    "cow.obj": (2904, 5804),
    "cube.obj": (8, 12),
    "rangemaps/face000.ply": (85849, 166259),
}


@pytest.mark.filterwarnings("ignore:.*no face uses")
@pytest.mark.parametrize("name", REAL)
def test_real_meshes_are_read_whole_and_written_back(tmp_path, name):
    mesh = read_mesh(wheel_path(name))
    assert (mesh.n_vertices, mesh.n_faces) == REAL[name]
    for extension in (".off", ".obj", ".ply"):
        write_mesh(tmp_path / f"a{extension}", mesh)
        assert same(read_mesh(tmp_path / f"a{extension}"), mesh.V, mesh.F)


@pytest.fixture(scope="module")
def mesh():
    return heat_igl.shapes.torus(9, 6)


# --- gzip -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".mesh", ".msh"])
def test_a_packed_file_is_the_plain_one(tmp_path, mesh, suffix):
    packed, plain = tmp_path / f"a{suffix}.gz", tmp_path / f"a{suffix}"
    heat_igl.write_mesh(packed, mesh)
    heat_igl.write_mesh(plain, mesh)
    assert gzip.decompress(packed.read_bytes()) == plain.read_bytes()
    back = heat_igl.read_mesh(packed)
    assert (back.V.tobytes(), back.F.tobytes()) == (mesh.V.tobytes(), mesh.F.tobytes())


def test_packed_files_have_the_same_bytes_each_time(tmp_path, mesh):
    for name in ("a.PLY.GZ", "b.ply.gz"):
        heat_igl.write_mesh(tmp_path / name, mesh, distance=mesh.V[:, 0])
    assert (tmp_path / "a.PLY.GZ").read_bytes() == (tmp_path / "b.ply.gz").read_bytes()
    assert (tmp_path / "a.PLY.GZ").read_bytes()[4:8] == bytes(4)  # the time of packing, in seconds
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "a.PLY.GZ")["distance"], mesh.V[:, 0])


# --- GIFTI and FreeSurfer ---------------------------------------------------------------------------------------------


def test_a_cortex_comes_back_in_single_precision_to_nibabel_too(tmp_path, mesh):
    nibabel = pytest.importorskip("nibabel")
    read_geometry = nibabel.freesurfer.read_geometry
    distance = np.where(mesh.V[:, 0] > 1, np.inf, mesh.V[:, 0])
    heat_igl.write_mesh(tmp_path / "a.gii.gz", mesh, distance=distance)
    image = nibabel.GiftiImage.from_bytes(gzip.decompress((tmp_path / "a.gii.gz").read_bytes()))
    assert np.array_equal(heat_igl.as_mesh(image).F, mesh.F)
    assert np.array_equal(heat_igl.read_attributes(tmp_path / "a.gii.gz")["distance"], distance.astype(np.float32))
    for name in ("lh.pial.surf.gii", "lh.white", "rh.inflated"):
        heat_igl.write_mesh(tmp_path / name, mesh)
        back = heat_igl.read_mesh(tmp_path / name)
        theirs = image.agg_data(("pointset", "triangle")) if ".gii" in name else read_geometry(tmp_path / name)
        for V, F in (theirs, (back.V, back.F)):
            assert np.array_equal(V, mesh.V.astype(np.float32))
            assert np.array_equal(F, mesh.F)


def test_gifti_without_a_surface_lists_its_arrays(tmp_path, mesh):
    nibabel = pytest.importorskip("nibabel")
    shape = nibabel.gifti.GiftiDataArray(np.zeros(3, np.float32), "NIFTI_INTENT_SHAPE")
    nibabel.GiftiImage(darrays=[shape]).to_filename(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"holds no surface, .* its arrays are shape"):
        heat_igl.read_mesh(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"^GIFTI holds one number per vertex, and normal has several"):
        heat_igl.write_mesh(tmp_path / "b.gii", mesh, normal=mesh.V)
    assert not (tmp_path / "b.gii").exists()


def test_scalars_on_two_surfaces_are_written_to_cifti(tmp_path, mesh):
    nibabel = pytest.importorskip("nibabel")
    path, x = tmp_path / "a.dscalar.nii", np.where(mesh.V[:, 2] > 0, mesh.V[:, 0], np.nan)
    maps = {"cortex_left x": x, "cortex_left y": mesh.V[:, 1], "cortex_right x": x[::-1], "cortex_right y": x[::-1]}
    heat_igl.write_attributes(path, maps)
    axes = nibabel.load(path).header
    assert list(axes.get_axis(0).name) == ["x", "y"]
    assert [name for name, _, _ in axes.get_axis(1).iter_structures()] == [
        "CIFTI_STRUCTURE_CORTEX_LEFT",
        "CIFTI_STRUCTURE_CORTEX_RIGHT",
    ]
    assert len(axes.get_axis(1)) == mesh.n_vertices + (mesh.V[:, 2] > 0).sum()
    found = heat_igl.read_attributes(path)
    assert found.keys() == maps.keys()
    for name, values in maps.items():
        np.testing.assert_array_equal(found[name], values.astype(np.float32))
    for wrong, said in (
        ({}, "no maps"),
        ({"cortex_left x": x, "cortex_right y": x}, "maps of cortex_right are y, and not x"),
        ({"heat x": x}, "^'heat' is no part of a brain"),
        ({"cortex_left x": mesh.V}, "several numbers per vertex"),
    ):
        with pytest.raises(MeshError, match=said):
            heat_igl.write_attributes(tmp_path / "b.dscalar.nii", wrong)
    assert not (tmp_path / "b.dscalar.nii").exists()


def test_maps_without_a_surface_are_read_and_matrices_take_them(tmp_path, mesh, capsys, monkeypatch):
    nibabel = pytest.importorskip("nibabel")
    cifti2 = nibabel.cifti2
    monkeypatch.chdir(tmp_path)
    n = mesh.n_vertices
    inside, parcel = mesh.V[:, 2] > mesh.V[:, 2].min(), (mesh.V[:, 0] > mesh.V[:, 0].mean()).astype(float)
    models = cifti2.BrainModelAxis.from_mask(inside, "cortex_left") + cifti2.BrainModelAxis.from_mask(
        np.ones(n, bool), "cortex_right"
    )
    names = cifti2.LabelAxis(["halves"], {i: (str(i), (1, 1, 1, 1)) for i in range(2)})
    values = np.concatenate([parcel[inside], 1 - parcel])[None].astype(np.float32)
    nibabel.Cifti2Image(values, header=(names, models)).to_filename("halves.dlabel.nii")
    maps = heat_igl.read_attributes("halves.dlabel.nii")
    np.testing.assert_array_equal(maps["cortex_left halves"], np.where(inside, parcel, np.nan))
    np.testing.assert_array_equal(maps["cortex_right halves"], 1 - parcel)
    heat_igl.write_attributes("inside.shape.gii", {"inside": inside})
    np.testing.assert_array_equal(nibabel.load("inside.shape.gii").darrays[0].data, inside)
    heat_igl.write_mesh("lh.ply", mesh)

    pytest.importorskip("typer")
    assert cli.run(["matrix", "lh.ply", "--parcels=halves.dlabel.nii", "--output=a.csv"]) == 1
    assert "name a map, as in halves.dlabel.nii::NAME (it has cortex_left halves" in capsys.readouterr().err
    options = ["--parcels=halves.dlabel.nii::cortex_left", "--region=inside.shape.gii", "--output=a.csv"]
    assert cli.run(["matrix", "lh.ply", *options]) == 0
    labels = np.where(inside, parcel, -1).astype(int)
    expected = heat_igl.parcel_distances(mesh, labels, region=inside)
    np.testing.assert_allclose(np.loadtxt("a.csv", delimiter=","), expected, rtol=1e-8)
    assert cli.run(["matrix", "lh.ply", "--radius=0.7", "--output=a.npz"]) == 0
    assert abs(scipy.sparse.load_npz("a.npz") - heat_igl.distances_within(mesh, 0.7)).nnz == 0
    from_mat, from_csv = lambda path: scipy.io.loadmat(path)["distance"], lambda path: np.loadtxt(path, delimiter=",")
    for name, load, rtol in (("b.npy", np.load, 0), ("b.mat", from_mat, 0), ("b.csv", from_csv, 1e-8)):
        assert cli.run(["matrix", "lh.ply", "--normalize", "--dtype=float64", f"--output={name}"]) == 0
        assert f"{n} by {n} distances: about" in capsys.readouterr().err
        rows = heat_igl.GeodesicSolver(mesh, tolerance=0).distances(range(n)) / np.sqrt(mesh.measures.sum())
        np.testing.assert_allclose(load(name), np.minimum(rows, rows.T), rtol=rtol)
    assert cli.run(["matrix", "lh.ply", "--radius=1", "--parcels=x", "--output=c.npz"]) == 1
    assert not Path("c.npz").exists()
    Path("cut.nii").write_bytes(b"cut")
    with pytest.raises(MeshError, match=r"cut.nii: nibabel finds no maps here"):
        heat_igl.read_attributes("cut.nii")


# --- point clouds -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".xyz", ".npy", ".xyz.gz", ".ply.gz"])
@pytest.mark.parametrize("with_normals", [False, True])
def test_point_clouds_come_back_exactly(tmp_path, mesh, suffix, with_normals):
    normals = mesh.V / np.linalg.norm(mesh.V, axis=1, keepdims=True)
    cloud = PointCloud(mesh.V, normals if with_normals else None)
    write_point_cloud(tmp_path / f"a{suffix}", cloud)
    back = heat_igl.read_point_cloud(tmp_path / f"a{suffix}")
    assert np.array_equal(back.P, cloud.P)
    assert (back.normals is None) == (not with_normals)
    assert not with_normals or np.array_equal(back.normals, cloud.normals)
