"""Paths on triangles: curves shortened within their class, and straightest lines from a place in a direction.

Exact shortest paths are followed back through windows, in `kernels.windows`; here a curve keeps its class, so that no
distance is needed. `heat_igl.curves.geodesics` and `.straightest` make the arguments.

1. `routes`: a path between two places begins as the shortest way along edges, found by A*. A curve that is given
   begins as it is.
2. `strips`: the faces that a curve runs through make a strip; where it passes a vertex, the strip is led around it the
   shorter way (`Detour`). `funnel`: laid out in the plane, the strip is a polygon, in which a funnel finds the shortest
   path. Both read the surface from a `face_table`.
3. `shortening`: where that path bends at a vertex with an angle below pi on another side, the strip is led there and
   step 2 is repeated until there is no such bend (`settle`). Vertices with less than 2 pi can be passed on both sides:
   the other side is tried, and kept if the path becomes shorter (`improve`).
4. An open curve is done then. A loop is straightened from one of its points to itself, and from another one, until its
   length stays the same (`shorten_loop`).

`straightest` is independent of these: a line goes straight on over edges (`kernels.mesh.straight`, as paths traced back
through windows and the search for circumcenters do), and past a vertex with equal angles on both sides.
"""
