"""Geodesic distance on meshes by the heat method, with operators from libigl."""

import re as _re
from importlib import import_module as _import_module
from importlib.util import find_spec as _find_spec
from pathlib import Path as _Path

__version__ = "0.1.0"

# Name -> the module that defines it: the stub beside this file is the one list of public names, for type checkers too.
_STUB = _Path(__file__).with_suffix(".pyi").read_text(encoding="utf8")
_HOMES = {name: home for home, name in _re.findall(r"^from (\S+) import (\w+) as \2$", _STUB, _re.MULTILINE)}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    """Load a public name, or a room, on first use: a call loads the rooms that it needs and no others."""
    home = _HOMES.get(name, __name__)
    if home != __name__:
        # What `from home import name` does, which finds modules in a room as well.
        found = globals()[name] = getattr(__import__(home, fromlist=[name]), name)
        return found
    if not name.startswith("_") and _find_spec(f"{__name__}.{name}"):
        return _import_module(f"{__name__}.{name}")
    message = f"module {__name__!r} has no attribute {name!r}"
    if not name.startswith("_"):
        from difflib import get_close_matches

        message += "".join(f"; did you mean {close!r}?" for close in get_close_matches(name, __all__, n=1))
    # With a name but no object, the interpreter adds no second suggestion.
    raise AttributeError(message, name=name)


def __dir__() -> list[str]:
    return sorted(name for name in {*globals(), *__all__} if not _re.match("_[^_]", name))
