"""Signed distance in space from surfaces with holes, in cells.

    python scripts/signed_volumes.py [--points 33] [--boxes 14] [--seeds 3] [--json FILE]

A sphere, a box and a torus in a unit cube: closed, with 20 % of the faces removed one by one, and with 20 % of the area
removed in patches. The truth is the distance from the closed surface by libigl, with the sign of the winding number.
Mean error at the points within a cell of the surface, and in brackets at all points; the largest of several seeds.
docs/signed.md shows the table. Takes about five seconds.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

import igl
import numpy as np

from heat_igl import Mesh, VoxelBox, shapes, volume_signed_distance
from heat_igl.typing import FloatArray

from scaffold import add_json, environment, option_parser, publish, table

REMOVED = 0.2
# Radius of a patch, as a share of the cube.
PATCH = 0.07


def ball() -> Mesh:
    """A sphere of radius 0.3."""
    sphere = shapes.icosphere(3)
    return Mesh(0.3 * sphere.V + 0.5, sphere.F)


def brick() -> Mesh:
    """A box of 0.6 x 0.5 x 0.4, each side a grid of squares, counter-clockwise seen from outside."""
    cells = shapes.box(8, (0.6, 0.5, 0.4))
    F = igl.boundary_facets(cells.F)[0]
    centre = cells.V.mean(axis=0)
    corners = cells.V[F]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("fx,fx->f", normal, corners.mean(axis=1) - centre) < 0
    used, compact = np.unique(np.where(inward[:, None], F[:, ::-1], F), return_inverse=True)
    return Mesh(cells.V[used] - centre + 0.5, compact.reshape(-1, 3))


def ring() -> Mesh:
    """A torus."""
    torus = shapes.torus(48, 24)
    return Mesh(0.25 * torus.V + 0.5, torus.F)


def closed(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """The whole surface."""
    del rng
    return mesh


def without_faces(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """A fifth of the faces away."""
    kept = np.ones(mesh.n_faces, bool)
    kept[rng.choice(mesh.n_faces, int(REMOVED * mesh.n_faces), replace=False)] = False
    return Mesh(mesh.V, mesh.F[kept])


def without_patches(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """A fifth of the area away, in patches around random faces."""
    centre = mesh.V[mesh.F].mean(axis=1)
    kept = np.ones(mesh.n_faces, bool)
    while mesh.measures[kept].sum() > (1 - REMOVED) * mesh.measures.sum():
        kept &= np.linalg.norm(centre - centre[rng.integers(mesh.n_faces)], axis=1) > PATCH
    return Mesh(mesh.V, mesh.F[kept])


SURFACES: dict[str, Callable[[], Mesh]] = {"sphere": ball, "box": brick, "torus": ring}
HOLES: dict[str, Callable[[Mesh, np.random.Generator], Mesh]] = {
    "closed": closed,
    "20 % of the faces away": without_faces,
    "20 % of the area away in patches": without_patches,
}


def errors(where: Any, points: FloatArray, cell: float, whole: Mesh, surface: Mesh) -> tuple[float, float]:
    """Mean error in cells, within a cell of the surface and everywhere."""
    kind = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    truth = np.asarray(igl.signed_distance(points, whole.V, whole.F, sign_type=kind)[0])
    off = np.abs(volume_signed_distance(where, surface).ravel() - truth) / cell
    return float(off[np.abs(truth) < cell].mean()), float(off.mean())


def measure(n_points: int, n_boxes: int, seeds: int) -> list[dict[str, Any]]:
    """A row for each surface and domain."""
    box = VoxelBox([0, 0, 0], 1 / (n_points - 1), [n_points] * 3)
    tetrahedra = shapes.box(n_boxes)
    domains: dict[str, tuple[Any, FloatArray, float]] = {
        f"grid of {n_points}^3": (box, box.positions().reshape(-1, 3), 1 / (n_points - 1)),
        f"tetrahedra of {n_boxes}^3 boxes": (tetrahedra, tetrahedra.V, 1 / n_boxes),
    }
    rows = []
    for domain, (where, points, cell) in domains.items():
        for name, make in SURFACES.items():
            whole = make()
            row: dict[str, Any] = {"domain": domain, "surface": name}
            for holes, remove in HOLES.items():
                found = [
                    errors(where, points, cell, whole, remove(whole, np.random.default_rng(seed)))
                    for seed in range(1 if remove is closed else seeds)
                ]
                row[holes] = [max(column) for column in zip(*found, strict=True)]
            rows.append(row)
    return rows


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--points", type=int, default=33, help="points along each side of the grid (default 33)")
    parser.add_argument("--boxes", type=int, default=14, help="boxes of tetrahedra along each side (default 14)")
    parser.add_argument("--seeds", type=int, default=3, help="surfaces with holes of each kind (default 3)")
    add_json(parser)
    arguments = parser.parse_args(argv)
    rows = measure(arguments.points, arguments.boxes, arguments.seeds)
    cells = [
        (row["domain"], row["surface"], *("{:.2f} ({:.2f})".format(*row[holes]) for holes in HOLES)) for row in rows
    ]
    text = "\n".join(table(["domain", "surface", *HOLES], cells, left=(0, 1)))
    publish({"environment": environment(), "rows": rows}, text, json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
