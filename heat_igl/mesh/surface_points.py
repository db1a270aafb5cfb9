"""Points and curves on a triangle mesh, given by a face and barycentric coordinates in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = ["SurfaceCurve", "SurfacePoints"]

# Barycentric coordinates that miss a sum of 1, or fall below 0, by more than this are not taken for rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on a triangle mesh.

    Parameters
    ----------
    faces : (k,) array_like of int
        The face that each point lies in, or on the rim of.
    barycentric : (k, 3) array_like
        Weights of the face's three corners: not negative, sum 1.

    Raises
    ------
    SourceError
        If an array has the wrong shape, a coordinate is not finite or negative, or a sum is not 1 to 1e-9; the message
        names the first such point.
    """

    faces: IntArray
    barycentric: FloatArray

    def __post_init__(self) -> None:
        faces = _face_indices("faces", self.faces)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "barycentric", _coordinates("barycentric", self.barycentric, len(faces)))

    def __len__(self) -> int:
        return len(self.faces)

    def positions(self, mesh: Mesh) -> FloatArray:
        """Where the points are in space, (k, 3).

        Raises
        ------
        SourceError
            If a face is not one of the mesh, or the mesh is tetrahedral.
        """
        return _in_space(mesh, self.faces, self.barycentric)


@dataclass(frozen=True, eq=False)
class SurfaceCurve:
    """A polyline on a triangle mesh, each of its straight segments inside one face.

    Parameters
    ----------
    faces : (s,) array_like of int
        The face of each segment.
    start, end : (s, 3) array_like
        Barycentric coordinates, in that face, of where the segment begins and ends. Each segment begins where the one
        before it ends, though mostly in another face.
    is_closed : bool
        Whether the last segment ends where the first begins.

    Raises
    ------
    SourceError
        As for `SurfacePoints`.
    """

    faces: IntArray
    start: FloatArray
    end: FloatArray
    is_closed: bool = False

    def __post_init__(self) -> None:
        faces = _face_indices("faces", self.faces)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "start", _coordinates("start", self.start, len(faces)))
        object.__setattr__(self, "end", _coordinates("end", self.end, len(faces)))

    def __len__(self) -> int:
        return len(self.faces)

    def positions(self, mesh: Mesh) -> FloatArray:
        """The corners of the polyline in space, (s + 1, 3); the last is the first again where it is closed."""
        first = _in_space(mesh, self.faces[:1], self.start[:1])
        return np.concatenate([first, _in_space(mesh, self.faces, self.end)])

    def lengths(self, mesh: Mesh) -> FloatArray:
        """Length of each segment, (s,)."""
        return np.asarray(np.linalg.norm(np.diff(self.positions(mesh), axis=0), axis=1))


def _face_indices(name: str, faces: ArrayLike) -> IntArray:
    array: AnyArray = np.atleast_1d(np.asarray(faces))
    if array.ndim != 1 or array.dtype.kind not in "iu" or not len(array):
        raise SourceError(f"{name} must be one face index or more, not {array.dtype} of shape {array.shape}")
    return np.array(array, dtype=np.int64)


def _coordinates(name: str, barycentric: ArrayLike, k: int) -> FloatArray:
    try:
        array = np.atleast_2d(np.array(barycentric, dtype=np.float64))
    except (TypeError, ValueError):
        raise SourceError(f"{name} must be real numbers of shape ({k}, 3)") from None
    if array.shape != (k, 3):
        raise SourceError(f"{name} must have shape ({k}, 3), a row for each face, not {array.shape}")
    wrong = ~(np.isfinite(array).all(axis=1) & (array.min(axis=1) >= -_ROUNDING))
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise SourceError(f"{name}[{first}] = {array[first].tolist()} must be finite and not negative")
    wrong = np.abs(array.sum(axis=1) - 1) > _ROUNDING
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise SourceError(f"{name}[{first}] = {array[first].tolist()} must sum to 1, not {array[first].sum():.12g}")
    array = np.maximum(array, 0.0)
    return np.asarray(array / array.sum(axis=1, keepdims=True))


def _in_space(mesh: Mesh, faces: IntArray, barycentric: FloatArray) -> FloatArray:
    if mesh.is_tetrahedral:
        raise SourceError("points on faces need triangles, but the mesh is tetrahedral")
    outside = (faces < 0) | (faces >= mesh.n_faces)
    if outside.any():
        first = int(np.flatnonzero(outside)[0])
        raise SourceError(f"faces[{first}] = {faces[first]} is no face: indices run from 0 to {mesh.n_faces - 1}")
    return np.asarray(np.einsum("kc,kcx->kx", barycentric, mesh.V[mesh.F[faces]]))
