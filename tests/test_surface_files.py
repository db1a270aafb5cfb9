"""GIFTI and FreeSurfer surfaces, files packed by gzip, and point clouds: nothing is lost, and damage is named."""

import gzip
import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import heat_igl
from heat_igl import MeshError, PointCloud, cli
from heat_igl.io import write_point_cloud

needs_nibabel = pytest.mark.skipif(importlib.util.find_spec("nibabel") is None, reason="needs nibabel")
neuro = [pytest.param(name, marks=needs_nibabel) for name in ("lh.pial.surf.gii", "lh.white", "rh.inflated")]


@pytest.fixture(scope="module")
def mesh():
    return heat_igl.shapes.torus(9, 6)


def rewritten(path: Path, change: Callable[[bytes], bytes]) -> Path:
    path.write_bytes(change(path.read_bytes()))
    return path


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


@pytest.mark.parametrize("change", [lambda data: data[:-20], lambda _: b"v 0 0 0\n", lambda data: data[:40] + b"x"])
def test_a_damaged_packed_file_is_named(tmp_path, mesh, change):
    heat_igl.write_mesh(tmp_path / "a.obj.gz", mesh)
    with pytest.raises(MeshError, match=r"a.obj.gz cannot be unpacked .*damaged, cut short"):
        heat_igl.read_mesh(rewritten(tmp_path / "a.obj.gz", change))


# --- GIFTI and FreeSurfer ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", neuro)
def test_a_cortex_comes_back_in_single_precision(tmp_path, mesh, name):
    heat_igl.write_mesh(tmp_path / name, mesh)
    back = heat_igl.read_mesh(tmp_path / name)
    assert np.array_equal(back.V, mesh.V.astype(np.float32))
    assert np.array_equal(back.F, mesh.F)


@needs_nibabel
def test_nibabel_reads_what_is_written(tmp_path, mesh):
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
        ("a.gii", b"<GIFTI>", "nibabel cannot read this surface"),
        ("lh.pial", b"", "empty"),
        ("lh.pial", b"solid a", "nibabel cannot read this surface"),
    ],
)
def test_a_damaged_cortex_is_named(tmp_path, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=rf"{name}: .*{said}"):
        heat_igl.read_mesh(tmp_path / name)


@needs_nibabel
def test_gifti_without_a_surface_lists_its_arrays(tmp_path, mesh):
    import nibabel

    shape = nibabel.gifti.GiftiDataArray(np.zeros(3, np.float32), "NIFTI_INTENT_SHAPE")
    nibabel.GiftiImage(darrays=[shape]).to_filename(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"holds no surface, .* its arrays are shape"):
        heat_igl.read_mesh(tmp_path / "a.shape.gii")
    with pytest.raises(MeshError, match=r"GIFTI holds one number per vertex, and normal has several"):
        heat_igl.write_mesh(tmp_path / "b.gii", mesh, normal=mesh.V)
    assert not (tmp_path / "b.gii").exists()


@needs_nibabel
def test_scalars_on_two_surfaces_are_written_to_cifti(tmp_path, mesh):
    import nibabel

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
        ({"heat x": x}, "'heat' is no part of a brain"),
        ({"cortex_left x": mesh.V}, "several numbers per vertex"),
    ):
        with pytest.raises(MeshError, match=said):
            heat_igl.write_attributes(tmp_path / "b.dscalar.nii", wrong)
    assert not (tmp_path / "b.dscalar.nii").exists()


@needs_nibabel
def test_maps_without_a_surface_are_read_and_matrices_take_them(tmp_path, mesh, capsys, monkeypatch):
    import nibabel
    from nibabel import cifti2

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
    for name, load in (("b.npy", np.load), ("b.mat", lambda path: scipy.io.loadmat(path)["distance"])):
        assert cli.run(["matrix", "lh.ply", "--normalize", "--dtype=float64", f"--output={name}"]) == 0
        assert f"{n} by {n} distances: about" in capsys.readouterr().err
        rows = heat_igl.GeodesicSolver(mesh, tolerance=0).distances(range(n)) / np.sqrt(mesh.measures.sum())
        np.testing.assert_array_equal(load(name), np.minimum(rows, rows.T))
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
