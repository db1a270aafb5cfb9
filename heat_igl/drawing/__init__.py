"""Pictures and interactive pages of a distance on a surface."""

from heat_igl.drawing.output import PAGE_SUFFIXES, PICTURE_SUFFIXES
from heat_igl.drawing.plots import (
    Page,
    Picture,
    page,
    picture,
    plot,
    plot_field,
    plot_labels,
    write_html,
    write_line_drawing,
)

__all__ = [
    "PAGE_SUFFIXES",
    "PICTURE_SUFFIXES",
    "Page",
    "Picture",
    "page",
    "picture",
    "plot",
    "plot_field",
    "plot_labels",
    "write_html",
    "write_line_drawing",
]
