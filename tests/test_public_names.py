"""The names that users have, and how the functions among them are called: these stay."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

import heat_igl

# All that `heat_igl.__all__` has ever held.
EXPORTED = """
AccuracyWarning BatchError ClosestPoints Diagnostics FactorizationError HeatMethodSolver HeatSolution ImageDomain
LabelledDistance Mesh MeshError MeshReport MissingExtraError OffsetSources Operators PointCloud PolygonMesh
ReferenceSolverError SourceError SurfaceCurve SurfacePoints TangentFrames ValidationReport ValidationRow
VectorHeatSolver VoronoiCells as_mesh baselines closed_forms closest_points cluster connection_laplacian curve_on
diameter distance_matrix distances_within dual_triangulation edge_curve enclosed_areas exp_map farthest_cells
farthest_points geodesic_centre geodesic_distance heat_method_distance image_domain isolines metrics nearest_vertices
offset_curves pair_distances plots point_cloud_operators polygon_operators read_attributes
read_distances_within read_mesh read_point_cloud
read_polygon_mesh reference sample_mesh sampling shapes shortest_paths speed_operators split_long_edges sublevel_areas
tangent_frames trace_geodesic CentroidalSites GeodesicPathSolver centroidal_voronoi
geodesic_bezier geodesic_path handle_loops karcher_mean straighten
Directions log_map
GeodesicSolver validate voronoi_cells write_curves write_distances_within write_mesh write_point_cloud
fibre_metric metric_operators
DomainReport DomainRow validate_domains
CutMesh OrientedPoints SignedHeatSolver VoxelBox cut region_boundary volume_signed_distance
Terrain curve_through geodesic_errors log_maps_within parcel_distances signed_distance smooth terrain to_open3d
to_pyvista to_trimesh
""".split()

# Arguments and their defaults, in their order; those after the star may come in any. More arguments may follow, if they
# have defaults.
CALLS = """
Mesh(V, F)
Mesh.report(self)
PolygonMesh(V, polygons)
PointCloud(P, normals=None)
SurfacePoints(faces, barycentric)
SurfaceCurve(faces, start, end, is_closed=False)
OffsetSources(sources, offsets)
read_mesh(path)
read_attributes(path)
read_polygon_mesh(path)
read_point_cloud(path)
write_mesh(path, mesh)
write_curves(path, mesh, curves, *, projection=None)
write_point_cloud(path, cloud)
heat_method_distance(V, F, sources)
geodesic_distance(mesh, sources, *, method='auto', tolerance=1e-05, cutoff=None, targets=None, region=None)
GeodesicSolver(mesh, *, method='auto', tolerance=1e-05, region=None)
GeodesicSolver.with_vertices(self, V)
GeodesicSolver.distance(self, sources, cutoff=None)
GeodesicSolver.distances(self, source_sets, out=None, progress=False, dtype=None, *, cutoff=None)
GeodesicSolver.voronoi(self, sources, *, cutoff=None)
GeodesicSolver.directions(self, sources)
GeodesicSolver.distance_vjp(self, sources)
as_mesh(mesh, F=None)
sample_mesh()
HeatMethodSolver(mesh, F=None, *, t_coef=None, t=None, laplacian='auto', boundary='neumann',\
 magnitude='auto', backend='auto')
HeatMethodSolver.from_operators(domain, *, t_coef=None, t=None, boundary='neumann', magnitude='auto',\
 backend='auto')
