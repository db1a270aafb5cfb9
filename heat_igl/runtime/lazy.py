"""Lazy loading: names of a package import their module on first use."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType


def attached(
    package: str, file: str, other_words: Mapping[str, str] = MappingProxyType({})
) -> tuple[list[str], Callable[[str], object], Callable[[], list[str]]]:
    """`__all__`, `__getattr__` and `__dir__` of a package (PEP 562), from the stub beside its ``__init__.py``.

    The stub ``__init__.pyi`` lists the names, a line ``from module import name as name`` for each, for type checkers
    too. A name must differ from all other modules of the package: importing a module would replace it. The error for
    an unknown name suggests its entry in `other_words`, or a similar name.
    """
    stub = Path(file).with_suffix(".pyi").read_text(encoding="utf8")
    homes = {name: home for home, name in re.findall(r"^from (\S+) import (\w+) as \2$", stub, re.MULTILINE)}
    names = sorted(homes)

    def load(name: str) -> object:
        home = homes.get(name, package)
        if home != package:
            # What `from home import name` does, which finds modules in a package as well.
            found = getattr(__import__(home, fromlist=[name]), name)
            setattr(sys.modules[package], name, found)
            return found
        if not name.startswith("_") and find_spec(f"{package}.{name}"):
            return import_module(f"{package}.{name}")
        message = f"module {package!r} has no attribute {name!r}"
        if not name.startswith("_"):
            from difflib import get_close_matches

            stubs = sorted(Path(file).parent.glob("*/__init__.pyi"))
            rooms = [stub.parent.name for stub in stubs if f" as {name}\n" in stub.read_text(encoding="utf8")]
            words = [other_words[name]] if name in other_words else get_close_matches(name, names, n=1, cutoff=0.7)
            close = [f"; did you mean {word}?" for word in words]
            message += "".join([f": it is in {package}.{room}" for room in rooms[:1]] or close)
        # With a name but no object, the interpreter adds no second suggestion.
        raise AttributeError(message, name=name)

    def listed() -> list[str]:
        return sorted(name for name in {*vars(sys.modules[package]), *names} if not re.match("_[^_]", name))

    return names, load, listed
