"""The documentation site: ``sphinx-build -W docs docs/_build``, with the extras ``docs`` and ``all``."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
import types
from pathlib import Path

import heat_igl

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = "heat_igl"
author = "the heat_igl developers"
version = release = heat_igl.__version__
html_title = f"heat_igl {release}"

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinxcontrib.bibtex",
]
html_theme = "furo"
html_extra_path = ["_parts/pages"]  # interactive pages, copied unchanged
templates_path = ["_templates"]
exclude_patterns = ["_build", "_parts"]
nitpicky = False
default_role = "py:obj"  # for names between single backticks in docstrings

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
bibtex_bibfiles = ["literature.bib"]
bibtex_default_style = "plain"
bibtex_reference_style = "author_year"
numpydoc_show_class_members = False
autodoc_typehints = "none"  # the docstrings give types and shapes
autosummary_generate = True
autosummary_generate_overwrite = True


def _public_names() -> str:
    """One line per public name of the package: a link and the summary."""
    lines = []
    for name in heat_igl.__all__:
        thing = getattr(heat_igl, name)
        target = thing.__name__ if inspect.ismodule(thing) else f"{thing.__module__}.{thing.__qualname__}"
        summary = (inspect.getdoc(thing) or "").split("\n\n")[0].replace("\n", " ")
        # Literals of reStructuredText become literals of Markdown.
        lines.append(f"{{py:obj}}`heat_igl.{name} <{target}>`\n: {summary.replace('``', '`')}\n")
    return "\n".join(lines)


def _write_parts(*_: object) -> None:
    """Write the list of public names and the pictures of the gallery."""
    parts = HERE / "_parts"
    parts.mkdir(exist_ok=True)
    (parts / "names.md").write_text(_public_names(), encoding="utf8")
    importlib.import_module("gallery").main(["--out", str(parts)])


def _escape_bars(app, what, name, obj, options, lines) -> None:
    """In docstrings |x| is a length, not a substitution."""
    for i, line in enumerate(lines):
        parts = re.split(r"(``.*?``)", line)
        lines[i] = "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def _skip_aliases(app, what, name, obj, skip, options) -> bool | None:
    """A generic alias such as tuple[int, ...] looks like a class and has no signature."""
    return True if isinstance(obj, types.GenericAlias) else None


def _resolve_room_names(app, env, node, contnode):
    """Link a name that a package hands on, such as heat_igl.io.read_mesh, to the module that defines it."""
    module, _, name = node.get("reftarget", "").rpartition(".")
    try:
        found = getattr(importlib.import_module(module), name)
        target = f"{found.__module__}.{found.__qualname__}"
    except (ImportError, AttributeError, ValueError):
        return None
    python = env.get_domain("py")
    return python.resolve_xref(env, node["refdoc"], app.builder, "obj", target, node, contnode)


def setup(app) -> None:
    app.connect("missing-reference", _resolve_room_names)
    app.connect("config-inited", _write_parts)
    app.connect("autodoc-skip-member", _skip_aliases)
    app.connect("autodoc-process-docstring", _escape_bars, priority=900)  # after numpydoc