HeatMethodSolver.with_vertices(self, V)
HeatMethodSolver.distance(self, sources, cutoff=None)
HeatMethodSolver.distances(self, source_sets, out=None, progress=False, dtype=None, *, cutoff=None)
HeatMethodSolver.voronoi(self, sources, *, cutoff=None)
HeatMethodSolver.solve(self, sources)
HeatMethodSolver.distance_vjp(self, sources)
isolines(mesh, values, levels)
offset_curves(mesh, solver, sources, radius)
enclosed_areas(mesh, values, level)
sublevel_areas(mesh, values, levels)
shortest_paths(mesh, distance, targets, sources=None)
tangent_frames(mesh)
trace_geodesic(mesh, start, direction, length)
exp_map(mesh, source, vectors)
log_map(mesh, source, *, method='exact')
connection_laplacian(mesh, laplacian='intrinsic-delaunay')
VectorHeatSolver(mesh, *, t_coef=None, t=None, method='heat', backend='auto')
VectorHeatSolver.extend(self, sources, values)
VectorHeatSolver.transport(self, sources, vectors)
VectorHeatSolver.log_map(self, source)
OrientedPoints(points, normals)
SignedHeatSolver(mesh, *, method=None, t_coef=None, t=None, backend='auto')
SignedHeatSolver.distance(self, curves, *, unsigned=None, level=None)
cut(mesh, curves)
region_boundary(mesh, *, faces=None, vertices=None)
VoxelBox(origin, spacing, shape)
volume_signed_distance(domain, surface, *, t_coef=1.0)
closest_points(mesh, positions)
curve_on(mesh, positions, *, closed=False, tolerance=None)
edge_curve(mesh, vertices, *, closed=False)
image_domain(mask, spacing=1.0)
split_long_edges(mesh, longest=None)
polygon_operators(mesh)
point_cloud_operators(cloud)
speed_operators(mesh, speed)
metric_operators(mesh, metric, laplacian='auto')
fibre_metric(directions, along, across)
farthest_points(solver, k, *, start=0)
farthest_cells(solver, k, *, start=0)
voronoi_cells(solver, sites)
dual_triangulation(mesh, cells)
geodesic_centre(mesh, solver, points, weights=None)
diameter(solver, *, start=0, rounds=10)
distance_matrix(solver, indices=None)
distances_within(mesh, radius, sources=None)
nearest_vertices(mesh, k, sources=None)
pair_distances(mesh, pairs)
write_distances_within(path, mesh, radius, sources=None)
read_distances_within(path, rows=None)
validate(mesh, sources, methods=('heat', 'sweep', 'windows', 'meshlab', 'igl'), reference='exact', *, name='mesh',\
 progress=None)
