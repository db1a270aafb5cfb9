"""Delaunay refinement of an intrinsic triangulation: circumcenters of bad triangles become vertices.

Sharp, Soliman and Crane (2019, section 4.2): the worst triangle's circumcenter is found by walking straight across the
surface from that triangle, the triangle it lies in is split there, and edges are flipped until the triangulation is
Delaunay again. Only for surfaces without a boundary: there the walk cannot leave.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.flipping import SPLIT, Flips
from cython.cimports.heat_igl.kernels.mesh.straight import INSIDE, OVER_SIDE, Exit, Heading, cross
from cython.cimports.heat_igl.kernels.mesh.triangles import area, foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.libc.math import atan2, sqrt

from heat_igl.kernels.signals import raise_caught

# Barycentric coordinates of a new vertex are at least this, so that no split makes a triangle without area. With 0.001
# and 0.05, 19 shapes get as many vertices, and heat on them has .97 and 1.02 of the error.
_LEAST = cython.declare(cython.double, 0.01)
# A cone of less than 60 degrees in all keeps the angle that it has.
_SHARPEST = cython.declare(cython.double, 1.0471975511965976)
# A walk to a circumcenter crosses few triangles, since the triangulation is Delaunay: with 10, errors are the same.
_MOST_STEPS = cython.declare(cython.int, 200)


@cython.final
@cython.cclass
class _Refinement:
    """A triangulation that is being refined, with its bad triangles by priority.

    The triangulation is closed: every half-edge has an aligned twin. Two sides of one face may be twins.
    """

    def __init__(self, edges, n_vertices, most_new, tolerance):
        """Copy a `HalfEdges`, with room for `most_new` more vertices."""
        size = len(edges.twin)
        rows = size // 3 + 2 * most_new
        arrays = [np.empty(3 * rows, np.int32) for _ in range(3)] + [np.empty(3 * rows)]
        for array, given in zip(arrays, (edges.vertex, edges.twin, edges.ring, edges.length), strict=True):
            array[:size] = given
        self.flips, self.bad = Flips(*arrays, tolerance, True), PriorityQueue(rows)
        self.unit, self.largest = np.empty((2, rows))
        self.is_sharp = np.zeros(n_vertices, np.uint8)
        self.n_faces, self.n_vertices = size // 3, n_vertices

    def run(self, most_vertices):
        """Refine until no triangle is bad, or there are `most_vertices`."""
        f: cython.int
        for f in range(self.n_faces):
            self.judge(f)
        while self.bad.count > 0 and self.n_vertices < most_vertices:
            if self.n_vertices % ASK == 0 and is_interrupted():
                break
            f = self.bad.first()
            center: Location = _circumcenter(self.flips, f)
            if center.face < 0:
                self.bad.set_key(f, 0.0)
            else:
                self.insert(center)
        return 0

    def judge(self, f):
        """Measure a triangle that is new or has changed, and move it to the right place in the queue, or out of it."""
        self.flips.measure(f)
        self.bad.set_key(f, self.badness(f))

    def badness(self, f):
        """Circumradius of a bad triangle in the unit of the face, 0 of another."""
        h: cython.int = 3 * f
        a: cython.double = self.flips.length[h]
        b: cython.double = self.flips.length[h + 1]
        c: cython.double = self.flips.length[h + 2]
        size: cython.double = area(a, b, c)
        if not size > 0.0:
            return 0.0
        radius: cython.double = a * b * c / (4.0 * size)
        badness: cython.double = radius / self.unit[f]
        if badness > self.largest[f]:
            return badness
        shortest: cython.int = 0 if a <= b and a <= c else 1 if b <= c else 2
        # The sine of the smallest angle is the side opposite over the diameter of the circumcircle.
        if min(min(a, b), c) >= 2.0 * radius * self.least_sine:
            return 0.0
        # The angle at the tip of a sharp cone stays as it is.
        tip: cython.int = self.flips.vertex[h + shortest]
        return 0.0 if tip < self.is_sharp.shape[0] and self.is_sharp[tip] else badness

    def insert(self, at):
        """Make a location a vertex and flip edges until all are Delaunay."""
        u: cython.double = max(at.u, _LEAST)
        v: cython.double = max(at.v, _LEAST)
        w: cython.double = max(at.w, _LEAST)
        total: cython.double = u + v + w
        f: cython.int = at.face
        g: cython.int = self.n_faces
        self.split(f, u / total, v / total, w / total)
        self.unit[g] = self.unit[g + 1] = self.unit[f]
        self.largest[g] = self.largest[g + 1] = self.largest[f]
        self.judge(f)
        self.judge(g)
        self.judge(g + 1)
        self.flips.wait(3 * f)
        self.flips.wait(3 * g + 1)
        self.flips.wait(3 * g + 5)
        h: cython.int = self.flips.next()
        while h >= 0:
            f, g = h // 3, self.flips.twin[h] // 3
            self.flips.flip(h)
            self.judge(f)
            self.judge(g)
            h = self.flips.next()
        return 0

    def split(self, f, u, v, w):
        """Split face f at barycentric coordinates u, v, w, which sum to 1: a new vertex, and two faces at the end."""
        length: cython.double[::1] = self.flips.length
        vertex: cython.int[::1] = self.flips.vertex
        h: cython.int = 3 * f
        a: cython.double = length[h]
        b: cython.double = length[h + 1]
        c: cython.double = length[h + 2]
        # From the new vertex to the corners: |sum of weights times edges|, without coordinates.
        to_0: cython.double = sqrt(max(v * v * c * c + w * w * b * b + v * w * (c * c + b * b - a * a), 0.0))
        to_1: cython.double = sqrt(max(u * u * c * c + w * w * a * a + u * w * (c * c + a * a - b * b), 0.0))
        to_2: cython.double = sqrt(max(u * u * b * b + v * v * a * a + u * v * (b * b + a * a - c * c), 0.0))
        i: cython.int = self.flips.append_move(SPLIT, f, self.n_faces)
        self.flips.numbers[i, 0], self.flips.numbers[i, 1], self.flips.numbers[i, 2] = u, v, w
        g: cython.int = 3 * self.n_faces
        k: cython.int = g + 3
        self.n_faces += 2
        p: cython.int = self.n_vertices
        self.n_vertices += 1
        beyond_1: cython.int = self.flips.twin[h + 1]
        beyond_2: cython.int = self.flips.twin[h + 2]
        # f = (p, 1, 2), g = (0, p, 2), k = (0, 1, p): each keeps one side of the old face at the same corner.
        vertex[g], vertex[g + 1], vertex[g + 2] = vertex[h], p, vertex[h + 2]
        vertex[k], vertex[k + 1], vertex[k + 2] = vertex[h], vertex[h + 1], p
        vertex[h] = p
        length[h + 1], length[h + 2] = to_2, to_1
        length[g], length[g + 1], length[g + 2] = to_2, b, to_0
        length[k], length[k + 1], length[k + 2] = to_1, to_0, c
        # Sides 1 and 2 of the old face may be glued to each other, or each to itself.
        if beyond_1 == h + 2:
            self.glue(g + 1, k + 2)
        else:
            self.glue(g + 1, g + 1 if beyond_1 == h + 1 else beyond_1)
            self.glue(k + 2, k + 2 if beyond_2 == h + 2 else beyond_2)
        self.glue(h + 1, g)
        self.glue(h + 2, k)
        self.glue(g + 2, k + 1)
        return 0

    def glue(self, h, t):
        """Make two half-edges twins."""
        self.flips.twin[h] = t
        self.flips.twin[t] = h

    def result(self):
        """Corners, twins and lengths (3 m,) of the faces, the number of vertices, and the moves."""
        size = 3 * self.n_faces
        flips = self.flips
        arrays = np.array(flips.vertex[:size]), np.array(flips.twin[:size]), np.array(flips.length[:size])
        return *arrays, int(self.n_vertices), *flips.moves()


def _find_sharp(t, n_faces, seen, is_sharp):
    """Mark vertices with a fan of faces whose angles sum to less than `_SHARPEST`: no split or flip changes that."""
    for first in range(3 * n_faces):
        at: cython.int = first
        total: cython.double = 0.0
        while not seen[at]:
            seen[at] = True
            following: cython.int = next_half_edge(at)
            a: cython.double = t.length[at]
            b: cython.double = t.length[following]
            d: cython.double = t.length[previous_half_edge(at)]
            total += atan2(4.0 * area(a, b, d), b * b + d * d - a * a)
            if t.twin[following] < 0:
                break  # in a part that is not refined
            at = next_half_edge(t.twin[following])
        if 0.0 < total < _SHARPEST:
            is_sharp[t.vertex[first]] = True


def _circumcenter(t, f):
    """Locate the circumcenter of a triangle, in the triangle or straight on from it; face -1 if it is not found."""
    a: cython.double = t.length[3 * f]
    b: cython.double = t.length[3 * f + 1]
    c: cython.double = t.length[3 * f + 2]
    u: cython.double = a * a * (b * b + c * c - a * a)
    v: cython.double = b * b * (c * c + a * a - b * b)
    w: cython.double = c * c * (a * a + b * b - c * c)
    total: cython.double = u + v + w
    u, v, w = u / total, v / total, w / total
    if u >= 0.0 and v >= 0.0 and w >= 0.0:
        return Location(f, u, v, w)
    # From the centroid, in the frame of the side from corner 0 to corner 1.
    apex: cython.double = foot(c, b, a)
    height: cython.double = 2.0 * area(a, b, c) / c
    x: cython.double = (c + apex) / 3.0
    y: cython.double = height / 3.0
    dx: cython.double = v * c + w * apex - x
    dy: cython.double = w * height - y
    left: cython.double = sqrt(dx * dx + dy * dy)
    at: cython.double[3]
    ray: Heading = Heading(3 * f + 2, INSIDE, x, y, dx / left, dy / left)
    for _ in range(_MOST_STEPS):
        h: cython.int = ray.h
        size: cython.double = area(t.length[h], t.length[next_half_edge(h)], t.length[previous_half_edge(h)])
        way: Exit = cross(cython.address(t.length[0]), 2.0 * size, cython.address(ray))
        across: cython.double = way.left + way.right
        if not across > 0.0:
            break
        share: cython.double = way.left / across
        step: cython.double = way.head_ahead + share * (way.tail_ahead - way.head_ahead)
        if step >= left:
            at_apex: cython.double = (ray.y + left * ray.dy) * t.length[h] / (2.0 * size)
            apex = foot(t.length[h], t.length[previous_half_edge(h)], t.length[next_half_edge(h)])
            at_head: cython.double = (ray.x + left * ray.dx - at_apex * apex) / t.length[h]
            at[h % 3], at[(h + 1) % 3], at[(h + 2) % 3] = at_apex, 1.0 - at_apex - at_head, at_head
            return Location(h // 3, at[0], at[1], at[2])
        left -= step
        h = t.twin[way.h]
        if h < 0:
            break
        ray = Heading(h, OVER_SIDE, share * t.length[h], 0.0, way.dx, way.dy)
    return Location(-1, 0.0, 0.0, 0.0)


def refine(edges, n, unit, least_angle, largest_radius, most_vertices: cython.longlong, tolerance):
    """Refine triangles until none is bad, or there are `most_vertices`.

    A triangle is bad if an angle is smaller than `least_angle`, in radians, or if the circumradius is larger than
    `largest_radius` (m,) times the `unit` (m,) of the face; none is in an infinite unit. Faces that are made of a face
    inherit both. `edges` are `HalfEdges` on n vertices: intrinsic Delaunay, and closed and oriented in finite units.
    `tolerance` is that of `flipping.flip`.

    Returns the vertices, twins and lengths of the new half-edges, the number of vertices, and the moves as `Moved`
    has them.
    """
    one = _Refinement(edges, n, max(most_vertices - n, 0), tolerance)
    np.asarray(one.unit)[: len(unit)], np.asarray(one.largest)[: len(unit)] = unit, largest_radius
    one.least_sine = np.sin(least_angle)
    seen: cython.uchar[::1] = np.zeros(len(edges.twin), np.uint8)
    with cython.nogil:
        _find_sharp(one.flips, one.n_faces, seen, one.is_sharp)
        one.run(most_vertices)
    raise_caught()
    return one.result()
