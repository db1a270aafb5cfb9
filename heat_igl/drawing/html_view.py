"""An interactive view of a distance as one HTML file, without a server, network access or libraries.

The page draws the surface with WebGL. After a click on a new source it computes the distance by the algorithm of
`heat_igl.sweep`, implemented in JavaScript in page/sweep.js, and the logarithmic map with it. The extra ``view`` is
needed for the colours.
"""

from __future__ import annotations

import base64
import html
import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, get_args

import numpy as np

from heat_igl.drawing.figure import PAGE_SUFFIXES
from heat_igl.drawing.scene import DISTANCE_COLOURS, DISTANCE_LABEL, LINE_INK, STRIPE_INK, Style, colours, scene
from heat_igl.errors import raise_at_first, require_choice
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.io import complete_file
from heat_igl.mesh import MeshLike, PointCloud, as_mesh, as_simplices
from heat_igl.sources import Sources
from heat_igl.typing import AnyArray, ArrayLike

_LOG_MAP = "log map"
_FRAME = (
    '<iframe srcdoc="{}" sandbox="allow-scripts allow-downloads" '
    'style="width: 100%; height: 520px; border: 1px solid #ccc"></iframe>'
)


@dataclass(frozen=True, eq=False)
class Page:
    """An interactive view, which notebooks display.

    Attributes
    ----------
    html : str
        The HTML document.
    """

    html: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page to a file. An existing file is replaced only when the new one is complete.

        Raises
        ------
        ValueError
            If `path` does not end in .html or .htm.
        OSError
            If the file cannot be written.
        """
        target = Path(path)
        if target.suffix.lower() not in PAGE_SUFFIXES:
            raise ValueError(f"{target} must end in {' or '.join(PAGE_SUFFIXES)} to be a page")
        with complete_file(target) as temporary:
            temporary.write_bytes(self.html.encode("utf8"))

    def _repr_html_(self) -> str:
        return _FRAME.format(html.escape(self.html, quote=True))


def page(
    mesh: MeshLike,
    distance: ArrayLike,
    *,
    sources: Sources | None = None,
    spacing: float | None = None,
    style: Style = "lines",
    view: tuple[float, float] | None = None,
    up: str = "y",
    colormap: str = DISTANCE_COLOURS,
    label: str = DISTANCE_LABEL,
    title: str = "Geodesic distance",
    method: str = "Distance as given.",
    fields: Mapping[str, ArrayLike] | None = None,
    beside: str | None = None,
    directions: bool = False,
) -> Page:
    """Make an interactive page that shows a distance on a surface or on points, and other fields beside it.

    Dragging rotates the surface, the wheel or a pinch zooms, and dragging with Shift translates. The page displays
    vertex, position and distance under the pointer. A click makes the vertex the source; the page then computes the
    distance by planar unfolding on the intrinsic Delaunay triangulation. The result agrees with ``method="sweep"`` to
    1e-3, on average to 1e-5. The logarithmic map of the source is drawn as a checkerboard; it is computed in the page,
    too. "directions" draws needles along the gradient, and "points" draws vertices as discs, as the points of a cloud
    are from the beginning. "save" downloads the page with the sources and the view as they are. For tetrahedra the page
    shows the boundary, and a click only displays the values, since shortest paths run through the interior.

    Parameters
    ----------
    mesh, distance, sources, spacing, style, view, up, colormap, label
        As for `heat_igl.drawing.plot`; also a `PointCloud`.
    title : str
        Title of the page.
    method : str
        Description of the method behind `distance`, displayed until a click replaces that distance.
    fields : dict of str to (n,) or (n, 2) array_like, optional
        More fields to choose from, by the names that the page shows: values at the vertices, such as the exact distance
        or a signed one, with white for 0 if both signs occur; or vectors of a logarithmic map, drawn as a checkerboard.
        They do not follow clicks: after one, they are drawn with the sources that they were given with.
    beside : str, optional
        The field that is drawn to the right of the distance at first: a name in `fields`, or "log map" if `sources` are
        vertices.
    directions : bool
        Whether needles are drawn at first.

    Returns
    -------
    Page
        Displayed by notebooks; `Page.save` writes it to a file. The size is 40 kB plus 50 to 55 bytes per vertex. It
        needs a browser with WebGL 2 and DecompressionStream (2023 or later).

    Raises
    ------
    ValueError
        If fields have another shape, or there is no field `beside`. Other errors are those of `heat_igl.drawing.plot`.
    """
    is_cloud = isinstance(given := as_mesh(mesh), PointCloud)
    mesh = as_simplices(given)
    require_choice("style", style, get_args(Style))
    seen = scene(mesh, distance, sources=sources, spacing=spacing, view=view, up=up)
    middle, extent = seen.box
    arrays: dict[str, AnyArray] = {
        "positions": seen.V.astype("<f4"),
        "faces": seen.F.astype("<i4"),
        "distance": (seen.values / seen.unit).astype("<f4"),
    }
    meta: dict[str, Any] = {
        "unit": seen.unit,
        "centre": seen.centre.tolist(),
        "turn": seen.turn.tolist(),
        "middle": middle.tolist(),
        "extent": extent.tolist(),
        "sources": seen.vertices.tolist(),
        "dots": np.concatenate([seen.dots, seen.lines.reshape(-1, 3)]).round(7).ravel().tolist(),
        "spacing": spacing,
        "style": str(get_args(Style).index(style)),
        "colours": _table(colormap),
        "signedColours": _table("RdBu_r", is_trimmed=False),
        "lineInk": LINE_INK,
        "stripeInk": STRIPE_INK,
        "label": label,
        "method": method,
    }
    if not mesh.is_tetrahedral:
        # The input of page/sweep.js. Unflipped faces become zeros, which compress well.
        triangulation = intrinsic_delaunay(intrinsic_triangulation(mesh))
        same = triangulation.F.shape == mesh.F.shape
        arrays["sweepFaces"] = (triangulation.F - mesh.F if same else triangulation.F).astype("<i4")
        arrays["lengths"] = (triangulation.l / seen.unit).astype("<f4")
        meta["sweepFacesAreDifferences"] = same
    _add_fields(arrays, meta, fields or {}, mesh.n_vertices)
    meta["begin"] = {"field": "distance", "beside": beside or "", "directions": directions, "points": is_cloud}
    choices = [name for name, _ in meta["fields"]]
    if not mesh.is_tetrahedral and len(seen.vertices):
        choices.append(_LOG_MAP)
    if beside is not None and beside not in choices:
        raise ValueError(f"beside must be one of {', '.join(map(repr, choices)) or 'the fields'}, not {beside!r}")
    return Page(_document(title, meta, arrays))


def _add_fields(arrays: dict[str, AnyArray], meta: dict[str, Any], fields: Mapping[str, ArrayLike], n: int) -> None:
    """Add further fields: the name of each, and how many numbers it has at a vertex."""
    meta["fields"] = []
    if not isinstance(fields, Mapping):
        raise ValueError(f"fields must be a dictionary of names and values, not {type(fields).__name__}")
    for name, given in fields.items():
        if name in ("distance", _LOG_MAP, ""):
            raise ValueError(f"fields cannot have the name {name!r}, which the page uses itself")
        values = np.asarray(given, np.float64)
        if values.shape not in ((n,), (n, 2)):
            raise ValueError(f"fields[{name!r}] must have shape ({n},) or ({n}, 2), not {values.shape}")
        raise_at_first(np.isnan(values), f"fields[{name!r}]", values, "must be a number or inf")
        arrays[f"field {name}"] = (values / meta["unit"]).astype("<f4").ravel()
        meta["fields"].append([name, values.ndim])


def _table(colormap: str, **options: bool) -> list[list[int]]:
    """Red, green and blue up to 255 of 256 values from 0 to 1."""
    rgb = colours(colormap, **options)(np.linspace(0, 1, 256))[:, :3]
    found: list[list[int]] = np.rint(255 * rgb).astype(int).tolist()
    return found


def _document(title: str, meta: dict[str, Any], arrays: dict[str, AnyArray]) -> str:
    """The template of a page with its scripts, and with `arrays`, of which the page learns from `meta`."""
    kinds = {"f": "float", "i": "int"}
    meta["arrays"] = [(name, kinds[array.dtype.kind], array.size) for name, array in arrays.items()]
    # Bytes are grouped by significance: adjacent signs and exponents compress best.
    planes = [np.ascontiguousarray(array).view(np.uint8).reshape(-1, 4).T.tobytes() for array in arrays.values()]
    folder = files("heat_igl.drawing") / "page"
    names = sorted(file.name for file in folder.iterdir() if file.name.endswith(".js"))
    return Template((folder / "page.html").read_text(encoding="utf8")).substitute(
        title=html.escape(title),
        # Without the character "<", which could end the surrounding script element.
        meta=json.dumps(meta, allow_nan=False).replace("<", "\\u003c"),
        data=base64.b64encode(zlib.compress(b"".join(planes), 9)).decode(),
        # One script in the end: view.js, the last by name, uses what the others define.
        scripts="\n".join((folder / name).read_text(encoding="utf8") for name in names),
    )
