"""Errors and warnings, one class per remedy.

`positive`, `truth`, `require_choice`, `real_numbers` and `as_array` check single arguments for all rooms, in the same
words.
"""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

P = ParamSpec("P")
R = TypeVar("R")


class MeshError(ValueError):
    """A mesh, or a file that should hold one, cannot be used as given.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     heat_igl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])
    ... except heat_igl.MeshError as error:
    ...     print(error)
    ...
    F[0, 2] = 3 is no vertex (1 of 1 faces are affected): there are 3 vertices, so indices run from 0 to 2
    """


class SourceError(ValueError):
    """The sources are not vertices, points or curves of the mesh.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     heat_igl.geodesic_distance(heat_igl.shapes.grid(2), 9)
    ... except heat_igl.SourceError as error:
    ...     print(error)
    ...
    sources[0] = 9 is no vertex: the mesh has 9 vertices, so indices run from 0 to 8
    """


class FactorizationError(RuntimeError):
    """A matrix cannot be factored, since it is not symmetric positive definite.

    Examples
    --------
    >>> import heat_igl
    >>> import scipy.sparse as sp
    >>> from heat_igl.linear import factorize
    >>> try:
    ...     factorize(sp.csc_array([[1.0, 2.0], [2.0, 1.0]]))  # of the eigenvalues -1 and 3
    ... except heat_igl.errors.FactorizationError as error:
    ...     print(error)
    ...
    the matrix (2 rows) is singular or not positive definite
    """


class ReferenceSolverError(RuntimeError):
    """A reference solver crashed, exceeded the time limit, or returned values that cannot be distances.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     heat_igl.validation.closed_forms.plane(heat_igl.shapes.icosphere(1), 0)
    ... except heat_igl.errors.ReferenceSolverError as error:
    ...     print(error)
    ...
    the mesh does not lie in a plane: use reference.exact
    """


class BatchError(RuntimeError):
    """A batch stopped early. Finished blocks are kept, and the same call resumes the batch.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     with heat_igl.cluster.connected("nowhere"):
    ...         pass
    ... except heat_igl.errors.BatchError as error:
    ...     print(error)
    ...
    there is no Dask scheduler at nowhere: missing port number in address 'nowhere'
    """


class MissingExtraError(ImportError):
    """An optional library is not installed; the message names the extra that installs it.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     heat_igl.errors.MissingExtraError.check("reading .abc", "abc_reader", "io")
    ... except heat_igl.errors.MissingExtraError as error:
    ...     print(error)
    ...
    reading .abc needs abc_reader: pip install abc_reader (or install heat-igl with its extra 'io')
    """

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


def names_guessed(function: Callable[P, R]) -> Callable[P, R]:
    """The function, whose TypeErrors say how it is called: the nearest name, or what goes by name.

    Examples
    --------
    >>> import heat_igl
    >>> try:
    ...     heat_igl.geodesic_distance(heat_igl.shapes.grid(2), 0, cut_off=1.0)
    ... except TypeError as error:
    ...     print(error)
    ...
    geodesic_distance() got an unexpected keyword argument 'cut_off'. Did you mean 'cutoff'?
    """
    parameters = list(inspect.signature(function).parameters.values())
    takes_any = parameters[-1].kind is inspect.Parameter.VAR_KEYWORD
    known = [each.name for each in parameters if each.name != "self" and each.kind is not each.VAR_KEYWORD]
    by_name = [each.name for each in parameters if each.kind is each.KEYWORD_ONLY]
    most = len(parameters) - len(by_name) - takes_any

    @wraps(function)
    def checked(*args: P.args, **named: P.kwargs) -> R:
        if len(args) > most:
            names = [name for name in known if name not in by_name]
            order = ", ".join(names) + (" in this order" if len(names) > 1 else "")
            others = ", ".join(f"{name}=" for name in (["distance"] if takes_any else by_name))
            remedy = f"the others go by name ({others})" if others else "there are no others"
            pair = "; positions V and faces F are one mesh, (V, F)" if "mesh" in known else ""
            called = function.__qualname__.removesuffix(".__init__")
            raise TypeError(f"{called}() takes {order}; {remedy}{pair}")
        for name in named:
            if name not in known and not takes_any:
                close = "".join(f" Did you mean {guess!r}?" for guess in get_close_matches(name, known, n=1))
                remedy = close or f" It takes {', '.join(known)}"
                raise TypeError(f"{function.__qualname__}() got an unexpected keyword argument {name!r}.{remedy}")
        return function(*args, **named)

    return checked


