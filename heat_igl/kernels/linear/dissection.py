"""Nested dissection of a graph by sweeps; the method is explained in `heat_igl.linear.multifrontal`.

A graph is given as scipy stores a symmetric matrix: the neighbours of v are ``neighbours[ends[v]:ends[v + 1]]``.
"""

import cython
import numpy as np


def breadth_first(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    skip: cython.const[cython.uchar][::1],
):
    """All vertices but those to skip, int32, in breadth-first order: neighbours are near in memory."""
    n: cython.Py_ssize_t = skip.shape[0]
    order = np.empty(n, np.int32)
    queue: cython.int[::1] = order
    seen: cython.uchar[::1] = np.array(skip)
    head: cython.Py_ssize_t = 0
    tail: cython.Py_ssize_t = 0
    with cython.nogil:
        for root in range(n):
            if not seen[root]:
                seen[root] = True
                queue[tail] = root
                tail += 1
            while head < tail:
                v: cython.Py_ssize_t = queue[head]
                head += 1
                for p in range(ends[v], ends[v + 1]):
                    w: cython.int = neighbours[p]
                    if not seen[w]:
                        seen[w] = True
                        queue[tail] = w
                        tail += 1
    return order[:tail]


def subgraph(
    ends: cython.const[cython.int][::1], neighbours: cython.const[cython.int][::1], some: cython.const[cython.int][::1]
):
    """The graph among some vertices, numbered as they come: `ends` and `neighbours`, int32."""
    n: cython.Py_ssize_t = some.shape[0]
    number: cython.int[::1] = np.full(ends.shape[0] - 1, -1, np.int32)
    v: cython.Py_ssize_t
    most: cython.Py_ssize_t = 0
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(n):
            v = some[i]
            number[v] = i
            most += ends[v + 1] - ends[v]
    new_ends, new_neighbours = np.zeros(n + 1, np.int32), np.empty(most, np.int32)
    into_ends: cython.int[::1] = new_ends
    into: cython.int[::1] = new_neighbours
    with cython.nogil:
        for i in range(n):
            v = some[i]
            for p in range(ends[v], ends[v + 1]):
                if number[neighbours[p]] >= 0:
                    into[count] = number[neighbours[p]]
                    count += 1
            into_ends[i + 1] = count
    return new_ends, new_neighbours[:count]


def dissect_pieces(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    order: cython.int[::1],
    is_start: cython.uchar[::1],
    parent: cython.longlong[::1],
    large: cython.double,
):
    """Dissect a graph, but for pieces of more than `large` vertices that were cut off from it.

    `order` (n,) holds all vertices and is rearranged; `is_start` is set at the start of each block in it, and `parent`
    there to the start of its parent, or -1. Returns the large pieces, (r, 3) int64: first, end, start of the parent.
    """
    n: cython.Py_ssize_t = order.shape[0]
    rest = np.empty((int(n / max(large, 1.0)) + 2, 3), np.int64)
    d = Dissecting(ends, neighbours, order, is_start, parent)
    large_pieces: cython.longlong[:, ::1] = rest
    n_rest: cython.Py_ssize_t = 0
    with cython.nogil:
        _push(d, 0, n, -1, 0)
        while d.depth > 0:
            d.depth -= 1
            piece: Piece = d.stack[d.depth]
            if large < piece.high - piece.low < 0.75 * n:
                large_pieces[n_rest, 0], large_pieces[n_rest, 1] = piece.low, piece.high
                large_pieces[n_rest, 2] = piece.above
                n_rest += 1
            else:
                _dissect_piece(d, piece)
    return rest[:n_rest]


@cython.cclass
class Dissecting:
    """A graph that is being dissected.

    Most arrays hold a value per vertex, which only the piece that is being cut uses.
    """

    def __init__(self, ends, neighbours, order, is_start, parent):
        self.ends, self.neighbours, self.order, self.is_start, self.parent = ends, neighbours, order, is_start, parent
        n = len(order)
        position = np.empty(n, np.int32)
        position[np.asarray(order)] = np.arange(n, dtype=np.int32)
        self.position, self.piece = position, np.zeros(n, np.int32)
        self.n_pieces = 1
        kind = [("low", np.intp), ("high", np.intp), ("above", np.intp), ("number", np.intc)]
        self.stack = np.empty(n + 2, np.dtype(kind, align=True))
        self.depth = 0
        self.near, self.far, self.queue = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n + 1, np.int32)
        self.f, self.smooth = np.empty(n, np.float32), np.empty(n, np.float32)


