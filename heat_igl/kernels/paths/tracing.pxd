from heat_igl.kernels.paths.straightening cimport Course
from heat_igl.kernels.paths.surfaces cimport Place, Surface

cdef extern from *:
    """
    // A path that is longer than the distance by this part of it is traced a second time, by the other rule.
    #define TOO_LONG 1e-3
    // Of two paths the second is taken when it is shorter by this part: not for its rounding.
    #define GAIN 1e-9
    """
    double TOO_LONG, GAIN

# How a way goes on from a point of a face: into `face`, through half-edge `enter`, to `goal` in it; each -1 if none.
cdef struct WayOn:
    int face, enter, goal
