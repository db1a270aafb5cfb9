"""A finished picture: shown by notebooks, written as a file that is complete or not there."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from heat_igl.io import complete_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["DPI", "PAGE_SUFFIXES", "PICTURE_SUFFIXES", "Picture"]

PICTURE_SUFFIXES = (".png", ".pdf", ".svg")
PAGE_SUFFIXES = (".html", ".htm")
DPI = 400  # of raster output: 8 cm become 1260 pixels


@dataclass(frozen=True, eq=False)
class Picture:
    """A finished picture; notebooks show it.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        For changes of one's own; independent of pyplot.
    """

    figure: Figure

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write PNG, PDF or SVG, by the suffix of `path`; an existing file is replaced only by a complete one.

        Raises
        ------
        ValueError
            If the suffix is another.
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
        buffer = io.BytesIO()
        # No date inside, so that the same input gives the same bytes.
        metadata = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[form]
        self.figure.savefig(buffer, format=form, dpi=dpi, metadata=metadata)
        return buffer.getvalue()

    def _repr_png_(self) -> bytes:
        return self._rendered("png", dpi=DPI / 2)
