"""The public contract: names, arguments and defaults that stay. Later arguments are by keyword and have defaults."""

import functools
import inspect

import pytest

import heat_igl

CONTRACT = """
read_mesh(path)
write_mesh(path, mesh)
as_mesh(mesh, F=None)
Mesh(V, F)
PolygonMesh(V, polygons)
PointCloud(P, normals=None)
geodesic_distance(mesh, sources, *, method="auto", tolerance=1e-5, cutoff=None, targets=None, region=None)
GeodesicSolver(mesh, *, method="auto", tolerance=1e-5, region=None)
GeodesicSolver.distance(self, sources, *, cutoff=None)
GeodesicSolver.distances(self, source_sets, *, out=None, progress=False)
GeodesicSolver.voronoi(self, sources)
GeodesicSolver.with_vertices(self, V)
GeodesicSolver.directions(self, sources)
GeodesicSolver.distance_vjp(self, sources)
HeatMethodSolver(mesh, *, t_coef=None, t=None, laplacian="auto", boundary="neumann", magnitude="auto", backend="auto")
HeatMethodSolver.distance(self, sources, *, cutoff=None)
HeatMethodSolver.distances(self, source_sets, *, out=None, progress=False)
HeatMethodSolver.voronoi(self, sources)
HeatMethodSolver.solve(self, sources)
HeatMethodSolver.with_vertices(self, V)
SurfacePoints(faces, barycentric)
OffsetSources(sources, offsets)
distances_within(mesh, radius, sources=None)
nearest_vertices(mesh, k, sources=None)
pair_distances(mesh, pairs)
tangent_frames(mesh)
log_map(mesh, source, *, method="exact")
log_maps_within(mesh, radius, sources=None)
exp_map(mesh, source, vectors)
trace_geodesic(mesh, start, direction, length)
VectorHeatSolver(mesh)
VectorHeatSolver.extend(self, sources, values)
VectorHeatSolver.transport(self, sources, vectors)
VectorHeatSolver.log_map(self, source)
shortest_path(mesh, a, b)
shortest_paths(mesh, targets, sources)
geodesic_path(mesh, waypoints, closed=False)
curve_through(mesh, points, *, closed=False)
straighten(mesh, curve)
karcher_mean(mesh, points, weights=None, p=2)
isolines(mesh, values, levels)
cut(mesh, curves)
signed_distance(mesh, curve)
SignedHeatSolver(mesh)
SignedHeatSolver.distance(self, curves)
metric_operators(mesh, metric)
activation_times(mesh, D, sites, times=0)
parcel_distances(mesh, labels, *, statistic="mean", region=None)
smooth(mesh, values, fwhm)
terrain(heights, spacing=1.0)
geodesic_errors(mesh, matches, truth)
to_trimesh(mesh)
to_pyvista(mesh)
to_open3d(mesh)
validate(mesh, sources)
shapes.icosphere(subdivisions)
shapes.grid(n)
shapes.strip(length, width)
reference.exact(mesh, sources)
reference.meshlab(mesh, sources)
cluster.distances(meshes, sources, store)
""".split("\n")[1:-1]  # fmt: skip


@pytest.mark.parametrize("line", CONTRACT)
def test_a_name_takes_the_arguments_of_the_contract(line):
    name, _, arguments = line.partition("(")
    if name.startswith("cluster"):
        pytest.importorskip("distributed")
    names = {}
    exec(f"def promised({arguments}: ...", names)
    promised = inspect.signature(names["promised"]).parameters
    found = inspect.signature(functools.reduce(getattr, name.split("."), heat_igl)).parameters
    for (argument, wanted), (there, has) in zip(promised.items(), found.items(), strict=False):
        if wanted.kind is not wanted.KEYWORD_ONLY:  # in this place
            assert argument == there
            assert has.kind is not has.KEYWORD_ONLY
    for argument, wanted in promised.items():
        assert found[argument].default == wanted.default
    for argument in found.keys() - promised.keys():
        assert found[argument].kind is found[argument].VAR_KEYWORD or found[argument].default is not inspect._empty
