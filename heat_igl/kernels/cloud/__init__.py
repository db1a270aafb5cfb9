"""Triangles of a point cloud: planes and quadrics of neighbours, stars, agreement and gaps."""
