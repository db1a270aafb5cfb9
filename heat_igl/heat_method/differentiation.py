"""The derivative of a distance that a solver has found: selects the parts of the solver to differentiate."""

from __future__ import annotations

import numpy as np

from heat_igl.heat_method.derivatives import DistanceDerivative, SidesDerivative
from heat_igl.heat_method.heat_derivative import HeatDerivative
from heat_igl.heat_method.parts import SolverParts
from heat_igl.heat_method.side_lengths import SideLengths
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.sources import SourceSet, right_hand_side
from heat_igl.typing import FloatArray
from heat_igl.unfolding import FrontSolver, UnfoldingSolver

__all__ = ["differentiated"]


def differentiated(
    distance: FloatArray, sources: SourceSet, parts: SolverParts, mesh: Mesh | PointCloud | None
) -> tuple[FloatArray, DistanceDerivative]:
    """A distance (n,) from `sources`, and its derivative.

    Parameters
    ----------
    distance : (n,) float64
        The answer.
    sources : SourceSet
        Vertices and points in faces.
    parts : SolverParts
        Of the solver that gave the answer.
    mesh : Mesh, PointCloud or None
        Its vertices.

    Raises
    ------
    ValueError
        If the domain is no surface of triangles, if a curve is among the sources, with ``refine="sweep"``, if the
        triangulation has added vertices, or as for `HeatDerivative`.
    """
    surface = parts.operators.surface
    if isinstance(parts.last_steps, FrontSolver) and parts.operators.is_surface:
        raise ValueError(
            "fronts through faces that see their edges at several lengths have no derivative: let the metric or the "
            "speed change by less than 10 % from face to face"
        )
    if surface is None or parts.operators.fans is not None or isinstance(mesh, PointCloud):
        raise ValueError(
            "derivatives need a surface of triangles: this domain has none, or is a point cloud, or heat on polygons"
        )
    if len(sources.segments.faces):
        raise ValueError(
            "derivatives are there for vertices and points, and a curve is among the sources: place points on it"
        )
    answer: SidesDerivative
    if isinstance(parts.last_steps, UnfoldingSolver):
        u = np.zeros(parts.operators.n)
        if not parts.last_steps.is_exact:
            term = parts.assembler.term(sources)
            u = parts.heat_flow.solve(right_hand_side(parts.operators.n, [term]))[:, 0]
        answer = parts.last_steps.paths(sources, u)
    else:
        answer = HeatDerivative(parts, sources)
    sides = parts.operators.metric if mesh is None else SideLengths(mesh)
    return distance, DistanceDerivative(distance, sources, surface, sides, answer)
