"""The scene that a picture or a page shows: triangles or discs, values, view direction, sources and colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import igl
import numpy as np

from heat_igl.drawing.raster import default_rotation, rotation
from heat_igl.errors import MissingExtraError, real_numbers, require_choice
from heat_igl.mesh import Mesh, MeshLike, NestedCurves, PointCloud, PolygonMesh, as_simplices, flat_curves
from heat_igl.sources import Sources, source_set
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray

Style = Literal["lines", "stripes", "plain"]

#: Near is light, far is dark: in pictures, pages and windows.
DISTANCE_COLOURS = "viridis_r"
DISTANCE_LABEL = "distance, in the mesh's unit"
UNREACHABLE = (0.72, 0.72, 0.72)  # no colour of a distance is nearer than 0.48
#: Fraction by which an isoline reduces the brightness; by eye, as the next one.
LINE_INK = 0.58
#: Fraction of white in the light stripes.
STRIPE_INK = 0.5

# Corners of a disc. Above this number of points it is a few pixels wide, and is drawn as a square.
_CORNERS, _FEW_CORNERS, _MANY = 8, 4, 20_000
_PERMUTATION = {"x": [1, 0, 2], "y": [0, 1, 2], "z": [1, 2, 0]}


@dataclass(frozen=True, eq=False)
class Scene:
    """A centred and scaled surface with values and a view direction."""

    V: FloatArray  # positions (n, 3) relative to `centre`, in units of `unit`: between -1 and 1 at the vertices of F
    F: IntArray  # triangles (m, 3); for tetrahedra, the boundary
    used: IntArray  # the vertices (k,) of F
    centre: FloatArray  # of the bounding box, in the unit of the mesh
    unit: float  # the length of 1 in the scene, in the unit of the mesh
    turn: FloatArray  # rotation (3, 3) to viewer coordinates: rows point right, up and towards the viewer
    values: FloatArray  # (n,), in the unit of the caller; inf means no value
    limits: tuple[float, float]  # values at the ends of the colour bar
    step: float  # distance between isolines, or width of stripes
    vertices: IntArray  # sources (s,) that are vertices
    dots: FloatArray  # positions (k, 3) of sources that are vertices or points in faces, in the coordinates of V
    lines: FloatArray  # segments (l, 2, 3) of sources that are curves, in the coordinates of V
    # Whether values are numbers of categories, between which there is nothing: no interpolation, no colour bar.
    is_categorical: bool = False
    # (m, 3, 3), of categories: for each corner of each triangle a linear function, by its values at the three corners.
    # A point has the category of the corner with the smallest; None stands for the nearest corner.
    borders: FloatArray | None = None

    @property
    def turned(self) -> FloatArray:
        """Positions (n, 3) in viewer coordinates: right, up and near."""
        return np.asarray(self.V @ self.turn.T)

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Middle and extent (2,) in viewer coordinates, right and up; no side is more than 1000 times the other."""
        turned = self.turned[self.used, :2]
        low, high = turned.min(axis=0), turned.max(axis=0)
        return (low + high) / 2, np.maximum(high - low, 1e-3 * (high - low).max())

    def placed(self, curves: NestedCurves, mesh: MeshLike) -> list[FloatArray]:
        """The vertices (k, 3) of each curve on the mesh that is shown, in viewer coordinates."""
        each = (curve.positions(mesh) for curve in flat_curves(curves))
        return [np.asarray((positions - self.centre) / self.unit @ self.turn.T) for positions in each]


