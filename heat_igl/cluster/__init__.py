"""Distances on many meshes, by Dask on one machine or several, into a zarr store (extra ``cluster``)."""

from heat_igl.cluster.batch import distances
from heat_igl.cluster.collection import folder, read_source_sets
from heat_igl.cluster.connection import connected
from heat_igl.cluster.report import BatchReport, BatchRow, report

__all__ = ["BatchReport", "BatchRow", "connected", "distances", "folder", "read_source_sets", "report"]
