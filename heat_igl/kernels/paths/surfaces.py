"""Input of the path kernels: triangles, the faces around edges and vertices, and places in faces."""

import cython

__all__ = ["Surface"]


@cython.final
@cython.cclass
class Surface:
    """Views of the arrays of `heat_igl.curves.surface.Surface`."""

    def __init__(self, surface):
        self.triangle = surface.triangle
        self.first_side, self.side = surface.first_side, surface.side
        self.first_corner, self.corner = surface.first_corner, surface.corner
