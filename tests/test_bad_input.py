"""Bad input is a clear error, never a crash: hundreds of cases in one subprocess, so that a dying interpreter is seen.

The module is its own script: ``python tests/test_bad_input.py DIRECTORY`` runs every case and prints one line of JSON
each. A case without a pattern is a neighbour: the nearest valid input of its family, which must pass.
To add cases, write a generator of `Case` and add it to `GENERATORS`.
"""

import json
import os
import random
import re
import struct
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import run_python
from surfaces import moebius_strip, twice

import heat_igl
from heat_igl import (
    AccuracyWarning,
    GeodesicSolver,
    HeatMethodSolver,
    MeshError,
    OffsetSources,
    PointCloud,
    PolygonMesh,
    SignedHeatSolver,
    SurfaceCurve,
    SurfacePoints,
    curve_on,
    edge_curve,
    geodesic_distance,
    geodesic_path,
    karcher_mean,
    plots,
    shortest_paths,
    straighten,
    tangent_frames,
    trace_geodesic,
    validate,
)
from heat_igl.compat import potpourri3d, pygeodesic
from heat_igl.drawing.plots import plot_labels, write_line_drawing
from heat_igl.heat.steps import fitted_laplacian
from heat_igl.intrinsic import delaunay_refinement, intrinsic_triangulation
from heat_igl.io.by_nibabel import FREESURFER_SUFFIXES
from heat_igl.io.curves import read_polylines
from heat_igl.io.files import MESH_SUFFIXES
from heat_igl.linear import analyse
from heat_igl.operators import edge_length_operators, operators
from heat_igl.sampling import dual_triangulation, farthest_cells
from heat_igl.sources import source_set, vertex_sources
from heat_igl.validation import closed_forms, metrics

EXTENSIONS = ("off", "obj", "ply", "stl", "mesh", "msh", "vtu")


@dataclass(frozen=True)
class Case:
    """An input and what must come of it: an error whose message matches every pattern, or (no pattern) no error."""

    name: str
    run: Callable[[Path], Any]
    patterns: tuple[str, ...] = ()
    error: str = "MeshError"


# --- arrays -----------------------------------------------------------------------------------------------------------

V4 = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TRIANGLES = np.array([[0, 1, 2], [0, 1, 3]])
TETRAHEDRA = np.array([[0, 1, 2, 3]])
BALL = heat_igl.shapes.icosphere(1)
SOLVER = HeatMethodSolver(BALL)


def changed(array: np.ndarray, at: tuple[int, int | slice], value: Any) -> np.ndarray:
    array = array.copy()
    array[at] = value
    return array


def changed_in(n: int, i: int, matrix: np.ndarray) -> np.ndarray:
    """Unit matrices (n, 3, 3), and `matrix` in place of one of them."""
    return np.where((np.arange(n) == i)[:, None, None], matrix, np.eye(3))


def mesh_case(name: str, V: Any, F: Any, *patterns: str) -> Case:
    return Case(f"Mesh: {name}", lambda _: heat_igl.Mesh(V, F), patterns)


