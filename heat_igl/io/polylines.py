"""Reading polylines in space from OBJ files, as `write_curves` writes them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.typing import FloatArray

__all__ = ["Polyline", "read_polylines"]


class Polyline(NamedTuple):
    """The corners (k, 3) of a polyline in space, each once, and whether a line leads from the last to the first."""

    positions: FloatArray
    is_closed: bool


def read_polylines(path: str | os.PathLike[str]) -> list[Polyline]:
    """Read the polylines (records ``l``) of an OBJ file; one is closed if its last index is the first again.

    Other records are ignored. A MeshError names the first vertex that is not three numbers, or line that has fewer than
    two vertices or one that is not in the file; or says that there is no line.
    """
    source = Path(os.fspath(path))
    positions: list[list[float]] = []
    lines: list[tuple[int, list[int]]] = []
    for number, record in enumerate(source.read_text(encoding="utf8", errors="replace").splitlines(), 1):
        words = record.split("#")[0].split()
        try:
            if words[:1] == ["v"]:
                x, y, z = (float(word) for word in words[1:4])
                positions.append([x, y, z])
            elif words[:1] == ["l"]:
                lines.append((number, [int(word.split("/")[0]) for word in words[1:]]))
        except ValueError:
            raise MeshError(f"{source}, line {number}: {' '.join(words)[:60]!r} is no vertex or line of OBJ") from None
    if not lines:
        raise MeshError(f"{source} holds no curve: a record that starts with l is expected, as write_curves writes it")
    found = []
    for number, indices in lines:
        wrong = [index for index in indices if not 1 <= index <= len(positions)]
        if wrong:
            raise MeshError(
                f"{source}, line {number}: vertex {wrong[0]} is not one of the {len(positions)} in the file"
            )
        closed = len(indices) > 2 and indices[0] == indices[-1]
        kept = indices[:-1] if closed else indices
        if len(kept) < 2:
            raise MeshError(f"{source}, line {number}: a curve needs two vertices or more")
        found.append(Polyline(np.array(positions)[np.array(kept) - 1], closed))
    return found
