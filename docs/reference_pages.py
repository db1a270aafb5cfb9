"""The pages of the reference: all public names, grouped by task, and the modules beside them."""

from __future__ import annotations

import heat_igl

# Names that the package lacks are left out, and those in no group come last.
GROUPS = {
    "Distance": """geodesic_distance HeatMethodSolver HeatSolution Diagnostics LabelledDistance heat_method_distance
        GeodesicSolver""",
    "Only what is asked": """distances_within nearest_vertices pair_distances distance_matrix
        write_distances_within read_distances_within""",
    "Meshes, polygons and points": """Mesh PolygonMesh PointCloud as_mesh sample_mesh MeshReport ImageDomain
        image_domain closest_points ClosestPoints split_long_edges""",
    "Files": """read_mesh read_polygon_mesh read_point_cloud read_attributes write_mesh write_point_cloud
        write_curves""",
    "Sources": "SurfacePoints SurfaceCurve OffsetSources curve_on edge_curve",
    "Curves": """isolines offset_curves enclosed_areas sublevel_areas shortest_paths geodesic_path straighten
        GeodesicPathSolver handle_loops geodesic_bezier trace_geodesic cut CutMesh""",
    "Directions and tangent vectors": """tangent_frames TangentFrames log_map exp_map VectorHeatSolver
        Directions connection_laplacian""",
    "Which side": "SignedHeatSolver OrientedPoints region_boundary volume_signed_distance VoxelBox",
    "Sampling": """farthest_points farthest_cells voronoi_cells VoronoiCells dual_triangulation geodesic_centre
        karcher_mean centroidal_voronoi CentroidalSites diameter sampling""",
    "Operators of a domain": """Operators polygon_operators point_cloud_operators speed_operators metric_operators
        fibre_metric activation_times""",
    "Validation": """validate ValidationReport ValidationRow validate_domains DomainReport DomainRow reference
        closed_forms metrics shapes baselines""",
    "Pictures": "plots",
    "Many meshes": "cluster",
    "Errors and warnings": """MeshError SourceError FactorizationError MissingExtraError ReferenceSolverError BatchError
        AccuracyWarning""",
}
# Modules without an attribute of the package, and what they are for.
MODULES = {
    "heat_igl.compat.igl": "libigl's functions for distance",
    "heat_igl.compat.potpourri3d": "potpourri3d's classes and functions",
    "heat_igl.steps": "the three steps of the heat method, each alone",
    "heat_igl.operators": "the operators of every kind of domain",
    "heat_igl.linear": "factor once, solve many times",
    "heat_igl.applications": "landmarks on edges, particles in images",
}


def grouped() -> dict[str, list[str]]:
    """The public names of each group."""
    public = list(heat_igl.__all__)
    found = {title: [name for name in names.split() if name in public] for title, names in GROUPS.items()}
    rest = set(public).difference(*found.values())
    return {title: names for title, names in {**found, "Further": sorted(rest)}.items() if names}


def _target(name: str) -> str:
    """What a name is documented as: modules under the name of their file."""
    thing = getattr(heat_igl, name)
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
