"""The documentation site: ``sphinx-build -W docs docs/_build``, with the extras ``docs`` and ``all``."""

from __future__ import annotations

import importlib
import importlib.util
import re
import sys
import types
from pathlib import Path

from sphinx.ext.autosummary.generate import generate_autosummary_docs

import heat_igl

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import notebook_pages  # noqa: E402
import reference_pages  # noqa: E402

project = "heat_igl"
author = project_copyright = "the heat_igl developers"
version = release = heat_igl.__version__
html_title = f"heat_igl {release}"
html_theme_options = {
    "source_repository": "https://github.com/heat-igl/heat_igl",
    "source_branch": "main",
    "source_directory": "docs/",
    "footer_icons": [],
}

extensions = [
    "myst_nb" if notebook_pages.are_rendered() else "myst_parser",  # the first loads the second
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    # Formulas as MathML; without the converter, by a script from the network.
    "mathml" if importlib.util.find_spec("latex2mathml") else "sphinx.ext.mathjax",
    "sphinxcontrib.bibtex",
]
html_math_renderer = extensions[-2].rpartition(".")[2]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_extra_path = ["_parts/pages"]  # interactive pages, copied unchanged
templates_path = ["_templates"]
exclude_patterns = ["jupyter_execute", "_build", "_parts"]
nitpicky = False
default_role = "py:obj"  # for names between single backticks in docstrings

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "cache"  # sphinx-build -D nb_execution_mode=off: without their results
nb_execution_cache_path = str(HERE / "_parts" / "executed")
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_output_stderr = "warn"  # a story has no warnings
bibtex_bibfiles = ["literature.bib"]
bibtex_default_style = "plain"
bibtex_reference_style = "author_year"
numpydoc_show_class_members = False
autodoc_typehints = "none"  # the docstrings give types and shapes
autosummary_generate = False  # see _generate_pages


def _write_parts(*_: object) -> None:
    """Write the tables of public names and of notebooks, and the pictures of the gallery; copy the notebooks."""
    parts = HERE / "_parts"
    parts.mkdir(exist_ok=True)
    (parts / "names.md").write_text(reference_pages.page(), encoding="utf8")
    (parts / "notebooks.md").write_text(notebook_pages.page(), encoding="utf8")
    notebook_pages.copy(HERE / "notebooks")
    importlib.import_module("gallery").main(["--out", str(parts)])


def _generate_pages(app) -> None:
    """Write a page for each name of the reference: autosummary does not look into included files by itself."""
    names = HERE / "_parts" / "names.md"
    generate_autosummary_docs([str(names)], output_dir=str(HERE / "api"), app=app, overwrite=True)


def _escape_bars(app, what, name, obj, options, lines) -> None:
    """In docstrings |x| is a length, not a substitution."""
    for i, line in enumerate(lines):
        parts = re.split(r"(``.*?``)", line)
        lines[i] = "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def _skip_members(app, what, name, obj, skip, options) -> bool | None:
    """Leave out of the page of a module what has a page of its own.

    A generic alias such as tuple[int, ...] looks like a class and has no signature.
    """
    has_page = what == "module" and reference_pages.has_page(obj)
    return True if has_page or isinstance(obj, types.GenericAlias) else None


def _resolve_names(app, env, node, contnode):
    """Link a name in a docstring, such as `Mesh` or `heat_igl.io.read_mesh`, to its page in the reference."""
    target = node.get("reftarget", "").removeprefix("~")
    head, _, name = target.rpartition(".")
    candidates = [f"heat_igl.{target}"]
    if head and not head.startswith("heat_igl"):
        candidates.append(f"heat_igl.{head}.{name}")
    of_rooms = " ".join(reference_pages.GROUPS.values()).split()
    candidates += [f"heat_igl.{each}" for each in of_rooms if each.endswith(f".{target.removeprefix('heat_igl.')}")]
    for place in [head] if head.startswith("heat_igl") else []:
        try:
            found = getattr(importlib.import_module(place), name)
        except (ImportError, AttributeError):
            continue
        candidates += [f"heat_igl.{name}"] if name in heat_igl.__all__ else []
        candidates.append(f"{getattr(found, '__module__', place)}.{getattr(found, '__qualname__', name)}")
    python = env.get_domain("py")
    for candidate in candidates:
        link = python.resolve_xref(env, node["refdoc"], app.builder, "obj", candidate, node, contnode)
        if link is not None:
            return link
    return None


def setup(app) -> None:
    app.connect("missing-reference", _resolve_names)
    app.connect("config-inited", _write_parts)
    app.connect("builder-inited", _generate_pages)
    app.connect("autodoc-skip-member", _skip_members)
    app.connect("autodoc-process-docstring", _escape_bars, priority=900)  # after numpydoc
