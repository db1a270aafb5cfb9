"""The meshes and the sources of a batch, and the names of the meshes in the store."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from heat_igl.errors import SourceError, errors_at
from heat_igl.io import MESH_SUFFIXES, is_mesh_or_cloud_path
from heat_igl.mesh import Mesh, MeshLike, PointCloud, as_simplices
from heat_igl.sources import Sources, vertex_sources

# Names that a zarr group cannot have: they stand for the store itself, the folder above it, or its metadata.
_RESERVED_NAMES = ("", ".", "..", "zarr.json")

SourcePlan = int | tuple[tuple[int, ...], ...] | None
"""The sources of each mesh: a number of farthest points, the same source sets, or None for every vertex."""


@dataclass(frozen=True, eq=False)
class Item:
    """A mesh of a batch: the name in the store, the label in messages, and the mesh or the path to read it from."""

    name: str
    label: str
    mesh: Path | Mesh | PointCloud | tuple[Any, Any]
    points: bool = False  # whether a file is read as a point cloud, whatever the format


def folder(path: str | os.PathLike[str], points: bool = False) -> dict[str, Path]:
    """All files of meshes and of point clouds (.xyz) below a folder; the keys are paths in it.

    With `points`, all files that `read_point_cloud` reads. Arrays (.npy), which may hold anything, and hidden files
    are left out.

    Raises
    ------
    ValueError
        If `path` is no folder, or there is no such file in it.
    """
    root = Path(path)
    if not root.is_dir():
        raise ValueError(f"{root} is not a folder of meshes")
    found = {
        file.relative_to(root).as_posix(): file
        for file in sorted(root.rglob("*"))
        if is_mesh_or_cloud_path(file, points) and not file.name.startswith(".")
    }
    if not found:
        suffixes = (".ply", ".obj") if points else MESH_SUFFIXES
        kind = "point cloud" if points else "mesh"
        raise ValueError(f"{root} holds no {kind}: files must end in {', '.join(suffixes)} or .xyz")
    return found


def items(meshes: Mapping[str, MeshLike] | Sequence[MeshLike], points: bool = False) -> Iterator[Item]:
    """The meshes with their names: keys of a mapping; file names, or positions, in a sequence.

    A ValueError if two files of a sequence have one name, or a name is that of no group.
    """
    if isinstance(meshes, Mapping):
        pairs = list(meshes.items())
    else:
        pairs = [
            (Path(mesh).name if isinstance(mesh, str | os.PathLike) else f"{i:06d}", mesh)
            for i, mesh in enumerate(meshes)
        ]
    seen: set[str] = set()
    for name, mesh in pairs:
        if name in seen:
            raise ValueError(f"two meshes are called {name!r}: pass a dictionary from names to meshes")
        if name in _RESERVED_NAMES:
            raise ValueError(f"a mesh cannot be called {name!r} in a store: choose another name")
        seen.add(name)
        label = os.fspath(mesh) if isinstance(mesh, str | os.PathLike) else name
        yield Item(group_name(name), label, _held(mesh, label), points)


def group_name(name: str) -> str:
    """The name in the store of a mesh, whose own may hold the separator of zarr's groups."""
    return quote(name, safe=" ()[]")


def _held(mesh: MeshLike, label: str) -> Path | Mesh | PointCloud | tuple[Any, Any]:
    """The data that a task carries: a path, a mesh, a cloud, or arrays, which are checked when they are used."""
    if isinstance(mesh, str | os.PathLike):
        return Path(mesh)
    if isinstance(mesh, Mesh | PointCloud) or (isinstance(mesh, tuple) and len(mesh) == 2):
        return mesh
    with errors_at(label):
        return as_simplices(mesh)


def source_plan(sources: str | Sequence[Sources]) -> SourcePlan:
    """The plan that `sources` of `distances` describes; a SourceError if it describes none."""
    if isinstance(sources, str):
        kind, _, count = sources.partition(":")
        if sources != "all" and (kind != "farthest" or not count.isdecimal() or int(count) < 1):
            raise SourceError(f"sources must be 'all', 'farthest:K' with K at least 1, or a list, not {sources!r}")
        return int(count) if count else None
    if isinstance(sources, int | np.integer):
        sources = [sources]
    if not hasattr(sources, "__len__") or not len(sources):
        raise SourceError(f"sources must be 'all', 'farthest:K' or a list of source sets, not {sources!r}")
    sets = []
    for i, one in enumerate(sources):
        with errors_at(f"sources[{i}]"):
            # The number of vertices of a mesh is not known yet.
            sets.append(tuple(int(v) for v in vertex_sources(one, np.iinfo(np.int64).max)))
    return tuple(sets)


def plan_text(plan: SourcePlan) -> str:
    """A plan as text, as a store has it."""
    if isinstance(plan, tuple):
        return " ".join(",".join(map(str, vertices)) for vertices in plan)
    return "all" if plan is None else f"farthest:{plan}"


def read_source_sets(path: str | os.PathLike[str]) -> list[list[int]]:
    """Source sets from a text file: one on each line, vertex indices separated by spaces or commas.

    Raises
    ------
    SourceError
        If a line holds anything else, or there is none.
    """
    sets = []
    for number, line in enumerate(Path(path).read_text(encoding="utf8").splitlines(), start=1):
        words = line.split("#")[0].replace(",", " ").split()
        wrong = next((word for word in words if not word.isdecimal()), None)
        if wrong is not None:
            raise SourceError(f"{path}, line {number}: {wrong!r} is no vertex index")
        if words:
            sets.append([int(word) for word in words])
    if not sets:
        raise SourceError(f"{path} holds no sources: write vertex indices, one set a line")
    return sets
