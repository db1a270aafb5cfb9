"""The pages of the reference: all public names, grouped by task, and the modules beside them."""

from __future__ import annotations

import importlib

import heat_igl

# Names with a dot are those of a room. Public names in no group come last.
GROUPS = {
    "Distance": """geodesic_distance HeatMethodSolver HeatSolution heat.Diagnostics
        heat.LabelledDistance GeodesicSolver""",
    "Only what is asked": """distances_within nearest_vertices pair_distances distance_matrix
        write_distances_within read_distances_within""",
    "Meshes, polygons and points": """Mesh PolygonMesh PointCloud as_mesh sample_mesh to_trimesh to_pyvista to_open3d
        mesh.MeshReport mesh.CloudReport terrain mesh.Terrain image_domain mesh.ImageDomain closest_points
        mesh.ClosestPoints""",
    "Files": """read_mesh read_polygon_mesh read_point_cloud read_attributes write_attributes write_mesh
        write_point_cloud write_curves""",
    "Sources": "SurfacePoints SurfaceCurve OffsetSources curve_on curve_through edge_curve",
    "Curves": """isolines curves.offset_curves curves.sublevel_areas shortest_path shortest_paths
        geodesic_path straighten curves.GeodesicPathSolver curves.geodesic_bezier trace_geodesic cut
        curves.CutMesh""",
    "Directions and tangent vectors": """tangent_frames intrinsic.TangentFrames log_map exp_map log_maps_within
        VectorHeatSolver heat.Directions operators.connection_laplacian""",
    "Which side": "signed_distance SignedHeatSolver OrientedPoints mesh.region_boundary",
    "Sampling": """farthest_points farthest_cells voronoi_cells sampling.VoronoiCells sampling.dual_triangulation
        karcher_mean centroidal_voronoi curves.CentroidalSites diameter""",
    "Operators of a domain": """Operators operators.point_cloud_operators speed_operators
        metric_operators fibre_metric activation_times""",
    "Surface maps": "smooth parcel_distances geodesic_errors",
    "Validation": """validate ValidationReport validation.ValidationRow reference
        validation.closed_forms validation.metrics shapes""",
    "Pictures": "plots",
    "Many meshes": "cluster",
    "Errors and warnings": """MeshError SourceError AccuracyWarning errors.FactorizationError errors.MissingExtraError
        errors.ReferenceSolverError errors.BatchError""",
}
# Modules without an attribute of the package, and what they are for.
MODULES = {
    "heat_igl.compat.igl": "libigl's functions for distance",
    "heat_igl.compat.potpourri3d": "potpourri3d's classes and functions",
    "heat_igl.compat.gdist": "gdist's functions",
    "heat_igl.compat.pygeodesic": "pygeodesic's class",
    "heat_igl.sampling": "samples of a surface",
    "heat_igl.heat.steps": "the three steps of the heat method, each alone",
    "heat_igl.operators": "the operators of every kind of domain",
    "heat_igl.linear": "factor once, solve many times",
    "heat_igl.applications": "activation times, maps on a surface, errors of matches",
}


def grouped() -> dict[str, list[str]]:
    """The public names of each group."""
    public = list(heat_igl.__all__)
    found = {title: names.split() for title, names in GROUPS.items()}
    rest = set(public).difference(*found.values())
    return {title: names for title, names in {**found, "Further": sorted(rest)}.items() if names}


def _documented(name: str) -> object:
    """What a name of the tables stands for."""
    room, _, last = f"heat_igl.{name}".rpartition(".")
    return getattr(importlib.import_module(room), last, None) or importlib.import_module(f"{room}.{last}")


def has_page(thing: object) -> bool:
    """Whether something has a page of its own."""
    return any(thing is _documented(name) for names in grouped().values() for name in names)


def _target(name: str) -> str:
    """What a name is documented as: modules under the name of their file."""
    thing = _documented(name)
    return f"heat_igl.{name}" if not hasattr(thing, "__path__") and not hasattr(thing, "__spec__") else thing.__name__


def page() -> str:
    """The tables of the page, each with links to a page per name."""
    lines = []
    for title, names in grouped().items():
        lines += [f"## {title}", "", *_table([_target(name) for name in names])]
    lines += ["## Modules", "", *_table(list(MODULES))]
    return "\n".join(lines)


def _table(targets: list[str]) -> list[str]:
    return [
        "```{eval-rst}", ".. autosummary::", "   :toctree: api", "   :nosignatures:", "",
        *(f"   {target}" for target in targets), "```", "",
    ]  # fmt: skip
