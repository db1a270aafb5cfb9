"""Types of arguments and options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
import typer

from heat_igl.cli.output import check_curves, check_json, check_picture
from heat_igl.errors import MeshError, SourceError
from heat_igl.geodesic import DistanceMethod
from heat_igl.io import MAP_SUFFIXES, read_attributes
from heat_igl.steps import Boundary
from heat_igl.typing import AnyArray, BoolArray

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
        metavar="FILE|NAME",
        help="What paths may enter, where this is not 0: an NPY, GIFTI or CIFTI file, or a vertex attribute.",
    ),
]
JsonOption = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="JSON file for the results; with - they are printed as JSON.",
        callback=check_json,
    ),
]
PictureOption = Annotated[
    Path | None, typer.Option("--picture", help="PNG, PDF or SVG file for a picture.", callback=check_picture)
]
CurveOutput = Annotated[
    Path,
    typer.Option("--output", help="OBJ, PLY, VTP, CSV, SVG or DXF file for the curves.", callback=check_curves),
]
SourcesOption = Annotated[
    list[int] | None, typer.Option(metavar="VERTEX", help="Source vertex, counted from 0; repeat for several.")
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


DtypeOption = Annotated[str, typer.Option(help="Of the distances.", callback=one_of(("float16", "float32", "float64")))]
NormalizeOption = Annotated[bool, typer.Option("--normalize", help="Divide by the square root of the area.")]
MethodOption = Annotated[
    str | None,
    choice(DistanceMethod, "Default: auto, windows on triangles; heat with one of the options of heat."),
]
TimeStepOption = Annotated[
    float | None, typer.Option(help="Heat: time step in squared mean edge lengths.", callback=positive)
]
BoundaryOption = Annotated[str, choice(Boundary, "Heat: what heat does at the boundary.")]
ToleranceOption = Annotated[float, typer.Option(help="Largest error over the distance; windows are exact.")]


def values_of(mesh: Path, option: str, text: str) -> AnyArray:
    """Values for vertices that an option names, in an NPY file, a map file or an attribute of the mesh.

    A map of a GIFTI or CIFTI file is named by the beginning of its name, as in ``FILE::cortex_left``.
    """
    file, _, name = text.partition("::")
    suffix = Path(file).suffix.lower()
    if suffix == ".npy":
        try:
            values = np.load(file, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise MeshError(f"{option} {text}: {error or 'no NPY file'}") from None
    else:
        is_file = suffix in MAP_SUFFIXES
        maps = read_attributes(file if is_file else mesh)
        found = [each for each in maps if (each.startswith(name) if is_file else each == text)]
        if len(found) != 1:
            where = f"name a map, as in {file}::NAME" if is_file else f"no NPY file, and no vertex attribute of {mesh}"
            raise MeshError(f"{option} {text}: {where} (it has {', '.join(maps) or 'none'})")
        values = maps[found[0]]
    if values.dtype.kind not in "biuf":
        raise MeshError(f"{option} {text} holds {values.dtype}: numbers or bools are expected")
    return np.asarray(values)


def region_mask(mesh: Path, region: str) -> BoolArray:
    """The mask that `RegionOption` names: where its values are not 0."""
    return np.asarray(np.nan_to_num(values_of(mesh, "--region", region)) != 0)