def scene(
    mesh: Mesh | PolygonMesh | PointCloud,
    values: ArrayLike,
    *,
    name: str = "distance",
    sources: Sources | None = None,
    spacing: float | None = None,
    limits: tuple[float, float] | None = None,
    view: tuple[float, float] | None = None,
    up: str = "y",
    is_categorical: bool = False,
) -> Scene:
    """Validate the input of a picture, as `plot` and `plot_field` take it; the points of a cloud become discs.

    A ValueError if `values` (called `name` in the message) do not have shape (n,), contain NaN or no finite value, or
    an option is invalid; a SourceError if `sources` are.
    """
    checked = vertex_values(name, values, mesh.n_vertices)
    vertices, dots, lines = _places(as_simplices(mesh), sources)
    require_choice("up", up, _PERMUTATION)
    finite = checked[np.isfinite(checked)]
    low, high = (min(0.0, float(finite.min())), float(finite.max())) if limits is None else map(float, limits)
    if limits is not None and not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"limits must be two numbers, the lower one first, not {limits!r}")
    across = max(high - low, 0.0)
    step = _isoline_spacing(across) if spacing is None else float(spacing)
    if not (np.isfinite(step) and step > 0) or across / step > 1000:
        raise ValueError(f"spacing must be a positive number, and no less than {across / 1000:.2g}, not {spacing!r}")

    if isinstance(mesh, PointCloud):
        mesh, checked = discs(mesh, checked, is_categorical)
    mesh = as_simplices(mesh)
    F = mesh.facets.vertices[mesh.facets.n_faces == 1] if mesh.is_tetrahedral else mesh.F
    used = np.unique(F)
    centre = (mesh.V[used].min(axis=0) + mesh.V[used].max(axis=0)) / 2
    V = mesh.V - centre
    unit = float(np.abs(V[used]).max())
    V, dots, lines = V / unit, (dots - centre) / unit, (lines - centre) / unit
    upright = np.eye(3)[_PERMUTATION[up]]
    if view is None:
        shown = np.concatenate([V, dots, lines.reshape(-1, 3)])
        marked = np.arange(len(V), len(shown)) if len(shown) > len(V) else None
        turn = default_rotation(shown @ upright.T, F, used, marked)
    else:
        angles = real_numbers("view", view)
        if angles.shape != (2,) or not np.isfinite(angles).all():
            raise ValueError(f"view must be two angles in degrees, azimuth and elevation, not {view!r}")
        turn = rotation(*angles)
    return Scene(
        V=V, F=F, used=used, centre=centre, unit=unit, turn=turn @ upright, values=checked,
        limits=(low, high if high > low else low + 1.0), step=step, vertices=vertices, dots=dots, lines=lines,
        is_categorical=is_categorical,
    )  # fmt: skip


def _isoline_spacing(largest: float) -> float:
    """A round number (1, 2 or 5 times a power of ten) near a sixteenth of `largest`."""
    if not largest > 0:
        return 1.0
    exponent = np.floor(np.log10(largest / 16))
    candidates = [digit * 10.0 ** (exponent + shift) for shift in (0, 1) for digit in (1, 2, 5)]
    return float(min(candidates, key=lambda step: abs(np.log(largest / 16 / step))))


def _places(mesh: Mesh, sources: Sources | None) -> tuple[IntArray, FloatArray, FloatArray]:
    """Source vertices (s,), positions of vertices and points (k, 3), and segments of curves (l, 2, 3)."""
    if sources is None:
        return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 2, 3))
    found = source_set(sources, mesh.n_vertices, *((None,) if mesh.is_tetrahedral else (mesh.F, mesh)))
    points, segments = found.points, found.segments

    def positions(faces: IntArray, barycentric: FloatArray) -> FloatArray:
        if not len(faces):
            return np.zeros((0, 3))
        return np.asarray(np.einsum("kc,kcx->kx", barycentric, mesh.V[mesh.F[faces]]))

    dots = np.concatenate([mesh.V[found.vertices], positions(points.faces, points.barycentric)])
    ends = [positions(segments.faces, barycentric) for barycentric in (segments.start, segments.end)]
    return found.vertices, dots, np.stack(ends, axis=1)


def colours(colormap: str, is_trimmed: bool = True) -> Any:
    """The matplotlib colour map of that name; if trimmed, without dark colours, on which lines would be invisible.

    A ValueError if there is none of that name, and a MissingExtraError without matplotlib.
    """
    with MissingExtraError.guard("a picture", "matplotlib", "view"):
        import matplotlib
        from matplotlib.colors import ListedColormap
    try:
        whole = matplotlib.colormaps[colormap]
    except KeyError:
        raise ValueError(f"colormap must be one of matplotlib's, such as 'viridis_r', not {colormap!r}") from None
    table = whole(np.linspace(0, 1, 512))
    return ListedColormap(table[table[:, :3] @ [0.2126, 0.7152, 0.0722] > 0.2] if is_trimmed else table)


