"""Constrained Delaunay triangulation of one triangle, in exact integer arithmetic.

Points are homogeneous barycentric coordinates: three integers. The sign of the determinant of three points is the
orientation of their triangle, the cross product of two points is the line through them, and the cross product of two
lines is their intersection, all without rounding or division. Points are inserted one by one, edge flips enforce the
segments (Sloan 1993), and further flips make the other edges Delaunay. Only these last flips use floating-point angles.
"""

from __future__ import annotations

from cmath import phase
from collections import deque
from fractions import Fraction
from itertools import combinations, pairwise
from math import gcd, pi

import numpy as np

from heat_igl.typing import FloatArray

Point = tuple[int, int, int]
# Tolerance of the Delaunay test: at an edge between cocircular points, opposite angles sum to pi up to rounding.
# All values from 0 to 1e-4 give the same triangles in 5122 faces cut along shortest paths.
_ROUNDING = 1e-9


def cut_triangle(
    points: list[Point], segments: list[tuple[int, int]], corners: FloatArray
) -> tuple[list[Point], list[tuple[int, int, int]], list[list[int]]]:
    """Triangulate a triangle with prescribed vertices and prescribed segments, each a chain of edges.

    `points` are distinct, the three corners first; `corners` (3, 2) are the positions of the corners in the plane.
    `segments` are pairs of point indices and may cross, overlap, and run along the sides. Returns the points followed
    by the intersections of segments, the triangles, oriented like the corners, and the chain of points of each segment.
    """
    points = [_reduced(point) for point in points]
    number = {point: i for i, point in enumerate(points)}
    for (a, b), (c, d) in combinations(segments, 2):
        crossing = _crossing(points[a], points[b], points[c], points[d])
        if crossing is not None and crossing not in number:
            number[crossing] = len(points)
            points.append(crossing)
    chains = [_along(points, a, b) for a, b in segments]
    triangulation = _Triangulation(points)
    for i in range(3, len(points)):
        triangulation.insert(i)
    for chain in chains:
        for a, b in pairwise(chain):
            triangulation.enforce(a, b)
    triangulation.make_delaunay({edge for chain in chains for edge in pairwise(chain)}, corners)
    return points, triangulation.triangles(), chains


def _cross(p: Point, q: Point) -> Point:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def _side(line: Point, p: Point) -> int:
    """Side of a directed line on which the point lies: 1 left, -1 right, 0 on the line."""
    value = line[0] * p[0] + line[1] * p[1] + line[2] * p[2]
    return (value > 0) - (value < 0)


def _reduced(p: Point) -> Point:
    """Normal form of a point: nonnegative integers whose greatest common divisor is 1."""
    divisor = gcd(*p)
    if sum(p) < 0:
        divisor = -divisor
    return p[0] // divisor, p[1] // divisor, p[2] // divisor


