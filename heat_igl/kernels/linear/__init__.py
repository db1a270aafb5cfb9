"""Sparse matrices: assembled by counting, ordered, factored and solved."""