validation.draw_sources(mesh, count, seed=0)
validate_domains(domains=None, *, seed=0, progress=None)
closed_forms.sphere(mesh, sources, *, center=(0.0, 0.0, 0.0))
metrics.relative_error(distance, truth)
cluster.distances(meshes, sources, store, *, client=None, method=None, tolerance=1e-05, dtype='float32', progress=False)
cluster.connected(scheduler=None, n_workers=None, dashboard=False)
cluster.folder(path)
cluster.read_source_sets(path)
reference.exact(mesh, sources, *, solver='windows')
reference.meshlab(mesh, sources)
reference.meshlab_heat(mesh, sources, *, m=1.0)
reference.meshlab_border(mesh)
reference.close()
shapes.grid(n)
shapes.icosphere(subdivisions)
shapes.strip(length, width)
steps.diffuse(operators, u0, t, boundary='neumann')
steps.normalize(operators, u, of_log=False)
steps.integrate(operators, X)
steps.damping(operators, u, t, full_rate=None, fitted=False)
steps.fitted_laplacian(domain, t)
operators.operators(mesh, laplacian='intrinsic-delaunay')
plots.plot(mesh, distance, *, sources=None, spacing=None, style='lines', curves=(), view=None, up='y')
plots.plot_field(mesh, values, *, label, limits=None, spacing=None, sources=None, curves=(), view=None, up='y')
plots.page(mesh, distance, *, sources=None, spacing=None, style='lines', view=None, up='y')
plots.picture(path, mesh, distance)
""".strip().splitlines()

# The statements of README, guide and notebooks.
STATEMENTS = [
    "from heat_igl.applications import EdgeSearch, particle_length, reconstruct, skeleton, zones_of_influence",
    "from heat_igl.heat_method import HeatMethodSolver",
    "from heat_igl.io import read_mesh",
    "from heat_igl.mesh import Mesh",
    "from heat_igl.operators import Operators, operators",
    "from heat_igl.steps import damping, diffuse, fitted_laplacian, integrate, normalize",
    "from heat_igl.validation import draw_sources",
]

RESULTS = {
    "HeatSolution": "heat direction distance t diagnostics",
    "LabelledDistance": "distance labels",
    "VoronoiCells": "sites distance labels",
}


def found(name: str) -> Any:
    value: Any = heat_igl
    for part in name.split("."):
        value = getattr(value, part)
    return value


@pytest.mark.parametrize("name", EXPORTED)
def test_exported_names_stay(name: str) -> None:
    assert name in heat_igl.__all__
    assert found(name) is not None


def test_no_name_is_exported_without_being_listed_here() -> None:
    assert sorted(heat_igl.__all__) == sorted(EXPORTED)


def expected_arguments(call: str) -> dict[str, tuple[bool, Any]]:
    """Whether each argument is named only, and its default, `inspect.Parameter.empty` if it has none."""
    arguments = ast.parse(f"def f({call.partition('(')[2].removesuffix(')')}): pass").body[0].args
    empty = inspect.Parameter.empty
    missing = [empty] * (len(arguments.args) - len(arguments.defaults))
    defaults = [*missing, *map(ast.literal_eval, arguments.defaults)]
    named = [empty if node is None else ast.literal_eval(node) for node in arguments.kw_defaults]
    return {arg.arg: (False, default) for arg, default in zip(arguments.args, defaults, strict=True)} | {
        arg.arg: (True, default) for arg, default in zip(arguments.kwonlyargs, named, strict=True)
    }


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.partition("(")[0])
def test_calls_stay(call: str) -> None:
    function: Callable[..., Any] = found(call.partition("(")[0])
    actual = inspect.signature(function).parameters
    expected = expected_arguments(call)
    for name, (named_only, default) in expected.items():
        assert actual[name].default == default, name
        assert named_only or actual[name].kind is not inspect.Parameter.KEYWORD_ONLY, name
    in_order = [name for name, (named_only, _) in expected.items() if not named_only]
    assert list(actual)[: len(in_order)] == in_order
    variadic = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    added = [p for p in actual.values() if p.name not in expected and p.kind not in variadic]
    assert [p.name for p in added if p.default is inspect.Parameter.empty] == []


@pytest.mark.parametrize("statement", STATEMENTS)
def test_statements_stay(statement: str) -> None:
    """In a new interpreter, in which nothing else has been imported."""
    done = subprocess.run([sys.executable, "-c", statement], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("name", "fields"), RESULTS.items())
def test_results_keep_their_fields(name: str, fields: str) -> None:
    annotated = inspect.get_annotations(found(name))
    assert [field for field in fields.split() if field not in annotated and not hasattr(found(name), field)] == []


def test_a_solver_shows_its_time_step_and_operators() -> None:
    solver = heat_igl.HeatMethodSolver(heat_igl.shapes.grid(8))
    assert solver.t > 0
    n, m = 81, 128
    shapes = {name: getattr(solver.operators, name).shape for name in "LMGD"}
    assert shapes["L"] == shapes["M"] == (n, n)
    assert shapes["G"][1] == shapes["D"][0] == n
    assert shapes["G"][0] == shapes["D"][1] in (2 * m, 3 * m)
    assert {getattr(solver.operators, name).format for name in "LMGD"} == {"csc"}


def test_a_mesh_shows_its_parts() -> None:
    mesh = heat_igl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert (mesh.V.shape, mesh.F.shape, mesh.n_vertices, mesh.n_faces) == ((3, 3), (1, 3), 3, 1)
    assert mesh.components.tolist() == [0, 0, 0]
    assert isinstance(mesh.report(), heat_igl.MeshReport)