def array_cases() -> Iterator[Case]:
    for kind, F in (("triangles", TRIANGLES), ("tetrahedra", TETRAHEDRA)):
        yield mesh_case(f"{kind}, neighbour", V4, F)
        yield mesh_case(f"{kind} as lists, neighbour", V4.tolist(), F.tolist())
        yield mesh_case(f"{kind} unsigned, neighbour", V4.astype(np.float32), F.astype(np.uint8))
        for column in range(F.shape[1]):
            for bad in (-1, -(2**40), 4, 2**31, 2**62):
                where = rf"F\[{len(F) - 1}, {column}\] = {bad} is no vertex \(1 of {len(F)}"
                yield mesh_case(f"{kind}, {bad} in column {column}", V4, changed(F, (-1, column), bad), where, "0 to 3")
            for other in range(column):
                F_bad = changed(F, (0, column), F[0, other])
                yield mesh_case(
                    f"{kind}, {other} and {column} equal", V4, F_bad, r"F\[0\] = \[.*repeats a vertex \(1 of"
                )
        yield mesh_case(f"{kind} counted from 1", V4, F + 1, "is no vertex", "1-based|0 to 3")
        for dtype in (np.float64, np.float32, np.complex128, np.bool_, object, np.str_):
            yield mesh_case(f"{kind} as {dtype.__name__}", V4, F.astype(dtype), "F must hold integers")
    for row, column in ((0, 0), (1, 1), (3, 2)):
        for bad in (np.nan, np.inf, -np.inf):
            V = changed(V4, (row, column), bad)
            yield mesh_case(f"{bad} in row {row}", V, TRIANGLES, rf"V\[{row}, {column}\] = {bad} must .* \(1 of 12")
    yield mesh_case("largest finite float32, neighbour", V4.astype(np.float32) * np.float32(3e38), TRIANGLES)
    for dtype in (np.complex128, np.bool_, object, np.str_, "datetime64[s]"):
        yield mesh_case(f"V as {dtype}", V4.astype(np.int64).astype(dtype), TRIANGLES, "V must hold real numbers")
    yield mesh_case("V of giant integers", [[10**400, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], "V must hold real")
    for shape in ((4, 1), (4, 4), (12,), (), (4, 3, 1), (3, 4)):
        V = np.ones(shape)
        yield mesh_case(f"V of shape {shape}", V, TRIANGLES, rf"V must have shape \(n, 3\).*{re.escape(str(shape))}")
    yield mesh_case("four coordinates", np.ones((4, 4)), TRIANGLES, r"V must have shape \(n, 3\), or \(n, 2\)")
    for shape in ((2, 2), (2, 5), (6,), (2, 3, 1), (1, 2, 3)):
        F = np.zeros(shape, int)
        yield mesh_case(f"F of shape {shape}", V4, F, rf"F must have shape.*{re.escape(str(shape))}")
    for shape in ((0, 3), (0, 4), (0,), (3, 0)):
        yield mesh_case(f"F empty, {shape}", V4, np.zeros(shape, int), "F is empty")
    yield mesh_case("V empty", V4[:0], TRIANGLES, "V is empty")
    yield mesh_case("V ragged", [[0, 0, 0], [1, 0]], TRIANGLES, "V must be an array, .* differ in length$")
    yield mesh_case("F ragged", V4, [[0, 1, 2], [1, 3]], "F must be .* rows differ in length: PolygonMesh")
    masked = np.ma.masked_array(V4, mask=V4 > 0.5)
    yield mesh_case("V masked", masked, TRIANGLES, "V has 3 masked entries: fill or remove them")
    yield mesh_case("V masked nowhere, neighbour", np.ma.masked_array(V4), TRIANGLES)
    yield mesh_case("V None", None, TRIANGLES, "V must hold real numbers")
    yield mesh_case("F None", V4, None, "F must hold integers")
    yield mesh_case("V a string", "bunny", TRIANGLES, "V must hold real numbers")
    yield mesh_case("all in one point", np.ones((4, 3)), TRIANGLES, "lie in one point")
    for scale in (1e-40, 1e40):
        yield mesh_case(f"scale {scale}, neighbour", V4 * scale, TRIANGLES)
    for scale in (1e-70, 1e70, 1e300):
        yield mesh_case(f"scale {scale}", V4 * scale, TRIANGLES, "V spans .*rescale")


def source_case(name: str, sources: Any, *patterns: str) -> Case:
    """Through every way in which a source reaches libigl and the solvers."""

    def run(_: Path) -> None:
        ways = (
            lambda: geodesic_distance(BALL, sources, method="heat"),
            lambda: SOLVER.distance(sources),
            lambda: SOLVER.solve(sources),
            lambda: SOLVER.distances([0, sources]),
        )
        errors = []
        for way in ways:
            try:
                way()
            except heat_igl.SourceError as error:
                errors.append(error)
        if errors:
            raise errors[0] if len(errors) == len(ways) else AssertionError(f"only {len(errors)} ways refuse it")

    return Case(f"source: {name}", run, patterns, error="SourceError")


def source_cases() -> Iterator[Case]:
    n = 42
    for name, sources in (("last vertex", n - 1), ("list", [0, 41]), ("mask", np.arange(n) == 5), ("int8", np.int8(3))):
        yield source_case(f"{name}, neighbour", sources)
    for bad in (-1, n, 2**31, 2**62, -(2**63)):
        yield source_case(f"{bad}", bad, rf"sources\[0\] = {bad} is no vertex: the mesh", "0 to 41")
        yield source_case(f"{bad} in a list", [3, bad, 5], rf"sources\[1\] = {bad} is no vertex \(1 of 3")
    for bad in (1.0, np.nan, [0, 1.5], 1j, "0", b"0", None, len, {0: 1}, [None], [[0, 1]], [[0], [1, 2]], [2**70]):
        yield source_case(f"{bad!r:.30}", bad, "sources must be")
    for empty in ([], (), np.empty(0), np.empty(0, int)):
        yield source_case(f"empty {type(empty).__name__}", empty, "sources is empty")
    yield source_case("mask that selects nothing", np.zeros(n, bool), "selects no vertex")
    yield source_case("mask of integers", np.eye(n, dtype=np.uint8)[7], "sources are 42 integers .* must be boolean")
    for length in (1, n - 1, n + 1):
        yield source_case(f"mask of {length}", np.ones(length, bool), f"has {length} entries.*has 42 vertices")


# --- other arguments --------------------------------------------------------------------------------------------------


def argument_case(name: str, run: Callable[[heat_igl.Mesh], Any], *patterns: str, error: str = "ValueError") -> Case:
    return Case(f"argument: {name}", lambda _: run(heat_igl.shapes.icosphere(1)), patterns, error)


def number_cases() -> Iterator[Case]:
    """Single numbers: other types, arrays, which are named by their shape, and numbers that make no sense."""
    ways: dict[str, Callable[[heat_igl.Mesh, Any], Any]] = {
        "cutoff": lambda mesh, value: geodesic_distance(mesh, 0, cutoff=value),
        "t": lambda mesh, value: HeatMethodSolver(mesh, t=value),
        "radius": lambda mesh, value: heat_igl.distances_within(mesh, value),
        "tolerance": lambda mesh, value: curve_on(mesh, mesh.V[mesh.F[0, :2]], tolerance=value),
    }
    for name, ask in ways.items():
        yield argument_case(f"{name}, neighbour", lambda mesh, ask=ask: ask(mesh, 1.0))
        for bad in (0, -1.0, np.nan, True, "1", [1.0], 1j, None if name == "radius" else (), np.ones(50)):
            shape = r"not an array of float64 of shape \(50,\)$" if isinstance(bad, np.ndarray) else "not "
            refused = f"{name} must be a positive number, {shape}"
            yield argument_case(f"{name} = {bad!r:.20}", lambda mesh, ask=ask, bad=bad: ask(mesh, bad), refused)


def choice_cases() -> Iterator[Case]:
    ways: dict[str, Callable[[heat_igl.Mesh, Any], Any]] = {
        name: lambda mesh, value, name=name: HeatMethodSolver(mesh, **{name: value})
        for name in ("laplacian", "boundary", "magnitude", "backend")
    }
    ways["method"] = lambda mesh, value: geodesic_distance(mesh, 0, method=value)
    for name, ask in ways.items():
        for bad in ("guess", 1, np.ones(50), ["windows"]):
            refused = f"{name} must be one of .*, not "
            yield argument_case(f"{name} = {bad!r:.20}", lambda mesh, ask=ask, bad=bad: ask(mesh, bad), refused)


def array_type_cases() -> Iterator[Case]:
    """Three numbers of other types, which numpy would cast without asking."""
    ways: dict[str, Callable[[Any], Any]] = {
        "positions": lambda value: heat_igl.closest_points(heat_igl.shapes.icosphere(1), value),
        "barycentric": lambda value: SurfacePoints([0], value),
        "offsets": lambda value: OffsetSources([0, 1, 2], value),
        "spacing": lambda value: heat_igl.image_domain(np.ones((2, 2, 2), bool), value),
    }
    wrong = {
        "complex": np.array([1j, 0, 0]),
        "texts": ["a", "0", "0"],
        "dates": np.array([1, 0, 0], "datetime64[s]"),
        "masked": np.ma.masked_array([1.0, 0, 0], [1, 0, 0]),
    }
    for name, ask in ways.items():
        error = "ValueError" if name == "spacing" else "SourceError"
        yield argument_case(f"{name}, neighbour", lambda _, ask=ask: ask([0.5, 0.25, 0.25]))
        for kind, bad in wrong.items():
            refused = rf"{name} (must be (real|one or three positive) numbers|has 1 masked)"
            yield argument_case(f"{name}, {kind}", lambda _, ask=ask, bad=bad: ask(bad), refused, error=error)


def argument_cases() -> Iterator[Case]:
    yield from number_cases()
    yield from array_type_cases()
    yield from choice_cases()
    for ask, pattern in REFUSED:
        yield argument_case(pattern, ask, pattern, error=ERRORS)
    for error, refused in REFUSED_BY_ERROR.items():
        for ask, pattern in refused:
            yield argument_case(pattern, ask, pattern, error=error)
    for name, ask in ACCEPTED.items():
        yield argument_case(f"{name}, neighbour", ask)


def segments(faces: list[int], closed: bool = False) -> SurfaceCurve:
    """The first side of each of some faces."""
    return SurfaceCurve(faces, [[1, 0, 0]] * len(faces), [[0, 1, 0]] * len(faces), closed)


def plot_field(mesh: heat_igl.Mesh, values: Any = None, **options: Any) -> Any:
    return plots.plot_field(mesh, mesh.V[:, 0] if values is None else values, label="heat", **options)


def carrier(mesh: heat_igl.Mesh) -> Any:
    return potpourri3d.MeshVectorHeatSolver(mesh.V, mesh.F)


RAGGED = [[1.0, 2.0], [3.0]]
CURVE = SurfaceCurve([0, 1], [[1, 0, 0], [0, 0.5, 0.5]], [[0.5, 0.5, 0], [0.2, 0.2, 0.6]])
CENTRE = [[1 / 3] * 3]
GRID = heat_igl.shapes.grid(4)
TRIANGLE, SQUARE, ROW = [[0, 1, 2]], V4[[0, 1, 3, 2]], np.outer(np.arange(30), [1.0, 2, 3])
BY_LENGTHS = GeodesicSolver(edge_length_operators(TRIANGLE, [[1, 1, 1]]))
SPHERE, BOX, BOOK = heat_igl.shapes.icosphere(4), heat_igl.shapes.box(1), heat_igl.shapes.book(3, 2)
PYGEODESIC = pygeodesic.PyGeodesicAlgorithmExact(twice(BALL).V, twice(BALL).F)
TWISTED, TWO, TORUS = moebius_strip(8, 1), twice(BALL), heat_igl.shapes.torus(20, 60)
TURNED = heat_igl.Mesh(GRID.V, np.where(np.arange(32)[:, None] == 5, GRID.F[:, ::-1], GRID.F))
LOOSE = heat_igl.Mesh([*GRID.V, [5, 5, 5]], GRID.F)
VECTORS = heat_igl.VectorHeatSolver(BALL)
WEST, SOLID = GRID.V[:, 0] < 0.6, np.ones((2, 2, 2), bool)
AT, INSIDE = [[1, 0, 0]], SurfacePoints([7], [[0.2, 0.3, 0.5]])
PULL_BACK, CLOUD = GeodesicSolver(BALL).distance_vjp(INSIDE)[1], PointCloud(BALL.V)
# A sphere with faces in one point, one whose vertices lie on a line, and one beside a sphere of another size.
RING = np.isin(np.arange(42), BALL.F[(BALL.F == 0).any(axis=1)])
POINTED = heat_igl.Mesh(np.where(RING[:, None], BALL.V[0], BALL.V), BALL.F)
LINE, FOLDED = (heat_igl.Mesh(x[:, None] * [1, 0, 0], BALL.F) for x in (np.arange(42), BALL.V[:, 0]))
SIZES = heat_igl.Mesh([*1e-20 * BALL.V, *BALL.V + 5], [*BALL.F, *BALL.F + 42])
HIDDEN, X = np.ma.masked_array([1, 2], mask=[True, False]), np.array([[1.0, 0, 0]])
ERRORS = "ValueError|SourceError|MeshError|TypeError|ReferenceSolverError"
# What is asked of a sphere of 42 vertices and 80 faces, and how it is refused.
REFUSED: tuple[tuple[Callable[[heat_igl.Mesh], Any], str], ...] = (
    (lambda m: heat_igl.closest_points(m, [[0, 0, 1], [0, 1e200, 0]]), r"positions\[1\] .* must be within 1e"),
    (lambda m: trace_geodesic(m, 0, (1, 0), 1e300), r"length is too long: 1e\+300"),
    (lambda m: heat_igl.exp_map(m, 0, [[1, 0], [1e200, 0]]), r"vectors\[1\] is too long: 1e"),
    (lambda _: heat_igl.exp_map(SIZES, [0, 50], [[1, 0], [1, 0]]), r"vectors\[0\] is too long: 1 is 1\.\d+e\+20"),
    (lambda _: heat_igl.exp_map(FOLDED, 0, [[0, 0], [1, 0.3]]), r"along vectors\[1\] is lost among faces without"),
    (lambda _: trace_geodesic(FOLDED, 0, [1, 0.3], 1.0), "line from start is lost among faces without area: repair"),
    (lambda m: heat_igl.exp_map(m, 0, RAGGED), "^vectors must be real numbers.*, not "),
    (lambda m: HeatMethodSolver(m).distances([0], dtype="float16"), "dtype must be float64 or"),
    (lambda m: HeatMethodSolver(m).distances([0], out=3), r"out must be an array .*, not "),
    (lambda m: HeatMethodSolver(m).distances(3), "source_sets must be .*: try distance"),
    (lambda m: validate(m, 0, methods="heat"), "methods must be a sequence of methods"),
    (lambda m: PolygonMesh(m.V, 3), "polygons must be .*, not "),
    (lambda _: PolygonMesh(SQUARE, []), "polygons is empty"),
    (
        lambda _: PolygonMesh(SQUARE, [[0, 1, 2, 3], [0, 1]]),
        r"polygons\[1\] = \[0, 1\] needs three corners or more \(1 of 2",
    ),
    (lambda _: PolygonMesh(SQUARE, [[0, 1, 2, 4]]), r"polygons\[0\] = \[0, 1, 2, 4\] holds 4, which is no vertex"),
    # Points without faces.
    *(
        (lambda _, P=P: PointCloud(P), pattern)
        for P, pattern in (
            (np.eye(3), "P has 3 points: a surface needs four or more"),
            (np.empty((0, 3)), "P is empty"),
            (np.ones((9, 3)), "all 9 points in P are equal"),
            (ROW, "all 30 points in P lie on a line"),
            (ROW + 1e6, "all 30 points in P lie on a line"),
            (changed(BALL.V, (4, 0), np.nan), r"P\[4, 0\] = nan must .* \(1 of 126 are not.*: P\[numpy.isfinite"),
            (np.zeros((9, 1)), r"P must have shape \(n, 3\), or \(n, 2\) in the plane, but .* \(9, 1\)"),
            (1e70 * BALL.V, "P spans .* rescale P"),
            ("scan.ply", "P must hold real numbers, .*; as_mesh takes files and clouds of other libraries"),
        )
    ),
    *(
        (lambda m, normals=normals: PointCloud(m.V, normals), pattern)
        for normals, pattern in (
            (changed(BALL.V, (2, 0), np.nan), r"normals\[2\] = \[nan, .* \(1 of 42 are"),
            (changed(BALL.V, (5, slice(3)), 0), r"normals\[5\] = \[0.0, 0.0, 0.0\] must be .* \(1 of 42 "),
            (BALL.V[:8], r"normals must have shape \(42, 3\)"),
            (BALL.V * 1j, "normals must hold real numbers"),
        )
    ),
    # No point has two neighbours on its own sheet.
    (lambda _: GeodesicSolver(PointCloud(SQUARE, [X[0], -X[0]] * 2)), "no three points of P are neighbours on a sur"),
    (lambda _: PolygonMesh(SQUARE * 1e150, [[0, 1, 2, 3]]), "outside what areas in double precision allow"),
    # Points and curves on faces.
    (lambda _: SurfacePoints([0], [[0.5, 0.5, 0.1]]), r"barycentric\[0\] .* must sum to 1: it sums to 1\.1"),
    (lambda _: SurfacePoints([0, 0], [[1, 0, 0], [0.5, 0.7, -0.2]]), r"barycentric\[1\] .* not negative"),
    (lambda _: SurfacePoints([0], [[np.nan, 0.5, 0.5]]), r"barycentric\[0\] .* finite"),
    (lambda _: SurfacePoints([0], [[1, 0]]), r"barycentric must have shape \(1, 3\)"),
    (lambda _: SurfacePoints([0.5], [[1, 0, 0]]), "faces must be one face index or more, not float64"),
    (lambda _: SurfacePoints([], np.zeros((0, 3))), "faces must be one face index"),
    (lambda m: SurfacePoints([0, 80], CENTRE * 2).positions(m), r"^faces\[1\] = 80 must be a face .* from 0 to 79"),
    (lambda m: edge_curve(m, [0, 12]).positions(m.halved()), "^faces.* not the triangle that it is on the curve's own"),
    (lambda m: geodesic_distance(m.halved(), edge_curve(m, [0, 12])), "^faces.* on the curve's own mesh: curve_on"),
    (lambda _: curve_on(GRID, [[0, 0, 0]]), "two corners of a curve or more, not 1"),
    (
        lambda _: curve_on(GRID, np.ones((2, 4))),
        r"positions must have shape \(k, 3\), a row for each, or .*, not \(2, 4\)",
    ),
    (lambda _: curve_on(GRID, [[0, 0, 0], [1, np.nan, 0]]), r"positions\[1\] = \[1.0, nan, 0.0\] must be finite"),
    (lambda _: curve_on(GRID, [[0.5, 0.5, 0], [0.5, 0.5, 0]]), "all in one place"),
    (
        lambda _: curve_on(GRID, [[0.5, 0.5, 0], [0.5, 0.5, 2]]),
        r"leaves the surface by .* on the line from positions\[0\].*tolerance is",
    ),
    (lambda _: curve_on(GRID, [[0, 0, 0], [1, 0, 0], [1.2, 0.4, 0]], tolerance=0.1), r"line from positions\[1\]"),
    (lambda m: edge_curve(m, RAGGED), "^vertices must be an array, but rows"),
    (lambda _: edge_curve(GRID, [0, 1, 3]), r"vertices\[1\] = 1 and the next, 3, are not joined by an edge"),
    (lambda _: edge_curve(GRID, [0]), "vertices must be two vertex indices or more"),
    # Sources in faces, and with offsets.
    (lambda _: OffsetSources([0, 1], [0.0, -1.0]), r"offsets\[1\] = -1.0 must be finite and not negative"),
    (lambda _: OffsetSources([0, 1], [np.nan, 0.0]), r"offsets\[0\] = nan must be finite"),
    (lambda _: OffsetSources([0, 1], np.inf), "offsets = inf must be finite"),
    (lambda _: OffsetSources([0, 1], [[0.0, 1.0]]), r"one number or one for each .*, not of shape \(1, 2\)"),
    *(
        (lambda m, sources=sources: geodesic_distance(m, sources), pattern)
        for sources, pattern in (
            (OffsetSources([0, 1], [0.0, 1.0, 2.0]), "offsets has 3 entries for 2 sources: give one for each"),
            (OffsetSources([CURVE, 0], [1.0]), "offsets has 1 entries for 2 sources"),
            (SurfacePoints([0, 83], CENTRE * 2), r"^faces\[1\] = 83 must be a face .*: indices run from 0 to 79"),
            (SurfaceCurve([-1], [[1, 0, 0]], [[0, 1, 0]]), r"^faces\[0\] = -1 must be a face"),
            ([CURVE, 42], r"sources\[1\]: sources\[0\] = 42 is no vertex"),
            ([3, SurfacePoints([99], CENTRE)], r"sources\[1\]: faces\[0\] = 99 must be a face"),
            ([CURVE, None], r"sources\[1\]: sources must be a vertex index"),
            ([CURVE, []], r"sources\[1\]: sources is empty"),
        )
    ),
    # Edge lengths and gluing.
    *(
        (lambda _, given=given: edge_length_operators(TRIANGLE, given), pattern)
        for given, pattern in (
            ([[1.0, 1.0]], r"one length per side of F, .* shape \(1, 2\)"),
            ([[1.0, np.nan, 1.0]], r"l\[0, 1\] = nan is not a length"),
            ([[1, 1, -1]], r"l\[0, 2\] = -1.0 is not a length"),
        )
    ),
    *(
        (lambda _, twin=twin: edge_length_operators([[0, 1, 1]], [[1, 3, 3]], twin=twin), pattern)
        for twin, pattern in (
            ([[-1, 2, -1]], r"twin\[0, 1\] = 2 is no half-edge .* glued back to 1 \(1 entries"),
            ([[0, 2, 1]], r"twin\[0, 0\] = 0 is no half-edge"),
            ([[1, 0, -1]], r"twin\[0, 0\] = 1 is no half-edge that ends at the same vertices"),
        )
    ),
    (lambda _: edge_length_operators(TRIANGLE, [[1, 1, 1]], laplacian="graph"), "laplacian must be"),
    # Tangent vectors.
    (
        lambda m: tangent_frames(m).to_world(np.ones((3, 2))),
        r"vectors must have shape \(42, 2\), but it has shape \(3, 2\)",
    ),
    (
        lambda m: tangent_frames(m).to_world([[0, 0], [np.nan, 0]], [0, 1]),
        r"vectors\[1\] = \[nan, 0.0\] must be finite",
    ),
    (lambda m: tangent_frames(m).from_world(["a"], [0]), "vectors must be real numbers"),
    (lambda _: tangent_frames(BOOK), "is one of more than two faces"),
    (lambda _: tangent_frames(TWISTED), "has faces that are oriented differently"),
    (lambda _: tangent_frames(BOX), "tetrahedral"),
    (lambda _: VECTORS.transport([0, 1], np.ones((3, 2))), r"vectors must have shape \(2, 2\), but .* \(3, 2\)"),
    (lambda _: VECTORS.extend([0, 1], [1.0, np.nan]), r"values\[1\] = \[nan\] must be finite"),
    (lambda _: VECTORS.extend(0, [1.0, 2.0]), "values must be one number for each of the 1 sources"),
    (lambda m: trace_geodesic(m, 3, [0, 0], 0.1), r"direction = \[0, 0\] is 0 in the tangent plane"),
    (lambda m: trace_geodesic(m, 3, [1, 0], -1), "length must be a finite number of at least 0, not -1"),
    # What a method or a domain does not give.
    *(
        (lambda m, e=e: GeodesicSolver(m, tolerance=e), "tolerance must be at least 0 and less than 1, not")
        for e in (-1e-9, 1, np.nan, "1e-5", True)
    ),
    (lambda m: HeatMethodSolver(m, t=1e300), r"t = 1e\+300 is too large: heat spreads over"),
    (lambda m: HeatMethodSolver(m, t_coef=1e20), r"t_coef = 1e\+20 is too large: heat spreads over"),
    (lambda _: geodesic_distance(SPHERE, 0, method="sweep", targets=INSIDE), "targets inside faces need"),
    (lambda _: BY_LENGTHS.directions(0), "directions need the positions of a mesh"),
    (lambda _: GeodesicSolver(SPHERE, method="sweep").directions(0), "paths, which a sweep does not find"),
    (lambda _: GeodesicSolver(BOX).directions(0), "directions follow paths on triangles that fit together"),
    (lambda _: heat_igl.distances_within(BOX, 1.0), "unlike those of distance_matrix, need triangles"),
    (lambda _: heat_igl.log_maps_within(BOOK, 1), "more than two faces"),
    (lambda _: shortest_paths(BOX, 1, 0), "paths need triangles"),
    (lambda _: shortest_paths(LOOSE, 25, 0), r"targets\[0\] = 25 is no vertex that a face uses"),
    (lambda _: shortest_paths(TWO, [1, 50], 0), r"from targets\[1\] no source can be reached \(1 of 2"),
    (lambda _: karcher_mean(TWO, [0, 42], p=1), "points lie on different components"),
    (lambda _: karcher_mean(TWO, [0, 42]), "points lie on different components"),
    (lambda _: GeodesicSolver(GRID, region=WEST).distance([0, 4]), r"sources\[1\]: vertex 4 .* \(1 of 2 do\)"),
    (lambda _: HeatMethodSolver(GRID, region=WEST).distance(4), r"sources\[0\]: vertex 4 lies outside"),
    (lambda _: GeodesicSolver(GRID, region=WEST).distance(INSIDE), r"sources\[0\]: face 7 lies outside"),
    (lambda _: SignedHeatSolver(TWISTED), "the surface cannot be oriented, as a Moebius strip cannot"),
    (lambda _: SignedHeatSolver(TURNED), r"face \d+ and a neighbour are oriented differently.*bfs_orient"),
    (lambda _: SignedHeatSolver(BOOK), r"more than two faces meet at .* \(\d+ edges.*cut\(mesh, curves\)"),
    (lambda _: SignedHeatSolver(BOX), "the mesh is tetrahedral"),
    (lambda m: SignedHeatSolver((m.V, [*m.F, m.F[3]])), r"F\[80\] has the corners of F\[3\] \(1 faces .* remove"),
    # Derivatives.
    *(
        (lambda _, g=g: PULL_BACK(g), pattern)
        for g, pattern in (
            (np.ones(5), r"g must have shape \(42,\) or \(k, 42\), one entry per vertex, but it has shape \(5,\)"),
            (np.ones((2, 3, 42)), "one entry per vertex"),
            (np.where(np.arange(42) == 7, np.nan, 1.0), "finite at reachable vertices, but is nan at vertex 7"),
        )
    ),
    (lambda _: PULL_BACK.push_forward(np.ones(3)), r"dV must be \(42, 3\) finite numbers"),
    (lambda m: PULL_BACK.push_forward(m.V, [np.nan, 0, 0]), r"points must be \(1, 3\) finite numbers, one velocity"),
    (lambda _: PULL_BACK.by_speed(np.ones(42)), "no metric to change: make it on speed_operators"),
    (lambda _: PULL_BACK.by_metric(np.ones(42)), "no metric to change: make it on metric_operators"),
    (lambda m: GeodesicSolver(m).distance_vjp(CURVE), "a curve is among the sources: place points on it"),
    (lambda _: GeodesicSolver(SPHERE, method="sweep").distance_vjp(0), "derivatives are those of paths"),
    (lambda _: GeodesicSolver(CLOUD).distance_vjp(0), "derivatives need a surface of triangles"),
    # Fibres and sheets.
    (lambda _: heat_igl.fibre_metric([[1, 0, 0], [0, 0, 0]], 1, 2), r"directions\[1\] = \[0.0, 0.0, 0.0\] is no dir"),
    (lambda _: heat_igl.fibre_metric([1, 0, 0], 1, 2), r"directions must have shape \(k, 3\)"),
    (lambda _: heat_igl.fibre_metric(X, 0, 2), r"along\[0\] = 0.0 must be positive and finite"),
    (lambda _: heat_igl.metric_operators(LINE, np.tile(np.eye(3), (len(LINE.F), 1, 1))), r"F\[0\] .* has no area"),
    (lambda _: heat_igl.fibre_metric(X, 1, 2, sheets=X[:, ::-1]), "sheets and normal go together"),
    (lambda _: heat_igl.fibre_metric(X, 1, 2, sheets=2 * X, normal=1), r"sheets\[0\] .* direction of its fibre"),
    (lambda _: heat_igl.fibre_metric(X, 1, 2, sheets=0 * X, normal=1), r"sheets\[0\] .* is no direction"),
    # Curves and waypoints.
    (lambda m: SignedHeatSolver(m).distance([]), "curves is empty"),
    (lambda m: SignedHeatSolver(m).distance(7), "curves must be a SurfaceCurve, OrientedPoints, a mask"),
    (lambda m: SignedHeatSolver(m).distance([CURVE, 7]), r"curves\[1\] must be a SurfaceCurve"),
    (lambda m: SignedHeatSolver(m).distance(CURVE, level="all"), "level must be one of 'zero', 'constant'"),
    (lambda _: heat_igl.OrientedPoints(INSIDE, np.ones((2, 3))), r"normals must have shape \(1, 3\), not \(2, 3\)"),
    (lambda _: heat_igl.OrientedPoints(INSIDE, [[1, 0, 0, 0]]), r"shape \(k, 3\), .* or \(k, 2\) .*, not \(1, 4\)"),
    (lambda m: straighten(m, segments([0, 40])), r"segment 0 ends in face 0 .* segment 1 starts in face 40"),
    (lambda m: straighten(m, segments([0], closed=True)), r"segment 0 ends .* and segment 0 starts"),
    (lambda m: straighten(m, segments([80])), "indices run from 0"),
    (lambda m: straighten(m, SurfaceCurve([0], AT, AT, is_closed=True)), "has no length"),
    (lambda m: straighten(m, [0, 1, 2]), "must be a SurfaceCurve, not list"),
    (lambda m: geodesic_path(m, [3]), "2 places or more for a path, not 1"),
    (lambda m: geodesic_path(m, [3, 4], closed=True), "3 places or more for a loop, not 2"),
    (lambda m: geodesic_path(m, [7, 7, 7], closed=True), "contracts to a point"),
    (lambda m: geodesic_path(m, [3, 42]), r"waypoints\[1\] = 42 is no vertex"),
    (lambda m: geodesic_path(m, [INSIDE, "x"]), r"waypoints\[1\] must be a vertex or SurfacePoints, not str"),
    (lambda m: geodesic_path(m, [SurfacePoints([80], AT), 5]), r"waypoints\[0\]: faces\[0\] = 80"),
    (lambda _: geodesic_path(TWO, [0, 5, 42]), r"waypoints\[1\] to waypoints\[2\]: .* different comp"),
    (lambda m: heat_igl.curve_through(m, [[0, 0, 1], [0, 0, 3.0]]), r"points\[1\] is \S+ away from .* \(1 of 2"),
    (lambda m: heat_igl.curve_through(m, [0, 1], closed=True), "points must be 3 places or more for a closed curve"),
    (lambda m: heat_igl.curve_through(m, [0, 99]), r"points\[1\] = 99 is no vertex"),
    (lambda m: validate(m, 0, ["magic"]), "'magic' is unknown: choose from heat, sweep, meshlab"),
    (lambda m: validate(m, 0, ["heat"], reference="magic"), "'magic' is unknown"),
    (lambda m: validate(m, 0, []), "methods is empty: choose from heat, sweep"),
    # Values, labels and images.
    *(
        (lambda _, ask=ask, bad=bad: ask(GRID, bad, 0.5), said)
        for ask in (heat_igl.isolines, heat_igl.curves.sublevel_areas, heat_igl.smooth)
        for bad, said in (
            (np.where(np.arange(25) == 3, np.nan, 1.0), r"values\[3\] (is|=) nan .*\(1 of 25"),
            (np.where(np.arange(25) == 3, -np.inf, 1.0), r"values\[3\] (is|=) -inf"),
            (np.zeros(24), r"values must have shape \(25,\)"),
        )
    ),
    (lambda m: heat_igl.smooth(m, np.zeros(42), 0), "fwhm must be a positive number"),
    (lambda m: heat_igl.parcel_distances(m, np.zeros(42)), r"labels must be integers of shape \(42,\), not float64"),
    (lambda m: heat_igl.parcel_distances(m, -np.ones(42, int)), "labels name no parcel"),
    (lambda _: heat_igl.parcel_distances(GRID, 1 - WEST, region=WEST), r"no vertex of parcel 1 lies in .* \(1 of 2"),
    (lambda m: heat_igl.geodesic_errors(m, [0, 1], [0]), "there are 2 matches and 1 entries of truth"),
    (lambda m: heat_igl.geodesic_errors(m, [0, 99], [0, 0]), r"matches\[1\] = 99 is no vertex"),
    (lambda m: karcher_mean(m, [1, 2], [1, 2, 3]), r"weights must be 2 numbers, .* but the shape is \(3,\)"),
    (lambda m: karcher_mean(m, [1, 2], [1, -1]), r"weights\[1\] = -1.0 must be finite and not negative"),
    (lambda m: karcher_mean(m, [1, 2], [0, 0]), "weights are all 0"),
    (lambda _: karcher_mean(LINE, [1, 2, 3]), r"the mean lies at F\[\d+\] = .* has no area: repair"),
    (lambda _: heat_igl.geodesic_errors(LINE, [0], [1]), "no face of the mesh has one"),
    (lambda _: heat_igl.speed_operators(POINTED, np.arange(1, 81)), r"F\[0\] = \[0, 12, 14\] has no area \(10 of 80"),
    (lambda _: heat_igl.centroidal_voronoi(BOX, [0, 1]), "tangent frames need triangles"),
    *(
        (lambda m, p=p: karcher_mean(m, [1, 2], p=p), "p must be a number from 1 to 64")
        for p in (0.5, 65, np.inf, np.nan, "2", True)
    ),
    *(
        (lambda m, k=k: heat_igl.nearest_vertices(m, k), "k must be a positive integer, not")
        for k in (0, -3, 2.0, True, "two")
    ),
    (lambda m: heat_igl.nearest_vertices(m, 2, [99]), r"sources\[0\] = 99 is no vertex"),
    (lambda m: heat_igl.log_maps_within(m, 0), "radius must be a positive number, not 0"),
    (lambda m: heat_igl.pair_distances(m, [1, 2]), r"shape \(p, 2\), but it has shape \(2,\)"),
    (lambda m: heat_igl.pair_distances(m, [[1], [2, 3]]), "pairs must be an array, but rows"),
    (lambda m: heat_igl.centroidal_voronoi(m, [3, 3]), "sites must be distinct, but vertex 3 is there twice"),
    (lambda m: heat_igl.centroidal_voronoi(m, [3, 42]), r"sites\[1\] = 42 is no vertex"),
    (lambda m: heat_igl.centroidal_voronoi(m, [3], rounds=-1), "rounds must be an integer of at least 0"),
    (lambda _: heat_igl.speed_operators(GRID, np.ones(32, bool)), "speed must be real numbers"),
    (lambda _: heat_igl.metric_operators(GRID, np.ones((32, 3, 3), bool)), "metric must be real numbers"),
    (lambda _: heat_igl.activation_times(GRID, np.eye(3, dtype=bool), 0), "D must be real numbers"),
    (lambda _: heat_igl.speed_operators(GRID, np.ones(31)), r"speed must have shape \(32,\), one per face, not \(31"),
    (lambda _: heat_igl.speed_operators(GRID, [1.0] * 31 + [0]), r"speed\[31\] = 0.0 must be .* \(1 of 32 are not"),
    *(
        (lambda _, mask=mask: heat_igl.image_domain(mask), f"mask must be {said}")
        for mask, said in (
            ([[0, 1], [1, 1]], "a boolean image"),
            ([[True], [True, False]], "an array, but rows or entries differ"),
            (SOLID[None], r"a boolean image .* \(1, 2, 2, 2\)"),
        )
    ),
    *((lambda _, mask=mask: heat_igl.image_domain(mask), "mask holds no pixel") for mask in ([[False]], ~SOLID)),
    *(
        (lambda _, bad=bad: heat_igl.image_domain([[True]], bad), "spacing must be one or two")
        for bad in (0, (1, -1), (1, 2, 3), "x", np.inf)
    ),
    (lambda _: heat_igl.image_domain(SOLID, (1.0, 2.0)), "spacing must be one or three positive numbers"),
    (lambda _: heat_igl.terrain([[0.0, 0], [0]]), "heights must be an array, but rows or entries differ in length"),
    (lambda _: heat_igl.terrain([0.0, 0, 0]), r"heights must be real numbers \(rows, .* of shape \(3,"),
    (lambda _: heat_igl.terrain(np.where(np.eye(3), 0, np.nan)), "no three neighbouring cells with ground"),
    (lambda _: heat_igl.terrain([[0, 0, 0], [0, 0, np.inf], [0, 0, 0]]), r"heights\[1, 2\] is inf \(1 of 9"),
    # References.
    (lambda _: heat_igl.reference.exact(BOX, 0), r"closed_forms\.convex_solid"),
    (lambda m: heat_igl.reference.exact(m, 0, solver="magic"), "one of windows, pygeodesic, gdist, igl"),
    (lambda m: heat_igl.reference.measured("magic", m, 0), "'magic' is unknown"),
    (lambda _: closed_forms.sphere(GRID, 0), "distance from the origin varies"),
    (lambda m: closed_forms.cylinder(m, 0), "distance from the z axis varies"),
    (lambda m: closed_forms.cone(m, 0, apex=(0, 0, 9)), "angle to the axis varies"),
    (lambda m: closed_forms.convex_solid(m, 0), "holds no tetrahedra"),
    # Unknown arguments, and the argument that holds the offender.
    (lambda m: geodesic_distance(m, 0, cut_off=1.0), r"geodesic_distance\(\) .* Did you mean 'cutoff'\?"),
    (lambda m: geodesic_distance(m, source=0), r"'source'. Did you mean 'sources'\?"),
    (lambda m: HeatMethodSolver(m, laplace=0), r"HeatMethodSolver.*'laplace'. Did you mean 'laplacian'\?"),
    (lambda _: SOLVER.distances([[0]], radius=1.0), "It takes source_sets, out, progress, dtype, cutoff$"),
    (lambda m: shortest_paths(m, target=3, sources=0), r"Did you mean 'targets'\?"),
    (lambda m: geodesic_distance(m.V, m.F, 0), r"takes mesh, sources in .* \(method=.* one mesh, \(V, F\)$"),
    (lambda _: SOLVER.distance(0, 40), r"distance\(\) takes sources; the others go by name \(cutoff=\)$"),
    (lambda m: heat_igl.write_mesh("a.ply", m, m.V), r"takes path, mesh in .* go by name \(distance=\)"),
    (lambda m: shortest_paths(m, 42, 0), r"^targets\[0\] = 42 is no vertex"),
    (lambda m: shortest_paths(m, [], 0), "^targets is empty"),
    (lambda m: shortest_paths(m, SurfacePoints([99], CENTRE), 0), r"^targets: faces\[0\] = 99 must be a face"),
    (lambda _: heat_igl.farthest_points(SOLVER, 3, start=42), r"^start\[0\] = 42 is no vertex"),
    (lambda m: heat_igl.farthest_points(m, 3, start=[0.5]), "^start must be a vertex index.* not floats such as 0.5"),
    (lambda _: heat_igl.voronoi_cells(SOLVER, [1, 42]), r"^sites\[1\] = 42 is no vertex"),
    # What numpy would take for something else.
    (lambda m: geodesic_path(m, [0, 1], closed="no"), "^closed must be True or False, not 'no'"),
    (lambda _: SurfaceCurve([0], [[1, 0, 0]], [[0, 1, 0]], 2), "^is_closed must be True or False, not 2"),
    (lambda _: SOLVER.distances([0], progress="bar"), "^progress must be True or False, not 'bar'"),
    (lambda m: geodesic_distance(m, HIDDEN), "^sources has 1 masked entries: fill or remove them"),
    (lambda _: SurfacePoints(HIDDEN, np.eye(3)[:2]), "^faces has 1 masked entries"),
    (lambda m: karcher_mean(m, [0, 1], HIDDEN), "^weights has 1 masked entries"),
    (lambda _: heat_igl.shapes.grid(np.inf), "^n must be an integer of at least 1, not inf"),
    (lambda _: heat_igl.shapes.icosphere(162), "^subdivisions must be at most 12, not 162"),
    (lambda m: heat_igl.exp_map(m, 0, np.empty((0, 2))), r"^vectors must be one vector or more.* \(0, 2\)"),
    (lambda m: tangent_frames(m).from_angles("1"), "^angles must be real numbers, not '?"),
)
REFUSED_BY_ERROR: dict[str, tuple[tuple[Callable[[heat_igl.Mesh], Any], str], ...]] = {
    "MeshError": (
        (lambda _: geodesic_path(BOX, [0, 1]), "tetrahedral"),
        (lambda _: straighten(BOX, edge_curve(GRID, [0, 1])), "tetrahedral"),
        (lambda _: dual_triangulation(TORUS, farthest_cells(TORUS, 6)), "sample more densely"),
        (lambda _: dual_triangulation(TORUS, farthest_cells(TORUS, 2)), "no three cells meet"),
        (lambda m: dual_triangulation(m, farthest_cells(GRID, 2)), "cells have 25 vert.* and the mesh 42"),
        (lambda _: GeodesicSolver(CLOUD, region=RING), "not of PointCloud: pass a mesh of triangles, or of a cloud"),
        (lambda _: heat_igl.as_mesh((V4[[0, 1, 2, 1]], [[1, 3, 2]]), merge="vertices"), "none is left"),
        (lambda m: heat_igl.as_mesh(m, m.F), "F is given beside a Mesh"),
        (lambda _: pygeodesic.PyGeodesicAlgorithmExact(V4, TRIANGLES[:, :2]), "must have shape"),
        (lambda m: potpourri3d.GeodesicTracer(m.V, [*m.F, [3, 3, 8]]), "repeats a vertex"),
        (lambda _: BY_LENGTHS.distance_vjp(0)[1](np.ones(3)), "no vertices to move: use by_lengths"),
        (lambda m: m.with_vertices(m.V[:3]), "V has 3 rows, but the mesh has 42 vertices"),
        (lambda m: m.with_vertices(np.where([False, True, False], np.nan, m.V)), r"V\[0, 1\] = nan"),
    ),
    "SourceError": (
        (lambda _: source_set([0, INSIDE], 5, None), "lie on triangles, and this domain has none: name vert"),
        (lambda _: vertex_sources(INSIDE, 5), "here, not SurfacePoints"),
        (
            lambda m: geodesic_distance(m, np.outer([1, 2], m.V[5])),
            r"sources\[1\] is \S+ away from the surface \(1 of 2 are .*closest_points",
        ),
        (lambda _: geodesic_distance(BOX, [0.0, 0.0, 0.0]), "for positions in space, pass the nearest vertices"),
        (lambda m: heat_igl.validation.draw_sources(m, 0), "0 sources cannot be drawn from a component of 42"),
        (lambda m: heat_igl.validation.draw_sources(m, 43), "43 sources cannot be drawn from a component of 42"),
        (lambda _: PYGEODESIC.geodesicDistance(0, 84), r"targetIndex\[0\] = 84 is no vertex"),
        (lambda _: PYGEODESIC.geodesicDistance(0, 50), "no source can be reached"),
        (lambda _: PYGEODESIC.geodesicDistances([-1]), r"source_indices\[0\] = -1 is no vertex"),
        (lambda m: heat_igl.distance_matrix(m, [4, 2, 4]), "indices must be distinct, but vertex 4 is there twice"),
        (lambda _: heat_igl.shortest_path(GRID, 4, 0, region=WEST), r"targets\[0\]: vertex 4 lies outside the region"),
        (lambda m: heat_igl.shortest_path(m, [0, 1], 2), "a must be one place, not 2"),
        (lambda _: SOLVER.iter_distances(5), "source_sets must be an iterable of sets of sources, not 5: try distance"),
        *(
            (lambda _, sites=sites: heat_igl.activation_times(GRID, np.eye(3), sites), f"^{said}")
            for sites, said in (
                ([2.0, 2, 0], r"sites\[0\] is 1.41 away"),
                ([0, np.nan, 0], r"sites\[0\] = \[0.0, nan, 0.0\] must be finite"),
                ([SurfacePoints([0], AT), [25]], r"sites\[1\]: sites\[0\] = 25 is no vertex"),
                (np.ones(25, int), "sites are 25 integers 0 and 1"),
            )
        ),
        (lambda _: heat_igl.activation_times(BOX, np.eye(3), [8]), r"sites\[0\] = 8 is no vertex"),
    ),
    "ValueError": (
        (lambda _: heat_igl.farthest_points(LOOSE, 26), "k must be an integer from 1"),
        (lambda m: heat_igl.farthest_points(m, 1, start=[20, 0]), "k must be an integer from 2"),
        (lambda _: delaunay_refinement(intrinsic_triangulation(GRID), 100), "take the tufted cover"),
        (lambda _: fitted_laplacian(operators(BOX), 1.0), "fitted to the lengths of edges, which this domain does not"),
        (lambda _: analyse(operators(GRID).L.tocsr()), r"must be a scipy\.sparse\.csc_matrix, not csr_matrix"),
        (lambda m: heat_igl.write_curves("a.svg", m, edge_curve(m, [0, 12])), "needs a flat mesh.*pass a projection"),
        (
            lambda m: heat_igl.write_curves("a.svg", m, [], projection=np.eye(3)),
            r"projection must be a finite array of shape \(2, 3\)",
        ),
        (
            lambda m: carrier(m).compute_log_map(7, "Affine"),
            "strategy must be one of 'VectorHeat', 'AffineLocal', 'AffineAdaptive'",
        ),
        (lambda m: carrier(m).extend_scalar([1, 22], [0.0]), "values must be one number for each of the 2 sources"),
        (lambda m: potpourri3d.EdgeFlipGeodesicSolver(m.V, m.F).find_geodesic_path(4, 4), "are the same vertex, 4"),
        (lambda m: heat_igl.diameter(m, rounds=0), "rounds must be a positive integer"),
        (lambda m: plots.plot(m, m.V[1:, 0]), r"distance must have shape \(42,\)"),
        (lambda m: plots.plot(m, np.where(np.arange(42) == 3, np.nan, 1)), r"distance\[3\] is NaN"),
        (lambda m: plots.plot(m, np.full(42, np.inf)), "infinite everywhere"),
        (lambda m: plot_labels(m, np.full(42, -1)), "labels are negative everywhere.*from 0 on"),
        (lambda m: plot_labels(m, np.arange(42), distance=[1.0]), r"distance must have shape \(42,\), one per vertex"),
        (lambda m: plot_field(m, limits=(1, 0)), "limits must be two numbers, the lower one first"),
        (lambda m: plot_field(m, view=(30, 20, 10)), "view must be two angles in degrees"),
        (lambda m: plot_field(m, np.where(np.arange(42) == 2, np.nan, 1)), r"values\[2\] is NaN"),
        (lambda m: write_line_drawing("a.png", m, []), r"a\.png: line drawings go to \.svg files"),
        (
            lambda m: write_line_drawing("a.svg", m, [], hidden="grey"),
            "hidden must be one of 'dotted', 'omitted', not 'grey'",
        ),
        (lambda m: heat_igl.isolines(m, m.V[:, 0], 0), "levels must be a positive number of levels"),
        (lambda m: heat_igl.drawing.page(m, m.V[:, 0], fields=[m.V]), "fields must be a dictionary"),
        (lambda _: validate(GRID, 0, reference=np.eye(2, 25)), r"reference must have shape \(1, 25\), not \(2, 25\)"),
        (lambda _: metrics.relative_error([1, 2], [1, 2, 3]), r"one shape, not \(2,\) and \(3,\)"),
        (lambda m: metrics.error_summary(m, *np.eye(2, 42), [0]), r"shape \(1, 42\), one row per set .* not \(42,\)"),
        (lambda m: heat_igl.as_mesh(m, merge="all"), "merge must be one of 'seams', 'vertices'"),
        (
            lambda _: heat_igl.image_domain(SOLID).per_face(np.ones((2, 3, 2))),
            r"image must have shape \(2, 2, 2\), with further axes .* not \(2, 3, 2\)",
        ),
        (lambda m: HeatMethodSolver(m, magnitude="log"), "magnitude must be one of 'auto', 'unit', 'damped', not 'l"),
        *(
            (lambda _, D=D, times=times: heat_igl.activation_times(BOX, D, 0, times), said)
            for D, times, said in (
                (changed_in(6, 3, np.diag([1, 1, -1])), 0, r"D\[3\] .* definite \(1 of 6"),
                (np.diag([1, np.inf, 1]), 0, r"D\[0\] = .* must be finite"),
                (1e200 * np.eye(3), 0, r"D\[0\] = .* take another unit"),
                (np.eye(3), np.inf, r"times\[0\] = inf must be finite"),
                (np.eye(3), [0, 1], r"times must be one number, or 1, one for each of the sites, not of shape \(2,\)"),
                (np.eye(3), [-1e308, 1e308], r"times\[1\] = 1e\+308 must be finite, also after the first \(1 of 2"),
                (np.triu(np.ones((3, 3))), 0, r"D\[0\] = .* must be symmetric"),
            )
        ),
        *(
            (lambda _, mesh=mesh, g=g: heat_igl.metric_operators(mesh, g), said)
            for mesh, g, said in (
                (BOX, changed_in(8, 5, -np.eye(3)), r"metric\[5\] = .* must be positive definite"),
                (GRID, changed_in(32, 4, np.diag([1, -1, 1])), r"metric\[4\] = .* positive definite \(1 of 32 are not"),
                (GRID, changed_in(32, 5, np.diag([1, 0, 1])), r"metric\[5\] = .* must be positive definite"),
                (GRID, np.ones((31, 3, 3)), r"must have shape \(32, 3, 3\) or \(25, 3, 3\) or \(32, 2, 2\), .* \(31"),
            )
        ),
        (lambda _: GeodesicSolver(BOX).distance_vjp(0)[1].by_metric(np.ones(8)), "no metric to change: make it on m"),
    ),
    "TypeError": (
        (lambda m: write_line_drawing("a.svg", m, 3), "curves must be a SurfaceCurve or a list of such, not int"),
    ),
    "ReferenceSolverError": (
        (lambda m: closed_forms.plane(m, 0), "does not lie in a plane"),
        (lambda m: closed_forms.flat_torus(m.V, 0), r"coordinates of shape \(n, 2\)"),
    ),
}
ACCEPTED: dict[str, Callable[[heat_igl.Mesh], Any]] = {
    "far positions": lambda m: heat_igl.closest_points(m, [[0, 1e149, 0]]),
    "long lines": lambda _: heat_igl.exp_map(heat_igl.shapes.cylinder(3, 1, 1e6), 0, [[9, 4e5], [4e5, 9]]),
    "polygons": lambda _: PolygonMesh(SQUARE, [[0, 1, 2, 3]]),
    "last face": lambda m: SurfacePoints([0, 79], CENTRE * 2).positions(m),
    "edge lengths": lambda _: edge_length_operators(TRIANGLE, [[1, 1, 1]]),
    "gluing": lambda _: edge_length_operators([[0, 1, 1]], [[1, 3, 3]], twin=[[-1, 2, 1]]),
    "one tangent vector": lambda m: tangent_frames(m).to_world([1.0, 0], [0]),
    "corners in one place": lambda _: (
        np.testing.assert_allclose(geodesic_distance(POINTED, 0, cutoff=0.4)[RING], 0, atol=1e-9),
        np.testing.assert_allclose(karcher_mean(POINTED, [12, 12, 30], p=1).positions(POINTED), [BALL.V[0]], atol=1e-6),
        heat_igl.log_map(POINTED, 0),
        validate(LINE, 0, methods=["sweep"]),
    ),
    "curve in small units": lambda m: SignedHeatSolver((1e-45 * m.V, m.F)).distance(CURVE, level="constant"),
    "curve far away": lambda m: geodesic_distance((m.V + 1e13, m.F), CURVE),
    "nested sources": lambda m: geodesic_distance(m, OffsetSources([CURVE, 41], [0.0, 1.0])),
}


# --- files, token by token --------------------------------------------------------------------------------------------

# x: a coordinate, i: an index, n and m: the counts of vertices and faces.
PLY_HEADER = (
    "ply\nformat ascii 1.0\nelement vertex {n}\nproperty double x\nproperty double y\nproperty double z\n"
    "element face {m}\nproperty list uchar int vertex_indices\nend_header\n"
)
FACET = "facet normal 0 0 1\n outer loop\n  vertex {} 0 0\n  vertex 1 0 0\n  vertex 0 {} 0\n endloop\nendfacet\n"
VTU = """<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="{n}" NumberOfCells="{m}">
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">
{x} 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">{i} 1 2 0 1 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3 6</DataArray>
<DataArray type="Int64" Name="types" format="ascii">5 5</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"""
TEMPLATES = {
    "off": "OFF\n{n} {m} 0\n{x} 0 0\n1 0 0\n0 1 0\n0 0 1\n3 {i} 1 2\n3 0 1 3\n",
    "obj": "v {x} 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf {i} 2 3\nf 1 2 4\n",
    "ply": PLY_HEADER + "{x} 0 0\n1 0 0\n0 1 0\n0 0 1\n3 {i} 1 2\n3 0 1 3\n",
    "stl": "solid a\n" + FACET.format("{x}", 1) + FACET.format(0, 2) + "endsolid\n",
    "mesh": "MeshVersionFormatted 2\nDimension 3\nVertices\n{n}\n{x} 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
    "Triangles\n{m}\n{i} 2 3 0\n1 2 4 0\nEnd\n",
    "msh": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n1 {x} 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
    "$Elements\n{m}\n1 2 2 0 0 {i} 2 3\n2 2 2 0 0 1 2 4\n$EndElements\n",
    "4.msh": "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 {n} 1 4\n2 1 0 4\n1\n2\n3\n4\n"
    "{x} 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 {m} 1 2\n2 1 2 2\n1 {i} 2 3\n2 1 2 4\n$EndElements\n",
    "vtu": VTU,
}
TOKENS = {
    "x": ("nan", "-inf", "1e999", "abc", "1.2.3", "", "0 0", "--1", "é"),
    "i": ("-9", "99", "99999999999999999999", "1.5", "nan", "x", "2", ""),
    "n": ("5", "3", "0", "-4", "1000000000000", "99999999999999999999", "4.5", "x", ""),
    "m": ("3", "1", "0", "-2", "1000000000000", "99999999999999999999", "2.5", "x", ""),
}
# meshio says what is wrong with a VTU file, and names neither line nor token.
PLACE = r"line \d+|node 1\b|nodes \[|face [01]|vertex [01] \(counted|header announces|meshio|p[a-z]+ [01]"


def filled(extension: str, **tokens: str) -> bytes:
    base = "1" if extension.endswith(("obj", "mesh", "msh")) else "0"
    return TEMPLATES[extension].format(**{"x": "0", "i": base, "n": "4", "m": "2", **tokens}).encode()


def file_case(
    name: str, file: str, content: bytes, *patterns: str, read: Callable[[Path], Any] = heat_igl.read_mesh
) -> Case:
    """Read a file; every message must name it."""

    def run(directory: Path) -> Any:
        path = directory / file
        path.write_bytes(content)
        return read(path)

    return Case(f"{file}: {name}", run, patterns and (re.escape(file), *patterns))


def token_cases() -> Iterator[Case]:
    for extension, template in TEMPLATES.items():
        file = f"a.{extension}" if extension[0] != "4" else "a4.msh"
        yield file_case("neighbour", file, filled(extension))
        yield file_case("neighbour, x = -1.5e-3", file, filled(extension, x="-1.5e-3"))
        yield file_case("neighbour, CRLF", file, filled(extension).replace(b"\n", b"\r\n"))
        for field, tokens in TOKENS.items():
            if f"{{{field}}}" not in template:
                continue
            for token in tokens:
                if token == "0 0" and extension in ("off", "obj"):
                    continue  # what follows the position is a colour there
                # Vertex 2 is a repeated one where counting starts at 1, and so is 1 elsewhere.
                token = "1" if (field, token) == ("i", "2") and filled(extension) == filled(extension, i="0") else token
                yield file_case(f"{field} = {token!r}", file, filled(extension, **{field: token}), PLACE)


# --- files as a whole -------------------------------------------------------------------------------------------------


def binary_files() -> dict[str, bytes]:
    """A small valid binary file of each format that has one."""
    ply = b"ply\nformat binary_%s_endian 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty float z\n"
    ply += b"property uchar red\nelement face 2\nproperty list uchar int vertex_index\nend_header\n"
    found = {}
    for name, order in ((b"little", "<"), (b"big", ">")):
        rows = b"".join(struct.pack(order + "dffB", *row, 200) for row in V4)
        rows += b"".join(struct.pack(order + "B3i", 3, *face) for face in TRIANGLES)
        found[f"{name.decode()}.ply"] = ply % name + rows
    # A triangle and a quadrilateral, so that rows differ in length.
    mixed = struct.pack("<B3i", 3, 0, 1, 2) + struct.pack("<B4i", 4, 0, 1, 2, 3)
    found["mixed.ply"] = found["little.ply"][: -2 * 13] + mixed
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *V4[face].ravel(), 0) for face in TRIANGLES)
    found["binary.stl"] = b"solid but binary".ljust(80, b"\0") + struct.pack("<I", 2) + facets
    nodes = b"".join(struct.pack("<i3d", i, *row) for i, row in enumerate(V4, 1))
    elements = struct.pack("<3i", 2, 2, 2) + b"".join(struct.pack("<6i", 1, 0, 0, *(face + 1)) for face in TRIANGLES)
    head = b"$MeshFormat\n%s 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n"
    body = b"$Nodes\n4\n" + nodes + b"\n$EndNodes\n$Elements\n2\n" + elements + b"\n$EndElements\n"
    found["binary2.msh"] = head % b"2.2" + body
    nodes = struct.pack("<4Q3iQ4Q", 1, 4, 1, 4, 2, 1, 0, 4, 1, 2, 3, 4) + V4.tobytes()
    elements = struct.pack("<4Q3iQ", 1, 2, 1, 2, 2, 1, 2, 2)
    elements += b"".join(struct.pack("<4Q", i, *(face + 1)) for i, face in enumerate(TRIANGLES, 1))
    found["binary4.msh"] = (
        head % b"4.1" + b"$Nodes\n" + nodes + b"\n$EndNodes\n$Elements\n" + elements + b"\n$EndElements\n"
    )
    return found


