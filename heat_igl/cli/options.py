"""Arguments and options that several commands share, checks of files before any work is done for them, and output."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from heat_igl.errors import MeshError, MissingExtraError, SourceError
from heat_igl.geodesic import DistanceMethod
from heat_igl.heat.steps import Boundary
from heat_igl.io import CURVE_SUFFIXES, MAP_SUFFIXES, complete_file, read_attributes, write_mesh, write_point_cloud
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.plan import Plan
from heat_igl.typing import AnyArray, BoolArray, FloatArray

if TYPE_CHECKING:
    from heat_igl.drawing import Picture

# For distances alone: an array of numpy, and text with a line per vertex.
ARRAY_SUFFIXES = (".npy", ".csv")
_STANDARD_OUTPUT = Path("-")
# The library that writes a format, and the extra that installs it.
_LIBRARIES = {".dxf": "ezdxf io", ".vtu": "meshio io", ".gii": "nibabel io"}

# Name and text of a line, and what JSON holds in place of the text, if anything.
Row = tuple[str, str] | tuple[str, str, Any]
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
SourcesOption = Annotated[
    list[int] | None, typer.Option(metavar="VERTEX", help="Source vertex, counted from 0; repeat for several.")
]
NormalizeOption = Annotated[bool, typer.Option("--normalize", help="Divide by the square root of the area.")]
ToleranceOption = Annotated[float, typer.Option(help="Largest error over the distance; windows are exact.")]


def say(message: str) -> None:
    """Print one line to standard error."""
    print(f"heat-igl: {' '.join(message.split())}", file=sys.stderr)


def plan_row(plan: Plan) -> Row:
    """The line that says which engine measures distance, and why."""
    return "plan", str(plan), {"engine": plan.engine, "tolerance": plan.tolerance, "reason": plan.reason}


def described(path: Path, mesh: Mesh | PointCloud) -> Row:
    """The line that names a mesh or a point cloud, with the numbers of vertices and faces."""
    kind = "tetrahedra" if isinstance(mesh, Mesh) and mesh.is_tetrahedral else "triangles"
    name, points = ("point cloud", "points") if isinstance(mesh, PointCloud) else ("mesh", "vertices")
    counts = {"path": str(path), "n_vertices": mesh.n_vertices, f"n_{kind}": mesh.n_faces}
    return name, f"{path}: {mesh.n_vertices} {points}, {mesh.n_faces} {kind}", counts


def print_rows(rows: Sequence[Row], json_file: Path | None = None) -> None:
    """Print names and texts as two columns; also as JSON to a file, or to standard output in their place.

    JSON has _ for spaces in names, and lists for what stands in several rows, and for the files written.
    """
    width = max(len(row[0]) for row in rows)
    lines = [Text.assemble((f"{name:{width}}", "bold"), f"  {text}\n") for name, text, *_ in rows]
    found: dict[str, list[Any]] = {}
    for name, text, *value in rows:
        found.setdefault(name.replace(" ", "_"), []).append(value[0] if value else text)
    content = {name: values if len(values) > 1 or name == "wrote" else values[0] for name, values in found.items()}
    print_report(content, Text.assemble(*lines), json_file)


def print_report(content: Mapping[str, Any], text: str | Text, json_file: Path | None) -> None:
    """Print a text, and write the content as JSON to a file; if the file is ``-``, print the JSON alone."""
    if json_file is not None:
        as_json = json.dumps(content, indent=1, allow_nan=False) + "\n"
        if json_file == _STANDARD_OUTPUT:
            print(as_json, end="")
            return
        with complete_file(json_file) as temporary:
            temporary.write_bytes(as_json.encode("utf8"))
    # No wrapping, so that pipes receive one line per row.
    Console(highlight=False, soft_wrap=True, markup=False, emoji=False).print(text, end="")


def wrote(*paths: Path | None) -> list[Row]:
    """The lines that name the files that were written."""
    return [("wrote", str(path)) for path in paths if path is not None]


def check_json(json_file: Path | None) -> Path | None:
    """Check that JSON can be written to the value of an option."""
    if json_file is not None and json_file != _STANDARD_OUTPUT:
        check_writable(json_file)
    return json_file


def check_writable(path: Path) -> None:
    """Check that a file can be written to `path`, before it is computed; an OSError if not."""
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a directory: name a file in it")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path} cannot be written: there is no directory {path.parent}")
    try:
        # Permissions do not suffice: the file system may be read-only.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OSError(f"{path} cannot be written: {error.strerror}") from error


def check_file(option: str, path: Path, what: str, suffixes: Sequence[str], library: str = "") -> None:
    """Check that the file named by an option can be written: its format holds `what`, and its library is installed.

    `library` names the library and the extra that installs it. A ValueError, MissingExtraError or OSError if not.
    """
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"{option} {path}: {what} go to {', '.join(suffixes[:-1])} or {suffixes[-1]} files")
    if library:
        MissingExtraError.check(f"a {path.suffix.lower()} file", *library.split())
    check_writable(path)


def check_picture(picture: Path | None) -> Path | None:
    """Check that a picture can be written to the value of an option."""
    if picture is not None:
        from heat_igl.drawing.figure import PICTURE_SUFFIXES

        check_file("--picture", picture, "pictures", PICTURE_SUFFIXES, "matplotlib view")
    return picture


def check_curves(output: Path) -> Path:
    """Check that curves can be written to the value of an option."""
    check_file("--output", output, "curves", CURVE_SUFFIXES, _LIBRARIES.get(output.suffix.lower(), ""))
    return output


def check_output(mesh: Mesh | PointCloud, output: Path | None) -> None:
    """Check that mesh and distance can be written to `output`."""
    if output is None:
        return
    kind = "distances"
    with_mesh: tuple[str, ...] = (".ply", ".vtu", ".gii")
    if isinstance(mesh, PointCloud):
        kind, with_mesh = "points with distances", (".ply",)
    elif mesh.is_tetrahedral:
        kind, with_mesh = "tetrahedra with distances", (".vtu",)
    check_file("--output", output, kind, with_mesh + ARRAY_SUFFIXES, _LIBRARIES.get(output.suffix.lower(), ""))


def write_results(
    mesh: Mesh | PointCloud,
    distance: FloatArray,
    output: Path | None,
    picture: Path | None,
    draw: Callable[[], Picture],
) -> list[Row]:
    """Write a distance, and the picture that `draw` makes of it, to those files that are asked for."""
    drawn = None
    if picture is not None:
        # Drawing comes before writing, since it may still fail.
        with Console(stderr=True).status("drawing"):
            drawn = draw()
    if output is not None:
        _write_distance(output, mesh, distance)
    if drawn is not None and picture is not None:
        drawn.save(picture)
    return wrote(output, picture)


def _write_distance(path: Path, mesh: Mesh | PointCloud, distance: FloatArray) -> None:
    """Write a distance: with the mesh or the points, or alone to one of the `ARRAY_SUFFIXES`."""
    suffix = path.suffix.lower()
    if suffix not in ARRAY_SUFFIXES:
        if isinstance(mesh, PointCloud):
            write_point_cloud(path, mesh, distance=distance)
        else:
            write_mesh(path, mesh, distance=distance)
        return
    with complete_file(path) as temporary, temporary.open("wb") as file:
        if suffix == ".npy":
            np.save(file, distance)
        else:
            lines = [f"{vertex},{value!r}" for vertex, value in enumerate(distance.tolist())]
            file.write("\n".join(["vertex,distance", *lines, ""]).encode("ascii"))


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
    Path, typer.Option("--output", help="OBJ, PLY, VTP, CSV, SVG or DXF file for the curves.", callback=check_curves)
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
MethodOption = Annotated[
    str | None, choice(DistanceMethod, "Default: auto, windows on triangles; heat with one of the options of heat.")
]
TimeStepOption = Annotated[
    float | None, typer.Option(help="Heat: time step in squared mean edge lengths.", callback=positive)
]
BoundaryOption = Annotated[str, choice(Boundary, "Heat: what heat does at the boundary.")]


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
