"""The notebooks as pages of the site: copies that need no network, and the list of them."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
from pathlib import Path

NOTEBOOKS = Path(__file__).resolve().parents[1] / "notebooks"
ON_GITHUB = "https://github.com/heat-igl/heat_igl/blob/main/notebooks"
BADGE = re.compile(r"\[!\[(Open in Colab)\]\([^)]*\)\]\(([^)]*)\)")  # an image from the network, and its link


def are_rendered() -> bool:
    """Whether the extension that executes notebooks is installed; without it the list links to their sources."""
    return importlib.util.find_spec("myst_nb") is not None


def copy(folder: Path) -> None:
    """Copies of the notebooks, with a plain link in place of the badge."""
    shutil.rmtree(folder, ignore_errors=True)
    if are_rendered():
        folder.mkdir(parents=True)
        for path in sorted(NOTEBOOKS.glob("*.ipynb")):
            text = BADGE.sub(r"[\1](\2)", path.read_text(encoding="utf8"))
            (folder / path.name).write_text(text, encoding="utf8")


def page() -> str:
    """A table of the notebooks, and the tree of their pages."""
    paths = sorted(NOTEBOOKS.glob("*.ipynb"))
    lines = ["| | notebook | |", "|---|---|---|"]
    for path in paths:
        opening = "".join(json.loads(path.read_text(encoding="utf8"))["cells"][0]["source"])
        title = opening.partition("\n")[0].removeprefix("# ")
        link = f"notebooks/{path.name}" if are_rendered() else f"{ON_GITHUB}/{path.name}"
        badge = BADGE.search(opening)
        lines.append(f"| {path.name[:2]} | [{title}]({link}) | {f'[Colab]({badge[2]})' if badge else ''} |")
    tree = ["", "```{toctree}", ":hidden:", "", *(f"notebooks/{path.stem}" for path in paths), "```"]
    return "\n".join([*lines, *(tree if are_rendered() else []), ""])
