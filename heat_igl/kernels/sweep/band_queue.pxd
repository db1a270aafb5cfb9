# The vertices to be visited, nearest first to within a band: a ring of queues, one for each band of distance.
#
# Keys beyond the last band of the ring wait in that one, and are put again when it comes. A vertex may be there several
# times. The order inside a band is that in which vertices were put.

from libc.math cimport INFINITY, floor

cdef enum:
    BANDS = 1024

cdef struct Waiting:
    int vertex, following


cdef struct BandQueue:
    Waiting* place  # room for all that is ever put
    int n_places
    int n_waiting
    double per_length  # bands
    double band  # the current one
    int first[BANDS]
    int last[BANDS]


cdef inline void clear(BandQueue* q, Waiting* place, double width) noexcept nogil:
    cdef int i
    q.place, q.n_places, q.n_waiting, q.per_length, q.band = place, 0, 0, 1.0 / width, 0.0
    for i in range(BANDS):
        q.first[i] = -1


cdef inline double band_of(BandQueue* q, double key) noexcept nogil:
    # Among those in the ring.
    return min(max(key * q.per_length, q.band), q.band + (BANDS - 1))


cdef inline void append(BandQueue* q, int place, double key) noexcept nogil:
    cdef int slot = <int> (<long long> band_of(q, key) & (BANDS - 1))
    q.place[place].following = -1
    if q.first[slot] < 0:
        q.first[slot] = place
    else:
        q.place[q.last[slot]].following = place
    q.last[slot] = place


cdef inline void put(BandQueue* q, int vertex, double key) noexcept nogil:
    # Add a vertex at a distance.
    q.place[q.n_places].vertex = vertex
    append(q, q.n_places, key)
    q.n_places += 1
    q.n_waiting += 1


cdef inline void leap(BandQueue* q, const double* key) noexcept nogil:
    # Go on to the nearest band in which a vertex waits: all of them are far ahead.
    cdef int slot, place, following
    cdef int left = -1
    cdef double nearest = INFINITY
    for slot in range(BANDS):
        place = q.first[slot]
        q.first[slot] = -1
        while place >= 0:
            following = q.place[place].following
            nearest = min(nearest, key[q.place[place].vertex])
            q.place[place].following = left
            left = place
            place = following
    q.band = floor(nearest * q.per_length)
    while left >= 0:
        following = q.place[left].following
        append(q, left, key[q.place[left].vertex])
        left = following


cdef inline int take(BandQueue* q, const double* key) noexcept nogil:
    # Take a vertex of the nearest band; -1 if none is left. `key` is the distance of each.
    cdef int slot, place
    cdef int n_passed = 0
    while q.n_waiting > 0:
        slot = <int> (<long long> q.band & (BANDS - 1))
        place = q.first[slot]
        if place < 0:
            q.band += 1.0
            n_passed += 1
            if n_passed == BANDS:
                n_passed = 0
                leap(q, key)
            continue
        q.first[slot] = q.place[place].following
        if key[q.place[place].vertex] * q.per_length >= q.band + 1.0:
            append(q, place, key[q.place[place].vertex])
            continue
        q.n_waiting -= 1
        return q.place[place].vertex
    return -1
