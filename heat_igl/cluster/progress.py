"""The progress of a batch on the client's side: the reports of workers go into the log and onto progress bars."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from typing import Any

from heat_igl.cluster.worker import TOPIC
from heat_igl.runtime import rich_progress

_LOG = logging.getLogger("heat_igl.cluster")


class Watch:
    """Counts meshes and blocks as the workers report them; `bar` (rich.progress.Progress, or None) shows the counts."""

    def __init__(self, n_meshes: int, bar: Any) -> None:
        self._n_meshes = n_meshes
        self._n_done = 0
        self._n_blocks = 0
        self._n_solved = 0
        self._bar = bar
        self._meshes = bar.add_task("meshes", total=n_meshes) if bar else None
        self._blocks = bar.add_task("blocks", total=None) if bar else None

    def event(self, event: tuple[float, Mapping[str, Any]]) -> None:
        """Note one report of a worker: a time, and the facts of an event."""
        _, facts = event
        mesh = facts["mesh"]
        if facts["kind"] == "begun":
            _LOG.info("%s: factored, %d blocks to solve", mesh, facts["blocks"])
            self._n_blocks += facts["blocks"]
        else:
            _LOG.info("%s: block %d solved in %.2f s", mesh, facts["block"], facts["seconds"])
            for warning in facts["warnings"]:
                _LOG.warning("%s: block %d: %s", mesh, facts["block"], warning)
            self._n_solved += 1
        if self._bar:
            self._bar.update(self._blocks, completed=self._n_solved, total=self._n_blocks)

    def mesh_done(self, label: str, reason: str | None) -> None:
        """Note that a mesh is done, or has failed for a reason."""
        self._n_done += 1
        if reason is None:
            _LOG.info("%s: done (%d of %d)", label, self._n_done, self._n_meshes)
        else:
            # Errors of files begin with the path, which is the label.
            _LOG.error("%s", reason if reason.startswith(label) else f"{label}: {reason}")
        if self._bar:
            self._bar.update(self._meshes, completed=self._n_done)


@contextmanager
def watched(client: Any, n_meshes: int, progress: bool) -> Iterator[Watch]:
    """A watch that receives the reports of all workers of `client`; bars need rich."""
    with rich_progress() if progress else nullcontext() as bar:
        watch = Watch(n_meshes, bar)
        client.subscribe_topic(TOPIC, watch.event)
        try:
            yield watch
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone, and nothing more is reported
                client.unsubscribe_topic(TOPIC)
