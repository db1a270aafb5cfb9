"""Stores of distances, damaged on purpose: what is read is what was written, or an error names the file."""

import errno
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from conftest import killed_at

from heat_igl import distances_within, read_distances_within, shapes, write_distances_within
from heat_igl.errors import BatchError

zarr = pytest.importorskip("zarr")
pytest.importorskip("distributed")

from heat_igl import cluster  # noqa: E402
from heat_igl.cluster.store import locked  # noqa: E402
from heat_igl.windows import within_store  # noqa: E402

BALL = shapes.icosphere(2)


@pytest.fixture(scope="module")
def near(tmp_path_factory):
    """A sparse matrix in three chunks of each array."""
    path = tmp_path_factory.mktemp("within") / "near.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(within_store, "_CHUNK", 600)
        write_distances_within(path, BALL, 0.5)
    return path


def test_a_store_of_zeros_alone_can_be_read(tmp_path):
    """zarr does not write chunks that hold the fill value alone."""
    write_distances_within(tmp_path / "near.zarr", BALL, 1e-3)
    assert (read_distances_within(tmp_path / "near.zarr").toarray() == 0).all()


MESHES = {"ball": BALL, "strip": shapes.strip(40, 3)}


@pytest.fixture(scope="module")
def batch(client, tmp_path_factory):
    """Two meshes in several blocks each."""
    path = tmp_path_factory.mktemp("batch") / "store.zarr"
    report = cluster.distances(MESHES, range(100), path, client=client)
    assert [row.status for row in report.rows] == ["done", "done"]
    return path


