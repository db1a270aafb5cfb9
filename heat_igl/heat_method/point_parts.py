"""Preparation of a solver on points: swept without heat, as long as nobody asks for that."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cached_property

import igl
import numpy as np

from heat_igl.heat_method.checking import Checker
from heat_igl.heat_method.options import SolverOptions
from heat_igl.heat_method.parts import SolverParts, prepare, prepare_mesh
from heat_igl.heat_method.solution import Diagnostics
from heat_igl.linear import Analysis
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.operators import Operators, operators, unfolding_surface
from heat_igl.sources import SourceAssembler
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.unfolding import UnfoldingSolver
from heat_igl.unfolding.distance import MeshDomain

__all__ = ["prepare_points"]

# See docs/clouds.md: the sides of random points' triangles differ so much that heat needs a larger step.
_T_COEF_EVEN, _T_COEF_RANDOM = 0.5, 1.0
# Median ratio of the longest to the shortest side above which points count as random: these have 1.9, the vertices of
# meshes 1.2 to 1.8.
_RANDOM_SIDES = 1.82


def prepare_points(cloud: PointCloud, options: SolverOptions, known: Analysis | None = None) -> SolverParts:
    """The parts of a solver on `cloud`; a `known` order of elimination is taken if it fits and anything is factored."""
    options = _for_points(cloud, options)
    return _SweptParts(cloud, options) if options.names_no_heat else prepare_mesh(cloud, options, known)


def _for_points(cloud: PointCloud, options: SolverOptions) -> SolverOptions:
    """The options with those left open chosen for a cloud: on scattered points the sweep is far nearer than heat."""
    if options.leaves_points:
        options = replace(options, refine="sweep")
    if options.refine is not None or options.t_coef is not None:
        return options
    return replace(options, t_coef=_t_coef_of_points(cloud.triangles))


def _t_coef_of_points(triangles: Mesh) -> float:
    sides = np.sort(igl.edge_lengths(triangles.V, triangles.F), axis=1)
    is_random = np.median(sides[:, 2] / np.maximum(sides[:, 0], np.finfo(float).tiny)) > _RANDOM_SIDES
    return _T_COEF_RANDOM if is_random else _T_COEF_EVEN


class _SweptSurface(MeshDomain):
    """Triangles of points as `UnfoldingSolver` takes them, before there are operators."""

    @cached_property
    def mean_edge_length(self) -> float:
        """Mean length of the edges that are unfolded across, as operators have it."""
        return self.surface.triangulation.mean_edge_length


class _SweptParts(SolverParts):
    """The parts of a solver that sweeps the triangles of points in an order of its own.

    A query needs the triangles, the tables of the sweep and the check alone. Everything else is made when it is first
    read: the operators, the time step and the diagnostics together, without factors, and the factors of the heat flow
    once heat is asked for. Threads that ask at the same time may make them twice, and all get the same values.
    """

    def __init__(self, cloud: PointCloud, options: SolverOptions) -> None:
        start = time.perf_counter()
        self._cloud, self._options, self._mesh = cloud, options, cloud.distinct_triangles
        self._surface = unfolding_surface(self._mesh)
        referenced = np.zeros(self._mesh.n_vertices, bool)
        referenced[self._mesh.F] = True
        self._checker = Checker(self._surface, referenced, cloud.V)
        domain = _SweptSurface(self._mesh, self._surface)
        self._sweep = UnfoldingSolver(domain, "sweep", originals=self.originals, orders_itself=True)
        self._seconds = time.perf_counter() - start

    @cached_property
    def _for_heat(self) -> SolverParts:
        """All parts, with operators and without factors."""
        start = time.perf_counter()
        domain = operators(self._mesh, self.options.triangulation)
        seconds = self._seconds + time.perf_counter() - start
        return prepare(domain, self.options, lambda: None, seconds, self._cloud.V, self.originals, self._sweep)

    # What a query needs, before anything is made for heat.

    @property
    def options(self) -> SolverOptions:
        """As the user gave them."""
        return self._options

    @property
    def last_steps(self) -> UnfoldingSolver:
        """The sweep."""
        return self._sweep

    @property
    def checker(self) -> Checker:
        """Checks answers against straight lines."""
        return self._checker

    @property
    def originals(self) -> IntArray | None:
        """The point (n,) whose distance each takes; None if there are no copies."""
        return self._cloud.originals if self._cloud.has_copies else None

    @property
    def n_vertices(self) -> int:
        """Length of a distance array."""
        return self._mesh.n_vertices

    @property
    def n_faces(self) -> int:
        """Faces of the domain."""
        return self._mesh.n_faces

    @property
    def is_surface(self) -> bool:
        """Whether the domain has two dimensions."""
        return True

    @property
    def given_faces(self) -> IntArray | None:
        """Vertices (m, 3) of the triangles that points and curves refer to."""
        return self._surface.given_faces

    # What heat needs.

    @property
    def analysis(self) -> None:
        """No order of elimination: that of the heat flow is found with the factors."""

    @property
    def factored(self) -> None:
        """No heat flow: `heat_flow` factors it."""

    @property
    def operators(self) -> Operators:
        """The domain."""
        return self._for_heat.operators

    @property
    def assembler(self) -> SourceAssembler:
        """From sources to right-hand sides."""
        return self._for_heat.assembler

    @property
    def time_steps(self) -> FloatArray:
        """Time step (n_components,) of each component."""
        return self._for_heat.time_steps

    @property
    def step_raised(self) -> BoolArray:
        """Whether that (n_components,) is more than was asked for."""
        return self._for_heat.step_raised

    @property
    def t_damping(self) -> float | FloatArray | None:
        """Time step for `damping`."""
        return self._for_heat.t_damping

    @property
    def fitted(self) -> bool:
        """Whether the heat flow is fitted to the lengths of edges."""
        return self._for_heat.fitted

    @property
    def diagnostics(self) -> Diagnostics:
        """For the user."""
        return self._for_heat.diagnostics
