"""Elements of an array by their label: the members of each group, and positions within groups."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.typing import IntArray


class Groups(NamedTuple):
    """Elements sorted by an integer label, as rows of different lengths in one array.

    Attributes
    ----------
    first : (n + 1,) int64
        The elements with label v are ``members[first[v] : first[v + 1]]``.
    members : (k,) int64
        The elements, ascending within each group.
    """

    first: IntArray
    members: IntArray

    def of(self, labels: IntArray) -> tuple[IntArray, IntArray]:
        """The members of several groups, and for each the position of the label in `labels`."""
        first = self.first[labels]
        which, within = enumerate_runs(self.first[labels + 1] - first)
        return self.members[first[which] + within], which


def group_by_label(labels: IntArray, n: int, elements: IntArray | None = None) -> Groups:
    """Sort elements by label, in linear time; equal labels keep their order.

    Parameters
    ----------
    labels : (k,) int64
        Label of each element, in ``range(n)``.
    n : int
        Number of labels.
    elements : (k,) int64, optional
        The elements; by default 0, 1, ..., k - 1.
    """
    elements = np.arange(len(labels)) if elements is None else elements
    # scipy converts a row to columns by counting.
    by_label = sp.csr_array((elements, labels, [0, len(labels)]), shape=(1, n)).tocsc()
    return Groups(by_label.indptr.astype(np.int64), by_label.data)


def enumerate_runs(counts: IntArray) -> tuple[IntArray, IntArray]:
    """Run and position within the run of each element, for runs of `counts` (r,) elements one after another."""
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts, counts)


def next_in_run(elements: IntArray, counts: IntArray) -> IntArray:
    """The element after each of `elements` in the same run, and the first of the run after the last.

    The runs follow one another and have `counts` (r,) elements each, at least one.
    """
    following = np.roll(elements, -1)
    last = np.cumsum(counts) - 1
    following[last] = elements[last - counts + 1]
    return following
