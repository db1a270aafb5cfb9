"""The nearest neighbours of points that are sorted by a k-d tree, for all points of a leaf at once."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.nearest import (
    LARGER,
    LEAST_RADIUS,
    MOST_POINTS,
    MOST_TRIES,
    SHELLS,
    SMALLER,
    WIDER,
)
from cython.cimports.libc.math import sqrt

__all__ = ["leaf_boxes", "nearest_points"]


def leaf_boxes(P: cython.const[cython.double][:, ::1], first: cython.const[cython.int][::1]):
    """The smallest and the largest coordinates (2 l, 6) of the points in the nodes of a k-d tree of l leaves.

    Leaf i holds the points P (n, 3) from ``first[i]`` to ``first[i + 1]``, and is node l + i; nodes 2 i and 2 i + 1
    make up node i, and node 1 is the whole tree. The number of leaves is a power of 2.
    """
    n_leaves: cython.Py_ssize_t = first.shape[0] - 1
    boxes = np.empty((2 * n_leaves, 6))
    box: cython.double[:, ::1] = boxes
    box[0, :] = 0.0
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    x: cython.Py_ssize_t
    with cython.nogil:
        for i in range(n_leaves):
            for x in range(3):
                low: cython.double = P[first[i], x]
                high: cython.double = low
                for j in range(first[i] + 1, first[i + 1]):
                    low, high = min(low, P[j, x]), max(high, P[j, x])
                box[n_leaves + i, x], box[n_leaves + i, 3 + x] = low, high
        for i in range(n_leaves - 1, 0, -1):
            for x in range(3):
                box[i, x] = min(box[2 * i, x], box[2 * i + 1, x])
                box[i, 3 + x] = max(box[2 * i, 3 + x], box[2 * i + 1, 3 + x])
    return boxes


def nearest_points(
    P: cython.const[cython.double][:, ::1],
    first: cython.const[cython.int][::1],
    boxes: cython.const[cython.double][:, ::1],
    chosen: cython.const[cython.longlong][::1],
    k: cython.Py_ssize_t,
):
    """The k nearest points of some points, themselves first, and others by distance; of equal ones the lowest first.

    Neighbours of points in one leaf are nearly the same: the points within a radius of the leaf are found once.

    Parameters
    ----------
    P : (n, 3) float64
        All points, leaf by leaf.
    first, boxes
        The leaves, and boxes around the nodes, see `leaf_boxes`.
    chosen : (c,) int64
        Points, in ascending order.
    k : int
        At most n.

    Returns
    -------
    index, square : (c, k) int32, (c, k) float64
        The nearest points, and the squared distances.
    found : (c,) bool
        Whether they were found: not where the density of the points changes much within a leaf.
    """
    c: cython.Py_ssize_t = chosen.shape[0]
    indices, squares, is_found = np.empty((c, k), np.int32), np.empty((c, k)), np.zeros(c, np.bool_)
    index: cython.int[:, ::1] = indices
    square: cython.double[:, ::1] = squares
    found: cython.uchar[::1] = is_found.view(np.uint8)
    leaves = LeafSearch(P, first, boxes, k)
    begin: cython.Py_ssize_t = 0
    leaf: cython.Py_ssize_t = 0
    with cython.nogil:
        while begin < c:
            while first[leaf + 1] <= chosen[begin]:
                leaf += 1
            end: cython.Py_ssize_t = begin + 1
            while end < c and chosen[end] < first[leaf + 1]:
                end += 1
            leaves.search(leaf, chosen[begin:end], index[begin:end], square[begin:end], found[begin:end])
            begin = end
    return indices, squares, is_found


@cython.final
@cython.cclass
class LeafSearch:
    """The search for the k nearest points, one leaf after the other."""

    def __init__(self, P, first, boxes, k):
        self.P, self.first, self.boxes, self.k = P, first, boxes, k
        self.n_leaves = self.first.shape[0] - 1
        self.radius = 0.0
        self.near, self.number = np.empty((3, MOST_POINTS)), np.empty(MOST_POINTS, np.int32)
        self.square, self.kept = np.empty(MOST_POINTS), np.empty(MOST_POINTS + 1, np.int32)
        self.keys, self.values = np.empty(MOST_POINTS), np.empty(MOST_POINTS, np.int32)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def search(
        self,
        leaf: cython.Py_ssize_t,
        chosen: cython.const[cython.longlong][::1],
        index: cython.int[:, ::1],
        square: cython.double[:, ::1],
        found: cython.uchar[::1],
    ) -> cython.void:
        """Fill the rows of some points of a leaf: with the radius of the last leaf, or others until it fits."""
        box: cython.double[6]
        self.enclose(chosen, box)
        if self.radius == 0.0:
            self.radius = self.first_guess(leaf)
        larger: cython.double = LARGER
        a: cython.Py_ssize_t
        for _ in range(MOST_TRIES):
            if not self.radius > LEAST_RADIUS:
                break
            count: cython.Py_ssize_t = self.gather(box)
            is_short: cython.bint = False
            largest: cython.double = 0.0
            n_found: cython.Py_ssize_t = 0
            if count >= 0:
                for a in range(chosen.shape[0]):
                    if not found[a]:
                        outcome: cython.int = self.sort_around(chosen[a], count, index[a], square[a])
                        found[a] = outcome == 0
                        is_short = is_short or outcome < 0
                    n_found += found[a]
                    if found[a]:
                        largest = max(largest, square[a, self.k - 1])
            if n_found == chosen.shape[0]:
                self.radius = WIDER * sqrt(largest)
                return
            self.radius *= larger if is_short else SMALLER
            larger *= LARGER
        self.radius = 0.0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def first_guess(self, leaf: cython.Py_ssize_t) -> cython.double:
        """The radius of a disc with k points, of points as dense as those of a leaf in a square."""
        size: cython.double = 0.0
        x: cython.Py_ssize_t
        for x in range(3):
            side: cython.double = self.boxes[self.n_leaves + leaf, 3 + x] - self.boxes[self.n_leaves + leaf, x]
            size += side * side
        return WIDER * sqrt(size * self.k / (6.28 * (self.first[leaf + 1] - self.first[leaf])))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def enclose(self, chosen: cython.const[cython.longlong][::1], box: cython.pointer[cython.double]) -> cython.void:
        a: cython.Py_ssize_t
        x: cython.Py_ssize_t
        for x in range(3):
            box[x] = box[3 + x] = self.P[chosen[0], x]
            for a in range(1, chosen.shape[0]):
                box[x] = min(box[x], self.P[chosen[a], x])
                box[3 + x] = max(box[3 + x], self.P[chosen[a], x])

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def gather(self, box: cython.pointer[cython.const[cython.double]]) -> cython.Py_ssize_t:
        """Find the points within the radius of a box; return how many there are, -1 if there are too many."""
        stack: cython.int[64]
        top: cython.Py_ssize_t = 1
        stack[0] = 1
        count: cython.Py_ssize_t = 0
        limit: cython.double = self.radius * self.radius
        x: cython.Py_ssize_t
        while top > 0:
            top -= 1
            node: cython.Py_ssize_t = stack[top]
            apart: cython.double = 0.0
            for x in range(3):
                beside: cython.double = max(
                    max(self.boxes[node, x] - box[3 + x], box[x] - self.boxes[node, 3 + x]), 0.0
                )
                apart += beside * beside
            if apart > limit:
                continue
            if node < self.n_leaves:
                stack[top], stack[top + 1] = cython.cast(cython.int, 2 * node + 1), cython.cast(cython.int, 2 * node)
                top += 2
                continue
            count = self.append(node - self.n_leaves, count, box)
            if count < 0:
                break
        return count

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def append(
        self, leaf: cython.Py_ssize_t, count: cython.Py_ssize_t, box: cython.pointer[cython.const[cython.double]]
    ) -> cython.Py_ssize_t:
        """Append the points of a leaf within the radius of a box to the `count` ones before them; -1 if too many."""
        limit: cython.double = self.radius * self.radius
        j: cython.Py_ssize_t
        x: cython.Py_ssize_t
        if count + self.first[leaf + 1] - self.first[leaf] > MOST_POINTS:
            return -1
        for j in range(self.first[leaf], self.first[leaf + 1]):
            apart: cython.double = 0.0
            for x in range(3):
                self.near[x, count] = self.P[j, x]
                beside: cython.double = max(max(self.P[j, x] - box[3 + x], box[x] - self.P[j, x]), 0.0)
                apart += beside * beside
            self.number[count] = cython.cast(cython.int, j)
            # Without a branch, which would often be mispredicted.
            count += apart <= limit
        return count

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sort_around(
        self,
        i: cython.Py_ssize_t,
        count: cython.Py_ssize_t,
        index: cython.int[::1],
        square: cython.double[::1],
    ) -> cython.int:
        """The k nearest of the points that were gathered; 0, -1 if the radius is too small, 1 if it is too large."""
        limit: cython.double = self.radius * self.radius
        j: cython.Py_ssize_t
        kept: cython.Py_ssize_t = 0
        px: cython.double = self.P[i, 0]
        py: cython.double = self.P[i, 1]
        pz: cython.double = self.P[i, 2]
        for j in range(count):
            dx: cython.double = self.near[0, j] - px
            dy: cython.double = self.near[1, j] - py
            dz: cython.double = self.near[2, j] - pz
            self.square[j] = dx * dx + dy * dy + dz * dz
        for j in range(count):
            self.kept[kept] = cython.cast(cython.int, j)
            kept += self.square[j] <= limit
        if kept < self.k:
            return -1
        size: cython.Py_ssize_t = self.fill_shells(kept)
        if size > 8 * self.k:
            return 1
        self.sort(size)
        for j in range(self.k):
            index[j], square[j] = self.values[j], self.keys[j]
        # Squares of distances may underflow, and then others are as near as the point itself.
        if index[0] != i:
            j = 1
            while j < self.k - 1 and index[j] != i:
                j += 1
            index[j], index[0] = index[0], cython.cast(cython.int, i)
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def fill_shells(self, kept: cython.Py_ssize_t) -> cython.Py_ssize_t:
        """Put the points that were kept into shells; return how many are in those that hold the k nearest."""
        begin: cython.int[65]
        scale: cython.double = SHELLS / (self.radius * self.radius)
        keys: cython.pointer[cython.double] = cython.address(self.keys[0])
        values: cython.pointer[cython.int] = cython.address(self.values[0])
        j: cython.Py_ssize_t
        shell: cython.Py_ssize_t
        size: cython.Py_ssize_t = 0
        for shell in range(SHELLS + 1):
            begin[shell] = 0
        for j in range(kept):
            begin[1 + self.shell_of(j, scale)] += 1
        for shell in range(SHELLS):
            begin[shell + 1] += begin[shell]
            size = begin[shell + 1] if begin[shell] < self.k else size
        for j in range(kept):
            shell = self.shell_of(j, scale)
            keys[begin[shell]], values[begin[shell]] = self.square[self.kept[j]], self.number[self.kept[j]]
            begin[shell] += 1
        return size

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def sort(self, size: cython.Py_ssize_t) -> cython.void:
        """Sort the points in shells by distance: by insertion, since few are misplaced.

        Equal distances stay in the order in which leaves are found, which is that of the numbers.
        """
        keys: cython.pointer[cython.double] = cython.address(self.keys[0])
        values: cython.pointer[cython.int] = cython.address(self.values[0])
        j: cython.Py_ssize_t
        for j in range(1, size):
            key: cython.double = keys[j]
            value: cython.int = values[j]
            b: cython.Py_ssize_t = j
            while b > 0 and keys[b - 1] > key:
                keys[b], values[b] = keys[b - 1], values[b - 1]
                b -= 1
            keys[b], values[b] = key, value

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def shell_of(self, j: cython.Py_ssize_t, scale: cython.double) -> cython.Py_ssize_t:
        shell: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, scale * self.square[self.kept[j]])
        return min(shell, SHELLS - 1)
