"""Types of arguments and options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer

from heat_igl.errors import MeshError, SourceError
from heat_igl.geodesic import DistanceMethod
from heat_igl.io import read_attributes
from heat_igl.typing import BoolArray

__all__ = [
    "JsonOption",
    "MeshArgument",
    "MethodOption",
    "PointsOption",
    "RegionOption",
    "ToleranceOption",
    "choice",
    "one_of",
    "position",
    "positive",
    "region_mask",
]

MeshArgument = Annotated[
    Path,
    typer.Argument(
        metavar="MESH",
        help="OFF, OBJ, PLY, STL, MESH, MSH, VTU, GIFTI or FreeSurfer file; or a point cloud: XYZ or NPY, and "
        "with --points PLY or OBJ.",
    ),
]
PointsOption = Annotated[bool, typer.Option("--points", help="The file holds points; faces are not read.")]
RegionOption = Annotated[
    str | None,
    typer.Option(
        metavar="NPY|NAME",
        help="What paths may enter, where this is not 0: an NPY file for vertices or faces, or a vertex attribute.",
    ),
]
JsonOption = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", help="JSON file for the results; with - they are printed as JSON."),
]


def one_of(choices: tuple[str, ...]) -> Callable[[str | None], str | None]:
    """A check that an option is one of `choices`."""

    def check(value: str | None) -> str | None:
        if value is not None and value not in choices:
            raise typer.BadParameter(f"{value!r} is not one of {', '.join(choices)}")
        return value

    return check


def positive(value: float | None) -> float | None:
    """Check that an option is a positive number."""
    if value is not None and not (np.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value:g} is not a positive number")
    return value


def choice(kind: Any, text: str) -> Any:
    """An option that takes one of the values of a Literal type; `text` is the help."""
    choices = get_args(kind)
    return typer.Option(help=text, metavar="|".join(choices), callback=one_of(choices))


def position(text: str, name: str = "--at") -> list[float]:
    """The three coordinates in the value of an option."""
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        raise SourceError(
            f"{name} {text}: three numbers separated by commas are expected, such as 0.5,0,1.25"
        ) from None
    return [x, y, z]


MethodOption = Annotated[
    str | None,
    choice(DistanceMethod, "Default: auto, windows on triangles; heat with one of the options of heat."),
]
ToleranceOption = Annotated[float, typer.Option(help="Largest error over the distance, of windows; 0 is exact.")]


def region_mask(mesh: Path, region: str) -> BoolArray:
    """The mask that `RegionOption` names: of an NPY file, or of a vertex attribute in the file of the mesh."""
    if Path(region).suffix == ".npy":
        try:
            values = np.load(region, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise MeshError(f"--region {region}: {error or 'no NPY file'}") from None
    else:
        attributes = read_attributes(mesh)
        if region not in attributes:
            known = ", ".join(attributes) or "none"
            raise MeshError(f"--region {region}: no NPY file, and no vertex attribute of {mesh} (it has {known})")
        values = attributes[region]
    if values.dtype.kind not in "biuf":
        raise MeshError(f"--region {region} holds {values.dtype}: numbers or bools are expected")
    return np.asarray(np.nan_to_num(values) != 0)
