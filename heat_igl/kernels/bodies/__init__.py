"""Straight lines through tetrahedra, and ways that bend around edges of the body.

`bodies` knows the tetrahedra behind sides and around vertices, and `rays` follows a line from one to the next.

Vertices look for the sources of their neighbours along straight lines (`sight`). Edges around which ways bend are
sources of further lines, in three steps that build on each other: lengths of ways around an edge (`bent_ways`), lines
that end on an edge (`edge_sight`), and distance along an edge from the ways to its ends (`fitted_bends`). `bends`
searches the vertices around each edge until no way gets shorter.
"""
