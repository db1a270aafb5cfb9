"""Files of curves: written as lines of OBJ, PLY and VTP, CSV, SVG and DXF, and read from OBJ."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError, real_numbers, shown
from heat_igl.io.contents import Text, format_rows, integers
from heat_igl.io.storage import replacing
from heat_igl.mesh import Mesh, MeshLike, NestedCurves, as_simplices, flat_curves
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# A mesh is flat if all vertices are at most this far from a plane, as a fraction of the extent.
_FLAT = 1e-9
# Width of a line in an SVG file, as a fraction of the larger side of the drawing.
_LINE = 1 / 500

Curves = NestedCurves | Mapping[str, NestedCurves]
_Lines = dict[str, list[tuple[FloatArray, bool]]]


def write_curves(
    path: str | os.PathLike[str], mesh: MeshLike, curves: Curves | None = None, *, projection: ArrayLike | None = None
) -> None:
    """Write curves on a mesh to a file.

    Parameters
    ----------
    path : path-like
        The extension selects the format: .obj (a polyline ``l`` for each curve), .ply (edges), .vtp (lines), .csv (a
        row for each point, a closed curve ends with its first), .svg (a drawing in the plane) or .dxf (polylines in
        space). An existing file is replaced only when the new one is complete.
    mesh : mesh
        Triangles on which the curves lie. It may be left out if the curves know it, as those of this package do:
        ``write_curves(path, curves)``.
    curves : SurfaceCurve, sequence of such of any depth, or mapping of str to such, optional
        For instance paths, or isolines as `isolines` returns them, a list for each level. The keys of a mapping become
        groups (OBJ, SVG), a column (CSV) or layers (DXF).
    projection : (2, 3) array_like, optional
        For .svg: the matrix that maps a position to x and y, with y upwards. By default the mesh must be flat and is
        drawn in the plane of the mesh with true lengths; if z is constant, x and y are used unchanged.

    Raises
    ------
    ValueError
        If the extension is unknown, the projection is invalid, an .svg file needs one because the mesh is not flat, or
        there is no mesh.
    MeshError
        If the file cannot be written.
    TypeError
        If `curves` holds anything else.
    SourceError
        If a curve lies on faces outside the mesh.
    MissingExtraError
        For .dxf without ezdxf.

    Notes
    -----
    Coordinates are in the unit of the mesh and in double precision. SVG files contain -y, since y points downwards in
    SVG, and the width of a line is 1/500 of the drawing.

    Examples
    --------
    >>> import heat_igl
    >>> from pathlib import Path
    >>> mesh = heat_igl.shapes.disk(12)
    >>> lines = heat_igl.isolines(mesh, heat_igl.geodesic_distance(mesh, 0), [0.25, 0.5, 0.75])
    >>> heat_igl.write_curves("lines.svg", mesh, lines)
    >>> Path("lines.svg").read_text().count("<polygon")  # closed, one for each level
    3
    """
    if curves is None:
        curves = mesh
        named = flat_curves(list(curves.values()) if isinstance(curves, Mapping) else curves)
        if not named or named[0].mesh is None:
            raise ValueError("there is no mesh, which these curves do not know: write_curves(path, mesh, curves)")
        mesh = named[0].mesh
    mesh = as_simplices(mesh)
    if not isinstance(path, (str, os.PathLike)):
        raise ValueError(f"path must be a string or a path, not {shown(path)}")
    target = Path(path)
    write = _FORMATS.get(target.suffix.lower())
    if write is None:
        raise ValueError(f"{target}: curves go to {', '.join(CURVE_SUFFIXES)} files, not '{target.suffix}'")
    if projection is not None and write is not write_svg:
        raise ValueError(f"{target}: projection is for .svg files; this format holds positions in space")
    groups = curves if isinstance(curves, Mapping) else {"": curves}
    lines = {
        name: [
            (curve.positions(mesh), curve.is_closed)
            for curve in flat_curves(group, f"curves[{name!r}]" if name else "curves")
        ]
        for name, group in groups.items()
    }
    if write is write_svg:
        matrix = _plane(mesh, target) if projection is None else real_numbers("projection", projection)
        if matrix.shape != (2, 3) or not np.isfinite(matrix).all():
            raise ValueError(f"projection must be a finite array of shape (2, 3), not {shown(projection)}")
        lines = {name: [(P @ matrix.T, closed) for P, closed in group] for name, group in lines.items()}
    with replacing(target) as temporary:
        write(temporary, lines)


def _plane(mesh: Mesh, path: Path) -> FloatArray:
    """Directions of x and y in the plane of a flat mesh, (2, 3)."""
    axes, off, extent = flatness(mesh)
    if off > _FLAT * extent:
        raise ValueError(
            f"{path}: a drawing needs a flat mesh, and this one reaches {off:.3g} off its plane: pass a projection, "
            "as projection=[[1, 0, 0], [0, 1, 0]] along z, or write .obj or .dxf"
        )
    return np.eye(2, 3) if np.ptp(mesh.V[mesh.referenced, 2]) <= _FLAT * extent else axes[:2]


def flatness(mesh: Mesh) -> tuple[FloatArray, float, float]:
    """The principal axes (3, 3) of the vertices, how far one is off the plane of the first two, and their extent."""
    used = mesh.V[mesh.referenced]
    centred = used - used.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    return axes, float(np.abs(centred @ axes[2]).max()), float(np.linalg.norm(np.ptp(used, axis=0)))


def is_flat(mesh: Mesh) -> bool:
    """Whether all vertices that faces use lie in one plane."""
    _, off, extent = flatness(mesh)
    return off <= _FLAT * extent


def _numbered(lines: _Lines) -> Iterator[tuple[str, FloatArray, IntArray]]:
    """Of each curve the group, the points (k, 3), and their numbers among all; closed curves end as they begin."""
    n = 0
    for name, group in lines.items():
        for P, is_closed in group:
            k = len(P) - is_closed
            yield name, P[:k], n + np.arange(len(P)) % k
            n += k


def _write_obj(path: Path, lines: _Lines) -> None:
    text, last = ["# curves, a polyline each\n"], ""
    for name, P, numbers in _numbered(lines):
        if name != last:
            text.append(f"g {name.replace(' ', '_')}\n")
            last = name
        text.append(format_rows("v %r %r %r\n", P) + f"l {' '.join(map(str, (numbers + 1).tolist()))}\n")
    path.write_text("".join(text), encoding="utf8")


def _write_csv(path: Path, lines: _Lines) -> None:
    text = ["group,curve,x,y,z\n"]
    for i, (name, P, numbers) in enumerate(_numbered(lines)):
        group = '"' + name.replace('"', '""') + '"' if name else ""
        closed = P[numbers - numbers[0]]  # with the first point again
        text += [f"{group},{i},{x!r},{y!r},{z!r}\n" for x, y, z in closed.tolist()]
    path.write_text("".join(text), encoding="utf8")


def _write_ply(path: Path, lines: _Lines) -> None:
    curves = list(_numbered(lines))
    P = np.concatenate([P for _, P, _ in curves] or [np.empty((0, 3))])
    edges = np.concatenate([np.stack([n[:-1], n[1:]], axis=1) for _, _, n in curves] or [np.empty((0, 2), np.int64)])
    columns = "".join(f"property double {axis}\n" for axis in "xyz")
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(P)}\n{columns}element edge {len(edges)}\nproperty int vertex1\n"
        "property int vertex2\nend_header\n" + format_rows("%r %r %r\n", P) + format_rows("%d %d\n", edges),
        encoding="ascii",
    )


def _write_vtp(path: Path, lines: _Lines) -> None:
    curves = list(_numbered(lines))
    n = sum(len(P) for _, P, _ in curves)
    arrays = {
        "points": ("Float64", 3, "".join(format_rows("%r %r %r\n", P) for _, P, _ in curves)),
        "connectivity": ("Int64", 1, " ".join(str(i) for _, _, numbers in curves for i in numbers.tolist())),
        "offsets": ("Int64", 1, " ".join(map(str, np.cumsum([len(numbers) for _, _, numbers in curves]).tolist()))),
    }
    points, *cells = (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">\n{data}\n</DataArray>\n'
        for name, (kind, width, data) in arrays.items()
    )
    path.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="0.1"><PolyData>\n'
        f'<Piece NumberOfPoints="{n}" NumberOfLines="{len(curves)}">\n<Points>\n{points}</Points>\n'
        f"<Lines>\n{''.join(cells)}</Lines>\n</Piece>\n</PolyData></VTKFile>\n",
        encoding="ascii",
    )


def write_svg(path: Path, lines: _Lines, dotted: str | None = None) -> None:
    """Write lines in the plane, (k, 2) each and whether it is closed, in groups by name; one group may be dotted."""
    from xml.sax.saxutils import quoteattr  # imported here, since it loads a web client

    points = np.concatenate([P for group in lines.values() for P, _ in group] or [np.zeros((1, 2))])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 2 * _LINE * max(float((high - low).max()), np.finfo(float).tiny)
    x, y = low - margin
    width, height = high - low + 2 * margin
    text = [
        '<?xml version="1.0" encoding="UTF-8"?>\n',
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x:.17g} {-y - height:.17g} {width:.17g} {height:.17g}">\n',
        f'<g fill="none" stroke="black" stroke-linejoin="round" stroke-width="{margin / 2:.6g}">\n',
    ]
    for name, group in lines.items():
        style = f' stroke-dasharray="{margin / 2:.6g} {margin:.6g}"' if name and name == dotted else ""
        text.append(f"<g id={quoteattr(name)}{style}>\n" if name else "<g>\n")
        for P, is_closed in group:
            drawn = P[:-1] if is_closed else P
            element = "polygon" if is_closed else "polyline"
            text.append(f'<{element} points="{" ".join(f"{x!r},{-y!r}" for x, y in drawn.tolist())}"/>\n')
        text.append("</g>\n")
    text.append("</g>\n</svg>\n")
    path.write_text("".join(text), encoding="utf8")


def _write_dxf(path: Path, lines: _Lines) -> None:
    with MissingExtraError.guard("a .dxf file", "ezdxf", "io"):
        from ezdxf.filemanagement import new
    document = new("R2010")
    space = document.modelspace()
    for name, group in lines.items():
        layer = name or "0"
        if layer not in document.layers:
            document.layers.add(layer)
        for P, is_closed in group:
            space.add_polyline3d((P[:-1] if is_closed else P).tolist(), close=is_closed, dxfattribs={"layer": layer})
    document.saveas(path)


_FORMATS: dict[str, Callable[[Path, _Lines], None]] = {
    ".obj": _write_obj,
    ".ply": _write_ply,
    ".vtp": _write_vtp,
    ".csv": _write_csv,
    ".svg": write_svg,
    ".dxf": _write_dxf,
}
CURVE_SUFFIXES = tuple(_FORMATS)


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
    text = Text(source, source.read_bytes(), comment="#", continued=True)
    word = text.words(2)
    lines = np.flatnonzero(word == b"l")
    if not len(lines):
        raise MeshError(f"{source} holds no curve: a record that starts with l is expected, as write_curves writes it")
    P = text.positions(np.flatnonzero(word == b"v"), skip=1)
    numbers, first = text.numbers(lines, skip=1, up_to_slash=True)
    owner = np.repeat(lines, text.count[lines] - 1)
    indices = integers(numbers, lambda i: text.where(owner[i]))
    wrong = (indices < 1) | (indices > len(P))
    text.refuse(owner, wrong, f"no such vertex is among the {len(P)} in the file ({int(wrong.sum())} are missing)")
    found = []
    for line, numbered in zip(lines.tolist(), np.split(indices, first[1:]), strict=True):
        closed = len(numbered) > 2 and bool(numbered[0] == numbered[-1])
        kept = numbered[: len(numbered) - closed]
        if len(kept) < 2:
            raise text.error(line, "a curve needs two vertices or more")
        found.append(Polyline(P[kept - 1], closed))
    return found
