"""Curves on triangles: followed, shortened within their class, and straightened."""
