"""Surfaces of neuroimaging, by nibabel (extra ``io``): GIFTI (``lh.pial.surf.gii``) and FreeSurfer's (``lh.white``).

Both hold triangles in single precision. Maps on surfaces come from GIFTI (``lh.label.gii``) and CIFTI (``dlabel.nii``).
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError
from heat_igl.io.contents import Contents, check, numbered, select
from heat_igl.io.storage import form_suffix
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray

# FreeSurfer's files have no extension; these names of surfaces stand in its place.
FREESURFER_SUFFIXES = (".white", ".pial", ".inflated", ".sphere", ".smoothwm", ".midthickness")

# Files that hold maps.
MAP_SUFFIXES = (".gii", ".nii")
_CORTEX = "CIFTI_STRUCTURE_"


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
                attributes = _gifti(nibabel, data)
                positions, triangles = (attributes.pop(name, None) for name in ("POINTSET", "TRIANGLE"))
                if positions is None or triangles is None:
                    raise MeshError(
                        f"{path}: the file holds no surface, which needs coordinates (POINTSET) and faces (TRIANGLE): "
                        f"its arrays are {', '.join(attributes) or 'none'}"
                    )
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
    check(V, cells, numbered(path, "vertex", 0), numbered(path, "face", 0))
    return Contents(V, cells, {name: values for name, values in attributes.items() if len(values) == len(V)})


def _gifti(nibabel: Any, data: bytes) -> dict[str, AnyArray]:
    """The arrays by name, or by what they are meant for: the first coordinates are POINTSET, triangles TRIANGLE."""
    found: dict[str, AnyArray] = {}
    for k, each in enumerate(nibabel.GiftiImage.from_bytes(data).darrays):
        intent = str(nibabel.nifti1.intent_codes.niistring[each.intent]).removeprefix("NIFTI_INTENT_")
        if intent in ("POINTSET", "TRIANGLE"):
            found.setdefault(intent, each.data)
        else:
            name = each.meta.get("Name") or intent.lower()
            found[name if name not in found else f"{name}_{k}"] = np.asarray(each.data)
    return found


def read_maps(path: Path, data: bytes) -> dict[str, AnyArray]:
    """The maps (n,) of a GIFTI file, with a surface or without, or of a CIFTI file of labels or scalars.

    A CIFTI file has a map for each surface, "cortex_left NAME", with NaN at vertices that it leaves out.
    """
    nibabel = _nibabel("reading")
    try:
        if form_suffix(path) == ".gii":
            found = _gifti(nibabel, data)
            return {name: values for name, values in found.items() if name not in ("POINTSET", "TRIANGLE")}
        image = nibabel.Cifti2Image.from_bytes(data)
        names, models = (image.header.get_axis(k) for k in range(2))
        found, rows = {}, np.asarray(image.get_fdata())
        for structure, columns, model in models.iter_structures():
            n = models.nvertices.get(structure)
            for name, row in zip(names.name, rows, strict=True) if n else ():
                values = np.full(n, np.nan)
                values[model.vertex] = row[columns]
                found[f"{structure.removeprefix(_CORTEX).lower()} {name}"] = values
        return found
    except Exception as error:  # as for surfaces
        raise MeshError(f"{path}: nibabel finds no maps here ({error}): it is damaged, or another file") from error


def write_maps(path: Path, maps: dict[str, FloatArray]) -> None:
    """Write maps (n,), to GIFTI as shapes; to CIFTI as scalars, under the names that `read_maps` gives them."""
    nibabel = _nibabel("writing")
    if form_suffix(path) == ".gii":
        path.write_bytes(_gifti_image(nibabel, {}, maps))
        return
    surfaces: dict[str, dict[str, FloatArray]] = {}
    for full, values in maps.items():
        structure, _, name = full.partition(" ")
        surfaces.setdefault(structure, {})[name] = values
    names = list(next(iter(surfaces.values())))
    models, columns = None, []
    for structure, found in surfaces.items():
        if list(found) != names:
            raise MeshError(f"the maps of {structure} are {', '.join(found)}, and not {', '.join(names)}")
        rows = np.array(list(found.values()))
        inside = ~np.isnan(rows).all(axis=0)
        try:
            model = nibabel.cifti2.BrainModelAxis.from_mask(inside, structure)
        except ValueError:
            raise MeshError(f"{structure!r} is no part of a brain: call a map 'cortex_left NAME'") from None
        models = model if models is None else models + model
        columns.append(rows[:, inside])
    header = (nibabel.cifti2.ScalarAxis(names), models)
    image = nibabel.Cifti2Image(np.hstack(columns).astype(np.float32), header=header)
    image.nifti_header.set_intent("NIFTI_INTENT_CONNECTIVITY_DENSE_SCALARS")
    path.write_bytes(image.to_bytes())


def _gifti_image(nibabel: Any, surface: dict[str, AnyArray], maps: dict[str, FloatArray]) -> bytes:
    """A file of arrays by what they are meant for, and of maps by name."""
    array = nibabel.gifti.GiftiDataArray
    arrays = [array(values, f"NIFTI_INTENT_{intent}", meta={}) for intent, values in surface.items()]
    arrays += [array(x.astype("<f4"), "NIFTI_INTENT_SHAPE", meta={"Name": name}) for name, x in maps.items()]
    return bytes(nibabel.GiftiImage(darrays=arrays).to_bytes())


def write(path: Path, mesh: Mesh, attributes: dict[str, FloatArray]) -> None:
    """Write triangles; a GIFTI file also holds arrays (n,)."""
    nibabel = _nibabel("writing")
    if form_suffix(path) != ".gii":
        # The stamp is part of the file: without it, nibabel writes the name of the user and the time.
        nibabel.freesurfer.write_geometry(str(path), mesh.V, mesh.F, create_stamp="created by heat_igl")
        return
    wide = [name for name, values in attributes.items() if values.ndim > 1]
    if wide:
        raise MeshError(f"GIFTI holds one number per vertex, and {wide[0]} has several: write them apart")
    surface = {"POINTSET": mesh.V.astype("<f4"), "TRIANGLE": mesh.F.astype("<i4")}
    path.write_bytes(_gifti_image(nibabel, surface, attributes))
