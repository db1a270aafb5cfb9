"""Centroidal Voronoi diagrams: sites are moved to the centroids of their cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.curves.straightest import Tracer
from heat_igl.errors import SourceError, raise_at_first
from heat_igl.geodesic import GeodesicSolver
from heat_igl.mesh import MeshLike, as_mesh, as_simplices
from heat_igl.runtime import over_rows
from heat_igl.sources import Sources, distinct_vertices
from heat_igl.typing import FloatArray, IntArray

# The step of a site is divided by each of these in turn; the first that lowers the energy of its cell is taken.
_SHORTER = np.array([1, 2, 4, 8])


@dataclass(frozen=True, eq=False, repr=False)
class CentroidalSites:
    """Sites near the centroids of their Voronoi cells.

    Attributes
    ----------
    sites : (k,) int64
        Vertices.
    labels : (n,) int64
        Index into `sites` of the nearest site, the lower one of two equally near sites; -1 at vertices that no site
        reaches.
    energies : (r + 1,) float64
        The energy at the start and after each of r rounds, decreasing: the sum over the vertices of area times squared
        distance from the nearest site.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(3)
    >>> found = heat_igl.centroidal_voronoi(mesh, heat_igl.farthest_points(mesh, 12))
    >>> bool((np.diff(found.energies) <= 0).all()), len(np.unique(found.labels))
    (True, 12)
    """

    sites: IntArray
    labels: IntArray
    energies: FloatArray

    def __repr__(self) -> str:
        return f"CentroidalSites({len(self.sites)} sites, {len(self.energies) - 1} rounds)"


def centroidal_voronoi(mesh: MeshLike, sites: Sources, *, rounds: int = 50) -> CentroidalSites:
    """Spread sites evenly: move each towards the centroid of its Voronoi cell until no move lowers the energy.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold and oriented alike.
    sites : sequence of int, or (n,) mask of bool
        The first sites, for instance those of `farthest_points`.
    rounds : int
        The largest number of rounds.

    Returns
    -------
    CentroidalSites
        `sites`, `labels` and `energies`.

    Raises
    ------
    MeshError
        If the mesh has no tangent frames, see `tangent_frames`.
    SourceError
        If `sites` are not distinct vertices.
    ValueError
        If `rounds` is no integer of at least 0.

    Notes
    -----
    Lloyd's algorithm (1982) for the energy sum over v of a_v d(v, nearest site)^2, where the area a_v of a vertex is a
    third of the area of its faces. The step of a site is the mean of its log map over the cell. The exponential map of
    the step is a point in a face, and the site moves to the nearest corner of this face if the corner is in the cell
    and lowers the energy of the cell. Otherwise a half, a quarter and an eighth of the step are tried. The energy
    decreases in every round until no site moves. Distances and directions are exact: a round calls
    `GeodesicSolver.directions` once for each site, and again for each corner that is tried.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(10)
    >>> found = heat_igl.centroidal_voronoi(mesh, [0])  # a corner moves to the middle of the unit square
    >>> mesh.V[found.sites].round(6).tolist()
    [[0.5, 0.5, 0.0]]
    """
    if isinstance(rounds, bool) or not isinstance(rounds, int | np.integer) or rounds < 0:
        raise ValueError(f"rounds must be an integer of at least 0, not {rounds!r}")
    mesh = as_mesh(mesh)
    triangles = as_simplices(mesh)
    chosen = distinct_vertices(sites, triangles.n_vertices, "sites", triangles.originals)
    lost = ~triangles.referenced[chosen]
    raise_at_first(lost, "sites", chosen, "is no vertex that a face uses", "it has no cell", SourceError)
    return _Relaxation(mesh).relaxed(chosen, int(rounds))


class _Relaxation:
    """Lloyd's algorithm on one mesh."""

    def __init__(self, given: MeshLike) -> None:
        self._mesh = mesh = as_simplices(given)
        self._tracer = Tracer(given)
        self._solver = GeodesicSolver(given, method="exact")
        self._areas = np.bincount(mesh.F.ravel(), np.repeat(mesh.measures / 3, 3), mesh.n_vertices)

    def relaxed(self, sites: IntArray, rounds: int) -> CentroidalSites:
        """Sites moved for some rounds."""
        sites, rows, angles = sites.copy(), *self._rows(sites)
        labels, energy = self._cells(rows)
        energies = [energy]
        for _ in range(rounds):
            steps = self._means(rows, angles, labels)
            if not self._move(sites, rows, angles, steps, labels):
                break
            labels, energy = self._cells(rows)
            energies.append(energy)
        return CentroidalSites(sites, labels, np.array(energies))

    def _rows(self, sites: IntArray) -> tuple[FloatArray, FloatArray]:
        """Distances (k, n) from each site, and the angles (k, n) at which the shortest paths leave the site."""
        rows, angles = np.empty((2, len(sites), self._mesh.n_vertices))

        def work(part: slice) -> None:
            for i in range(part.start, part.stop):
                found = self._solver.directions(int(sites[i]))
                rows[i], angles[i] = found.distance, found.departure

        over_rows(work, len(sites), len(sites))
        return rows, angles

    def _cells(self, rows: FloatArray) -> tuple[IntArray, float]:
        nearest = rows.min(axis=0)
        reached = np.isfinite(nearest)
        labels = np.where(reached, rows.argmin(axis=0), -1)
        return labels, float(self._areas[reached] @ nearest[reached] ** 2)

    def _move(self, sites: IntArray, rows: FloatArray, angles: FloatArray, steps: FloatArray, labels: IntArray) -> bool:
        """Move the sites in place, with their `rows` and `angles`, where this lowers the energy; whether one moved."""
        tried = (steps[:, None] / _SHORTER[:, None]).reshape(-1, 2)
        ends = self._tracer.exp(np.repeat(sites, len(_SHORTER)), tried)
        corners = self._mesh.F[ends.faces, ends.barycentric.argmax(axis=1)].reshape(-1, len(_SHORTER))

        def moves(i: int) -> bool:
            cell = labels == i
            for corner in dict.fromkeys(corners[i].tolist()):
                # A site stays inside its cell, so that no two sites meet.
                if corner != sites[i] and cell[corner]:
                    found = self._solver.directions(corner)
                    if self._areas[cell] @ found.distance[cell] ** 2 < self._areas[cell] @ rows[i][cell] ** 2:
                        sites[i], rows[i], angles[i] = corner, found.distance, found.departure
                        return True
            return False

        moved = over_rows(lambda part: [moves(i) for i in range(part.start, part.stop)], len(sites), len(sites))
        return any(map(any, moved))

    def _means(self, rows: FloatArray, angles: FloatArray, labels: IntArray) -> FloatArray:
        """The mean (k, 2) of the log map of each site over its cell."""
        found = np.empty((len(rows), 2))
        for i, (row, angle) in enumerate(zip(rows, angles, strict=True)):
            cell = labels == i
            area = self._areas[cell]
            moment = area * row[cell] / max(area.sum(), np.finfo(float).tiny)
            found[i] = moment @ np.cos(angle[cell]), moment @ np.sin(angle[cell])
        return found
