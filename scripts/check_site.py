"""Checks the built documentation: every link inside leads to a place on a page, and nothing is loaded from outside.

    sphinx-build -W docs docs/_build && python scripts/check_site.py docs/_build

Prints what is wrong, and ends with a status of 1 if anything is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADING = {"img": "src", "script": "src", "iframe": "src", "source": "src", "link": "href"}
LOADED_LINKS = {"stylesheet", "icon", "preload"}  # of the element link; others are links for robots


class PageLinks(HTMLParser):
    """The places of a page, what it links to, and what it loads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places: set[str] = {""}
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take note of one element; called by `feed`."""
        found = {name: value for name, value in attrs if value}
        self.places |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if LOADING.get(tag) in found and (tag != "link" or found.get("rel") in LOADED_LINKS):
            self.loaded.append(found[LOADING[tag]])


def faults(root: Path) -> Iterator[str]:
    """One line for each link that leads nowhere, and each thing that is loaded from outside."""
    pages = {path.resolve(): PageLinks(path.read_text(encoding="utf8")) for path in sorted(root.rglob("*.html"))}
    if not pages:
        yield f"{root} holds no pages"
    for path, page in pages.items():
        name = path.relative_to(root.resolve()).as_posix()
        for target in dict.fromkeys(page.loaded + page.links):
            address = urlsplit(target)
            if address.scheme in ("http", "https") or target.startswith("//"):
                if target in page.loaded:
                    yield f"{name} loads {target} from outside"
            elif not address.scheme:
                there = (path.parent / unquote(address.path)).resolve() if address.path else path
                if not there.exists():
                    yield f"{name}: {target} does not exist"
                elif there in pages and unquote(address.fragment) not in pages[there].places:
                    yield f"{name}: {target} names no place on that page"


if __name__ == "__main__":
    sys.exit("\n".join(faults(Path(sys.argv[1]))) or 0)
