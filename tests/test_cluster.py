"""Batches: the same bits as a solver's, bad meshes apart, and nothing lost or done twice when processes die."""

import contextlib
import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import scipy.io
from conftest import killed_at

import heat_igl
from heat_igl import Mesh, cluster
from heat_igl.cluster.collection import items
from heat_igl.cluster.store import Store, rows_per_block
from heat_igl.cluster.worker import Task, work
from heat_igl.errors import BatchError
from heat_igl.geodesic import SolverChoice

pytest.importorskip("distributed")
zarr = pytest.importorskip("zarr")

FAN = Mesh(
    [[0, 0, 0], [0, 0, 1], [1, 0, 0.5], [-1, 0.3, 0.5], [0, 1, 0.5], [0.4, -1, 0.5], [-0.7, -0.7, 0.5]],
    [[0, 1, k] for k in range(2, 7)],
)


def expected(mesh: Mesh, source_sets, dtype="float32", **options):
    return SolverChoice.of(**options).on(mesh).distances(source_sets).astype(dtype)


@pytest.mark.parametrize("options", [{}, {"method": "sweep"}, {"dtype": "float64", "boundary": "average"}])
def test_the_bits_are_those_of_a_solver(client, tmp_path, options):
    meshes = {"ball": heat_igl.shapes.icosphere(2), "fan": FAN, "tile": heat_igl.shapes.grid(12)}
    report = cluster.distances(meshes, "all", tmp_path / "store", client=client, **options)
    assert [row.status for row in report.rows] == ["done"] * 3
    for name, mesh in meshes.items():
        group = zarr.open_group(tmp_path / "store" / name, mode="r")
        n = mesh.n_vertices
        np.testing.assert_array_equal(group["source_vertex"][:], np.arange(n))
        np.testing.assert_array_equal(group["distance"][:], expected(mesh, range(n), **options))
        of_heat = {name: value for name, value in options.items() if name not in ("dtype", "method")}
        if of_heat or options.get("method") == "heat":
            assert group.attrs["t"] == pytest.approx(heat_igl.HeatMethodSolver(mesh, **of_heat).t, rel=1e-15)


def test_source_sets_and_farthest_points(client, tmp_path):
    mesh = heat_igl.shapes.icosphere(3)
    sets = [[3, 5, 9], 7, [1, 2]]
    cluster.distances([mesh], sets, tmp_path / "sets", client=client)
    group = zarr.open_group(tmp_path / "sets" / "000000", mode="r")
    np.testing.assert_array_equal(group["source_vertex"][:], [3, 5, 9, 7, 1, 2])
    np.testing.assert_array_equal(group["source_row"][:], [0, 0, 0, 1, 2, 2])
    np.testing.assert_array_equal(group["distance"][:], expected(mesh, sets))
    cluster.distances([mesh], "farthest:5", tmp_path / "far", client=client)
    group = zarr.open_group(tmp_path / "far" / "000000", mode="r")
    points = heat_igl.farthest_points(heat_igl.GeodesicSolver(mesh), 5)
    np.testing.assert_array_equal(group["source_vertex"][:], points)
    np.testing.assert_array_equal(group["distance"][:], expected(mesh, points))


