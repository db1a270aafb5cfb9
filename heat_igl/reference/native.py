"""The native reference solvers, each called in the way that gives the right result. They run in the guarded child.

Every function takes arrays that were validated, and the component (n,) of each vertex. It returns the distance with the
seconds for the part that could be kept between sources (``precompute_seconds``) and for the rest (``solve_seconds``),
summed over the components that hold a source. Loading the library is not counted.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from heat_igl.typing import FloatArray, IntArray

__all__ = [
    "gdist_exact",
    "igl_exact",
    "igl_heat",
    "meshlab_border",
    "meshlab_front",
    "meshlab_heat",
    "potpourri3d_heat",
    "potpourri3d_marching",
    "pygeodesic_exact",
]

# The exact solvers compare areas and volumes with multiples of a length, so that in large units they drop wavefronts
# that matter: with lengths divided by a thousand the cow is wrong by 0.2 %. With edges of about a thousand units
# all thresholds are below rounding. A power of two keeps every bit.
_EDGE_OF_EXACT = 1024.0

# MeshLab stops its front at half the bounding box's diagonal unless told otherwise, and leaves 0 beyond.
_NO_CUTOFF = 1e30


def _binary_scale(V: FloatArray, F: IntArray, edge: float) -> float:
    """The power of two that brings the mean edge nearest to `edge`."""
    mean = float(np.linalg.norm(V[F] - V[np.roll(F, 1, axis=1)], axis=2).mean())
    return float(2.0 ** np.round(np.log2(edge / mean)))


_Solve = Callable[..., dict[str, Any]]


def _by_components(solve: _Solve) -> _Solve:
    """Solve on each component that holds a source: solvers fail at vertices without faces and on other components."""

    @wraps(solve)
    def whole(
        V: FloatArray, F: IntArray, sources: IntArray, components: IntArray | None = None, **options: Any
    ) -> dict[str, Any]:
        if components is None:
            return solve(V, F, sources, **options)
        found: dict[str, Any] = {"distance": np.full(len(V), np.inf), "precompute_seconds": 0.0, "solve_seconds": 0.0}
        found["distance"][sources] = 0.0  # also if no face uses the source
        for label in np.unique(components[sources]):
            inside = components == label
            faces = F[inside[F[:, 0]]]
            if len(faces):
                number = np.cumsum(inside) - 1
                part = solve(V[inside], number[faces], number[sources[inside[sources]]], **options)
                found["distance"][inside] = part["distance"]
                for cost in ("precompute_seconds", "solve_seconds"):
                    found[cost] += part[cost]
        return found

    return whole


def _outcome(distance: Any, start: float, ready: float, end: float) -> dict[str, Any]:
    return {
        "distance": np.asarray(distance, dtype=np.float64),
        "precompute_seconds": ready - start,
        "solve_seconds": end - ready,
    }


@_by_components
def pygeodesic_exact(V: FloatArray, F: IntArray, sources: IntArray) -> dict[str, Any]:
    """Exact distance by pygeodesic (Mitchell, Mount and Papadimitriou 1987, Kirsanov's implementation)."""
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    start = time.perf_counter()
    scale = _binary_scale(V, F, _EDGE_OF_EXACT)
    # It prints an error message and returns None.
    with contextlib.redirect_stdout(io.StringIO()) as said:
        solver = PyGeodesicAlgorithmExact(V * scale, F)
        ready = time.perf_counter()
        distance, _ = solver.geodesicDistances(sources)
    end = time.perf_counter()
    if distance is None:
        raise ValueError(said.getvalue())
    return _outcome(distance / scale, start, ready, end)


@_by_components
def gdist_exact(V: FloatArray, F: IntArray, sources: IntArray) -> dict[str, Any]:
    """Exact distance by tvb-gdist (the same implementation)."""
    import gdist

    start = time.perf_counter()
    scale = _binary_scale(V, F, _EDGE_OF_EXACT)
    positions, faces, seeds = V * scale, F.astype(np.int32), sources.astype(np.int32)
    ready = time.perf_counter()
    distance = gdist.compute_gdist(positions, faces, source_indices=seeds)
    return _outcome(distance / scale, start, ready, time.perf_counter())


@_by_components
def igl_exact(V: FloatArray, F: IntArray, sources: IntArray) -> dict[str, Any]:
    """Exact distance by libigl: the length of the path that the same implementation traces back from each vertex."""
    import igl

    start = time.perf_counter()
    scale = _binary_scale(V, F, _EDGE_OF_EXACT)
    positions, targets = V * scale, np.arange(len(V))
    ready = time.perf_counter()
    # Without keywords the targets land in the argument for source faces, and the result is empty.
    distance = igl.exact_geodesic(V=positions, F=F, VS=sources, VT=targets)
    return _outcome(distance / scale, start, ready, time.perf_counter())


@_by_components
def igl_heat(
    V: FloatArray, F: IntArray, sources: IntArray, t: float | None = None, intrinsic_delaunay: bool = False
) -> dict[str, Any]:
    """The heat method of libigl, on the mesh as it is."""
    import igl

    start = time.perf_counter()
    data = igl.HeatGeodesicsData()
    data.use_intrinsic_delaunay = intrinsic_delaunay
    if t is None:
        igl.heat_geodesics_precompute(V, F, data)
    else:
        igl.heat_geodesics_precompute(V, F, t, data)
    ready = time.perf_counter()
    distance = igl.heat_geodesics_solve(data, sources)
    return _outcome(distance, start, ready, time.perf_counter())


@_by_components
def potpourri3d_heat(
    V: FloatArray, F: IntArray, sources: IntArray, t_coef: float = 1.0, use_robust: bool = True
) -> dict[str, Any]:
    """The heat method of geometry-central through potpourri3d, on the mesh as it is."""
    import potpourri3d

    start = time.perf_counter()
    solver = potpourri3d.MeshHeatMethodDistanceSolver(V, F, t_coef=t_coef, use_robust=use_robust)
    ready = time.perf_counter()
    distance = solver.compute_distance_multisource(sources)
    return _outcome(distance, start, ready, time.perf_counter())


@_by_components
def potpourri3d_marching(V: FloatArray, F: IntArray, sources: IntArray) -> dict[str, Any]:
    """Fast marching of geometry-central through potpourri3d."""
    import potpourri3d

    start = time.perf_counter()
    solver = potpourri3d.MeshFastMarchingDistanceSolver(V, F)
    ready = time.perf_counter()
    # A curve of one point without barycentric coordinates denotes a vertex.
    distance = np.ravel(solver.compute_distance([[(vertex, [])] for vertex in sources.tolist()]))
    return _outcome(distance, start, ready, time.perf_counter())


@_by_components
def meshlab_front(V: FloatArray, F: IntArray, sources: IntArray) -> dict[str, Any]:
    """MeshLab's front from selected vertices, without the cutoff."""
    import pymeshlab

    cutoff = pymeshlab.PureValue(_NO_CUTOFF)
    return _filtered(
        V, F, sources, "compute_scalar_by_geodesic_distance_from_selection_per_vertex", {"maxdistance": cutoff}
    )


@_by_components
def meshlab_border(V: FloatArray, F: IntArray, _: IntArray) -> dict[str, Any]:
    """MeshLab's front from all vertices of the border, which are the sources."""
    return _filtered(V, F, None, "compute_scalar_by_border_distance_per_vertex", {})


@_by_components
def meshlab_heat(V: FloatArray, F: IntArray, sources: IntArray, m: float = 1.0) -> dict[str, Any]:
    """MeshLab's heat method, in single precision."""
    name = "compute_scalar_by_heat_geodesic_distance_from_selection_per_vertex"
    return _filtered(V, F, sources, name, {"m": m})


def _filtered(
    V: FloatArray, F: IntArray, sources: IntArray | None, name: str, parameters: dict[str, Any]
) -> dict[str, Any]:
    import pymeshlab

    start = time.perf_counter()
    # Centred in the bounding box and with edges of about 1, the mesh survives the filters that go through float32.
    scale = _binary_scale(V, F, 1.0)
    positions = (V - (V.min(axis=0) + V.max(axis=0)) / 2) * scale
    marks = np.zeros(len(V))
    if sources is not None:
        marks[sources] = 1.0
    # A new mesh set for every call: the heat filter caches factors under the parameter m alone.
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(positions, F, v_scalar_array=marks))
    if sources is not None:
        # Selecting vertices avoids the start point, which is one only, and is snapped to the nearest vertex.
        meshes.compute_selection_by_condition_per_vertex(condselect="(q > 0.5)")
        if meshes.current_mesh().selected_vertex_number() != len(sources):
            raise ValueError("MeshLab did not select the sources")
    ready = time.perf_counter()
    meshes.apply_filter(name, **parameters)
    end = time.perf_counter()
    distance = meshes.current_mesh().vertex_scalar_array()
    if sources is not None and np.array_equal(distance, marks):
        raise ValueError("MeshLab's filter failed without saying so and left the old scalars in place")
    return _outcome(distance / scale, start, ready, end)
