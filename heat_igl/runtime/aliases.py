"""Modules that stay importable under an earlier name."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from types import ModuleType

__all__ = ["alias_modules"]


class _Aliases(MetaPathFinder, Loader):
    """Finder and loader of modules that exist under another name."""

    def __init__(self, target_of: Mapping[str, str]) -> None:
        self._target_of = target_of

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None = None,  # noqa: ARG002
        target: ModuleType | None = None,  # noqa: ARG002
    ) -> ModuleSpec | None:
        """The spec of an alias; None for every other module."""
        return spec_from_loader(fullname, self) if fullname in self._target_of else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module itself, not a copy: both names stand for one set of classes."""
        module = import_module(self._target_of[spec.name])
        self._spec = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Put back the module's own spec, which the import system has replaced by that of the alias."""
        module.__spec__ = self._spec


def alias_modules(target_of: Mapping[str, str]) -> None:
    """Make modules importable under further names.

    Parameters
    ----------
    target_of : mapping of str to str
        Further name -> name of the module, both absolute. The module is loaded on the first import of either.
    """
    sys.meta_path.append(_Aliases(dict(target_of)))