def _push(d, low, high, above, number):
    if low < high:
        d.stack[d.depth] = Piece(low, high, above, number)
        d.depth += 1


def _dissect_piece(d, piece):
    """Cut a piece in two, or make it a block; the parts wait on the stack."""
    low: cython.Py_ssize_t = piece.low
    high: cython.Py_ssize_t = piece.high
    size: cython.Py_ssize_t = high - low
    above: cython.Py_ssize_t = piece.above
    cut: Cut = Cut(-1, 0)
    if size > LEAF:
        reached: cython.Py_ssize_t = _line_up(d, low, high)
        if reached < size:
            # The component in the queue moves to the front, as a piece of its own.
            for i in range(reached):
                v: cython.int = d.queue[i]
                w: cython.int = d.order[low + i]
                p: cython.int = d.position[v]
                d.order[low + i], d.order[p] = v, w
                d.position[v], d.position[w] = low + i, p
                d.piece[v] = d.n_pieces
            _push(d, low, low + reached, above, d.n_pieces)
            _push(d, low + reached, high, above, piece.number)
            d.n_pieces += 1
            return
        if _fill_buckets(d, low, high):
            cut = _best_cut(d, low, high)
    if cut.bucket < 0:
        d.is_start[low] = True
        d.parent[low] = above
        return
    _assign(d, low, high, cut)
    first: cython.Py_ssize_t = _arrange(d, low, low, high, 0)
    second: cython.Py_ssize_t = _arrange(d, first, low, high, 1)
    _arrange(d, second, low, high, SEPARATOR)
    for i in range(low, high):
        v = d.queue[i - low]
        d.order[i] = v
        d.position[v] = i
        d.piece[v] = d.n_pieces if i < first else d.n_pieces + 1 if i < second else -1
    if second < high:
        d.is_start[second] = True
        d.parent[second] = above
        above = second
    _push(d, low, first, above, d.n_pieces)
    _push(d, first, second, above, d.n_pieces + 1)
    d.n_pieces += 2


