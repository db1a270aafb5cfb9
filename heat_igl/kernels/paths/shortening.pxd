cdef extern from *:
    """
    // A part of a loop that becomes shorter by less than this share has not changed: rounding.
    #define GAIN_OF_PART 1e-13
    // Angles around a vertex that differ by less are the same: rounding.
    #define SAME_ANGLE 1e-6
    // The base of a loop does not slide by a smaller share of its edge.
    #define SHORTEST_SLIDE 1e-4
    """
    double GAIN_OF_PART
    double SAME_ANGLE
    double SHORTEST_SLIDE

cdef enum:
    # A loop whose length stays the same from this many bases, one after another, is straight at all of them.
    BOTH_WAYS = 2
    # From so many at most: a loop moves to the next vertex with each.
    MOST_BASES = 100000

# A vertex of a loop and the straight part to the joint after it: `count` crossings from `first` on, out of `face`. The
# part leaves at the angle `leave` around this vertex and comes to the next one at the angle `arrive` there.
cdef struct Joint:
    double length, leave, arrive
    int vertex, face, first, count, before, after
