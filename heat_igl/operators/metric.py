"""A metric or a speed on each face: distance is measured with a length for every direction, or is a travel time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, partial
from operator import attrgetter
from typing import Any

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import names_guessed, raise_at_first, real_numbers
from heat_igl.intrinsic import IntrinsicTriangulation, intrinsic_delaunay, intrinsic_triangulation, mollify
from heat_igl.mesh import Mesh, MeshLike, as_simplices, connectivity
from heat_igl.operators.matrices import Laplacian, Operators, check_laplacian, laplacian_of_gradient
from heat_igl.operators.metric_derivatives import MetricSides, plane_axes
from heat_igl.operators.metric_simplices import MetricSimplices, equal_runs, inverse_root, least_of_components
from heat_igl.operators.suitability import mean_angle_defects
from heat_igl.operators.triangles import check_measures, edge_length_operators, intrinsic_operators, longest_sides
from heat_igl.plan import hopf_lax_is_nearer
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray

# Share of the longer by which two faces may see the length of an edge differ, for which the mean is taken then.
_ONE_LENGTH = 0.1
# Share that has to remain of the length by which two sides of a triangle are longer than the third, with the mean of
# two lengths for each side, or with lengths integrated in a smooth metric.
_SLACK = 0.03
# Squared lengths in a metric per squared length; areas are their squares.
_LARGEST = 1e120
# Asymmetry of a metric, and a negative direction across a triangle, that are taken for rounding.
_ROUNDING = 1e-9


@names_guessed
def metric_operators(mesh: MeshLike, metric: ArrayLike, *, laplacian: Laplacian = "auto") -> Operators:
    """The operators of a mesh with a metric on each face, which may be longer in one direction than in another.

    A vector w in face f has the length sqrt(w^T g w), with g = ``metric[f]``: travel time, where g is the inverse
    square of a speed; a distance that is shorter along fibres than across; the first fundamental form of another shape.

    Parameters
    ----------
    mesh : mesh
        m triangles or tetrahedra.
    metric : (m, 3, 3), (n, 3, 3) or (m, 2, 2) array_like
        Symmetric and positive definite. (m, 3, 3) in space, of which a triangle takes what lies in its plane. (n, 3, 3)
        at each vertex, of a metric whose inverse root, the velocity, is linear in between: take this where the metric
        is smooth, as then distance is of second order. If n = m, (m, 3, 3) is per face. (m, 2, 2) in the plane of each
        triangle: the first axis along the edge from corner 0 to corner 1, the second towards corner 2. Unit: squared
        length in the metric per squared length of the mesh.
    laplacian : {"auto", "intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan"}
        Of triangles, see `operators`.

    Returns
    -------
    Operators
        For `GeodesicSolver` and `HeatMethodSolver`; all lengths are those of the metric.

        Triangles: where faces see their common edges at the same length, within 10 %, they are an intrinsic
        triangulation with these lengths (the mean of both, or integrals along the edges of a metric at the vertices).
        Edges are flipped, and every method works. Distance from vertices is that of windows, or of the Hopf-Lax
        formula where the metric varies within triangles by more than the surface is curved.

        Where faces of a component differ by more, as at a jump of the speed, or the metric changes too far along an
        edge, no unfolding is straight: there is no `surface`, flips end at such edges, sources are vertices, and there
        distance is that of the Hopf-Lax formula, per face on the triangles after flips if most edges have one length.

        Tetrahedra: in components with one metric, distance is exact as in space, else that of the Hopf-Lax formula.

        This is of first order, sharpened to second where the metric and the distance are smooth. Where tensors per
        face are those of a smooth field, their velocities are carried to the vertices first.

    Raises
    ------
    MeshError
        If a face has no area or volume.
    ValueError
        If `metric` has another shape, is not finite, symmetric and positive definite on every face, or `laplacian` is
        unknown.

    Notes
    -----
    Edge lengths determine the metric of a triangle: each has the squared lengths of its three sides, e^T g e (Sharp,
    Soliman and Crane 2019, section 2). A front that passes an edge keeps its travel time along the edge: Snell's law.

    Examples
    --------
    Twice as far in x as in y:

    >>> import numpy as np
    >>> from heat_igl import GeodesicSolver, metric_operators, shapes
    >>> mesh = shapes.grid(8)
    >>> domain = metric_operators(mesh, np.tile(np.diag([4.0, 1.0, 1.0]), (mesh.n_faces, 1, 1)))
    >>> distance = GeodesicSolver(domain).distance(0)
    >>> bool(np.allclose(distance, np.hypot(2 * mesh.V[:, 0], mesh.V[:, 1])))
    True
    """
    check_laplacian(laplacian)
    mesh = as_simplices(mesh)
    check_measures(mesh)
    g = real_numbers("metric", metric, refused="bcmMSU")
    if g.shape == (mesh.n_vertices, 3, 3) and mesh.n_vertices != mesh.n_faces:
        checked = _checked_at_corners(g, mesh)
        del g
        return _of_smooth_metric(mesh, *checked, laplacian)
    if mesh.is_tetrahedral:
        return _of_groups(mesh, *_checked(g, mesh))
    return operators_in_metric(mesh, *_checked(g, mesh)[:3], None, g, laplacian)


def speed_operators(mesh: MeshLike, speed: ArrayLike) -> Operators:
    """The operators of a mesh on which one travels at a speed of its own in each face.

    Distance is then the time T of the fastest way, |grad T| = 1 / speed: Fermat's principle, and Snell's law where the
    speed changes. It is `metric_operators` with the metric ``speed^-2``, the same in all directions.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    speed : (m,) array_like
        Length per unit of time on each face, positive.

    Returns
    -------
    Operators
        For `GeodesicSolver` and `HeatMethodSolver`, with every length a travel time, as those of `metric_operators`:
        windows in a speed that is the same everywhere, else the Hopf-Lax formula, right at any contrast. Where speeds
        of neighbours jump by more than 10 %, and on tetrahedra, sources are vertices.

    Raises
    ------
    ValueError
        If `speed` is not a positive number for each face.
    MeshError
        If a tetrahedron has no volume, or an edge no length.

    Notes
    -----
    A time step that is asked for (`t_coef`, `t`) asks for heat. One step for slow and fast faces cannot suit both: with
    jumps, heat is 1 to 4 % wrong at a contrast of 2, 28 % at 1000, and arbitrarily wrong beyond.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(10, 2)
    >>> domain = heat_igl.speed_operators(mesh, [2.0] * mesh.n_faces)
    >>> time = heat_igl.GeodesicSolver(domain).distance(0)
    >>> round(float(time[10]), 6)  # the length 10 at the speed 2
    5.0
    """
    mesh = as_simplices(mesh)
    m, s = mesh.n_faces, real_numbers("speed", speed, refused="bcmMSU")
    if s.shape != (m,):
        raise ValueError(
            f"speed must have shape ({m},), one per face, not {s.shape}: speed[mesh.F].mean(axis=1) of one per vertex"
        )
    remedy = "remove faces that cannot be crossed"
    raise_at_first(~((s > 0) & np.isfinite(s)), "speed", s, "must be positive and finite", remedy)
    if mesh.is_tetrahedral or not igl.edge_lengths(mesh.V, mesh.F).all():
        check_measures(mesh)
    largest = _LARGEST**0.5
    outside = (s < 1 / largest) | (s > largest)
    raise_at_first(outside, "speed", s, f"is not between {1 / largest:g} and {largest:g}", f"{remedy}, or rescale")
    each, group = equal_runs(s[:, None, None])
    least = least_of_components(1 / s, mesh.components[mesh.F[:, 0]], mesh.components)
    root = (each[:, 0] * np.eye(3)[np.triu_indices(3)], None, None)
    # A metric without a name here does not outlive its use there.
    if mesh.is_tetrahedral:
        return _of_groups(mesh, np.eye(3) / each**2, least, root, group)
    return operators_in_metric(mesh, np.eye(3) / each**2, least, root, group, s)


def fibre_metric(
    directions: ArrayLike,
    along: ArrayLike,
    across: ArrayLike,
    *,
    sheets: ArrayLike | None = None,
    normal: ArrayLike | None = None,
) -> FloatArray:
    """The metric in space in which lengths are multiplied by `along` along a direction, and by `across` across it.

    Parameters
    ----------
    directions : (k, 3) array_like
        Of the fibres, or a principal direction, on each face or at each vertex; of any length but 0, and either sign.
        (k, 2) in the plane z = 0.
    along, across : float or (k,) array_like
        Positive factors; for a speed, one over it.
    sheets : (k, 3) array_like, optional
        Directions across the fibres in which `across` holds; their part along the fibres is left out.
    normal : float or (k,) array_like, optional
        Factor across fibres and sheets; `across` if it is not given.

    Returns
    -------
    (k, 3, 3) float64
        For `metric_operators`.

    Raises
    ------
    ValueError
        If a direction is 0 or not finite, a sheet has the direction of its fibre, a factor is not positive, or one of
        `sheets` and `normal` is given without the other.

    Examples
    --------
    >>> import heat_igl
    >>> g = heat_igl.fibre_metric([[1, 0, 0]], along=0.5, across=2.0)
    >>> g[0].tolist()
    [[0.25, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]

    Velocities of .6 along fibres, .4 along sheets and .2 across:

    >>> g = heat_igl.fibre_metric([[1, 0, 0]], 1 / 0.6, 1 / 0.4, sheets=[[0, 1, 0]], normal=1 / 0.2)
    >>> g[0].diagonal().round(2).tolist()
    [2.78, 6.25, 25.0]
    """
    if (sheets is None) != (normal is None):
        raise ValueError("sheets and normal go together: give both, or neither for one factor across the fibres")
    fibre = _unit_directions("directions", directions)
    k = len(fibre)
    one, two = _squared_factor("along", along, k), _squared_factor("across", across, k)
    projection = fibre[:, :, None] * fibre[:, None]
    if sheets is None or normal is None:
        return np.asarray(one * projection + two * (np.eye(3) - projection))
    sheet = _unit_directions("sheets", sheets)
    if sheet.shape != fibre.shape:
        raise ValueError(f"sheets must have the shape of directions, ({k}, 3), not {np.shape(sheets)}")
    sheet -= np.einsum("ki,ki->k", sheet, fibre)[:, None] * fibre
    size = np.linalg.norm(sheet, axis=1, keepdims=True)
    raise_at_first(size[:, 0] < _ROUNDING, "sheets", np.asarray(sheets), "has the direction of its fibre")
    sheet /= size
    second = sheet[:, :, None] * sheet[:, None]
    three = _squared_factor("normal", normal, k)
    return np.asarray(one * projection + two * second + three * (np.eye(3) - projection - second))


def _unit_directions(name: str, given: ArrayLike) -> FloatArray:
    """Unit vectors (k, 3) from (k, 3) or (k, 2), checked."""
    w = real_numbers(name, given)
    if w.ndim != 2 or w.shape[1] not in (2, 3):
        raise ValueError(
            f"{name} must have shape (k, 3), one per face or vertex, or (k, 2) in the plane, not {w.shape}"
        )
    w = np.pad(w, ((0, 0), (0, 3 - w.shape[1])))
    with np.errstate(over="ignore"):
        length = np.linalg.norm(w, axis=1)
    raise_at_first(~((length > 0) & np.isfinite(length)), name, w, "is no direction")
    return np.asarray(w / length[:, None])


def _squared_factor(name: str, given: ArrayLike, k: int) -> FloatArray:
    """The squares (k, 1, 1) of positive numbers (k,) or one number, checked."""
    factor = real_numbers(name, given)
    if factor.shape not in ((), (k,)):
        raise ValueError(f"{name} must be a number or have shape ({k},), not {factor.shape}")
    factor = np.broadcast_to(factor, k)
    with np.errstate(over="ignore", under="ignore"):
        square = factor**2
    raise_at_first(~((factor > 0) & (square > 0) & np.isfinite(square)), name, factor, "must be positive and finite")
    return np.asarray(square[:, None, None])


def operators_in_metric(
    mesh: Mesh,
    g: FloatArray,
    least: float | FloatArray,
    root: Any,
    group: Any,
    given: FloatArray | None,
    laplacian: Laplacian = "auto",
) -> Operators:
    """`metric_operators` of checked triangles and metrics g (k, 3, 3) of each `group` (m,), or of each triangle.

    No unit vector is shorter than `least` in it. The inverse root may be known. Lengths are differentiated by the
    metric `given`, or speeds (m,).
    """
    group = np.arange(mesh.n_faces, dtype=np.int32) if group is None else group
    squares = MetricSimplices(mesh.F, mesh.n_vertices, mesh.V, tensors=g, group=group).measured[1]
    own = np.sqrt(squares, out=squares)[:, ::-1]
    triangulation = intrinsic_triangulation(mesh)
    fits = _at_all_faces(mesh, _fit_together(mesh, own, triangulation.twin))
    if not fits.all():
        in_metric = partial(MetricSimplices.in_metric, mesh, g, least, False, root, group)
        domain, is_even = _refracting(mesh, triangulation, own, least, in_metric, laplacian)
        root = inverse_root(g, mesh) if root is None else root
        parts = (
            operators_in_metric(own, g, least, root, group[faces], None if given is None else given[faces], laplacian)
            for own, faces in _of_kinds(mesh, np.where(fits, 2, is_even))
        )
        return replace(domain, parts=tuple(parts))
    del own, squares
    given = g[group] if given is None else given
    # Triangles without area know no metric in their plane.
    if not (mesh.measures > 0).all():
        return _of_triangles(mesh, None, laplacian, given)
    defect = mean_angle_defects(triangulation, mesh.components)
    del triangulation
    root = inverse_root(g, mesh) if root is None else root
    del g
    simplices = MetricSimplices.in_metric(mesh, None, least, False, root, group)
    del root
    return _unfolded(defect, mesh, simplices, laplacian, given)


def _unfolded(defect: FloatArray, mesh: Mesh, simplices: MetricSimplices, *of: Any) -> Operators:
    """The operators of triangles whose edges have one length each, and with `simplices` where these are nearer.

    Components (k,) have these mean angle defects.
    """
    component = mesh.components[mesh.F[:, 0]]
    total = np.bincount(component, simplices.measured[-1], len(defect))
    variation = total / np.maximum(np.bincount(component, minlength=len(defect)), 1)
    is_nearer = hopf_lax_is_nearer(variation, defect)
    if is_nearer[component].any():
        nearer = simplices if is_nearer[component].all() else simplices.part(is_nearer[mesh.components])
        return _LaterOperators(mesh, nearer, _of_triangles, mesh, simplices, *of)
    return replace(_of_triangles(mesh, simplices, *of), simplices=None)


def _at_all_faces(mesh: Mesh, is_so: BoolArray) -> BoolArray:
    """Whether something is so at all faces (m,) of a component (k,)."""
    return ~connectivity.mask_of(mesh.components[mesh.F[~is_so, 0]], mesh.components.max() + 1)


def _of_kinds(mesh: Mesh, kind: AnyArray) -> Iterator[tuple[Mesh, BoolArray]]:
    """Where components (k,) are of several kinds, the mesh of each, with all vertices, and which faces (m,) it has."""
    of = kind[mesh.components[mesh.F[:, 0]]]
    for number in np.unique(of) if (of != of[0]).any() else ():
        yield Mesh(mesh.V, mesh.F[of == number]).with_originals(mesh.originals), of == number


def _of_triangles(mesh: Mesh, simplices: Any, laplacian: Laplacian, given: FloatArray | None) -> Operators:
    """The operators of triangles with the lengths in the metric, or at the speeds, `given`, or in the simplices."""
    given = np.eye(3) / given[:, None, None] ** 2 if given is not None and given.ndim == 1 else given
    metric = None if given is None else MetricSides(mesh, given)
    sides = simplices.edges[1].reshape(-1, 3)[:, ::-1] if metric is None else metric.lengths
    domain = edge_length_operators(mesh.F, sides, mesh.n_vertices, laplacian)
    return replace(domain, simplices=simplices, metric=metric, originals=mesh.originals)


def _of_smooth_metric(mesh: Mesh, g: Any, least: Any, root: Any, laplacian: Laplacian) -> Operators:
    """The operators of simplices with what `_checked_at_corners` returns."""
    if mesh.is_tetrahedral:
        return _of_groups(mesh, g, least, root)
    # Before the simplices, as both take much memory.
    defect = mean_angle_defects(intrinsic_triangulation(mesh), mesh.components)
    simplices = MetricSimplices.in_metric(mesh, g, least, True, root)
    keep = _at_all_faces(mesh, _keep_shape(simplices.edges[1].reshape(-1, 3), np.sqrt(simplices.measured[1])))
    if keep.all():
        return _unfolded(defect, mesh, simplices, laplacian, None)
    # For heat: what each face says alone. Without a surface, no vertices can be told from those that were added.
    at_corners = (simplices.metric(np.arange(mesh.n_faces), corner) for corner in range(3))
    each = np.asarray(sum(at_corners)) / 3
    fitted: Laplacian = "cotan" if laplacian == "cotan" else "intrinsic-delaunay"
    domain = operators_in_metric(mesh, each, least, None, None, each, fitted)
    made = domain._made if isinstance(domain, _LaterOperators) else domain
    velocity, rows, sizes = root
    parts = (
        _of_smooth_metric(own, None, least, (velocity, rows[faces], sizes), laplacian)
        for own, faces in _of_kinds(mesh, keep)
    )
    return replace(made, surface=None, simplices=simplices, metric=None, parts=tuple(parts))


def _fit_together(mesh: Mesh, own: FloatArray, twin: AnyArray) -> BoolArray:
    """Whether edges of faces (m,), which these see at lengths `own` (m, 3), may have the mean: they nearly agree."""
    if (twin == -2).any():  # edges of more than two faces
        of_side = mesh.facets.of_face
        shortest, longest = np.full(len(mesh.edges), np.inf), np.zeros(len(mesh.edges))
        np.minimum.at(shortest, of_side, own)
        np.maximum.at(longest, of_side, own)
        mean = (np.bincount(of_side.ravel(), own.ravel()) / np.bincount(of_side.ravel()))[of_side]
        differ = (longest - shortest > _ONE_LENGTH * longest)[of_side]
    else:
        other, is_outer = own.ravel()[twin].reshape(-1, 3), (twin < 0).reshape(-1, 3)
        other[is_outer] = own[is_outer]
        differ = np.abs(own - other) > _ONE_LENGTH * np.maximum(own, other)
        mean = np.multiply(np.add(own, other, out=other), 0.5, out=other)
    a, b, c = differ.T
    return np.asarray(~(a | b | c) & _keep_shape(mean, own))


def _keep_shape(sides: FloatArray, was: FloatArray) -> BoolArray:
    """Whether triangles (m,) of sides `was` (m, 3) keep a share of the slack with these sides."""
    slack, was_slack = (a.sum(axis=1) - 2 * longest_sides(a) for a in (sides, was))
    return np.asarray(slack >= _SLACK * was_slack)


def _refracting(
    mesh: Mesh, apart: IntrinsicTriangulation, sides: FloatArray, least: Any, in_metric: Any, laplacian: Laplacian
) -> tuple[Operators, BoolArray]:
    """The operators of triangles that see some edge at two lengths: L is the sum of what each says alone.

    Also whether simplices are, in each component (k,), those after flips.
    """
    # Cut apart at the edges that are seen at two lengths.
    sides = sides + mollify(sides, mesh.F)
    twin = apart.twin.copy()
    inner = np.flatnonzero(twin >= 0)
    one, other = sides.ravel()[inner], sides.ravel()[twin[inner]]
    twin[inner[np.abs(one - other) > _ROUNDING * np.maximum(one, other)]] = -1
    glued = replace(apart, l=sides, twin=twin)
    triangulation = glued if laplacian == "cotan" else intrinsic_delaunay(glued)
    domain = intrinsic_operators(triangulation)
    pairs = np.concatenate([triangulation.F[:, pair] for pair in ([1, 2], [2, 0], [0, 1])])
    domain = _with_shortest_edges(domain, mesh, pairs, triangulation.l.ravel(order="F"))
    # Where most triangles fit together, they are those after flips: even ones, however thin the given ones are in the
    # metric. Triangles without area know no metric in their plane, but have lengths.
    of_side, k = mesh.components[mesh.F[inner // 3, 0]], mesh.components.max() + 1
    is_even = 2 * np.bincount(of_side[twin[inner] >= 0], minlength=k) > np.bincount(of_side, minlength=k)
    is_even |= ~_at_all_faces(mesh, mesh.measures > 0)
    if is_even.any():
        # A flip may join a vertex with itself, or two that an edge joins already: no triangles in space.
        ends = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
        used = triangulation if len(ends) == len(mesh.edges) else glued
        simplices = MetricSimplices.of_sides(mesh.V, used.F, used.l, least)
    else:
        simplices = in_metric()
    return replace(domain, simplices=simplices), is_even


def _of_groups(mesh: Mesh, g: FloatArray, least: Any, root: Any, group: Any = None) -> Operators:
    """The operators of tetrahedra in metrics g (k, 3, 3) of each `group` (m,), or at each vertex."""
    simplices = MetricSimplices.in_metric(mesh, g, least, group is None, root, group)
    # At vertices, its inverse root is known.
    kept = g[np.unique(mesh.components, return_index=True)[1]] if group is None else g
    return _LaterOperators(mesh, simplices, _of_tetrahedra, mesh, simplices, kept, group)


class _LaterOperators(Operators):
    """The operators of a mesh in a metric, made on first use: distance by `simplices` needs none."""

    def __init__(self, mesh: Mesh, simplices: MetricSimplices, make: Callable[..., Operators], *of: Any) -> None:
        vars(self).update(mesh=mesh, _make=make, _of=of, simplices=simplices, is_surface=not mesh.is_tetrahedral)
        vars(self).update(originals=mesh.originals)

    mesh: Mesh
    _make: Callable[..., Operators]
    _of: tuple[Any, ...]

    @property
    def n(self) -> int:
        """Number of vertices."""
        return self._made.n if self.is_surface else self.mesh.n_vertices

    @cached_property
    def _made(self) -> Operators:
        return self._make(*self._of)

    @property
    def in_tensors(self) -> MetricSimplices | None:
        """The simplices of a body with the given tensors; `simplices` have none where these are the same."""
        if self.is_surface or self.simplices is None:
            return None
        mesh, simplices = self.mesh, self.simplices
        *_, g, group = self._of
        if group is None and not simplices.is_in_space:
            return replace(simplices, parts=())
        component, corners, (root, _, sizes) = mesh.components, mesh.F.astype(np.int32), inverse_root(g)
        if group is not None:
            least = least_of_components(np.sqrt(sizes[group, 0]), component[corners[:, 0]], component)
            return MetricSimplices(corners, mesh.n_vertices, mesh.V, least, None, g, group, is_given=True)
        least, velocity = np.sqrt(sizes[component, 0]), root[component]
        return MetricSimplices(corners, mesh.n_vertices, mesh.V, least, velocity=velocity, rows=corners, is_given=True)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # an instance that is not filled yet, as in `pickle`
            raise AttributeError(name)
        return getattr(self._made, name)


# Fields with a default, which is no attribute of an instance that is not made, and what is known without them.
for _name in ("lengths", "longest_distances", "metric", "surface"):
    setattr(_LaterOperators, _name, property(attrgetter(f"_made.{_name}")))
for _name, _known in ("n_given", "mesh.n_vertices"), ("has_surface", "is_surface"):
    setattr(_LaterOperators, _name, property(attrgetter(_known)))


def _of_tetrahedra(mesh: Mesh, simplices: MetricSimplices, g: FloatArray, group: AnyArray | None) -> Operators:
    """The operators of tetrahedra with a metric on each or at each vertex for heat, and `simplices` for distance."""
    m, n = mesh.n_faces, mesh.n_vertices
    at_corners = (simplices.metric(np.arange(m), corner) for corner in range(4))
    if group is None and simplices.velocity is None:
        group = mesh.components[mesh.F[:, 0]]
    g = g[group] if group is not None else np.asarray(sum(at_corners)) / 4
    # Each in a space of its own: edges times C have the lengths of the metric C C^T.
    corners = mesh.V[mesh.F]
    corners = (corners - corners[:, :1]) @ np.linalg.cholesky(g)
    apart = np.arange(4 * m).reshape(-1, 4)
    # In units of the mean length: libigl multiplies up to six of them.
    pairs, lengths = simplices.edges
    unit = float(2.0 ** round(np.log2(float(lengths.mean()))))
    flat = corners.reshape(-1, 3) / unit
    own = sp.csc_matrix((np.ones(4 * m), mesh.F.ravel(), np.arange(4 * m + 1)), shape=(n, 4 * m)).T
    G = (igl.grad(flat, apart) @ own).tocsc() / unit
    weights = np.abs(igl.volume(flat, apart)) * unit**3
    # A quarter of the volume for each corner, as igl.massmatrix has it.
    mass = np.bincount(mesh.F.ravel(), np.repeat(weights / 4, 4), minlength=n)
    domain = Operators(
        L=laplacian_of_gradient(G, weights),
        M=sp.diags(mass, format="csc"),
        gradient=G,
        weights=weights,
        face_sizes=longest_sides(lengths.reshape(m, -1)),
        mean_edge_length=np.nan,
        components=mesh.components,
        boundary=mesh.boundary,
        referenced=mesh.referenced,
        longest_distance=np.nan,
        is_surface=False,
        simplices=simplices,
    )
    return _with_shortest_edges(domain, mesh, pairs, lengths)


def _with_shortest_edges(domain: Operators, mesh: Mesh, pairs: AnyArray, lengths: FloatArray) -> Operators:
    """With the shortest lengths of edges (e, 2), and the boundary of the mesh; without a `surface`."""
    graph = connectivity.shortest_edge_graph(pairs, lengths, mesh.n_vertices)
    longest = connectivity.longest_paths(graph, domain.components)
    return replace(
        domain,
        mean_edge_length=float(graph.data.mean()),
        boundary=mesh.boundary,
        longest_distance=float(longest.max()),
        longest_distances=longest,
        surface=None,
        originals=mesh.originals,
    )


def _checked(g: FloatArray, mesh: Mesh) -> tuple[FloatArray, Any, Any, Any]:
    """The metric (k, 3, 3) of triangles, or of groups (m,) of tetrahedra, its least length and `inverse_root`."""
    m, p = mesh.n_faces, mesh.F.shape[1] - 1
    shapes = [(m, 3, 3), (mesh.n_vertices, 3, 3)] + [(m, 2, 2)] * (p == 2)
    if g.shape not in (shapes[0], *shapes[2:]):
        remedy = f": np.broadcast_to(metric, ({m}, 3, 3)) is the same on all" if g.shape == (3, 3) else ""
        raise ValueError(
            f"metric must have shape {' or '.join(map(str, shapes))}, one per face or vertex, not {g.shape}{remedy}"
        )
    symmetric = symmetric_tensors("metric", g)
    if g.shape[1] == 2:
        axes = plane_axes(mesh)
        symmetric = np.swapaxes(axes, 1, 2) @ symmetric @ axes
    symmetric, group = equal_runs(symmetric) if p == 3 else (symmetric, slice(None))
    root = inverse_root(symmetric, mesh)
    smallest = root[2][group, 0]
    check_eigenvalues("metric", smallest, g)
    return symmetric, least_of_components(smallest**0.5, mesh.components[mesh.F[:, 0]], mesh.components), root, group


def _checked_at_corners(g: FloatArray, mesh: Mesh) -> tuple[Any, Any, Any]:
    """Of tetrahedra the metric (n, 3, 3) at vertices, else None; its least length and `inverse_root`."""
    symmetric = symmetric_tensors("metric", g)
    root = inverse_root(symmetric, mesh, True)
    smallest = np.where(mesh.referenced, root[2][:, 0], np.inf)
    check_eigenvalues("metric", smallest, g)
    least = least_of_components(smallest**0.5, mesh.components, mesh.components)
    return symmetric if mesh.is_tetrahedral else None, least, root


def symmetric_tensors(name: str, g: FloatArray) -> FloatArray:
    """Tensors (k, p, p), after a check that they are finite and symmetric but for rounding."""
    is_finite = np.isfinite(g)
    if not is_finite.all():
        raise_at_first(~is_finite.all(axis=(1, 2)), name, g, "must be finite")
    above = np.triu_indices(g.shape[1], 1)
    if all((g[:, i, j] == g[:, j, i]).all() for i, j in zip(*above, strict=True)):
        return g
    apart = longest_sides(np.abs(g[:, *above] - g[:, *above[::-1]]))
    raise_at_first(apart > _ROUNDING * np.abs(g).max(axis=(1, 2)), name, g, "must be symmetric")
    return np.asarray((g + np.swapaxes(g, 1, 2)) / 2)


def check_eigenvalues(name: str, smallest: FloatArray, g: FloatArray) -> None:
    """An error unless the smallest eigenvalues (k,) of tensors g (k, p, p) are positive, and doubles hold all."""
    raise_at_first(~(smallest > 0), name, g, "must be positive definite")
    if smallest.min() < 1 / _LARGEST or np.abs(g).max() > _LARGEST:
        outside = (smallest < 1 / _LARGEST) | (np.abs(g) > _LARGEST).any(axis=(1, 2))
        needed = f"must have entries and eigenvalues between {1 / _LARGEST:g} and {_LARGEST:g}"
        raise_at_first(outside, name, g, needed, "squares leave the range of doubles, take another unit")