def garbage() -> dict[str, bytes]:
    noise = random.Random(20130613).randbytes(4000)
    return {
        "empty": b"",
        "blank": b" \n\n\t\n",
        "zeros": bytes(500),
        "noise": noise,
        "text": b"Dear all,\n\nplease find the mesh attached.\n\nBest wishes\n",
        "html": b"<!DOCTYPE html>\n<html><head><title>404</title></head></html>\n",
        "numbers": b"1 2 3\n" * 50,
        "one number": b"7",
        "utf-16": "OFF\n4 2 0\n".encode("utf-16"),
        "pointer": b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
        "one long line": b"v 1" * 3000,
        "brackets": b"[" * 5000,
    }


def whole_file_cases() -> Iterator[Case]:
    for kind, content in garbage().items():
        for extension in EXTENSIONS:
            yield file_case(
                f"{kind}", f"a.{extension}", content, r"line \d|empty|header|starts with|meshio|no faces|is missing"
            )
    for extension in ("off", "obj"):
        wide = filled(extension).decode().encode("utf-16")
        yield file_case("whole but in UTF-16", f"a.{extension}", wide, "line 1: a zero byte.*save it as UTF-8 text")
    for file, content in binary_files().items():
        yield file_case("neighbour", file, content)
        yield file_case("one byte short", file, content.rstrip(b"\n")[:-1], "cut short|announced|counts say")
        yield file_case("half", file, content[: len(content) // 2], "cut short|missing")
        if not file.endswith(".msh"):  # which may go on with other sections
            yield file_case("surplus", file, content + b"surplus", "announces|follow|longer|header")
    other = {"a.off": "obj", "a.obj": "off", "a.ply": "stl", "a.stl": "ply", "a.mesh": "msh", "a.msh": "mesh"}
    for file, extension in other.items():
        yield file_case(f"content is {extension}", file, filled(extension), r"line \d|starts with|is missing")
    yield file_case(
        "no tetrahedra", "a.mesh", filled("mesh").replace(b"Triangles", b"Edges"), "neither triangles nor|meshio"
    )
    tets = TEMPLATES["msh"].replace("1 2 2 0 0 {i} 2 3\n2 2 2 0 0 1 2 4\n", "1 4 2 0 0 1 2 3 4\n").encode()
    tets = tets.replace(b"{n}", b"4").replace(b"{x}", b"0").replace(b"{m}", b"1")
    yield file_case("tetrahedra, neighbour", "tet.msh", tets)
    no_polygons = "the file holds tetrahedra, not polygons"
    yield file_case("tetrahedra for polygons", "tet.msh", tets, no_polygons, read=heat_igl.read_polygon_mesh)
    whole = b"1 4 2 0 0 1 2 3 4"
    for name, old, new, says in (
        ("hexahedra", b"1 4 2", b"1 5 2", "meshio cannot read"),
        ("a point only", whole, b"1 15 2 0 0 1", "neither triangles nor tetrahedra"),
        ("second order", whole, b"1 9 2 0 0 1 2 3 4 1 2", "triangle6"),
        ("node twice", b"\n3 0 1 0", b"\n2 0 1 0", "tetrahedron 1 .*: there is no vertex"),
        ("unlisted node", b"2 3 4\n$End", b"2 3 0\n$End", "line 13 .*: node number 0"),
        ("giant node number", b"\n4 0 0 1", b"\n2000000000 0 0 1", "line 9 .*: node number 2000000000"),
        ("version 4.0", b"2.2", b"4.0", "line 5 .*: expected 4 numbers"),
    ):
        yield file_case(name, "tet.msh", tets.replace(old, new), says)
    yield file_case("a line more", "a.off", filled("off") + b"3 0 1 2\n", "longer than announced")
    yield file_case("BINARY", "a.off", b"OFF BINARY\n\0\0\0\4", "line 1|BINARY|binary")
    yield file_case("1e300", "a.off", filled("off", x="1e300"), "V spans .*rescale V")
    yield file_case("4OFF", "a.off", b"4OFF\n1 1 0\n0 0 0 0\n", "line 1.*not for points in space")
    yield file_case("edge as face", "a.off", filled("off").replace(b"3 0 1 3", b"2 0 1"), "line 8.*2 corners")
    yield file_case("face without index", "a.off", filled("off").replace(b"3 0 1 3", b"4 0 1 3"), "line 8.*4 corners")
    yield file_case("vertex of two numbers", "a.off", filled("off").replace(b"1 0 0", b"1 0"), "line 4.*three coord")
    for face in ("4 0 1 2 1", "4 0 1 0 2", "5 0 1 2 3 1"):
        says = rf"line 8 \({face}\): a face repeats a vertex \(1 of 2 faces do\)"
        yield file_case(f"face {face}", "a.off", filled("off").replace(b"3 0 1 3", face.encode()), says)
    yield file_case("index 0", "a.obj", filled("obj", i="0"), "line 5 .*counts vertices from 1")
    yield file_case("index -5", "a.obj", filled("obj", i="-5"), r"line 5 \(f -5 2 3\)")
    yield file_case("index -4, neighbour", "a.obj", filled("obj", i="-4"))
    yield file_case("two corners", "a.obj", filled("obj", i=""), "line 5 .*three corners")
    yield file_case("damaged keyword", "a.obj", filled("obj").replace(b"v 0 1 0", b"w 0 1 0"), r"line 3 \(w 0 1 0\)")
    yield file_case("no faces", "a.obj", b"v 0 0 0\nv 1 0 0\n", "no faces")
    yield file_case("no vertices", "a.obj", b"f 1 2 3\n", "no vertices")
    ply = filled("ply")
    for name, old, new, pattern in (
        ("no z", b"property double z\n", b"", "more numbers|x, y and z"),
        ("z of unknown type", b"double z", b"quad z", "line 6"),
        ("z twice", b"double z", b"double y", "twice"),
        ("no format", b"format ascii 1.0\n", b"", "format"),
        ("no list", b"property list uchar int vertex", b"property int vertex", "numbers|vertex_indices"),
        ("list counted by float", b"list uchar int", b"list float int", "line 8"),
        ("another list", b"vertex_indices", b"corners", "vertex_indices"),
        ("no end_header", b"end_header\n", b"", "end_header"),
        ("faces twice", b"element face 2\n", b"element face 0\nelement face 2\n", "twice"),
        ("two corners", b"3 0 1 3", b"2 0 1", "face 1 .*2 corners"),
        ("giant list", b"3 0 1 3", b"999999999999 0 1 3", "line 15.*too few numbers"),
        ("negative list", b"3 0 1 3", b"-1 0 1 3", "line 15.*too few numbers"),
    ):
        yield file_case(name, "a.ply", ply.replace(old, new), pattern)
    binary = binary_files()["little.ply"]
    for count in (b"5", b"3", b"1000000000000", b"0"):
        bad = binary.replace(b"vertex 4", b"vertex " + count)
        yield file_case(f"{count!r} vertices", "a.ply", bad, "announces|follow|face . ")
        bad = binary.replace(b"face 2", b"face " + count)
        says = "points without faces" if count == b"0" else "announces|follow"
        yield file_case(f"{count!r} faces", "a.ply", bad, says)
    stl = binary_files()["binary.stl"]
    for count in (0, 1, 3, 2**32 - 1):
        bad = stl[:80] + struct.pack("<I", count) + stl[84:]
        yield file_case(f"{count} triangles", "a.stl", bad, f"announces {count} triangles.*of 184")
    yield file_case("NaN", "a.stl", stl[:96] + struct.pack("<f", np.nan) + stl[100:], "vertex 0 .*not finite")
    yield file_case("one point", "a.stl", stl[:84] + bytes(100), "none is left")
    yield file_case("no triangles", "a.stl", stl[:80] + bytes(4), "holds neither triangles")
    four_corners = filled("stl").replace(b" endloop", b" vertex 1 1 1\n endloop")
    yield file_case("quadrilateral", "a.stl", four_corners, "line 2 .*this facet is damaged")
    vtu = filled("vtu")
    piece = vtu[vtu.index(b"<Piece") : vtu.index(b"</Piece>") + 8]
    yield file_case("two pieces", "a.vtu", vtu.replace(piece, piece + piece), "2 pieces")
    attribute = b'<PointData><DataArray type="Float64" Name="d" format="ascii">1 2</DataArray></PointData></Piece>'
    yield file_case("short attribute", "a.vtu", vtu.replace(b"</Piece>", attribute), r"len\(point_data")
    yield file_case("other grid", "a.vtu", vtu.replace(b"UnstructuredGrid", b"PolyData"), "PolyData")


def points_and_curves_cases() -> Iterator[Case]:
    for file, text, says in (
        ("a.xyz", "0 0 0\n1 0 0\n1 2\n", r"line 3 \(1 2\): a point has 3 numbers, or 6 with a normal"),
        ("a.xyz", "0 0 0\n1 0 x\n", "line 2 .*'x' is not a number"),
        ("a.xyz", "0 0 0\n1 0 0\n", "a.xyz: P has 2 points"),
        ("a.obj", "v 0 0\n", "line 1 .*a vertex needs three coordinates"),
        ("a.obj", "vn 0 0 1\n", "the file has no points"),
        ("a.npy", "no array", "not an array in the format of numpy.save"),
        ("a.ply", "ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"),
        ("a.pcd", "", "pass open3d.io.read_point_cloud"),
        ("a.las", "", "unknown extension '.las'; the formats are .ply, .obj, .xyz, .npy"),
    ):
        yield file_case(f"points, {says}", file, text.encode(), says, read=heat_igl.read_point_cloud)
    for text, says in (
        ("v 0 0 0\nv 1 0 0\n", "holds no curve"),
        ("v 0 0 0\nl 1 2\n", r"line 2 \(l 1 2\): no such vertex is among the 1 in the file"),
        ("v 0 zero 0\nl 1 1\n", r"line 1 \(v 0 zero 0\): 'zero' is not a number"),
        ("v 0 0 0\nl 1\n", r"line 2 \(l 1\): a curve needs two vertices or more"),
    ):
        yield file_case(f"curves, {says}", "bad.obj", text.encode(), says, read=read_polylines)


# --- paths and writing ------------------------------------------------------------------------------------------------


def path_cases() -> Iterator[Case]:
    def read(name: Any, *patterns: str) -> Case:
        return Case(f"path {name!r}", lambda directory: heat_igl.read_mesh(directory / name), patterns)

    yield read("missing.off", "missing.off: no such file")
    yield read("missing/a.off", "a.off: no such file")
    for name in ("a.xyz", "a", "a.blend", ".off"):
        yield read(name, re.escape(name), "unknown extension", ".off, .obj")
    yield read("nul\0.off", "cannot be a path")
    yield read("surrogate\udc80\ud800.off", "cannot be a path")
    yield read("x" * 300 + ".off", "cannot be read")
    for bad in (None, 3, V4, b"a.off"):
        patterns = ("path must be a string",)
        yield Case(f"path {type(bad).__name__}", lambda _, bad=bad: heat_igl.read_mesh(bad), patterns)

    def directory_named_off(directory: Path) -> None:
        (directory / "folder.off").mkdir()
        heat_igl.read_mesh(directory / "folder.off")

    yield Case("directory", directory_named_off, ("folder.off is a directory",))

    def below_a_file(directory: Path) -> None:
        (directory / "file").write_text("")
        heat_igl.read_mesh(directory / "file" / "a.off")

    yield Case("below a file", below_a_file, ("a.off cannot be read: Not a directory",))

    def pipe(directory: Path) -> None:
        os.mkfifo(directory / "pipe.off")
        heat_igl.read_mesh(directory / "pipe.off")

    def as_nobody(action: Callable[[Path], Any]) -> Callable[[Path], Any]:
        def run(directory: Path) -> Any:
            was = os.geteuid()
            if was == 0:  # permissions do not bind root
                os.seteuid(65534)
            try:
                return action(directory)
            finally:
                os.seteuid(was)

        return run

    def write_file(directory: Path) -> Path:
        path = directory / "locked.off"
        path.write_bytes(filled("off"))
        return path

    def locked(directory: Path) -> None:
        path = write_file(directory)
        path.chmod(0)
        as_nobody(lambda _: heat_igl.read_mesh(path))(directory)

    def locked_folder(directory: Path) -> None:
        folder = directory / "locked"
        folder.mkdir()
        folder.chmod(0o500)
        as_nobody(lambda _: heat_igl.write_mesh(folder / "a.off", heat_igl.Mesh(V4, TRIANGLES)))(directory)

    if hasattr(os, "mkfifo"):
        yield Case("pipe", pipe, ("pipe.off is not a regular file",))
        yield Case("locked file, neighbour", lambda directory: heat_igl.read_mesh(write_file(directory)))
        yield Case("locked file", locked, ("locked.off cannot be read: Permission denied",))
        yield Case("locked folder", locked_folder, ("a.off cannot be written: Permission denied",))


def write_cases() -> Iterator[Case]:
    surface, solid, phi = heat_igl.Mesh(V4, TRIANGLES), heat_igl.Mesh(V4, TETRAHEDRA), np.arange(4.0)

    def write(name: str, file: str, mesh: Any, *patterns: str, **attributes: Any) -> Case:
        def run(directory: Path) -> None:
            heat_igl.write_mesh(directory / file, mesh, **attributes)

        return Case(f"write {file}: {name}", run, patterns)

    for extension in ("off", "obj", "stl", "mesh", "msh"):
        yield write("neighbour", f"w.{extension}", surface)
        patterns = (rf"w.{extension}: .*no vertex attributes \(phi\)", ".ply, .vtu and .gii")
        yield write("attribute", f"w.{extension}", surface, *patterns, phi=phi)
    for extension in ("off", "obj", "stl", "ply"):
        yield write("tetrahedra", f"w.{extension}", solid, rf"w.{extension}.*no tetrahedra", ".mesh, .msh and .vtu")
    for file in ("w.ply", "w.vtu"):
        yield write("attributes, neighbour", file, surface, phi=phi, inf=phi / [0.5, 1, 2, np.inf])
        for bad in (phi[:3], phi[None], np.empty((4, 0)), 1.0):
            shape = re.escape(str(np.shape(bad)))
            yield write(f"shape {np.shape(bad)}", file, surface, "phi must have shape", shape, phi=bad)
        for bad in (phi.astype(complex), phi.astype(str), np.array([None] * 4)):
            yield write(f"{bad.dtype}", file, surface, f"phi must hold real numbers.*{bad.dtype}", phi=bad)
        large = np.array([2**53 + 2, 0, 0, 0])
        yield write("2**53 + 1", file, surface, r"phi holds integers beyond 2\*\*53", phi=large)
        for name in ("x", "a b", "", "1", "é", '"'):
            yield write(f"name {name!r}", file, surface, "cannot name an attribute", **{name: phi})
    yield write("unknown extension", "w.xyz", surface, "unknown extension '.xyz'")
    yield write("missing folder", "missing/w.off", surface, "w.off cannot be written: No such file")
    yield write("mesh ndarray", "w.off", V4, "faces F are missing")


GENERATORS: tuple[Callable[[], Iterator[Case]], ...] = (
    array_cases,
    source_cases,
    token_cases,
    whole_file_cases,
    points_and_curves_cases,
    path_cases,
    write_cases,
    argument_cases,
)


@cache
def cases() -> dict[str, Case]:
    found: dict[str, Case] = {}
    for generate in GENERATORS:
        for case in generate():
            # A file may be bad in the same words for two reasons; both run.
            name = case.name if case.name not in found else f"{case.name} ({len(found)})"
            found[name] = replace(case, name=name)
    return found


# --- fuzzing ----------------------------------------------------------------------------------------------------------


def valid_files(directory: Path) -> dict[str, bytes]:
    """A small file of each format, and of each of its forms."""
    text = {f"text.{extension}" if extension[0] != "4" else "text4.msh": filled(extension) for extension in TEMPLATES}
    written = {}
    for suffix in (".gii", ".white", ".vtu", ".off.gz"):
        path = directory / f"written{suffix}"
        heat_igl.write_mesh(path, heat_igl.Mesh(V4, TRIANGLES))
        written[path.name] = path.read_bytes()
    return text | binary_files() | written


def fuzz(directory: Path, rounds: int) -> dict[str, Any]:
    """Every prefix and many mutations of every valid file; what is neither a mesh nor a MeshError is reported."""
    generator = random.Random(55)
    files = valid_files(directory)
    outcome: dict[str, Any] = {"files": list(files), "unclear": [], "accepted prefixes": []}

    def attempt(file: str, content: bytes) -> bool:
        path = directory / file
        path.write_bytes(content)
        try:
            found = heat_igl.as_mesh(path)
        except (MeshError, AccuracyWarning) as error:  # warnings are errors here
            if file not in str(error):
                outcome["unclear"].append([file, content.hex(), str(error)])
            return False
        except BaseException as error:
            outcome["unclear"].append([file, content.hex(), repr(error)])
            return False
        if not (isinstance(found, heat_igl.Mesh) and found.n_faces and np.isfinite(found.V).all()):
            outcome["unclear"].append([file, content.hex(), repr(found)])
        return True

    for file, content in files.items():
        whole = content.rstrip()
        if not file.endswith(".obj"):  # which has neither counts nor an end
            accepted = [size for size in range(len(whole)) if attempt(file, whole[:size])]
            outcome["accepted prefixes"] += [[file, size] for size in accepted]
        for _ in range(rounds):
            mutated = bytearray(content)
            for _ in range(generator.randint(1, 3)):
                at = generator.randrange(len(mutated))
                match generator.randrange(4):
                    case 0:
                        mutated[at] = generator.randrange(256)
                    case 1:
                        del mutated[at : at + generator.randint(1, 9)]
                    case 2:
                        mutated[at:at] = generator.choice(
                            [b"9", b"-", b" ", b"\n", b"\0", b"nan ", b"1e9", b"\xff" * 4]
                        )
                    case 3:
                        mutated[at:at] = mutated[at : at + generator.randint(1, 40)]
                mutated = mutated or bytearray(b"x")
            attempt(file, bytes(mutated))
    return outcome


# --- the subprocess and the tests -------------------------------------------------------------------------------------


def run_all(directory: Path) -> None:
    try:
        import resource

        # An array as large as a header may claim fails here, instead of filling the machine.
        resource.setrlimit(resource.RLIMIT_AS, (6 * 2**30, 6 * 2**30))
    except (ImportError, ValueError):
        pass
    for number, (name, case) in enumerate(cases().items()):
        print(json.dumps({"start": name}), flush=True)
        place = directory / str(number)
        place.mkdir()
        try:
            case.run(place)
            outcome = {"error": "", "message": ""}
        except BaseException as error:
            outcome = {"error": type(error).__name__, "message": str(error)}
        print(json.dumps({"name": name, **outcome}), flush=True)
    print(json.dumps({"start": "fuzz"}), flush=True)
    print(json.dumps({"name": "fuzz", **fuzz(directory, 100)}), flush=True)


@pytest.fixture(scope="session")
def outcomes(tmp_path_factory):
    directory = tmp_path_factory.mktemp("bad_input")
    done = run_python("-W", "error", __file__, str(directory), cwd=directory, timeout=300)
    lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    assert done.returncode == 0, f"the interpreter died ({done.returncode}) in {lines[-1:]}: {done.stderr[-2000:]}"
    assert done.stdout.count("\n") == len(lines), "a reader printed something"
    return {line["name"]: line for line in lines if "name" in line}


@pytest.mark.parametrize("name", cases())
def test_case(name, outcomes):
    case, outcome = cases()[name], outcomes[name]
    if not case.patterns:
        assert outcome["error"] == "", outcome["message"]
        return
    assert outcome["error"] in case.error.split("|"), outcome["message"]
    for pattern in case.patterns:
        assert re.search(pattern, outcome["message"]), outcome["message"]


def test_mutated_files_are_meshes_or_mesh_errors(outcomes):
    """1800 of them; no cloud either. All surfaces of FreeSurfer are read alike."""
    formats = {f".{file.split('.')[1]}" for file in outcomes["fuzz"]["files"]}
    assert formats == set(MESH_SUFFIXES) - set(FREESURFER_SUFFIXES) | {".white"}
    assert outcomes["fuzz"]["unclear"] == []


def test_every_cut_is_noticed(outcomes):
    assert outcomes["fuzz"]["accepted prefixes"] == []


if __name__ == "__main__":
    run_all(Path(sys.argv[1]))
