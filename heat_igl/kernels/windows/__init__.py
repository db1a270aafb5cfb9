"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is an interval of a half-edge that straight lines from one root cross, all through the same faces. With the
faces unfolded into a plane, the position of the root gives the distance of every point of the window (Mitchell, Mount,
Papadimitriou 1987). The modules, from data to results:

- `structures`: windows, lists, the state of a search, and the geometry of one triangle.
- `surface`: tables of a triangulation, and the kind of a vertex: whether shortest paths bend there.
- `front`: windows that enter a face over the same side wait in one list (Qin et al. 2016); a queue orders lists and
  vertices; `relax` updates the distance of a vertex.
- `emission`: sources and vertices where paths bend emit windows.
- `trimming`: the windows of a list are trimmed where another path is shorter.
- `crossing`: a list crosses its face. The corner ahead gets its distance, and windows continue over the other two
  sides, unless their lines cross a shorter path to this corner.
- `sharing`: two threads exchange distances, and one hands over lists and vertices to the other.
- `windows`: processes the queue, on one thread or on two, and is the interface to Python: one search for all vertices,
  or many local ones.
- `paths`: shortest paths, traced back by `kernels.mesh.straight`, and the derivatives of their lengths.
"""
