"""The result of a batch: a row for each mesh."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from heat_igl.cluster.store import Store

__all__ = ["BatchReport", "BatchRow", "report"]


@dataclass(frozen=True)
class BatchRow:
    """The result for one mesh.

    Attributes
    ----------
    name : str
        Group of the mesh in the store.
    mesh : str
        The file, or the name it was given.
    status : {"done", "running", "failed"}
        "running" if some distances are still missing.
    reason : str
        Why it failed; empty otherwise.
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
        return tuple(row for row in self.rows if row.status == "running")

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
            lines += [f"| {row.mesh} | {row.status} | {_cell(row.reason)} |" for row in concerning]
        return "\n".join(lines) + "\n"


def report(store: str | os.PathLike[str]) -> BatchReport:
    """The report of a store, finished or not.

    Raises
    ------
    ValueError
        If `store` is not one of distances.
    """
    opened = Store(store)
    return BatchReport(os.fspath(store), rows(opened, opened.names()))


def rows(store: Store, names: Sequence[str]) -> tuple[BatchRow, ...]:
    """The rows of some meshes of a store."""
    return tuple(_row(store, name) for name in sorted(names))


def _row(store: Store, name: str) -> BatchRow:
    found = store.attributes(name)
    status = found.get("status", "running")
    mesh = found.get("mesh", name)
    if status == "failed":
        return BatchRow(name, mesh, status, reason=found["reason"])
    if "status" not in found:
        return BatchRow(name, mesh, status)
    group = store.group(name)
    return BatchRow(name, mesh, status, "", group.n_columns, group.n_rows, found.get("checksum", ""))


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
