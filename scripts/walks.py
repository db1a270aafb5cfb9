"""The files of Python that a call enters, in the order in which it enters them.

    python scripts/walks.py --docs ARCHITECTURE.md

``HeatMethodSolver.distance(1234)`` of a solver that has answered three times, and ``geodesic_distance(mesh, 1234)``.
What is imported is not part of it, nor are kernels, which are compiled.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, geodesic_distance, shapes

from harness import parsed, publish

PACKAGE = Path(heat_igl.__file__).parent


def entered(call: Callable[[], object]) -> list[str]:
    """Files, relative to the package."""
    found: dict[str, None] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        path = Path(frame.f_code.co_filename)
        if event == "call" and path.is_relative_to(PACKAGE):
            found[path.relative_to(PACKAGE).as_posix()] = None

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return list(found)


def walks() -> dict[str, list[str]]:
    """The files of both calls."""
    mesh = shapes.icosphere(4)
    solver = HeatMethodSolver(mesh)
    solver.distances([1, 2, 3])  # the first three are compared with a sweep, which is not part of it
    geodesic_distance(mesh, 1)  # imports
    again = Mesh(mesh.V, mesh.F)
    return {
        "HeatMethodSolver.distance": entered(lambda: solver.distance(1234)),
        "geodesic_distance": entered(lambda: geodesic_distance(again, 1234)),
    }


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv)
    found = walks().items()
    publish(
        options, {call: f"{len(files)} files: {', '.join(f'`{file}`' for file in files)}." for call, files in found}
    )


if __name__ == "__main__":
    sys.exit(main())
