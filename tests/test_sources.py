from __future__ import annotations

import numpy as np
import pytest

from heat_igl import SourceError
from heat_igl.sources import vertex_sources


@pytest.mark.parametrize(
    ("sources", "expected"),
    [
        (3, [3]),
        (np.int32(3), [3]),
        (np.array(3), [3]),
        ([4, 1, 4], [1, 4]),
        (range(2), [0, 1]),
        (np.array([2, 0], np.uint8), [0, 2]),
        ([False, True, False, False, True], [1, 4]),
        (np.array([True, False, False, False, False]), [0]),
    ],
)
def test_accepted_forms(sources, expected):
    found = vertex_sources(sources, 5)
    assert found.dtype == np.int64
    assert found.tolist() == expected


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        (5, r"sources\[0\] = 5 is no vertex \(1 of 1 are not\).* from 0 to 4"),
        ([0, -1, 9], r"sources\[1\] = -1 is no vertex \(2 of 3"),
        ([], "sources is empty"),
        (np.zeros(5, bool), "selects no vertex"),
        (np.ones(4, bool), "4 entries, but the mesh has 5"),
        (1.0, "floats such as 1.0"),
        ([0, np.nan], "floats"),
        ("0", "sources must be a vertex index"),
        (None, "sources must be a vertex index"),
        ([[0, 1]], r"shape \(1, 2\)"),
        ([[0], [1, 2]], "ragged"),
        ({0}, "sources must be a vertex index"),
    ],
)
def test_refused(sources, message):
    with pytest.raises(SourceError, match=message):
        vertex_sources(sources, 5)
