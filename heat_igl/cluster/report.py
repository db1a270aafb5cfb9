"""The result of a batch: a row for each mesh."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from heat_igl.cluster.collection import group_name
from heat_igl.cluster.store import Store
from heat_igl.errors import shown
from heat_igl.typing import AnyArray


@dataclass(frozen=True)
class BatchRow:
    """The result for one mesh.

    Attributes
    ----------
    name : str
        Group of the mesh in the store.
    mesh : str
        The file, or the name it was given.
    status : {"done", "running", "failed", "damaged"}
        "running" if some distances are still missing; "damaged" if files of the store are lost or changed.
    reason : str
        Why it failed, or which file is damaged; empty otherwise.
    n_vertices, n_sources : int
        Size of the distances; 0 if it failed.
    checksum : str
        Checksum of all distances; empty unless they are done. Comparable between
        stores that one version of heat_igl wrote.
    """

    name: str
    mesh: str
    status: str
    reason: str = ""
    n_vertices: int = 0
    n_sources: int = 0
    checksum: str = ""


@dataclass(frozen=True)
class BatchReport:
    """The result of a batch.

    Attributes
    ----------
    store : str
        Path of the store.
    rows : tuple of BatchRow
        One for each mesh, sorted by name.
    """

    store: str
    rows: tuple[BatchRow, ...]

    @property
    def failed(self) -> tuple[BatchRow, ...]:
        """The meshes that have no distances."""
        return tuple(row for row in self.rows if row.status == "failed")

    @property
    def unfinished(self) -> tuple[BatchRow, ...]:
        """The meshes that lack some of their distances; running the batch again goes on with them."""
        return tuple(row for row in self.rows if row.status in ("running", "damaged"))

    def to_dict(self) -> dict[str, Any]:
        """The report as JSON has it."""
        return {"store": self.store, "rows": [asdict(row) for row in self.rows]}

    def to_markdown(self) -> str:
        """A table of the meshes that failed or are unfinished, below the totals."""
        n_done = len(self.rows) - len(self.failed) - len(self.unfinished)
        lines = [
            f"{n_done} of {len(self.rows)} meshes done, {len(self.failed)} failed, {len(self.unfinished)} unfinished"
        ]
        concerning = [*self.failed, *self.unfinished]
        if concerning:
            lines += ["", "| mesh | status | reason |", "|---|---|---|"]
            for row in concerning:
                reason = row.reason.replace("|", "\\|").replace("\n", " ")
                lines.append(f"| {row.mesh} | {row.status} | {reason} |")
        return "\n".join(lines) + "\n"


def report(store: str | os.PathLike[str]) -> BatchReport:
    """The report of a store, finished or not.

    Of each chunk, the checksum at its end is read; `read_distances` reads all of it.

    Raises
    ------
    ValueError
        If `store` is not one of distances.
    """
    opened = Store(store)
    return BatchReport(os.fspath(store), rows(opened, opened.names()))


def read_distances(store: str | os.PathLike[str], name: str, rows: slice | None = None) -> AnyArray:
    """Distances on one mesh of a store, checked against the checksums of the store.

    Parameters
    ----------
    store : path-like
        The store of a batch.
    name : str
        Name of the mesh, or that in the store, `BatchRow.name`.
    rows : slice, optional
        Consecutive rows; all if not given.

    Returns
    -------
    (rows, n) array
        In the number type of the batch.

    Raises
    ------
    ValueError
        If there is no such store or mesh, if distances are missing, or a file that holds them is missing or damaged.
        The message names the file. Running the batch again writes it anew.

    Examples
    --------
    >>> import heat_igl
    >>> with heat_igl.cluster.connected(n_workers=1) as client:
    ...     report = heat_igl.cluster.distances([heat_igl.shapes.grid(4)], [0, 1, 2], "grid.zarr", client=client)
    ...
    >>> heat_igl.cluster.read_distances("grid.zarr", "000000", slice(1, 3)).shape
    (2, 25)
    """
    opened = Store(store)
    name = name if opened.attributes(name) else group_name(name)
    status = opened.attributes(name).get("status", "not begun")
    if status != "done":
        raise ValueError(f"the distances on {name} in store {store} are not complete ({status}): run the batch again")
    chosen = slice(None) if rows is None else rows
    if not (isinstance(chosen, slice) and chosen.step in (None, 1)):
        raise ValueError(f"rows must be a slice of consecutive rows, not {shown(rows)}: read them all, and select")
    try:
        return opened.group(name).read(chosen)
    except ValueError as error:
        raise ValueError(f"{error}: run the batch again, or restore the file from a copy") from None


def rows(store: Store, names: Sequence[str]) -> tuple[BatchRow, ...]:
    """The rows of some meshes of a store."""
    return tuple(_row(store, name) for name in sorted(names))


def _row(store: Store, name: str) -> BatchRow:
    try:
        found = store.attributes(name)
    except ValueError as error:
        return BatchRow(name, name, "damaged", str(error))
    status = found.get("status", "running")
    mesh = found.get("mesh", name)
    if status == "failed" or "status" not in found:
        return BatchRow(name, mesh, status, found.get("reason", ""))
    group = store.group(name)
    problem = group.damaged_chunk() if status == "done" else ""
    if problem:
        return BatchRow(name, mesh, "damaged", problem, group.n_columns, group.n_rows)
    return BatchRow(name, mesh, status, "", group.n_columns, group.n_rows, found.get("checksum", ""))
