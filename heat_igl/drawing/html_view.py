"""An interactive view of a distance as one HTML file, without a server, network access or libraries.

The page draws the surface with WebGL. After a click on a new source it computes the distance by the algorithm of
`heat_igl.unfolding.sweeping`, implemented in JavaScript in page/sweep.js. The extra ``view`` is needed for the colours.
"""

from __future__ import annotations

import base64
import html
import json
import os
import zlib
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any, get_args

import numpy as np

from heat_igl.drawing.output import PAGE_SUFFIXES
from heat_igl.drawing.scene import (
    DISTANCE_COLOURS,
    DISTANCE_LABEL,
    LINE_INK,
    STRIPE_INK,
    Style,
    check_style,
    colours,
    scene,
)
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.io import complete_file
from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.sources import Sources
from heat_igl.typing import AnyArray, ArrayLike

__all__ = ["Page", "page"]

_AS_GIVEN = "Distance as given."
_FRAME = (
    '<iframe srcdoc="{}" sandbox="allow-scripts" style="width: 100%; height: 520px; border: 1px solid #ccc"></iframe>'
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
    method: str = _AS_GIVEN,
) -> Page:
    """Make an interactive page that shows a distance on a surface.

    Dragging rotates the surface, the wheel or a pinch zooms, and dragging with Shift translates. The page displays
    vertex, position and distance under the pointer. A click makes the vertex the source; the page then computes the
    distance by planar unfolding on the intrinsic Delaunay triangulation. The result agrees with ``refine="sweep"`` to
    1e-3, on average to 1e-5. For tetrahedra the page shows the boundary, and a click only displays the values, since
    shortest paths run through the interior.

    Parameters
    ----------
    mesh, distance, sources, spacing, style, view, up, colormap, label
        As for `heat_igl.drawing.plot`.
    title : str
        Title of the page.
    method : str
        Description of the method behind `distance`, displayed until a click replaces that distance.

    Returns
    -------
    Page
        Displayed by notebooks; `Page.save` writes it to a file. The size is 35 kB plus 50 to 55 bytes per vertex. It
        needs a browser with WebGL 2 and DecompressionStream (2023 or later).

    Raises
    ------
    ValueError, SourceError, MissingExtraError
        As for `heat_igl.drawing.plot`.
    """
    mesh = as_simplices(mesh)
    check_style(style)
    seen = scene(mesh, distance, sources=sources, spacing=spacing, view=view, up=up)
    table = colours(colormap)(np.linspace(0, 1, 256))
    turned = seen.turned[seen.used, :2]
    low, high = turned.min(axis=0), turned.max(axis=0)
    arrays: dict[str, AnyArray] = {
        "positions": seen.V.astype("<f4"),
        "faces": seen.F.astype("<i4"),
        "distance": (seen.values / seen.unit).astype("<f4"),
    }
    meta: dict[str, Any] = {
        "unit": seen.unit,
        "centre": seen.centre.tolist(),
        "turn": seen.turn.tolist(),
        "middle": ((low + high) / 2).tolist(),
        "extent": np.maximum(high - low, 1e-3).tolist(),
        "sources": seen.vertices.tolist(),
        "dots": np.concatenate([seen.dots, seen.lines.reshape(-1, 3)]).round(7).ravel().tolist(),
        "spacing": spacing,
        "style": str(get_args(Style).index(style)),
        "colours": np.rint(255 * table[:, :3]).astype(int).tolist(),
        "lineInk": LINE_INK,
        "stripeInk": STRIPE_INK,
        "label": label,
        "method": method,
    }
    if not mesh.is_tetrahedral:
        _add_sweep(arrays, meta, mesh)
    meta["arrays"] = [
        (name, "float" if array.dtype.kind == "f" else "int", array.size) for name, array in arrays.items()
    ]
    folder = files("heat_igl.drawing") / "page"
    parts = {name: (folder / name).read_text(encoding="utf8") for name in ("page.html", "sweep.js", "view.js")}
    return Page(
        Template(parts["page.html"]).substitute(
            title=html.escape(title),
            meta=_in_script(meta),
            data=base64.b64encode(_packed(list(arrays.values()))).decode(),
            sweep=parts["sweep.js"],
            view=parts["view.js"],
        )
    )


def _add_sweep(arrays: dict[str, AnyArray], meta: dict[str, Any], mesh: Mesh) -> None:
    """Add the input of page/sweep.js: corners and edge lengths of the intrinsic Delaunay triangulation."""
    triangulation = intrinsic_delaunay(intrinsic_triangulation(mesh))
    # Unflipped faces become zeros, which compress well.
    same = triangulation.F.shape == mesh.F.shape
    arrays["sweepFaces"] = (triangulation.F - mesh.F if same else triangulation.F).astype("<i4")
    arrays["lengths"] = (triangulation.l / meta["unit"]).astype("<f4")
    meta["sweepFacesAreDifferences"] = same


def _in_script(value: object) -> str:
    """`value` as JSON without the character "<", which could end the surrounding script element."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")


def _packed(arrays: list[AnyArray]) -> bytes:
    """The arrays, compressed. Bytes are grouped by significance: adjacent signs and exponents compress best."""
    planes = [np.ascontiguousarray(array).view(np.uint8).reshape(-1, 4).T.tobytes() for array in arrays]
    return zlib.compress(b"".join(planes), 9)
