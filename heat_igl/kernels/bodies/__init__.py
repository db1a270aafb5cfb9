"""Straight lines through tetrahedra, and ways that bend around edges of the body."""
