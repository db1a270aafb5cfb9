"""Formulas as MathML, which browsers draw themselves: pages need no network and no scripts."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging

logger = logging.getLogger(__name__)
# Environments inside display mode under the names that the converter knows.
_ENVIRONMENTS = {"aligned": "align*", "split": "align*", "gathered": "align*"}


def mathml(latex: str, display: str) -> str:
    """The formula as a ``math`` element."""
    from latex2mathml.converter import convert

    text = re.sub(
        r"\\(begin|end)\{(\w+)\}",
        lambda found: f"\\{found[1]}{{{_ENVIRONMENTS.get(found[2], found[2])}}}",
        latex.strip(),
    )
    found = str(convert(text, display=display))
    unknown = re.findall(r"<mi>(\\[^<]*)</mi>", found)
    if unknown:
        logger.warning("formula %r holds %s, which cannot be drawn", latex, ", ".join(unknown))
    return found


def _visit_inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def _visit_block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math-block">{mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_html_math_renderer("mathml", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True}