def _line_up(d, low, high):
    """Set f to the difference of the distances of a vertex from both ends of the piece.

    Returns the size of the piece, or that of the component in the queue if the piece is not connected.
    """
    size: cython.Py_ssize_t = high - low
    for i in range(low, high):
        d.near[d.order[i]] = d.far[d.order[i]] = -1
    # The last vertex is one of the farthest from the first.
    reached: cython.Py_ssize_t = _breadth_first(d, d.order[high - 1], d.far)
    if reached < size:
        return reached
    for i in range(low, high):
        d.far[d.order[i]] = -1
    _breadth_first(d, d.queue[size - 1], d.far)
    _breadth_first(d, d.queue[size - 1], d.near)
    for i in range(low, high):
        v: cython.Py_ssize_t = d.order[i]
        d.f[v] = d.far[v] - d.near[v]
    if size > ROUGH:
        for _ in range(SMOOTHING // 2):
            _average(d, low, high, d.f, d.smooth)
            _average(d, low, high, d.smooth, d.f)
    return size


def _breadth_first(d, root, distance):
    """Number the vertices of root's piece by their distance from it; the queue keeps them in that order."""
    here: cython.int = d.piece[root]
    d.queue[0] = root
    distance[root] = 0
    head: cython.Py_ssize_t = 0
    tail: cython.Py_ssize_t = 1
    while head < tail:
        v: cython.Py_ssize_t = d.queue[head]
        head += 1
        further: cython.int = distance[v] + 1
        for p in range(d.ends[v], d.ends[v + 1]):
            # Without a branch, which would be unpredictable. The queue has room for one entry more.
            w: cython.int = d.neighbours[p]
            old: cython.int = distance[w]
            new: cython.bint = (d.piece[w] == here) & (old < 0)
            d.queue[tail] = w
            distance[w] = further if new else old
            tail += new
    return tail


def _average(d, low, high, f, smooth):
    """The mean of f over each vertex and the neighbours in the piece."""
    for i in range(low, high):
        v: cython.Py_ssize_t = d.order[i]
        total: cython.float = f[v]
        count: cython.int = 1
        for p in range(d.ends[v], d.ends[v + 1]):
            w: cython.Py_ssize_t = d.neighbours[p]
            if d.piece[w] == d.piece[v]:
                total += f[w]
                count += 1
        smooth[v] = cython.cast(cython.double, total) / count


def _fill_buckets(d, first, end):
    """Divide the range of f evenly; false if f is constant. `near` takes the buckets."""
    low: cython.float = d.f[d.order[first]]
    high: cython.float = low
    for i in range(first, end):
        low, high = min(low, d.f[d.order[i]]), max(high, d.f[d.order[i]])
    if not low < high:
        return False
    scale: cython.double = (BUCKETS - 0.01) / (high - low)
    for i in range(first, end):
        d.near[d.order[i]] = cython.cast(cython.int, (d.f[d.order[i]] - low) * scale)
    return True


def _best_cut(d, first, end):
    """The cut whose separator is smallest for how evenly it divides the piece.

    A vertex is in the left rim of every cut between the vertex's bucket and the highest among its neighbours, so
    counting the begins and ends of such intervals gives the rims of all cuts in one pass.
    """
    count: Rims
    for i in range(BUCKETS):
        count.inside[i] = count.rim[0][i] = count.rim[1][i] = 0
    for i in range(first, end):
        v: cython.Py_ssize_t = d.order[i]
        own: cython.int = d.near[v]
        low: cython.int = own
        high: cython.int = own
        for p in range(d.ends[v], d.ends[v + 1]):
            w: cython.Py_ssize_t = d.neighbours[p]
            if d.piece[w] == d.piece[v]:
                low, high = min(low, d.near[w]), max(high, d.near[w])
        count.inside[own] += 1
        count.rim[0][own] += 1
        count.rim[0][high] -= 1
        count.rim[1][low] += 1
        count.rim[1][own] -= 1
    size: cython.longlong = end - first
    left: cython.longlong = 0
    separator: cython.longlong[2]
    separator[0] = separator[1] = 0
    cut: Cut = Cut(-1, 0)
    best: cython.double = 0.0
    for bucket in range(BUCKETS - 1):
        left += count.inside[bucket]
        for side in range(2):
            separator[side] += count.rim[side][bucket]
            smaller: cython.longlong = (
                min(left - separator[0], size - left) if side == 0 else min(left, size - left - separator[1])
            )
            if smaller > 0:
                share: cython.double = cython.cast(cython.double, smaller) / size
                cost: cython.double = separator[side] / (share * (1 - share))
                if cut.bucket < 0 or cost < best:
                    best = cost
                    cut = Cut(bucket, side)
    return cut


def _assign(d, low, high, cut):
    """Turn buckets into parts: 0 and 1 for the two sides and 2 for the separator, encoded as -1 - part."""
    for i in range(low, high):
        v: cython.Py_ssize_t = d.order[i]
        part: cython.int = d.near[v] > cut.bucket
        if part == cut.side:
            for p in range(d.ends[v], d.ends[v + 1]):
                w: cython.Py_ssize_t = d.neighbours[p]
                if d.piece[w] == d.piece[v] and _side(d.near[w], cut) != part:
                    part = SEPARATOR
                    break
        d.near[v] = -1 - part


def _side(code, cut):
    """The side of a vertex by bucket, or by part; a separator is on the side that gives it."""
    if code >= 0:
        return code > cut.bucket
    return cut.side if code == -1 - SEPARATOR else -1 - code


def _arrange(d, position, low, high, part):
    """Collect the vertices of a part in the queue, in their old order; return their end in the new one."""
    for i in range(low, high):
        v: cython.int = d.order[i]
        if d.near[v] == -1 - part:
            d.queue[position - low] = v
            position += 1
    return position
