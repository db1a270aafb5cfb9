"""A speed on each face: distance becomes the time that the fastest way takes."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic import IntrinsicTriangulation, intrinsic_delaunay, intrinsic_triangulation
from heat_igl.mesh import MeshLike, as_simplices, connectivity
from heat_igl.operators.intrinsic import intrinsic_operators
from heat_igl.operators.matrices import Operators, laplacian_of_gradient
from heat_igl.operators.simplices import cotan_operators
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["speed_operators"]


def speed_operators(mesh: MeshLike, speed: ArrayLike) -> Operators:
    """The operators of a mesh on which one travels at a speed of its own in each face.

    Distance is then the time T of the fastest way, |grad T| = 1 / speed: Fermat's principle, and Snell's law where the
    speed changes. In the metric g = speed^-2, which is that of the surface times a factor, the gradient's length is
    multiplied by the speed and a p-dimensional measure by speed^-p. So G becomes speed G, the weights W and the mass of
    each face's corners are divided by speed^p, and D = -G^T W and L = D G follow. On triangles, p = 2, L does not
    change at all.

    Edge lengths cannot do this: an edge between two speeds would have two of them.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    speed : (m,) array_like
        Length per unit of time on each face, positive.

    Returns
    -------
    Operators
        For `HeatMethodSolver.from_operators`, with every length a travel time. Edges are flipped towards a Delaunay
        triangulation where both faces have the same speed, and stay where it changes. No `surface`: ways bend at edges
        here, so there is nothing to unfold and `refine` is refused, and sources are vertices.

    Raises
    ------
    ValueError
        If `speed` is not a positive number for each face.
    MeshError
        If a tetrahedron has no volume.

    Notes
    -----
    h, and with it the time step, is a mean over the mesh. Where speed varies smoothly over a regular mesh, t_coef = 4
    gives smaller errors than 1: edges that are long in time, the slow ones, otherwise leave an error of direction.
    """
    mesh = as_simplices(mesh)
    s = _checked(speed, mesh.n_faces)
    if mesh.is_tetrahedral:
        domain, F = cotan_operators(mesh), mesh.F
        # A quarter of the volume for each corner, as igl.massmatrix has it.
        corner_mass = np.repeat(mesh.measures / 4, 4)
        lengths = igl.edge_lengths(mesh.V, F)
        pairs = np.concatenate([F[:, pair] for pair in ([3, 0], [3, 1], [3, 2], [1, 2], [2, 0], [0, 1])])
    else:
        triangulation = _flipped_within_speeds(intrinsic_triangulation(mesh), s)
        # The path length is replaced below.
        domain, F = intrinsic_operators(triangulation, mesh), triangulation.F
        lengths = triangulation.l
        corner_mass = igl.massmatrix_intrinsic(lengths, np.arange(F.size).reshape(-1, 3)).diagonal()
        pairs = np.concatenate([F[:, pair] for pair in ([1, 2], [2, 0], [0, 1])])
    p = F.shape[1] - 1
    times = connectivity.shortest_edge_graph(pairs, (lengths / s[:, None]).ravel(order="F"), mesh.n_vertices)
    longest = connectivity.longest_paths(times, domain.components)
    mass = np.bincount(F.ravel(), corner_mass / np.repeat(s, p + 1) ** p, minlength=mesh.n_vertices)
    G = (sp.diags(np.tile(s, domain.dimension)) @ domain.G).tocsc()
    weights = domain.weights / s**p
    return replace(
        domain,
        L=domain.L if p == 2 else laplacian_of_gradient(G, weights),
        M=sp.diags(mass, format="csc"),
        gradient=G,
        weights=weights,
        face_sizes=domain.face_sizes / s,
        mean_edge_length=float(times.data.mean()),
        boundary=mesh.boundary,
        longest_distance=float(longest.max()),
        longest_distances=longest,
        lengths=None,
        surface=None,
    )


def _checked(speed: ArrayLike, m: int) -> FloatArray:
    try:
        s = np.array(speed, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"speed must be real numbers of shape ({m},), one per face") from None
    if s.shape != (m,):
        raise ValueError(f"speed must have shape ({m},), one per face, not {s.shape}")
    bad = ~((s > 0) & np.isfinite(s))
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(
            f"speed[{first}] = {s[first]} must be positive and finite ({int(bad.sum())} of {m} are not): remove faces "
            "that cannot be crossed"
        )
    return s


def _flipped_within_speeds(triangulation: IntrinsicTriangulation, s: FloatArray) -> IntrinsicTriangulation:
    """Delaunay flips of the edges between equal speeds; a flip keeps its two faces' numbers, and so their speed."""
    twin: IntArray = triangulation.twin.copy()
    glued = np.flatnonzero(twin >= 0)
    cut = glued[s[glued // 3] != s[twin[glued] // 3]]
    twin[cut] = -1
    return intrinsic_delaunay(replace(triangulation, twin=twin))
