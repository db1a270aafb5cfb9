"""The mesh report: counts, defects and sizes that bear on a distance computed on a mesh."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import reduce
from typing import TYPE_CHECKING

import igl
import numpy as np

from heat_igl.mesh import connectivity
from heat_igl.mesh.seams import seam_pairs
from heat_igl.runtime import RANGE_LIMIT
from heat_igl.typing import FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.mesh.mesh import Mesh

# An edge is flipped when the two cotangents opposite it sum to less than this. The cotangents of cocircular corners
# (every quad of a grid, a cylinder or a torus) sum to zero up to rounding; flipping such an edge would improve nothing.
# Rounding is 1e-9 when a mesh lies 1e7 edge lengths from the origin, so 1e-7 keeps the same diagonals there too.
DELAUNAY_TOLERANCE = -1e-7

# A face is degenerate when its area (volume) is at most this share of the square (cube) of the longest edge.
_DEGENERATE = 1e-12


@dataclass(frozen=True)
class MeshReport:
    """Counts, defects and sizes of a mesh, as `Mesh.report` returns them.

    Lengths are in the mesh's unit; lists of defects are index arrays.

    Attributes
    ----------
    n_vertices, n_faces, n_edges : int
        Counts; faces are triangles or tetrahedra.
    n_components : int
        Components that hold faces.
    n_boundary_loops : int
        Closed boundary curves (patches, for tetrahedra).
    euler_characteristic : int
        Alternating sum of the numbers of simplices, without unreferenced vertices.
    nonmanifold_edges : (k, 2) int64
        Edges of more than two triangles (for tetrahedra: triangles (k, 3) of more than two tetrahedra).
    nonmanifold_vertices : (k,) int64
        Vertices whose faces are not one fan (triangle meshes; empty for tetrahedra).
    degenerate_faces : (k,) int64
        Faces whose area or volume is zero to rounding: at most 1e-12 of the square (cube) of their longest edge.
    duplicate_faces : (k,) int64
        Faces with the same vertices as an earlier face.
    unreferenced_vertices : (k,) int64
        Vertices that no face uses; every distance there is ``inf``.
    seam_edges : (k, 2) int64
        Boundary edges that lie on another one, as at texture seams; ``as_mesh(mesh, merge="seams")`` joins them.
    crossed_polygons : (k,) int64
        Polygons that the triangles were cut from and whose sides cross each other, counted as in the file.
    shortest_edge, mean_edge, longest_edge : float
        Over the distinct edges.
    smallest_angle, largest_angle : float
        Over all triangles, in degrees.
    is_intrinsic_delaunay : bool or None
        Whether the intrinsic Delaunay triangulation flips no edge; None for tetrahedra.
    edges_across : float
        `Mesh.longest_distance` in mean edge lengths.
    range_limit : float
        Number of lengths sqrt(t) after which heat underflows in double precision. With the time step t = c h^2 the
        solver raises t on a mesh of more than sqrt(c) times as many edges across: 919 for the default c = 0.5 of
        triangles, 1300 for c = 1.

    Examples
    --------
    >>> import heat_igl
    >>> report = heat_igl.shapes.torus(24, 16).report()
    >>> report.euler_characteristic, report.n_boundary_loops, report.n_components
    (0, 0, 1)
    >>> heat_igl.shapes.book(3, 4).report().nonmanifold_edges.shape  # the four edges where three pages meet
    (4, 2)
    """

    n_vertices: int
    n_faces: int
    n_edges: int
    n_components: int
    n_boundary_loops: int
    euler_characteristic: int
    nonmanifold_edges: IntArray
    nonmanifold_vertices: IntArray
    degenerate_faces: IntArray
    duplicate_faces: IntArray
    unreferenced_vertices: IntArray
    seam_edges: IntArray
    crossed_polygons: IntArray
    shortest_edge: float
    mean_edge: float
    longest_edge: float
    smallest_angle: float
    largest_angle: float
    is_intrinsic_delaunay: bool | None
    edges_across: float
    range_limit: float

    def rows(self) -> list[tuple[str, str]]:
        """The report as (name, value) pairs for printing; long lists of defects are cut."""
        return [(field.name.replace("_", " "), _shown(getattr(self, field.name))) for field in fields(self)]

    def __str__(self) -> str:
        rows = self.rows()
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name:{width}}  {value}" for name, value in rows)


@dataclass(frozen=True)
class CloudReport(MeshReport):
    """Report on the surface through the points of a `PointCloud`, returned by `PointCloud.report`.

    The counts, defects and sizes are those of `PointCloud.triangles`; `unreferenced_vertices` are the points left out,
    outliers that belong to no triangle.

    Attributes
    ----------
    boundary_points : (k,) int64
        Points at a border of the triangles: of the surface, of a hole, or of a part that was not scanned.
    cut_off_points : (k,) int64
        Points in no triangle of the largest part, from which their distance is ``inf``.
    doubtful_points : (k,) int64
        Points at which the triangles may join sheets that are apart, or tear one: at an edge of two triangles that
        contradict each other's orientation or fold back, with less than 60 degrees between them; or more than four
        edges away from a point nearby, as beside another sheet, or at triangles that bridge a gap, without these.
    n_copies : int
        Points that are copies of earlier ones.
    noise : float
        Root mean square of how far points were moved to smooth them, in the unit of the points; 0 if they were not.
    tilt : float
        Degrees between triangles and the tangent planes of their corners, the angle of the mean cosine: near 0 where
        the points are dense enough for the bends of the surface.
    """

    boundary_points: IntArray
    cut_off_points: IntArray
    doubtful_points: IntArray
    n_copies: int
    noise: float
    tilt: float


def _shown(value: object) -> str:
    if isinstance(value, np.ndarray):
        head = ", ".join(str(row.tolist()) for row in value[:5])
        return f"{len(value)}" + (f": {head}" if head else "") + (", ..." if len(value) > 5 else "")
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "-" if value is None else str(value)


def mesh_report(mesh: Mesh) -> MeshReport:
    """The report of `mesh`; see `Mesh.report`."""
    n, F = mesh.n_vertices, mesh.F
    found = mesh.facets
    triangles = found.vertices if mesh.is_tetrahedral else F
    cotangents, angles = _cotangents_and_angles(mesh.V, triangles)
    sides = igl.edge_lengths(mesh.V, F) if mesh.is_tetrahedral else mesh.edge_lengths[found.of_face]
    longest = reduce(np.maximum, sides.T)
    n_unreferenced = int((~mesh.referenced).sum())
    is_copy = mesh.originals != np.arange(n)
    cells = len(found.vertices) - len(F) if mesh.is_tetrahedral else len(F)
    mean_edge = float(mesh.edge_lengths.mean())
    is_delaunay = None
    if not mesh.is_tetrahedral:
        opposite = np.bincount(found.of_face.T.ravel(), weights=cotangents.ravel())
        is_delaunay = not (opposite[found.n_faces == 2] < DELAUNAY_TOLERANCE).any()
    return MeshReport(
        n_vertices=n,
        n_faces=len(F),
        n_edges=len(mesh.edges),
        n_components=int(mesh.components.max()) + 1 - n_unreferenced,
        n_boundary_loops=connectivity.boundary_loops(found, n),
        euler_characteristic=n - n_unreferenced - len(mesh.edges) + cells,
        nonmanifold_edges=found.vertices[found.n_faces > 2],
        nonmanifold_vertices=np.empty(0, np.int64)
        if mesh.is_tetrahedral
        else connectivity.nonmanifold_vertices(F, found, n),
        degenerate_faces=np.flatnonzero(mesh.measures <= _DEGENERATE * longest ** (F.shape[1] - 1)),
        duplicate_faces=connectivity.duplicate_faces(F, n),
        unreferenced_vertices=np.flatnonzero(~mesh.referenced & ~is_copy),
        seam_edges=seam_pairs(mesh)[:, :2],
        crossed_polygons=mesh.crossed_polygons,
        shortest_edge=float(mesh.edge_lengths.min()),
        mean_edge=mean_edge,
        longest_edge=float(mesh.edge_lengths.max()),
        smallest_angle=float(np.degrees(angles.min())),
        largest_angle=float(np.degrees(angles.max())),
        is_intrinsic_delaunay=is_delaunay,
        edges_across=mesh.longest_distance / mean_edge,
        range_limit=RANGE_LIMIT,
    )


def _cotangents_and_angles(V: FloatArray, F: IntArray) -> tuple[FloatArray, FloatArray]:
    """Cotangent and angle (3, m) at each corner of triangles; the angle is 0 at a corner with a side of length 0.

    From positions, not from edge lengths: these give an angle near pi to half the digits only.
    """
    dot = np.zeros((3, len(F)))
    for x in V.T:
        a, b, c = x[F.T]
        ab, bc, ca = b - a, c - b, a - c
        dot -= ca * ab, ab * bc, bc * ca
    cross = igl.doublearea(V, F)
    with np.errstate(divide="ignore", invalid="ignore"):
        return dot / cross, np.arctan2(cross, dot)
