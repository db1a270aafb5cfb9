"""What the tests share: meshes, workers, and stores that a crash cuts off.

Real meshes come from the pymeshlab wheel; all others are made by the shapes and the zoo of the package, from seeds.
"""

import contextlib
import importlib
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import heat_igl
from heat_igl.reference import guarded, native
from heat_igl.validation.zoo import SHAPES

ROOT = Path(__file__).resolve().parents[1]
# For processes: the package under test, wherever they run.
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(Path(heat_igl.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]),
}


def run_python(*arguments: str | Path, cwd: Path, timeout: float = 120) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own, with the package under test."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=cwd, env=ENVIRONMENT, stdin=subprocess.DEVNULL,
        capture_output=True, text=True, timeout=timeout, check=False,
    )  # fmt: skip


def wheel_path(name: str) -> Path:
    """A sample mesh of the pymeshlab wheel, found without importing pymeshlab (which needs OpenGL libraries)."""
    spec = importlib.util.find_spec("pymeshlab")
    if spec is None or spec.origin is None:
        pytest.skip("pymeshlab is not installed, and its sample meshes with it")
    return Path(spec.origin).parent / "tests" / "sample_meshes" / name


def zoo(name: str) -> heat_igl.Mesh:
    """A shape of the zoo."""
    return next(shape.make() for shape in SHAPES if shape.name == name)


def perturbed(mesh: heat_igl.Mesh, amount: float = 0.15, seed: int = 0) -> heat_igl.Mesh:
    """The same with inner vertices moved at random, by at most `amount` of the shortest edge: no symmetry is left."""
    rng = np.random.default_rng(seed)
    offset = rng.uniform(-1, 1, mesh.V.shape) * amount * mesh.edge_lengths.min()
    offset[mesh.boundary] = 0
    return heat_igl.Mesh(mesh.V + offset, mesh.F)


def flat_perturbed(mesh: heat_igl.Mesh, amount: float = 0.3, seed: int = 0) -> heat_igl.Mesh:
    """A mesh of z = 0, its inner vertices moved in their plane."""
    return heat_igl.Mesh(perturbed(mesh, amount, seed).V * [1, 1, 0], mesh.F)


def two_halves(n: int) -> heat_igl.Mesh:
    """A square of n by n cells, its inner vertices moved in the plane, but for those at x = 1/2."""
    grid = heat_igl.shapes.grid(n)
    V, inner = grid.V.copy(), ~grid.boundary & (grid.V[:, 0] != 0.5)
    V[inner, :2] += np.random.default_rng(0).uniform(-0.25 / n, 0.25 / n, (int(inner.sum()), 2))
    return heat_igl.Mesh(V, grid.F)


def relative_error(d: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """|d - truth| / truth at the vertices with a positive finite truth."""
    there = (truth > 0) & np.isfinite(truth)
    return np.abs(d[there] - truth[there]) / truth[there]


def mean_error(d: np.ndarray, truth: np.ndarray) -> float:
    """The mean of `relative_error`."""
    return float(relative_error(d, truth).mean())


def pygeodesic_distance(mesh: heat_igl.Mesh, source: int) -> np.ndarray:
    """Exact distance (n,) by pygeodesic."""
    pytest.importorskip("pygeodesic")
    return native.pygeodesic_exact(mesh.V, mesh.F, np.array([source]), mesh.components)["distance"]


@pytest.fixture
def in_this_process(monkeypatch):
    """Native reference solvers without the child process that guards them, which takes most of their time."""

    def call(function, arrays, parameters=None, **_):
        module, name = function.split(":")
        return guarded.Reply(dict(getattr(importlib.import_module(module), name)(**arrays, **(parameters or {}))), None)

    monkeypatch.setattr(guarded, "call", call)


class KilledError(Exception):
    """In place of a signal: from some write on, nothing reaches the disk."""


@contextlib.contextmanager
def killed_at(crash: int, error: Exception | None = None):
    """Let `crash` files of a zarr store be written and nothing more; yields the list of what was written."""
    zarr = pytest.importorskip("zarr")
    written: list[str] = []
    plain = zarr.storage.LocalStore.set

    async def set_or_die(self, key, value):
        if len(written) == crash:
            partial = self.root / f"{key}.partial"
            partial.parent.mkdir(parents=True, exist_ok=True)
            partial.write_bytes(b"half of it")
            raise error or KilledError
        written.append(key)
        await plain(self, key, value)

    with pytest.MonkeyPatch.context() as patch, contextlib.suppress(KilledError):
        patch.setattr(zarr.storage.LocalStore, "set", set_or_die)
        yield written


@pytest.fixture(scope="session")
def client():
    """Two workers, as threads of this process: real ones are started where processes have to die."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0") as local,
        distributed.Client(local) as connected,
    ):
        yield connected


@pytest.fixture(scope="session")
def cow():
    return heat_igl.read_mesh(wheel_path("cow.obj"))


@pytest.fixture(scope="session")
def bunny():
    return heat_igl.read_mesh(wheel_path("bunny.obj"))


@pytest.fixture(scope="session")
def sphere():
    """A sphere without symmetries, of 2562 vertices."""
    return perturbed(heat_igl.shapes.icosphere(4))


@pytest.fixture(scope="session")
def solver(sphere):
    return heat_igl.HeatMethodSolver(sphere)
