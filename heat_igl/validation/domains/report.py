"""The result of a validation of domains: rows with an error, its bound, and whether it holds."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from heat_igl.validation.report import plain

__all__ = ["LEGEND", "DomainReport", "DomainRow"]

#: The words of the table, for readers of the report alone.
LEGEND = (
    "Errors: |d - exact| / exact over all vertices; a row passes if the mean is at most the bound. Methods: heat, the "
    "heat method; default, GeodesicSolver without options, which sweeps over points, follows straight "
    "lines in bodies and fronts where a speed jumps, and takes windows elsewhere; the others, its methods."
)


@dataclass(frozen=True)
class DomainRow:
    """One method on one problem with a known answer.

    Attributes
    ----------
    domain, case : str
        The kind of domain, and the problem.
    against : str
        Where the exact distance comes from.
    method : str
        "default", "heat", "sweep", "windows" or "exact".
    n_vertices : int
        Vertices or points.
    mean, maximum : float or None
        Relative error |d - exact| / exact over the vertices at a positive distance; ``inf`` if a distance is not
        finite, None if the method failed.
    shortest : float or None
        Largest share of the exact distance by which a distance is too short; None if the method failed.
    bound : float
        The largest `mean` that passes.
    seconds : float or None
        Time to make the solver and for one query.
    failure : str or None
        The reason why the method failed; None if it did not.

    Examples
    --------
    >>> import heat_igl
    >>> row = heat_igl.validate_domains(["tetrahedra"]).rows[0]
    >>> row.case, row.against, row.passed, row.mean < row.bound == 0.01
    ('cube of even tetrahedra', 'straight line', True, True)
    """

    domain: str
    case: str
    against: str
    method: str
    n_vertices: int
    mean: float | None
    maximum: float | None
    shortest: float | None
    bound: float
    seconds: float | None
    failure: str | None = None

    @property
    def passed(self) -> bool:
        """Whether the mean error is at most the bound; False for a method that failed, and for NaN."""
        return self.mean is not None and self.mean <= self.bound


_COLUMNS = ("domain", "case", "exact by", "method", "vertices", "mean %", "max %", "too short %", "bound %", "passed")


@dataclass(frozen=True)
class DomainReport:
    """Methods on kinds of domains against exact distances; made by `heat_igl.validate_domains`.

    Attributes
    ----------
    rows : tuple of DomainRow
        Case after case.
    seed : int
        For the random points, tetrahedra and sources.

    Examples
    --------
    >>> import heat_igl
    >>> report = heat_igl.validate_domains(["polygons"])
    >>> report.failed
    ()
    >>> print(report.to_markdown().splitlines()[0])
    8 of 8 rows passed
    """

    rows: tuple[DomainRow, ...]
    seed: int

    @property
    def failed(self) -> tuple[DomainRow, ...]:
        """The rows that do not prove a mean error within the bound."""
        return tuple(row for row in self.rows if not row.passed)

    def to_dict(self) -> dict[str, Any]:
        """The report as values that JSON can carry; an infinite error becomes the string ``"inf"``."""
        return {"seed": self.seed, "rows": [plain({**asdict(row), "passed": row.passed}) for row in self.rows]}

    def to_markdown(self) -> str:
        """A table with one line per row, errors in percent, and below it a legend and why a method failed."""
        lines = [
            f"{len(self.rows) - len(self.failed)} of {len(self.rows)} rows passed",
            "",
            "| " + " | ".join(_COLUMNS) + " |",
            "|---" * 4 + "|---:" * 5 + "|---|",
        ]
        lines += ["| " + " | ".join(_cells(row)) + " |" for row in self.rows]
        lines += ["", LEGEND]
        reasons = [f"- {row.case}, {row.method}: {row.failure}" for row in self.rows if row.failure]
        return "\n".join([*lines, *([""] if reasons else []), *reasons]) + "\n"


def _cells(row: DomainRow) -> list[str]:
    errors = ["-" if e is None else f"{100 * e:.2g}" for e in (row.mean, row.maximum, row.shortest)]
    verdict = "yes" if row.passed else "NO"
    bound = f"{100 * row.bound:g}"
    return [row.domain, row.case, row.against, row.method, str(row.n_vertices), *errors, bound, verdict]
