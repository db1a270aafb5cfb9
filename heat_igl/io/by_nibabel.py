"""Surfaces of neuroimaging, by nibabel (extra ``io``): GIFTI (``lh.pial.surf.gii``) and FreeSurfer's (``lh.white``).

Both hold triangles in single precision.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Contents, check, select
from heat_igl.io.packed import form_suffix
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["FREESURFER_SUFFIXES", "read", "write"]

# FreeSurfer's files have no extension; these names of surfaces stand in its place.
FREESURFER_SUFFIXES = (".white", ".pial", ".inflated", ".sphere", ".smoothwm", ".midthickness")


def _nibabel(purpose: str) -> Any:
    with MissingExtraError.guard(f"{purpose} GIFTI files and FreeSurfer's surfaces", "nibabel", "io"):
        import nibabel
        import nibabel.freesurfer
    return nibabel


def read(path: Path, data: bytes) -> Contents:
    """Parse a surface, in the coordinates of the file, with the arrays of a GIFTI file that have a row per vertex."""
    nibabel = _nibabel("reading")
    if not data.strip():
        raise MeshError(f"{path}: the file is empty")
    attributes: dict[str, AnyArray] = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if form_suffix(path) == ".gii":
                positions, triangles, attributes = _gifti(path, nibabel, data)
            else:
                # Without the centre of the volume, which other programs leave out, too.
                positions, triangles = nibabel.freesurfer.read_geometry(str(path))
            V: FloatArray = np.asarray(positions, np.float64).reshape(-1, 3)
            F = np.asarray(triangles, np.int64).reshape(-1, 3)
    except MeshError:
        raise
    except Exception as error:  # of the XML parser, of base64, of zlib, of shapes, of memory for wrong counts
        raise MeshError(
            f"{path}: nibabel cannot read this surface ({error}): it is damaged, cut short, or another file"
        ) from error
    cells = select(path, [("triangle", F)])
    check(V, cells, lambda i: f"{path}, vertex {i} (counted from 0)", lambda i: f"{path}, face {i} (counted from 0)", 0)
    return Contents(V, cells, {name: values for name, values in attributes.items() if len(values) == len(V)})


def _gifti(path: Path, nibabel: Any, data: bytes) -> tuple[Any, Any, dict[str, AnyArray]]:
    """The first coordinates, the first triangles, and the other arrays by name."""
    image = nibabel.GiftiImage.from_bytes(data)
    parts: dict[str, Any] = {}
    others: dict[str, AnyArray] = {}
    for k, each in enumerate(image.darrays):
        intent = str(nibabel.nifti1.intent_codes.niistring[each.intent]).removeprefix("NIFTI_INTENT_")
        if intent in ("POINTSET", "TRIANGLE"):
            parts.setdefault(intent, each.data)
        else:
            name = each.meta.get("Name") or intent.lower()
            others[name if name not in others else f"{name}_{k}"] = np.asarray(each.data)
    if len(parts) < 2:
        raise MeshError(
            f"{path}: the file holds no surface, which needs coordinates (POINTSET) and faces (TRIANGLE): its arrays "
            f"are {', '.join(map(str.upper, [*parts, *others])) or 'none'}"
        )
    return parts["POINTSET"], parts["TRIANGLE"], others


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles; a GIFTI file also holds arrays (n,)."""
    nibabel = _nibabel("writing")
    if form_suffix(path) != ".gii":
        # The stamp is part of the file: without it, nibabel writes the name of the user and the time.
        nibabel.freesurfer.write_geometry(str(path), mesh.V, mesh.F, create_stamp="created by heat_igl")
        return
    wide = [name for name, values in attributes.items() if values.ndim > 1]
    if wide:
        raise MeshError(f"{path}: GIFTI holds one number per vertex, and {wide[0]} has several: write them apart")
    arrays: list[tuple[str, AnyArray, dict[str, str]]] = [
        ("POINTSET", mesh.V.astype("<f4"), {}),
        ("TRIANGLE", mesh.F.astype("<i4"), {}),
    ]
    arrays += [("SHAPE", values.astype("<f4"), {"Name": name}) for name, values in attributes.items()]
    image = nibabel.GiftiImage(
        darrays=[
            nibabel.gifti.GiftiDataArray(values, f"NIFTI_INTENT_{intent}", meta=meta) for intent, values, meta in arrays
        ]
    )
    path.write_bytes(image.to_bytes())
