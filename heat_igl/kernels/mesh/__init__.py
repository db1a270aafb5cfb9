"""Triangles by their corners and edge lengths: joined along edges, numbered, flipped and refined.

Half-edge ``3 f + c`` is the side of face f opposite its corner c; `triangles.pxd` steps from one to the next, and
`straight.pxd` carries a straight line through a face. A mesh goes through these modules, as far as its use needs:

1. `incidence` finds distinct rows, and by them the edges of a mesh, and its components.
2. `gluing` joins the half-edges that share an edge and takes their lengths, without the edges of a mesh, and brings
   neighbours near each other in memory by their numbers.
3. `flipping` makes the triangulation Delaunay, and records the flips if their history is needed.
4. `refinement` splits faces of a Delaunay triangulation and flips edges until no angle is small; `carrying` finds the
   faces that points are in after these moves.
5. `polar_angles` sums the angles around vertices for tangent frames, and carries them over flips.

`checking` is about distances: what edges and straight lines say of them without a search.
"""