class AccuracyWarning(UserWarning):
    """A result is usable but less accurate than usual; the message gives the reason.

    Examples
    --------
    >>> import warnings
    >>> import heat_igl
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     solver = heat_igl.HeatMethodSolver(heat_igl.shapes.grid(20), t=1e-12)
    ...
    >>> print(str(caught[0].message).partition(";")[0])
    t = 1e-12 is too small for heat to cross the mesh in double precision
    >>> solver.diagnostics.t_raised
    True
    """


def shown(value: object) -> str:
    """`value` as an error message shows it: on one line, and arrays by their shape."""
    shape, dtype = getattr(value, "shape", None), getattr(value, "dtype", None)
    if shape and dtype is not None:
        return f"an array of {dtype} of shape {tuple(shape)}"
    text = repr(value)
    return text if len(text) <= 80 and "\n" not in text else f"this {type(value).__name__}"


def is_number(value: object) -> bool:
    """Whether `value` is a real number. Truth values and texts that look like numbers are mistakes of the caller."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def positive(name: str, value: object, *, infinite: bool = False) -> float:
    """`value` as a float; a ValueError that calls it `name` if it is not a positive number.

    With `infinite`, infinity is one.
    """
    try:
        number = float(value) if is_number(value) else np.nan  # type: ignore[arg-type]
    except OverflowError:
        number = np.inf
    if not (number > 0 and (infinite or np.isfinite(number))):
        raise ValueError(f"{name} must be a positive number, not {shown(value)}")
    return number


def truth(name: str, value: object) -> bool:
    """`value` as a bool; a ValueError that calls it `name` if it is neither a truth value nor 0 or 1."""
    if isinstance(value, (bool, np.bool_)) or (isinstance(value, (int, np.integer)) and value in (0, 1)):
        return bool(value)
    raise ValueError(f"{name} must be True or False, not {shown(value)}")


def raise_at_first(
    bad: npt.ArrayLike,
    name: str,
    values: npt.NDArray[Any],
    problem: str,
    remedy: str = "",
    error: type[ValueError] = ValueError,
) -> None:
    """Raise an `error` that names the first of the `values`, called `name`, at which `bad` is true.

    `bad` has the shape of the values, or of the first dimensions of these.
    """
    if np.any(bad):
        first, size = np.argwhere(bad)[0].tolist(), np.size(bad)
        count, end = f" ({np.sum(bad)} of {size} are not)" if size > 1 else "", f": {remedy}" if remedy else ""
        raise error(f"{name}{first or ''} = {values[tuple(first)].tolist()} {problem}{count}{end}")


@contextmanager
def errors_at(place: str) -> Iterator[None]:
    """Put the `place`, in a file or an argument, before the message of a `MeshError` or `SourceError`."""
    try:
        yield
    except (MeshError, SourceError) as error:
        raise type(error)(f"{place}: {error}") from None


def checked_cutoff(value: float | None) -> float:
    """The cutoff as a positive float, infinity for None; a ValueError for anything else."""
    return np.inf if value is None else positive("cutoff", value, infinite=True)


def require_choice(name: str, value: object, choices: Iterable[str | None]) -> None:
    """Raise a ValueError that calls `value` `name` and lists the `choices` if it is none of them."""
    known = list(choices)
    # Arrays compare entry by entry.
    if not (isinstance(value, (str, type(None))) and value in known):
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, not {shown(value)}")


def refuse_masked(name: str, values: object, error: type[ValueError] = ValueError) -> None:
    """Raise an `error` if entries of a masked array are masked: numpy would take the numbers under the mask."""
    mask = getattr(values, "mask", None) if isinstance(values, np.ndarray) else None
    if mask is not None and np.any(mask):
        raise error(f"{name} has {int(np.sum(mask))} masked entries: fill or remove them")


def real_numbers(
    name: str, values: npt.ArrayLike, error: type[ValueError] = ValueError, refused: str = "cmMSU"
) -> npt.NDArray[np.float64]:
    """`values` as a new float64 array; an `error` that calls them `name` if they are no real numbers."""
    refuse_masked(name, values, error)
    try:
        # numpy would take dates as numbers of days, and read texts.
        if np.asarray(values).dtype.kind not in refused:
            return np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise error(f"{name} must be real numbers in an array, not {shown(values)}") from None
    raise error(f"{name} must be real numbers, not {shown(values if np.ndim(values) == 0 else np.asarray(values))}")


def as_array(name: str, values: npt.ArrayLike | None, error: type[ValueError] = ValueError) -> npt.NDArray[Any]:
    """`values` as an array of any type.

    An `error` that calls them `name` if the rows differ in length, or if entries are masked.
    """
    refuse_masked(name, values, error)
    try:
        return np.asarray(values)
    except ValueError:
        raise error(f"{name} must be an array, but rows or entries differ in length") from None
