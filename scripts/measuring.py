"""Truths, errors and times, as several scripts take them."""

from __future__ import annotations

import hashlib
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from heat_igl import Mesh
from heat_igl.typing import FloatArray
from heat_igl.validation import metrics

Query = Callable[[int], FloatArray]


# Truths and peers.


def exact_distance(mesh: Mesh, source: int, cache: Path | None) -> tuple[FloatArray, float]:
    """Exact distance by pygeodesic, and the seconds that it took; `cache` is a folder that keeps both."""
    key = hashlib.sha256(mesh.V.tobytes() + mesh.F.tobytes() + bytes([0]) + str(source).encode()).hexdigest()[:24]
    kept = cache / f"{key}.npz" if cache else None
    if kept and kept.exists():
        with np.load(kept) as data:
            return data["distance"], float(data["seconds"])
    import pygeodesic.geodesic

    start = time.perf_counter()
    algorithm = pygeodesic.geodesic.PyGeodesicAlgorithmExact(mesh.V, mesh.F)
    distance = np.asarray(algorithm.geodesicDistances(np.array([source]))[0])
    seconds = time.perf_counter() - start
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        np.savez(kept, distance=distance, seconds=seconds)
    return distance, seconds


def potpourri3d(mesh: Mesh) -> Query:
    """The heat method of potpourri3d with its defaults, factored."""
    import potpourri3d

    return potpourri3d.MeshHeatMethodDistanceSolver(mesh.V, mesh.F).compute_distance


def drawn_sources(mesh: Mesh, seeds: range) -> list[int]:
    """One vertex of a face for each seed."""
    return [int(np.random.default_rng(seed).choice(np.unique(mesh.F))) for seed in seeds]


# Errors.


def mean_error(distance: FloatArray, truth: FloatArray) -> float:
    """Mean of |d - truth| / truth over the vertices at a positive finite distance, as a fraction."""
    return float(_relative(distance, truth).mean())


def errors(distance: FloatArray, truth: FloatArray) -> tuple[float, float, float]:
    """Mean and 99th percentile of the relative error, and the largest error in largest distances; in percent."""
    relative = 100 * _relative(distance, truth)
    there = np.isfinite(truth) & (truth > 0)
    largest = 100 * np.abs(distance[there] - truth[there]).max() / truth[there].max()
    return float(relative.mean()), float(np.percentile(relative, 99)), float(largest)


def _relative(distance: FloatArray, truth: FloatArray) -> FloatArray:
    error = metrics.relative_error(distance, truth)
    return error[~np.isnan(error)]


# Times.


def seconds_of(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def median_seconds(call: Callable[[], object], repeats: int) -> float:
    """Median over `repeats` calls, after one that warms up."""
    call()
    return statistics.median(seconds_of(call) for _ in range(repeats))


def bandwidth(size: int = 2**28, repetitions: int = 7) -> float:
    """Bytes read and written per second by one thread that copies a large array; the best of some repetitions."""
    source, target = np.ones(size // 8), np.zeros(size // 8)
    return 2 * size / min(seconds_of(lambda: np.copyto(target, source)) for _ in range(repetitions))