def bad_files(folder: Path) -> set[str]:
    """Files that are no meshes, or no files, beside one that is; returns their names."""
    heat_igl.write_mesh(folder / "good.off", heat_igl.shapes.icosphere(1))
    text = (folder / "good.off").read_text()
    (folder / "truncated.off").write_text(text[: len(text) // 2])
    (folder / "nonfinite.off").write_text("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n")
    (folder / "outside.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")
    (folder / "empty.ply").write_bytes(b"")
    (folder / "directory.stl").mkdir()
    (folder / "dangling.obj").symlink_to(folder / "nowhere.obj")
    return {path.name for path in folder.iterdir()} - {"good.off"}


def test_bad_files_are_rows_and_the_others_go_on(client, tmp_path):
    folder = tmp_path / "meshes"
    folder.mkdir()
    bad = bad_files(folder)
    heat_igl.write_mesh(folder / "fan.off", FAN)
    (folder / "below").mkdir()
    heat_igl.write_mesh(folder / "below" / "tile.obj", heat_igl.shapes.grid(4))
    (folder / "below" / "._tile.obj").write_bytes(b"left out")
    report = cluster.distances(cluster.folder(folder), [0], tmp_path / "store", client=client)
    assert {Path(row.mesh).name for row in report.failed} == bad
    assert all(row.reason for row in report.failed)
    reasons = {Path(row.mesh).name: row.reason for row in report.failed}
    assert "not finite" in reasons["nonfinite.off"] or "nan" in reasons["nonfinite.off"]
    assert "7" in reasons["outside.off"]
    assert {row.name for row in report.rows if row.status == "done"} == {"good.off", "fan.off", "below%2Ftile.obj"}
    assert cluster.report(tmp_path / "store") == report
    assert cluster.read_distances(tmp_path / "store", "below/tile.obj").shape == (1, 25)
    assert f"3 of {len(bad) + 3} meshes done, {len(bad)} failed" in report.to_markdown()


def test_files_of_points_are_clouds(client, tmp_path, caplog):
    """As those that are passed as objects; arrays in a folder are not taken."""
    cloud = heat_igl.PointCloud(heat_igl.shapes.icosphere(2).V)
    folder = tmp_path / "clouds"
    folder.mkdir()
    for name in ("a.xyz", "b.ply", "c.npy"):
        heat_igl.write_point_cloud(folder / name, cloud)
    (folder / "bad.xyz").write_text("0 0 0\n1 0\n")
    report = cluster.distances(cluster.folder(folder), [0, [3, 5]], tmp_path / "store", client=client)
    assert {row.name for row in report.rows if row.status == "done"} == {"a.xyz"}
    # A PLY file without faces may be a damaged mesh.
    assert [row.name for row in report.failed] == ["b.ply", "bad.xyz"]
    assert "--points" in report.failed[0].reason
    assert caplog.text.count(str(folder / "bad.xyz")) == 1
    found = zarr.open_group(tmp_path / "store")["a.xyz"]["distance"][:]
    np.testing.assert_array_equal(found, expected(cloud, [0, [3, 5]]))
    as_points = cluster.distances(
        cluster.folder(folder, points=True), [0, [3, 5]], tmp_path / "points", client=client, points=True
    )
    assert [row.status for row in as_points.rows] == ["done", "done", "failed"]


def test_a_source_that_a_mesh_does_not_have_is_a_row(client, tmp_path):
    report = cluster.distances({"fan": FAN, "ball": heat_igl.shapes.icosphere(2)}, [9], tmp_path / "s", client=client)
    (row,) = report.failed
    assert row.name == "fan"
    assert "9" in row.reason
    assert "7 vertices" in row.reason


def chunk_times(store: Path) -> dict[str, int]:
    """When each chunk of distances was written."""
    return {str(path): path.stat().st_mtime_ns for path in store.glob("*/distance/c/*/*") if path.suffix != ".partial"}


def test_only_what_is_missing_is_computed_again(client, tmp_path):
    mesh = heat_igl.shapes.icosphere(3)  # 642 vertices: 11 blocks
    store = tmp_path / "store"
    before = cluster.distances({"ball": mesh}, "all", store, client=client)
    first = zarr.open_group(store / "ball", mode="r")["distance"][:]
    chunk = [store / "ball" / "distance" / "c" / str(block) / "0" for block in range(11)]
    chunk[3].rename(chunk[3].with_suffix(".partial"))  # not finished
    chunk[5].write_bytes(b"half of it")  # damaged
    bits = bytearray(chunk[6].read_bytes())
    bits[1000] ^= 1
    chunk[6].write_bytes(bits)
    chunk[7].unlink()  # lost
    times = chunk_times(store)
    after = cluster.distances({"ball": mesh}, "all", store, client=client)
    changed = {path for path, written in chunk_times(store).items() if times.get(path) != written}
    # Of the turned bit only the codec knows; a lost or cut chunk is seen at once.
    assert {Path(path).parent.name for path in changed} == {"3", "5", "6", "7"}
    np.testing.assert_array_equal(zarr.open_group(store / "ball", mode="r")["distance"][:], first)
    assert after == before


def test_long_rows_lie_in_several_chunks(client, tmp_path, monkeypatch):
    monkeypatch.setattr("heat_igl.cluster.store._ENTRIES", 2000)
    mesh = heat_igl.shapes.icosphere(3)  # 642 vertices: 3 chunks for 8 rows, the last one padded
    store = tmp_path / "store"
    before = cluster.distances({"ball": mesh}, range(18), store, client=client)  # and the last block
    np.testing.assert_array_equal(zarr.open_group(store / "ball", mode="r")["distance"][:], expected(mesh, range(18)))
    assert len(chunk_times(store)) == 9
    (store / "ball" / "distance" / "c" / "1" / "2").unlink()
    assert Store(store).group("ball").missing() == [1]
    assert cluster.distances({"ball": mesh}, range(18), store, client=client) == before
    np.testing.assert_array_equal(zarr.open_group(store / "ball", mode="r")["distance"][:], expected(mesh, range(18)))


def begin_fan(store: Path, attributes) -> None:
    solver = {"method": "auto", "tolerance": 1e-05}
    made = Store(store, {"sources": "0 4", "dtype": "float32", "normalize": False, "solver": solver})
    made.begin("fan", [np.array([0]), np.array([4])], 7, "float32", attributes)


def test_a_group_that_a_crash_left_half_made_is_made_anew(client, tmp_path):
    """Wherever it happened: nothing counts before all is there."""
    store = tmp_path / "store"
    whole = cluster.distances({"fan": FAN}, [0, 4], tmp_path / "whole", client=client)
    attributes = Store(tmp_path / "whole").attributes("fan")
    with killed_at(1000) as written:
        begin_fan(store, attributes)
    n_files = len(written)
    shutil.rmtree(store)
    assert n_files >= 7  # metadata of two groups and three arrays, two chunks
    for crash in range(n_files):
        shutil.rmtree(store, ignore_errors=True)
        with killed_at(crash) as written:
            begin_fan(store, attributes)
        assert len(written) == crash
        assert not (store / "fan" / "zarr.json").exists()
        assert cluster.distances({"fan": FAN}, [0, 4], store, client=client).rows == whole.rows
        np.testing.assert_array_equal(zarr.open_group(store / "fan", mode="r")["distance"][:], expected(FAN, [0, 4]))


def test_the_format_of_a_store_is_one_that_can_be_read(client, tmp_path):
    store = tmp_path / "store"
    cluster.distances({"fan": FAN}, [0, 4], store, client=client)
    root = zarr.open_group(store, mode="r+")
    begun = root.attrs["heat_igl"]
    assert begun["format"] == 4
    root.update_attributes({"heat_igl": {**begun, "format": 3}})
    message = r"has format 3, and this version of heat_igl reads 4: name a new store, or continue it with"
    with pytest.raises(ValueError, match=message):
        cluster.distances({"fan": FAN}, [0, 4], store, client=client)
    with pytest.raises(ValueError, match=message):
        cluster.report(store)


def test_a_worker_that_does_not_see_the_store_ends_the_batch(tmp_path):
    (item,) = items({"fan": FAN})
    task = Task(item, tmp_path / "elsewhere", None, "float32", False, {})
    with pytest.raises(BatchError, match=r"a worker cannot open store .*elsewhere.* Name a folder that .* share"):
        work(task)


WORKERS = """
import os
from heat_igl import cluster

def found(dask_worker):
    named = "HEAT_IGL_NUM_THREADS", "MALLOC_TRIM_THRESHOLD_"
    return "profile" in dask_worker.periodic_callbacks, *map(os.environ.get, named)

if __name__ == "__main__":
    with cluster.connected(n_workers=1) as client:
        print(*client.run(found).values(), os.environ.get("HEAT_IGL_NUM_THREADS"))
        client.restart()
    print(os.environ.get("HEAT_IGL_NUM_THREADS"))
"""


@pytest.mark.slow
def test_workers_have_settings_of_their_own(tmp_path):
    """Not Dask's profiler, which takes 5 % of a worker, nor its malloc, which makes a solver half as slow again.

    And none of what is theirs stays behind in the process that started them.
    """
    script = tmp_path / "workers.py"
    script.write_text(WORKERS)
    environ = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    result = subprocess.run([sys.executable, script], env=environ, capture_output=True, text=True, check=True)
    assert result.stdout == "(False, '1', None) None\nNone\n"


def test_a_mesh_that_changed_is_computed_again(client, tmp_path):
    path = tmp_path / "mesh.off"
    heat_igl.write_mesh(path, heat_igl.shapes.grid(6))
    cluster.distances([path], [0], tmp_path / "store", client=client)
    times = chunk_times(tmp_path / "store")
    cluster.distances([path], [0], tmp_path / "store", client=client)
    assert chunk_times(tmp_path / "store") == times
    heat_igl.write_mesh(path, heat_igl.shapes.grid(7))
    (row,) = cluster.distances([path], [0], tmp_path / "store", client=client).rows
    assert row.n_vertices == heat_igl.shapes.grid(7).n_vertices
    mesh = heat_igl.read_mesh(path)
    got = zarr.open_group(tmp_path / "store" / "mesh.off", mode="r")["distance"][:]
    np.testing.assert_array_equal(got, expected(mesh, [0]))


def test_a_store_keeps_its_options(client, tmp_path):
    cluster.distances({"fan": FAN}, [0], tmp_path / "store", client=client)
    with pytest.raises(ValueError, match=r"was begun with sources='0', not '0 1'"):
        cluster.distances({"fan": FAN}, [0, 1], tmp_path / "store", client=client)
    with pytest.raises(ValueError, match="was begun with dtype='float32', not 'float64'"):
        cluster.distances({"fan": FAN}, [0], tmp_path / "store", client=client, dtype="float64")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "precious.txt").write_text("")
    with pytest.raises(ValueError, match="is not a zarr group of distances"):
        cluster.distances({"fan": FAN}, [0], tmp_path / "other", client=client)
    assert (tmp_path / "other" / "precious.txt").exists()
    zarr.open_group(tmp_path / "foreign", mode="w").create_group("data")
    with pytest.raises(ValueError, match="holds other data"):
        cluster.distances({"fan": FAN}, [0], tmp_path / "foreign", client=client)


@pytest.mark.parametrize("name", ["", ".", "..", "zarr.json"])
def test_a_name_that_would_overwrite_something_else_is_refused(client, tmp_path, name):
    """The group of a mesh replaces the folder of its name: here the store, its parent, or the metadata of the store."""
    with pytest.raises(ValueError, match=f"a mesh cannot be called '{name}' in a store: choose another name"):
        cluster.distances({"ball": heat_igl.shapes.icosphere(1), name: FAN}, [0], tmp_path / "store", client=client)
    cluster.distances({"ball": heat_igl.shapes.icosphere(1), "...": FAN}, [0], tmp_path / "store", client=client)


def test_a_mesh_too_large_for_its_worker_is_a_row(client, tmp_path, monkeypatch):
    # The workers are threads of this process.
    monkeypatch.setattr("heat_igl.cluster.worker.memory_for_solvers", lambda: 2**20)
    meshes = {"ball": heat_igl.shapes.icosphere(4), "fan": FAN}
    report = cluster.distances(meshes, [0], tmp_path / "store", client=client)
    (row,) = report.failed
    assert row.name == "ball"
    assert "use fewer workers, or workers with more memory" in row.reason
    monkeypatch.undo()
    assert not cluster.distances(meshes, [0], tmp_path / "store", client=client).failed


def test_blocks_are_whole_blocks_of_right_hand_sides():
    for n in (3, 1000, 30_000, 200_000, 10_000_000):
        rows = rows_per_block(n)
        assert rows % 8 == 0
        assert 8 <= rows <= 64
        assert rows * n <= max(2**22, 8 * n)


def test_a_full_disk_ends_with_one_error_and_can_be_resumed(client, tmp_path):
    ball = heat_igl.shapes.icosphere(2)  # 162 vertices: 3 blocks
    meshes = {f"ball {i}": Mesh((1 + i) * ball.V, ball.F) for i in range(3)}
    disk, full = tmp_path / "disk", OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with (
        pytest.raises(BatchError, match=r"disk.*cannot be written: No space left on device.*free some space"),
        killed_at(30, full),
    ):
        cluster.distances(meshes, "all", disk / "store", client=client)
    begun = chunk_times(disk / "store")
    assert 0 < len(begun) < 9
    # A mesh whose metadata the full disk cut off counts as damaged and is made again.
    begun_meshes = {row.name for row in cluster.report(disk / "store").rows if row.n_sources}
    intact = {
        path
        for name in begun_meshes
        for block in set(range(3)) - set(Store(disk / "store").group(name).missing())
        for path in begun
        if f"/{name}/distance/c/{block}/" in path
    }
    report = cluster.distances(meshes, "all", disk / "store", client=client)
    assert [row.status for row in report.rows] == ["done"] * 3
    after = chunk_times(disk / "store")
    assert intact
    assert all(after[path] == begun[path] for path in intact)
    undisturbed = cluster.distances(meshes, "all", tmp_path / "undisturbed", client=client)
    assert [row.checksum for row in report.rows] == [row.checksum for row in undisturbed.rows]


class Processes:
    """A scheduler and workers as processes of their own."""

    def __init__(self, folder: Path) -> None:
        self.scheduler_file = folder / "scheduler.json"
        self.log = (folder / "processes.log").open("a")
        self.children: list[subprocess.Popen[bytes]] = []

    def start(self, *arguments: str) -> subprocess.Popen[bytes]:
        child = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]],
            stdout=self.log, stderr=self.log, start_new_session=True,
        )  # fmt: skip
        self.children.append(child)
        return child

    def scheduler(self) -> subprocess.Popen[bytes]:
        self.scheduler_file.unlink(missing_ok=True)
        child = self.start(
            "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
            "--scheduler-file", str(self.scheduler_file),
        )  # fmt: skip
        wait_until(self.scheduler_file.exists)
        return child

    def worker(self) -> subprocess.Popen[bytes]:
        return self.start(
            "dask_worker", "--scheduler-file", str(self.scheduler_file), "--nthreads", "1", "--no-nanny",
            "--no-dashboard", "--death-timeout", "20",
        )  # fmt: skip

    @property
    def address(self) -> str:
        return str(json.loads(self.scheduler_file.read_text())["address"])

    def close(self) -> None:
        for child in self.children:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()
        self.log.close()


