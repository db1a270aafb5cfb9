"""GIFTI surfaces of neuroimaging (``lh.pial.surf.gii``), by nibabel, with attributes per vertex."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Contents, check, select
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["read", "write"]


def _nibabel(purpose: str) -> Any:
    with MissingExtraError.guard(f"{purpose} GIFTI files", "nibabel", "neuro"):
        import nibabel
    return nibabel


def read(path: Path, data: bytes) -> Contents:
    """Parse a GIFTI file: its first coordinates and triangles, and the other arrays with a row per vertex."""
    nibabel = _nibabel("reading")
    if not data.strip():
        raise MeshError(f"{path}: the file is empty")
    try:
        image = nibabel.GiftiImage.from_bytes(data)
        arrays = [(str(nibabel.nifti1.intent_codes.niistring[each.intent]), each) for each in image.darrays]
    except Exception as error:  # of the XML parser, of base64, of zlib, of shapes
        raise MeshError(f"{path}: nibabel cannot read this GIFTI file ({error}): it is damaged or cut short") from error
    positions = [each.data for intent, each in arrays if intent == "NIFTI_INTENT_POINTSET"]
    triangles = [each.data for intent, each in arrays if intent == "NIFTI_INTENT_TRIANGLE"]
    if not positions or not triangles:
        raise MeshError(
            f"{path}: the file holds no surface, which needs coordinates (POINTSET) and faces (TRIANGLE): its arrays "
            f"are {', '.join(intent.removeprefix('NIFTI_INTENT_') for intent, _ in arrays) or 'none'}"
        )
    V: FloatArray = np.asarray(positions[0], np.float64).reshape(-1, 3)
    cells = select(path, [("triangle", np.asarray(triangles[0], np.int64).reshape(-1, 3))])
    check(V, cells, lambda i: f"{path}, vertex {i} (counted from 0)", lambda i: f"{path}, face {i} (counted from 0)", 0)
    attributes: dict[str, AnyArray] = {}
    for k, (intent, each) in enumerate(arrays):
        if intent not in ("NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE") and len(each.data) == len(V):
            name = each.meta.get("Name") or intent.removeprefix("NIFTI_INTENT_").lower()
            attributes[name if name not in attributes else f"{name}_{k}"] = np.asarray(each.data)
    return Contents(V, cells, attributes)


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles as GIFTI, in single precision, the only one that the format allows."""
    nibabel = _nibabel("writing")
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
