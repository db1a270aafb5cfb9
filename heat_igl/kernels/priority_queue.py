"""A priority queue of numbers whose keys may change: a binary heap that knows the place of each number in it."""

import cython
import numpy as np


@cython.final
@cython.cclass
class PriorityQueue:
    """Numbers below `size` by their keys, the largest key first; a number of key 0 is not in the queue.

    ``heap[:count]`` are the numbers in the queue, and ``place[i]`` is the index of i in `heap`, -1 for none.
    """

    def __init__(self, size):
        self.key, self.heap, self.place = np.zeros(size), np.empty(size, np.int64), np.full(size, -1)
        self.count = 0

    def first(self):
        """The number with the largest key; the queue must not be empty."""
        return self.heap[0]

    def set_key(self, i, key):
        """Give i another key, at least 0: insert it, move it, or remove it."""
        k: cython.longlong = self.place[i]
        if k < 0:
            if key > 0.0:
                self.key[i] = key
                self.heap[self.count] = i
                self.count += 1
                self._lift(self.count - 1)
            return
        if key > 0.0:
            grows: cython.bint = key > self.key[i]
            self.key[i] = key
            if grows:
                self._lift(k)
            else:
                self._sink(k)
            return
        self.count -= 1
        self.place[i] = -1
        last: cython.longlong = self.heap[self.count]
        if last != i:
            self.heap[k] = last
            self.place[last] = k
            self._lift(k)
            self._sink(self.place[last])

    def _lift(self, k):
        """Restore the heap above index k, whose key may be too large for that place."""
        i: cython.longlong = self.heap[k]
        while k > 0:
            parent: cython.longlong = (k - 1) // 2
            if self.key[self.heap[parent]] >= self.key[i]:
                break
            self.heap[k] = self.heap[parent]
            self.place[self.heap[k]] = k
            k = parent
        self.heap[k] = i
        self.place[i] = k

    def _sink(self, k):
        """Restore the heap below index k, whose key may be too small for that place."""
        i: cython.longlong = self.heap[k]
        while True:
            child: cython.longlong = 2 * k + 1
            if child >= self.count:
                break
            if child + 1 < self.count and self.key[self.heap[child + 1]] > self.key[self.heap[child]]:
                child += 1
            if self.key[self.heap[child]] <= self.key[i]:
                break
            self.heap[k] = self.heap[child]
            self.place[self.heap[k]] = k
            k = child
        self.heap[k] = i
        self.place[i] = k
