"""Shortest paths through tetrahedra: chains of straight lines that bend around edges (`heat_igl.sweep.lines`).

They bend at edges of the body with more than half a turn inside. Such an edge is a source like a given one, once its
ends have distances.

- `rays` lists the tetrahedron behind each side and the neighbours of each vertex, and follows a line through the
  tetrahedra until it arrives or leaves the body.
- `sight`: from near to far, each vertex looks for the sources of its neighbours, the nearest first, and takes the
  shortest line that stays inside. Then neighbours that do not see this source look again, until nothing changes. A
  vertex that sees no source stays at infinity.
- `edge_distances`: distance along an edge is that from one point beside it, if this agrees at the middle and the
  quarters, else interpolated between these and the places at which two fronts meet. The points take ways as vertices
  do. Where both ends see one source, the points between are presumed to, until a way bends there.
- `bends`: each edge, from near to far, whose ends have got shorter distances is fitted, and vertices around it take the
  ways around it as far as they see it; until no end gets shorter.
"""