def _crossing(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """Intersection of the segments a b and c d, or None unless it is an interior point of both."""
    ab = _cross(a, b)
    if _side(ab, c) * _side(ab, d) >= 0:
        return None
    cd = _cross(c, d)
    return _reduced(_cross(ab, cd)) if _side(cd, a) * _side(cd, b) < 0 else None


def _along(points: list[Point], a: int, b: int) -> list[int]:
    """All points on the segment from a to b, sorted along it."""
    p, q = points[a], points[b]
    line = _cross(p, q)
    # Sort by a barycentric coordinate that differs between a and b.
    k = next(k for k in range(3) if p[k] * sum(q) != q[k] * sum(p))
    place = {i: Fraction(point[k], sum(point)) for i, point in enumerate(points) if _side(line, point) == 0}
    chain = sorted(place, key=place.__getitem__, reverse=place[a] > place[b])
    return chain[chain.index(a) : chain.index(b) + 1]


class _Triangulation:
    """A triangulation: `_apex` maps a directed edge (a, b) to the third vertex c of the triangle a b c on its left."""

    def __init__(self, points: list[Point]) -> None:
        self._points = points
        self._apex: dict[tuple[int, int], int] = {}
        self._add(0, 1, 2)

    def triangles(self) -> list[tuple[int, int, int]]:
        """Sorted list of triangles, each beginning with its lowest index."""
        return sorted((a, b, c) for (a, b), c in self._apex.items() if a < b and a < c)

    def insert(self, i: int) -> None:
        """Split the triangle that contains point i, or both triangles at the edge that contains it."""
        for a, b, c in self.triangles():
            if self._left(a, b, i) >= 0 and self._left(b, c, i) >= 0 and self._left(c, a, i) >= 0:
                self._remove(a, b, c)
                for edge in ((a, b), (b, c), (c, a)):
                    if self._left(*edge, i) > 0:
                        self._add(*edge, i)

    def enforce(self, a: int, b: int) -> None:
        """Insert the edge a b by flipping the edges that cross it; no other point may lie on the edge."""
        if (a, b) in self._apex or (b, a) in self._apex:
            return
        crossed = deque(self._crossed(a, b))
        while crossed:
            x, y = crossed.popleft()
            p, q = self._apex[x, y], self._apex[y, x]
            if not self._flip(x, y):
                crossed.append((x, y))  # its quadrilateral is not convex yet: retry after the others
            elif self._left(a, b, p) * self._left(a, b, q) < 0:
                crossed.append((p, q))

    def make_delaunay(self, fixed: set[tuple[int, int]], corners: FloatArray) -> None:
        """Flip edges, except `fixed` ones, until the two angles opposite each edge sum to at most pi.

        This removes thin triangles along collinear points. In exact arithmetic a flipped edge is never flipped back.
        `gone` forbids it where rounding or collinear corners would allow it, so that the loop ends.
        """
        weights = np.array([[weight / sum(point) for weight in point] for point in self._points])
        at = (weights @ corners @ [1, 1j]).tolist()
        waiting = deque(edge for edge in sorted(self._apex) if edge[0] < edge[1])
        gone: set[tuple[int, int]] = set()
        while waiting:
            x, y = waiting.popleft()
            if not ((x, y) in self._apex and (y, x) in self._apex) or (x, y) in fixed or (y, x) in fixed:
                continue
            p, q = self._apex[x, y], self._apex[y, x]
            opposite = sum(abs(phase((at[x] - at[k]).conjugate() * (at[y] - at[k]))) for k in (p, q))
            if opposite > pi + _ROUNDING and (p, q) not in gone and self._flip(x, y):
                gone.update(((x, y), (y, x)))
                waiting.extend(((p, x), (x, q), (q, y), (y, p)))

    def _flip(self, x: int, y: int) -> bool:
        """Replace the edge x y by the other diagonal of its quadrilateral; False if that is not strictly convex."""
        p, q = self._apex[x, y], self._apex[y, x]
        if self._left(p, q, y) <= 0 or self._left(q, p, x) <= 0:
            return False
        self._remove(x, y, p)
        self._remove(y, x, q)
        self._add(p, q, y)
        self._add(q, p, x)
        return True

    def _crossed(self, a: int, b: int) -> list[tuple[int, int]]:
        """Edges that cross the segment from a to b, in order, each directed from right to left of it."""
        for (p, x), y in list(self._apex.items()):
            if p == a and self._left(a, b, x) < 0 < self._left(a, b, y):
                found = [(x, y)]
                break
        while True:
            x, y = found[-1]
            third = self._apex[y, x]
            if third == b:
                return found
            found.append((x, third) if self._left(a, b, third) > 0 else (third, y))

    def _left(self, a: int, b: int, c: int) -> int:
        return _side(_cross(self._points[a], self._points[b]), self._points[c])

    def _add(self, a: int, b: int, c: int) -> None:
        self._apex[a, b], self._apex[b, c], self._apex[c, a] = c, a, b

    def _remove(self, a: int, b: int, c: int) -> None:
        for edge in ((a, b), (b, c), (c, a)):
            del self._apex[edge]
