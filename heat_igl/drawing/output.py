"""The result of drawing: a picture for notebooks and files."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from heat_igl.io import complete_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE_SUFFIXES = (".png", ".pdf", ".svg")
PAGE_SUFFIXES = (".html", ".htm")
DPI = 400  # resolution of raster output: 1260 pixels for 8 cm


@dataclass(frozen=True, eq=False)
class Picture:
    """A finished picture, which notebooks display.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        The figure, which may be changed. pyplot does not manage it.
    """

    figure: Figure

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG, PDF or SVG file, according to the suffix. An existing file is replaced only by a complete one.

        Raises
        ------
        ValueError
            If the suffix is not .png, .pdf or .svg.
        OSError
            If the file cannot be written.
        """
        target = Path(path)
        suffix = target.suffix.lower()
        if suffix not in PICTURE_SUFFIXES:
            raise ValueError(f"{target} must end in one of {', '.join(PICTURE_SUFFIXES)} to be a picture")
        with complete_file(target) as temporary:
            temporary.write_bytes(self._rendered(suffix[1:]))

    def _rendered(self, form: str, dpi: float = DPI) -> bytes:
        import matplotlib

        buffer = io.BytesIO()
        # Without a date and random names, the same input gives the same bytes.
        metadata = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[form]
        with matplotlib.rc_context({"svg.hashsalt": "heat_igl"}):
            self.figure.savefig(buffer, format=form, dpi=dpi, metadata=metadata)
        return buffer.getvalue()

    def _repr_png_(self) -> bytes:
        return self._rendered("png", dpi=DPI / 2)
