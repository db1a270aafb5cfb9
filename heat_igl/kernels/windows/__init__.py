"""Exact distance by windows (continuous Dijkstra), the paths back from where windows arrived, and their derivatives."""
