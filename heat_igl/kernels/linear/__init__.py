"""Sparse matrices: assembled by counting, ordered, factored, solved, and relaxed where factors do not fit."""
