"""Distances on many meshes, by Dask on one machine or several, into a zarr store (extra ``cluster``).

Examples
--------
>>> import heat_igl
>>> with heat_igl.cluster.connected(n_workers=1) as client:
...     meshes = {"small": heat_igl.shapes.grid(4), "large": heat_igl.shapes.grid(8)}
...     report = heat_igl.cluster.distances(meshes, [0, 1], "distances.zarr", client=client)
...
>>> [(row.name, row.status) for row in report.rows]
[('large', 'done'), ('small', 'done')]
"""

from heat_igl.cluster.batch import DTYPES, distances
from heat_igl.cluster.collection import folder, read_source_sets
from heat_igl.cluster.connection import connected
from heat_igl.cluster.report import BatchReport, BatchRow, read_distances, report

__all__ = [
    "DTYPES",
    "BatchReport",
    "BatchRow",
    "connected",
    "distances",
    "folder",
    "read_distances",
    "read_source_sets",
    "report",
]
