"""The faces that curves run over: sides, angles and gluing, and points in faces. Faces need not be oriented alike."""

import cython


@cython.final
@cython.cclass
class FaceTable:
    """m faces on n vertices, which need not be oriented alike.

    `face` (m,) are structures as `heat_igl.curves.geodesics` makes them, and `edges` are `HalfEdges`. The corners at
    vertex v, numbered like half-edges, are ``corner[first_corner[v]:first_corner[v + 1]]``.
    """

    def __init__(self, face, edges, first_corner, corner):
        self.triangle, self.twin, self.ring = face, edges.twin, edges.ring
        self.first_corner, self.corner = first_corner, corner