def wait_until(condition, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


@pytest.fixture
def processes(tmp_path):
    running = Processes(tmp_path)
    yield running
    running.close()


@pytest.mark.slow
def test_killed_processes_lose_nothing_and_repeat_nothing(processes, tmp_path):
    """Kill a worker, then the scheduler, then the client; what was finished is not touched again, and the bits are
    those of a solver that nobody disturbed."""
    folder, store = tmp_path / "meshes", tmp_path / "store"
    folder.mkdir()
    ball = heat_igl.shapes.icosphere(5)
    meshes = {f"ball{i}.ply": Mesh(ball.V * [1, 1, 1 + i / 4], ball.F) for i in range(4)}
    for name, mesh in meshes.items():
        heat_igl.write_mesh(folder / name, mesh)
    source_file = tmp_path / "sources.txt"
    source_file.write_text("\n".join(map(str, range(256))))
    command = [
        sys.executable, "-m", "heat_igl", "batch", str(folder), "--store", str(store), "--sources", str(source_file),
    ]  # fmt: skip

    def client(*arguments):
        return subprocess.Popen(
            [*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
        )

    scheduler = processes.scheduler()
    victim, _ = processes.worker(), processes.worker()
    batch = client("--scheduler", processes.address)
    wait_until(lambda: len(chunk_times(store)) >= 2)
    victim.kill()
    at_worker = chunk_times(store)
    wait_until(lambda: len(chunk_times(store)) >= len(at_worker) + 2)
    scheduler.kill()
    _, errors = batch.communicate(timeout=120)
    assert batch.returncode == 1
    assert "the cluster is lost; what is finished stays" in errors
    assert "Traceback" not in errors
    at_scheduler = chunk_times(store)

    batch = client("--workers", "2")
    wait_until(lambda: len(chunk_times(store)) >= len(at_scheduler) + 2)
    os.killpg(batch.pid, signal.SIGKILL)
    batch.communicate()
    at_client = chunk_times(store)
    assert 6 <= len(at_client) < 16, "nothing was left to do: the test is too small for this machine"

    batch = client("--workers", "2")
    output, errors = batch.communicate(timeout=120)
    assert batch.returncode == 0, errors
    assert "4 of 4 meshes done" in output
    at_end = chunk_times(store)
    assert len(at_end) == 16
    for before in (at_worker, at_scheduler, at_client):
        assert all(at_end[path] == written for path, written in before.items())
    for name, mesh in meshes.items():
        got = zarr.open_group(store / name, mode="r")["distance"][:]
        np.testing.assert_array_equal(got, expected(mesh, range(256)))


def test_a_mesh_that_kills_its_workers_is_a_row():
    from distributed import Future, KilledWorker

    from heat_igl.cluster import batch

    future, task = Mock(spec=Future), Mock()
    future.result.side_effect = KilledWorker("task", None, 3)
    run = batch._Run(Mock(), Mock(), Mock())
    assert not run._collect(future, task)
    reason = "the workers that tried it died: out of memory, or a crash in a library"
    run._store.fail.assert_called_once_with(task.item.name, task.item.label, reason)


def test_a_data_set_is_symmetric_normalized_and_exact(client, tmp_path, capsys, monkeypatch):
    cli = pytest.importorskip("heat_igl.cli", exc_type=ImportError)
    monkeypatch.setattr(cluster, "connected", lambda *_: contextlib.nullcontext(client))
    meshes = {"a.off": heat_igl.shapes.icosphere(2), "sub/b.ply": heat_igl.shapes.grid(6)}
    (tmp_path / "in" / "sub").mkdir(parents=True)
    for name, mesh in meshes.items():
        heat_igl.write_mesh(tmp_path / "in" / name, mesh)
    arguments = ["dataset", str(tmp_path / "in"), str(tmp_path / "out"), "--normalize", "--dtype=float16"]
    assert cli.run([*arguments, "--format=mat"]) == 0
    assert re.search(r"all pairs on 2 meshes: about \d+ s with \d+ workers, and \d+ MB", capsys.readouterr().err)
    for name, mesh in meshes.items():
        found = scipy.io.loadmat(tmp_path / "out" / f"{name}.mat")["distance"]
        assert (found == found.T).all()
        expected = heat_igl.reference.exact(mesh, 7) / np.sqrt(mesh.measures.sum())
        np.testing.assert_allclose(found[7], expected, rtol=2**-11)  # the rounding of float16
    report = cluster.distances([Mesh(1e5 * mesh.V, mesh.F)], [0], tmp_path / "far", client=client, dtype="float16")
    assert re.match(r"distances up to .* are no float16: normalize them, or take float32", report.rows[0].reason)
