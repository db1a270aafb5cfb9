"""What can go wrong, one class per remedy."""

from __future__ import annotations

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
    """A set of sources does not describe a place on the mesh."""


class FactorizationError(RuntimeError):
    """A matrix that should be symmetric positive definite could not be factored."""


class ReferenceSolverError(RuntimeError):
    """A reference solver crashed, hung, or returned something that is not a distance."""


class BatchError(RuntimeError):
    """A batch had to stop before it was done; what is finished stays, and the same call goes on from there."""


class MissingExtraError(ImportError):
    """An optional dependency is needed; the message names the extra that installs it."""

    @classmethod
    def of(cls, purpose: str, package: str, extra: str) -> MissingExtraError:
        """The error for `purpose`, which needs `package` from the extra `extra`."""
        return cls(f'{purpose} needs {package}: pip install "heat-igl[{extra}]"')


class AccuracyWarning(UserWarning):
    """A result is finite and usable, but less accurate than usual, and why."""