def damaged(store: Path, generator: random.Random) -> tuple[list[Path], str]:
    """Damage a store somewhere; returns the files and what was done."""
    files = sorted(path for path in store.rglob("*") if path.is_file())
    file = generator.choice(files)
    data = bytearray(file.read_bytes())
    kind = generator.choice(["lost", "cut", "longer", "turned", "swapped"])
    match kind:
        case "lost":
            file.unlink()
        case "cut":
            file.write_bytes(data[: generator.randrange(len(data))])
        case "longer":
            file.write_bytes(data + data[:4])
        case "turned":
            for _ in range(generator.randint(1, 2)):
                data[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
            file.write_bytes(data)
        case "swapped":
            other = generator.choice([path for path in files if path.name == file.name and path != file] or [file])
            file.write_bytes(other.read_bytes())
            other.write_bytes(data)
            return [file, other], kind
    return [file], kind


def named(problem: str, files: list[Path], store: Path) -> bool:
    """Whether an error names a damaged file, or the folder of its mesh."""
    places = {str(place) for file in files for place in (file, store / file.relative_to(store).parts[0])}
    root = any(file == store / "zarr.json" for file in files) and str(store) in problem and "zarr.json" in problem
    return root or any(place in problem for place in places)


def damaged_copies(whole: Path, places: Path, seed: int) -> Iterator[tuple[Path, str, list[str]]]:
    """Copies of a store, what was done to each, and a list for the errors, of which each must name a damaged file."""
    generator, refused = random.Random(seed), 0
    for trial in range(50):
        store = shutil.copytree(whole, places / str(trial))
        files, kind = damaged(store, generator)
        problems: list[str] = []
        yield store, f"{kind} {files}", problems
        for problem in problems:
            assert named(problem, files, store), (kind, files, problem)
        refused += bool(problems)
    assert refused >= 35


@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_matrix_is_an_error_or_without_effect(near, tmp_path, seed):
    whole = read_distances_within(near)
    for store, harm, problems in damaged_copies(near, tmp_path, seed):
        try:
            found = read_distances_within(store)
        except ValueError as error:
            problems.append(str(error))
            continue
        for part in ("indptr", "indices", "data"):
            np.testing.assert_array_equal(getattr(found, part), getattr(whole, part), err_msg=harm)


def test_rows_beside_the_damage_are_read(near, tmp_path):
    store = shutil.copytree(near, tmp_path / "near")
    whole = read_distances_within(near)
    last = max((store / "data" / "c").iterdir(), key=lambda file: int(file.name))
    last.unlink()
    np.testing.assert_array_equal(read_distances_within(store, slice(0, 40)).toarray(), whole[:40].toarray())
    with pytest.raises(ValueError, match=rf"chunk {last} is missing: restore it from a copy, or write the distances"):
        read_distances_within(store)


@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_batch_is_an_error_or_without_effect(batch, tmp_path, seed):
    whole = {name: cluster.read_distances(batch, name) for name in MESHES}
    checksums = {row.name: row.checksum for row in cluster.report(batch).rows}
    for store, harm, problems in damaged_copies(batch, tmp_path, seed):
        try:
            for row in cluster.report(store).rows:
                assert row.checksum == (checksums[row.name] if row.status == "done" else "")
                problems += [row.reason] if row.status != "done" else []
        except ValueError as error:
            problems.append(str(error))
        for name, truth in whole.items():
            try:
                found = cluster.read_distances(store, name)
            except ValueError as error:
                problems.append(str(error))
            else:
                np.testing.assert_array_equal(found, truth, err_msg=harm)


def test_blocks_that_changed_places_are_found_before_the_mesh_is_done(batch, tmp_path):
    from heat_igl.cluster.store import Store

    store = shutil.copytree(batch, tmp_path / "store")
    Store(store).update("ball", {"status": "running", "chunks": []})
    first, second = (store / "ball" / "distance" / "c" / str(block) / "0" for block in (0, 1))
    data = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(data)
    assert Store(store).group("ball").missing() == [0, 1]
    with pytest.raises(ValueError, match=r"distances on ball in store .* are not complete \(running\): run the batch"):
        cluster.read_distances(store, "ball")


def test_one_of_two_writers_of_a_matrix_is_told(tmp_path, monkeypatch):
    path, plain = tmp_path / "near", within_store.blocks_within

    def with_a_second_writer(*arguments):
        for block in plain(*arguments):
            with pytest.raises(FileExistsError, match=r"near.partial exists: another process writes .*near, or was"):
                write_distances_within(path, BALL, 0.3)
            yield block

    monkeypatch.setattr(within_store, "blocks_within", with_a_second_writer)
    write_distances_within(path, BALL, 0.3)
    monkeypatch.undo()
    assert (read_distances_within(path) != distances_within(BALL, 0.3)).nnz == 0
    assert [entry.name for entry in tmp_path.iterdir()] == ["near"]


def test_a_store_that_appears_meanwhile_stays(tmp_path, monkeypatch):
    def late(*_):
        yield distances_within(BALL, 0.2)
        (tmp_path / "near").mkdir()

    monkeypatch.setattr(within_store, "blocks_within", late)
    with pytest.raises(FileExistsError, match="near was made by somebody else meanwhile"):
        write_distances_within(tmp_path / "near", BALL, 0.2)
    assert [entry.name for entry in tmp_path.iterdir()] == ["near"]


@pytest.mark.parametrize("moment", range(20))
def test_a_writer_that_is_killed_leaves_no_matrix(tmp_path, monkeypatch, moment):
    """From some write on nothing reaches the disk, and nothing is cleaned up."""
    path = tmp_path / "near"
    with monkeypatch.context() as patch, killed_at(moment) as written:
        patch.setattr(within_store, "_CHUNK", 500)
        patch.setattr(within_store, "_remove", lambda _: None)
        write_distances_within(path, BALL, 0.4)
    assert len(written) == moment
    assert not path.exists()
    with pytest.raises(ValueError, match="near holds no distances"):
        read_distances_within(path)
    with pytest.raises(FileExistsError, match=r"near.partial exists"):
        write_distances_within(path, BALL, 0.4)
    within_store._remove(tmp_path / "near.partial")
    write_distances_within(path, BALL, 0.4)
    assert (read_distances_within(path) != distances_within(BALL, 0.4)).nnz == 0


def test_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    plain = zarr.storage.LocalStore.set

    async def full(self, key, value):
        if "data/c" in key:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), key)
        await plain(self, key, value)

    monkeypatch.setattr(zarr.storage.LocalStore, "set", full)
    with pytest.raises(OSError, match="near cannot be written: No space left on device"):
        write_distances_within(tmp_path / "near", BALL, 0.4)
    assert list(tmp_path.iterdir()) == []


def test_one_of_two_batches_on_a_store_is_told(client, tmp_path):
    store = tmp_path / "store"
    code = "import sys, pathlib\nfrom heat_igl.cluster.store import locked\n"
    code += "with locked(pathlib.Path(sys.argv[1])):\n  print(1, flush=True)\n  input()"
    with subprocess.Popen(
        [sys.executable, "-c", code, str(store)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout.readline() == "1\n"
        with pytest.raises(BatchError, match=r"another batch writes to store .*store \(it holds .*store.lock\): wait"):
            cluster.distances(MESHES, [0], store, client=client)
        assert not store.exists()
        other.kill()
    # The lock ends with the process that held it.
    assert not cluster.distances(MESHES, [0], store, client=client).failed
    with locked(store), pytest.raises(BatchError, match="another batch writes"), locked(store):
        pass


def test_files_of_somebody_else_in_a_store_stay(client, tmp_path):
    store = tmp_path / "store"
    cluster.distances({"ball": BALL}, [0], store, client=client)
    (store / "strip").mkdir()
    (store / "strip" / "thesis.tex").write_text("precious")
    (row,) = cluster.distances(MESHES, [0], store, client=client).failed
    assert "holds thesis.tex, which no batch has written: move it elsewhere" in row.reason
    assert (store / "strip" / "thesis.tex").read_text() == "precious"
