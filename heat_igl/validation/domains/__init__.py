"""Check every kind of domain against exact distances: points, metrics, tetrahedra, polygons and images."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable

import numpy as np

from heat_igl.errors import AccuracyWarning, FactorizationError, MeshError, shown
from heat_igl.validation.domains import body_cases, surface_cases
from heat_igl.validation.domains.case import DomainCase, Problem, solver_for
from heat_igl.validation.domains.report import LEGEND, DomainReport, DomainRow
from heat_igl.validation.error_norms import relative_error
from heat_igl.validation.methods import Counter, Progress

__all__ = ["CASES", "DOMAINS", "LEGEND", "DomainCase", "DomainReport", "DomainRow", "Problem", "validate_domains"]

#: All cases, kind after kind.
CASES: tuple[DomainCase, ...] = (*surface_cases.CASES, *body_cases.CASES)
#: The kinds of domains.
DOMAINS = tuple(dict.fromkeys(case.domain for case in CASES))


def validate_domains(
    domains: Iterable[str] | None = None, *, seed: int = 0, progress: Progress | None = None
) -> DomainReport:
    """Measure the methods of `GeodesicSolver`, and heat, on small domains of every kind, against exact distances.

    Each case has a closed form: arcs on a sphere for a point cloud, a linear map for a constant metric, Snell's law for
    layers, straight lines in solids, polygons and images, and straight lines around edges and walls.

    Parameters
    ----------
    domains : iterable of str, optional
        Kinds among "point cloud", "metric", "tetrahedra", "polygons" and "image"; all by default.
    seed : int
        For the random points, tetrahedra and sources.
    progress : callable, optional
        Called before each row with the case and the method, the number of rows done, and their total; at the end with
        "done" and the total twice.

    Returns
    -------
    DomainReport
        A row per case and method, with the mean error, the bound and whether it holds.

    Raises
    ------
    ValueError
        If there is no kind, or one is unknown.

    Examples
    --------
    >>> import heat_igl
    >>> report = heat_igl.validate_domains(["image"])
    >>> {row.case for row in report.rows if row.method == "default"}
    {'wall of voxels of 1 by 2 by 1.5'}
    >>> all(row.passed for row in report.rows)
    True
    """
    asked = DOMAINS if domains is None else _known(domains)
    cases = [case for case in CASES if case.domain in asked]
    total = sum(len(case.bounds) for case in cases)
    counter = Counter(progress, total)
    counter.begin_method(total)
    rows: list[DomainRow] = []
    for number, case in enumerate(CASES):
        if case.domain in asked:
            # A case has the same numbers whichever others are asked for.
            problem = case.problem(np.random.default_rng([seed, number]))
            for method, bound in case.bounds.items():
                counter.step(f"{case.name}, {method}")
                rows.append(_row(case, problem, method, bound))
    counter.finish()
    return DomainReport(tuple(rows), seed)


def _known(domains: Iterable[str]) -> tuple[str, ...]:
    if isinstance(domains, str) or not isinstance(domains, Iterable):
        domains = [domains]
    asked = tuple(domains)
    if not asked:
        raise ValueError(f"domains is empty: choose among {', '.join(map(repr, DOMAINS))}, or leave it out for all")
    for kind in asked:
        if kind not in DOMAINS:
            raise ValueError(f"domains must be among {', '.join(map(repr, DOMAINS))}, not {shown(kind)}")
    return asked


def _row(case: DomainCase, problem: Problem, method: str, bound: float) -> DomainRow:
    begin = time.perf_counter()
    try:
        # The error of a row is known, so a warning about it says nothing new.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            found = solver_for(problem.domain, method).distance(problem.sources)
    except (FactorizationError, MeshError, ValueError) as error:
        named = (case.domain, case.name, case.against, method, len(problem.exact))
        return DomainRow(*named, None, None, None, bound, None, str(error))
    seconds = time.perf_counter() - begin
    away = problem.exact > 0
    errors = relative_error(found, problem.exact)[away]
    return DomainRow(
        domain=case.domain,
        case=case.name,
        against=case.against,
        method=method,
        n_vertices=len(problem.exact),
        mean=float(errors.mean()),
        maximum=float(errors.max()),
        shortest=max(0.0, float((1 - found[away] / problem.exact[away]).max())),
        bound=bound,
        seconds=seconds,
    )
