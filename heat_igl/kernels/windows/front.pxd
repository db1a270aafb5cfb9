from heat_igl.kernels.windows.structures cimport Entry, Search, Window, p_search, p_window

cdef void allocate(Search* s) noexcept nogil
cdef void more_room(Search* s, int n) noexcept nogil
cdef void empty_front(Search* s) noexcept nogil
cdef void free_front(Search* s) noexcept nogil
cdef void push(Search* s, double key, int what) noexcept nogil
cdef Entry pop(Search* s) noexcept nogil
cdef void aim_at(Search* s, int v, int goal) noexcept nogil
cdef int towards_goal(Search* s, int e, Window* run, int n) noexcept nogil
cdef void relax(
    Search* s, int v, double distance, int root, int entered, double crossing, int corner, double x, double y
) noexcept nogil
cdef void take(Search* s, int j, double distance, int root) noexcept nogil
cdef void tell(Search* s, int v, double distance) noexcept nogil
cdef void append(Search* s, int t, Window* run, int n, int turns, bint mirrored) noexcept nogil
cdef void add(Search* s, int e, Window* run, int n, int turns) noexcept nogil
cdef void start_at(Search* s, int v, double offset, int label) noexcept nogil


# A little more than a distance: by more than rounding, and than needles are made longer by. Edges are about 1.
cdef inline double with_rounding(double distance) noexcept nogil:
    return distance * (1.0 + 1e-9) + 1e-10


# Make a list free again; its room stays with it.
cdef inline void release(Search* s, int place) noexcept nogil:
    s.lists[place].count = s.free_list
    s.lists[place].half_edge = -1
    s.free_list = place

cdef inline double _key(p_search s, p_window w, double length, double bulge) noexcept nogil
cdef inline Window _mirrored(Window w, double length) noexcept nogil
cdef inline int _free_list(p_search s) noexcept nogil
