"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is the part of a half-edge that straight lines from one root cross, all through the same faces; the root laid
out in the plane before the half-edge gives the distance of every point of the window (Mitchell, Mount, Papadimitriou
1987). The modules, from data to results:

- `structures`: windows, lists, the state of a search, and the geometry of one triangle.
- `surface`: tables of a triangulation, and the kind of a vertex: whether shortest paths bend there.
- `front`: windows that enter a face over the same side wait there in one list (Qin et al. 2016); a queue orders lists
  and vertices; `relax` takes the distance of a vertex. Windows begin at sources, and at vertices where paths bend.
- `crossing`: a list crosses its face. Windows are cut to the points that no other path reaches sooner, and to the lines
  that cross no shorter path to the corner ahead; the corner gets its distance, and windows go on over two sides.
- `windows`: takes one entry after the other from the queue, on one thread or on two, and is what Python calls: one
  search for all vertices or many local ones.
- `paths`: shortest paths back from where windows arrived, by `kernels.mesh.straight`, and derivatives of their lengths.
"""