def vertex_values(name: str, values: ArrayLike, n: int) -> FloatArray:
    """`values` (n,) as an array; a ValueError that calls them `name` if they are not such, or if none can be drawn."""
    checked = real_numbers(name, values)
    if checked.shape != (n,):
        raise ValueError(f"{name} must have shape ({n},), one per vertex, but it has {checked.shape}")
    if np.isnan(checked).any():
        raise ValueError(f"{name}[{int(np.flatnonzero(np.isnan(checked))[0])}] is NaN: there is nothing to draw")
    if not np.isfinite(checked).any():
        raise ValueError(f"{name} is infinite everywhere: there is nothing to draw")
    return checked


def discs(cloud: PointCloud, values: FloatArray, is_flat: bool = False) -> tuple[Mesh, FloatArray]:
    """A polygon around each of n points, split into triangles, and values at its vertices; the first n are the points.

    A disc has the value of the point (``inf`` for none) everywhere if `is_flat`; else values change linearly, with the
    gradient at the point.
    """
    triangles = cloud.triangles
    n, V = cloud.n_vertices, triangles.V
    k = _CORNERS if n <= _MANY else _FEW_CORNERS
    normals = igl.per_vertex_normals(V, triangles.F)[cloud.originals] if cloud.normals is None else cloud.normals
    normals = np.where(
        np.isfinite(normals).all(axis=1, keepdims=True) & (normals != 0).any(axis=1)[:, None], normals, 1
    )
    x = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normals, x) / np.linalg.norm(normals, axis=1, keepdims=True)
    # Discs around its corners cover a triangle if they reach the centre of its circle; a triangle with an obtuse angle
    # needs no more than an equilateral one with its longest side.
    sides = igl.edge_lengths(V, triangles.F)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.fmin(sides.prod(axis=1) / (4 * triangles.measures), sides.max(axis=1) / np.sqrt(3))
    radius = np.zeros(n)
    np.maximum.at(radius, triangles.F, np.broadcast_to(reach[:, None], triangles.F.shape))
    radius = np.where(radius > 0, radius, reach.mean())[cloud.originals] / np.cos(np.pi / k)
    angle = 2 * np.pi * np.arange(k) / k
    across = np.cos(angle)[:, None] * x[:, None] + np.sin(angle)[:, None] * y[:, None]
    rim = radius[:, None, None] * across
    known: BoolArray = np.asarray(np.isfinite(values)[triangles.F].all(axis=1))
    slope = np.zeros((n, 3)) if is_flat else slopes(triangles, values, known)[cloud.originals]
    finite = values[np.isfinite(values)]
    on_rim = values[:, None] + np.einsum("nkx,nx->nk", rim, slope)
    on_rim = np.where(np.isfinite(values)[:, None], np.clip(on_rim, finite.min(), finite.max()), values[:, None])
    corner = n + np.arange(n * k).reshape(n, k)
    F = np.stack([np.repeat(np.arange(n), k), corner.ravel(), np.roll(corner, -1, axis=1).ravel()], axis=1)
    return Mesh(np.concatenate([V, (V[:, None] + rim).reshape(-1, 3)]), F), np.append(values, on_rim.ravel())


def slopes(triangles: Mesh, values: FloatArray, faces: BoolArray) -> FloatArray:
    """The gradient (n, 3) of values at each vertex, the mean of the chosen faces around it by area; 0 where is none."""
    known = np.where(np.isfinite(values), values, 0.0)
    G = igl.grad(triangles.V, triangles.F)
    per_face = (G @ known).reshape(3, -1).T
    weights = triangles.measures * faces * np.isfinite(per_face).all(axis=1)
    weighted = np.where(weights[:, None] > 0, per_face, 0.0) * weights[:, None]
    of_corner = triangles.F.ravel()
    total = np.bincount(of_corner, np.repeat(weights, 3), len(values))
    sums = [np.bincount(of_corner, np.repeat(column, 3), len(values)) for column in weighted.T]
    return np.stack(sums, axis=1) / np.maximum(total, np.finfo(float).tiny)[:, None]
