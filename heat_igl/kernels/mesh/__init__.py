"""Intrinsic triangulations, given by faces and edge lengths: connectivity, edge flips and Delaunay refinement.

Half-edge ``3 f + c`` is the side of face f opposite corner c. `triangles.pxd` steps between half-edges, `straight.pxd`
traces a straight line across a face. In the order in which a mesh passes through them:

1. `incidence`: unique rows of an integer array (edges from faces) and connected components.
2. `gluing`: twins and lengths of half-edges, without an edge list; renumbering so that neighbours are close in memory.
3. `flipping`: edge flips to the intrinsic Delaunay triangulation, recorded on request.
4. `refinement`: Delaunay refinement up to a minimum angle. `carrying`: point location after splits and flips.
5. `polar_angles`: angle sums at vertices and polar angles of half-edges for tangent frames, updated by flips.

`segments`: lists of segments in faces. `checking`: bounds on distances by edge paths and straight lines.
"""
