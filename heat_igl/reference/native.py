"""The native reference solvers, each called in the way that gives the right result. They run in the guarded child.

Each is called with validated arrays, the component (n,) of each vertex and options, and returns the distance with the
seconds for the part that could be kept between sources (``precompute_seconds``) and for the rest (``solve_seconds``),
summed over the components that hold a source. Loading the library is not counted. What is written here for each is the
first part, on one component, which returns the second.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable
from functools import partial, wraps
from typing import Any

import numpy as np

from heat_igl.typing import FloatArray, IntArray

# The exact solvers compare areas and volumes with multiples of a length, so that in large units they drop wavefronts
# that matter: with lengths divided by a thousand the cow is wrong by 0.2 %. With edges of about a thousand units
# all thresholds are below rounding. A power of two keeps every bit.
_EDGE_OF_EXACT = 1024.0
# With edges of about 1, and centred, a mesh survives the filters of MeshLab that go through float32.
_EDGE_OF_MESHLAB = 1.0

# MeshLab stops its front at half the bounding box's diagonal unless told otherwise, and leaves 0 beyond.
_NO_CUTOFF = 1e30

_Solve = Callable[[], Any]


def _by_components(prepare: Callable[..., _Solve], edge: float | None = None) -> Callable[..., dict[str, Any]]:
    """Solve on each component that holds a source: solvers fail at vertices without faces and on other components.

    With `edge` a component is scaled by the power of two that brings the mean edge nearest to it.
    """

    @wraps(prepare)
    def whole(
        V: FloatArray, F: IntArray, sources: IntArray, components: IntArray | None = None, **options: Any
    ) -> dict[str, Any]:
        component = np.zeros(len(V), np.int64) if components is None else components
        distance = np.full(len(V), np.inf)
        distance[sources] = 0.0  # also if no face uses the source
        seconds = np.zeros(2)
        for label in np.unique(component[sources]):
            inside = component == label
            faces = F[inside[F[:, 0]]]
            if not len(faces):
                continue
            number = np.cumsum(inside) - 1
            mean = float(np.linalg.norm(V[faces] - V[np.roll(faces, 1, axis=1)], axis=2).mean())
            scale = 1.0 if edge is None else float(2.0 ** np.round(np.log2(edge / mean)))
            # pygeodesic prints an error message and returns None.
            with contextlib.redirect_stdout(io.StringIO()) as said:
                times = [time.perf_counter()]
                solve = prepare(V[inside] * scale, number[faces], number[sources[inside[sources]]], **options)
                times.append(time.perf_counter())
                found = solve()
                times.append(time.perf_counter())
            if found is None:
                raise ValueError(said.getvalue())
            distance[inside] = found / scale
            seconds += np.diff(times)
        return {"distance": distance, "precompute_seconds": float(seconds[0]), "solve_seconds": float(seconds[1])}

    return whole


@partial(_by_components, edge=_EDGE_OF_EXACT)
def pygeodesic_exact(V: FloatArray, F: IntArray, sources: IntArray) -> _Solve:
    """Exact distance by pygeodesic (Mitchell, Mount and Papadimitriou 1987, Kirsanov's implementation)."""
    from pygeodesic.geodesic import PyGeodesicAlgorithmExact

    solver = PyGeodesicAlgorithmExact(V, F)
    return lambda: solver.geodesicDistances(sources)[0]


@partial(_by_components, edge=_EDGE_OF_EXACT)
def gdist_exact(V: FloatArray, F: IntArray, sources: IntArray) -> _Solve:
    """Exact distance by tvb-gdist (the same implementation)."""
    import gdist

    faces, seeds = F.astype(np.int32), sources.astype(np.int32)
    return lambda: gdist.compute_gdist(V, faces, source_indices=seeds)


@partial(_by_components, edge=_EDGE_OF_EXACT)
def igl_exact(V: FloatArray, F: IntArray, sources: IntArray) -> _Solve:
    """Exact distance by libigl: the length of the path that the same implementation traces back from each vertex."""
    import igl

    targets = np.arange(len(V))
    # Without keywords the targets land in the argument for source faces, and the result is empty.
    return lambda: igl.exact_geodesic(V=V, F=F, VS=sources, VT=targets)


@_by_components
def igl_heat(
    V: FloatArray, F: IntArray, sources: IntArray, t: float | None = None, intrinsic_delaunay: bool = False
) -> _Solve:
    """The heat method of libigl, on the mesh as it is."""
    import igl

    data = igl.HeatGeodesicsData()
    data.use_intrinsic_delaunay = intrinsic_delaunay
    igl.heat_geodesics_precompute(V, F, *([] if t is None else [t]), data)
    return lambda: igl.heat_geodesics_solve(data, sources)


@_by_components
def potpourri3d_heat(
    V: FloatArray, F: IntArray, sources: IntArray, t_coef: float = 1.0, use_robust: bool = True
) -> _Solve:
    """The heat method of geometry-central through potpourri3d, on the mesh as it is."""
    import potpourri3d

    solver = potpourri3d.MeshHeatMethodDistanceSolver(V, F, t_coef=t_coef, use_robust=use_robust)
    return lambda: solver.compute_distance_multisource(sources)


@partial(_by_components, edge=_EDGE_OF_MESHLAB)
def meshlab_front(V: FloatArray, F: IntArray, sources: IntArray) -> _Solve:
    """MeshLab's front from selected vertices, without the cutoff."""
    import pymeshlab

    cutoff = pymeshlab.PureValue(_NO_CUTOFF)
    name = "compute_scalar_by_geodesic_distance_from_selection_per_vertex"
    return _filtered(V, F, sources, name, maxdistance=cutoff)


@partial(_by_components, edge=_EDGE_OF_MESHLAB)
def meshlab_border(V: FloatArray, F: IntArray, _: IntArray) -> _Solve:
    """MeshLab's front from all vertices of the border, which are the sources."""
    return _filtered(V, F, None, "compute_scalar_by_border_distance_per_vertex")


@partial(_by_components, edge=_EDGE_OF_MESHLAB)
def meshlab_heat(V: FloatArray, F: IntArray, sources: IntArray, m: float = 1.0) -> _Solve:
    """MeshLab's heat method, in single precision."""
    return _filtered(V, F, sources, "compute_scalar_by_heat_geodesic_distance_from_selection_per_vertex", m=m)


def _filtered(V: FloatArray, F: IntArray, sources: IntArray | None, name: str, **parameters: Any) -> _Solve:
    import pymeshlab

    positions = V - (V.min(axis=0) + V.max(axis=0)) / 2
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

    def solve() -> Any:
        meshes.apply_filter(name, **parameters)
        distance = meshes.current_mesh().vertex_scalar_array()
        if sources is not None and np.array_equal(distance, marks):
            raise ValueError("MeshLab's filter failed without saying so and left the old scalars in place")
        return distance

    return solve
