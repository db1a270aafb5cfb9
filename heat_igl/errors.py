"""Errors and warnings, one class per remedy."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = [
    "AccuracyWarning",
    "BatchError",
    "FactorizationError",
    "MeshError",
    "MissingExtraError",
    "ReferenceSolverError",
    "SourceError",
]


class MeshError(ValueError):
    """A mesh, or a file that should hold one, cannot be used as given."""


class SourceError(ValueError):
    """The sources are not vertices, points or curves of the mesh."""


class FactorizationError(RuntimeError):
    """A matrix cannot be factored, since it is not symmetric positive definite."""


class ReferenceSolverError(RuntimeError):
    """A reference solver crashed, exceeded the time limit, or returned values that cannot be distances."""


class BatchError(RuntimeError):
    """A batch stopped early. Finished blocks are kept, and the same call resumes the batch."""


class MissingExtraError(ImportError):
    """An optional library is not installed; the message names the extra that installs it."""

    @classmethod
    def of(cls, purpose: str, package: str, extra: str) -> MissingExtraError:
        """The error that says: `purpose` needs `package`, which the extra `extra` installs too.

        Several packages are joined by "and".
        """
        names = package.replace(" and ", " ")
        return cls(f"{purpose} needs {package}: pip install {names} (or install heat-igl with its extra '{extra}')")

    @classmethod
    @contextmanager
    def guard(cls, purpose: str, package: str, extra: str) -> Iterator[None]:
        """A context for the import of an optional library. It raises this error if the import fails."""
        try:
            yield
        except ImportError:
            raise cls.of(purpose, package, extra) from None

    @classmethod
    def check(cls, purpose: str, package: str, extra: str) -> None:
        """Raise this error if the module `package` is not installed. The module is not imported."""
        if importlib.util.find_spec(package) is None:
            raise cls.of(purpose, package, extra)


class AccuracyWarning(UserWarning):
    """A result is usable but less accurate than usual; the message gives the reason."""
