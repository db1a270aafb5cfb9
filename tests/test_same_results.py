"""scripts/same_results.py calls equal what is equal to the bit, and nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import load_script

same_results = load_script("same_results")
ONE = np.array([0.0, 1.0, 4.0, np.inf])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ([ONE], [ONE.copy()], 0.0),
        ([ONE], [np.array([0.0, 1 + 2e-9, 4.0, np.inf])], 5e-10),
        ([ONE], [np.array([-0.0, 1.0, 4.0, np.inf])], 5e-324),
        ([ONE], [np.array([0.0, 1.0, 4.0, 5.0])], np.inf),
        ([ONE], [ONE[:3]], np.inf),
        ([ONE], [ONE, ONE], np.inf),
        ([np.array([3, 4])], [np.array([3, 4])], 0.0),
        ([np.array([3, 4])], [np.array([3.0, 4.0])], np.inf),
        ([], [], 0.0),
        ("MeshError", "MeshError", 0.0),
        ("MeshError", [ONE], np.inf),
    ],
)
def test_differences_are_relative_to_the_largest_value(old: Any, new: Any, expected: float) -> None:
    assert same_results.difference(old, new) == pytest.approx(expected, rel=1e-6)
    assert (same_results.difference(old, new) == 0) == (expected == 0)


def test_the_table_shows_what_differs_and_what_failed() -> None:
    near = np.array([0, 1, 4 + 4e-9, np.inf])
    old = {"found": {"cow": {"heat": [ONE], "paths": [ONE]}, "cube": {"heat": [ONE]}}, "sizes": {"cow": 4, "cube": 8}}
    new = {"found": {"cow": {"heat": [ONE], "paths": "MeshError"}, "cube": {"heat": [near]}}}
    found = same_results.compared(old, new)
    assert found["largest"] == np.inf
    text = same_results.markdown({"old": "OLD", "new": "NEW", **found})
    assert "| cow | 4 | = | inf |" in text
    assert "| cube | 8 | 1.0e-09 |  |" in text
    assert "- cow, paths: OLD computes it, NEW MeshError" in text


def test_every_quantity_is_computed_on_a_small_mesh() -> None:
    """The same twice: the sources are drawn with a seed."""
    mesh = same_results.meshes(None, 1000, 0)["five pages"]
    first, second = same_results.computed(mesh, 0), same_results.computed(mesh, 0)
    assert {"heat", "sweep", "windows", "voronoi", "paths", "isolines", "batch"} <= set(first)
    assert [name for name, value in first.items() if isinstance(value, str) or not any(a.size for a in value)] == []
    assert {same_results.difference(first[name], second[name]) for name in first} == {0.0}
