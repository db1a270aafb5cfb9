"""scripts/structure.py on small trees whose rooms, arrows, lengths and repeated passages are known."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import load_script

structure = load_script("structure")


def package(root: Path, **files: str) -> Path:
    """A package of these modules; a double underscore in a name stands for a folder."""
    folder = root / structure.NAME
    for name, text in {"__init__": "", **files}.items():
        path = folder / f"{name if name.startswith('__') else name.replace('__', '/', 1)}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def test_arrows_are_found_wherever_an_import_stands(tmp_path: Path) -> None:
    made = package(
        tmp_path,
        __init__="from heat_igl.low import Thing\n",
        low="",
        middle____init__="",
        middle__file="from ..low import Thing\n",
        inside="def late():\n    from heat_igl import middle\n",
        by_name="from heat_igl import Thing\n",
        by_attribute="import heat_igl\n\nthing = heat_igl.Thing\n",
        for_types="from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    import heat_igl.low\n",
    )
    real, for_types = structure.arrows(made)
    assert set(real) == {"low", "middle", "inside", "by_name", "by_attribute", "for_types"}
    assert {room: others for room, others in real.items() if others} == {
        "middle": {"low"},
        "inside": {"middle"},
        "by_name": {"low"},
        "by_attribute": {"low"},
    }
    assert {room: others for room, others in for_types.items() if others} == {"for_types": {"low"}}


def test_floors_back_arrows_and_circles() -> None:
    imports = {"a": set(), "b": {"a"}, "c": {"a", "b"}, "d": {"a"}}
    assert structure.floors(imports) == [["a"], ["b", "d"], ["c"]]
    assert structure.circles(imports) == []
    assert structure.back_arrows(imports, ["a", "b", "c", "d"]) == []
    assert structure.back_arrows(imports, ["b", "a", "d"]) == [("b", "a"), ("c", "a"), ("c", "b")]
    bent = imports | {"a": {"c"}}
    assert structure.circles(bent) == [["a", "b", "c"]]
    assert structure.floors(bent) == []


def test_the_table_of_rooms_keeps_its_order_and_takes_first_sentences(tmp_path: Path) -> None:
    made = package(tmp_path, low='"""Stands low,\nvery low. Twice."""', high____init__='"""Stands high."""', other="")
    text = structure.room_table(made, ["high", "gone", "low"])
    assert text.splitlines()[2:] == ["| `high` | Stands high |", "| `low` | Stands low, very low |", "| `other` |  |"]
    assert structure.table_order(f"| `x` | y |\n<!-- rooms -->\n{text}\n<!-- /rooms -->\n") == ["high", "low", "other"]


def test_lengths_count_code_and_keep_kernels_apart(tmp_path: Path) -> None:
    made = package(
        tmp_path,
        low='''
class Box:
    """Two
    lines."""

    def open(self,
             wide):
        """Three
        more
        lines."""
        # a comment

        lid = [
            1,
        ]
        return lid


''',
        kernels____init__="def compiled():\n    return 1\n",
    )
    bodies, kernels, classes = structure.lengths(made)
    assert [(each.name, each.lines) for each in bodies] == [("open", 4)]
    assert [(each.name, each.lines) for each in kernels] == [("compiled", 1)]
    assert [(each.name, each.lines) for each in classes] == [("Box", 7)]


LINES = [f"line_{k} = {k}" for k in range(8)]


@pytest.mark.parametrize(("shared", "found"), [(5, []), (6, [6]), (8, [8])])
def test_repeated_passages_are_as_long_as_they_can_be(shared: int, found: list[int]) -> None:
    first = "\n".join(["a = 0", *LINES[:shared], "b = 0"])
    # Comments, blank lines, white space, brackets, imports and decorators of kernels make no difference.
    noise = ["    " + line + "  # why" for line in LINES[:shared]]
    noise[2:2] = ["", "# a comment", ")", "from x import (", "    y,", ")", "@cython.nogil"]
    second = "\n".join(["c = 0", *noise, "d = 0"])
    passages = structure.repeated({"first": first, "second": second})
    assert [each.lines for each in passages] == found
    if found:
        assert (passages[0].first, passages[0].second) == (f"first:2-{shared + 1}", f"second:2-{shared + 8}")


def test_a_file_repeats_itself_but_not_the_lines_of_a_run() -> None:
    assert structure.repeated({"one": "x = 1\n" * 11}) == []
    assert [each.lines for each in structure.repeated({"one": "\n".join([*LINES, "x = 1", *LINES])})] == [8]


def test_the_exit_status_says_whether_a_bound_is_exceeded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    body = "\n".join(f"    line_{k} = {k}" for k in range(60))
    package(tmp_path, low=f'"""Low."""\n\n\nclass Box:\n    """Holds."""\n\n\ndef f():\n{body}\n')
    page = tmp_path / "ARCHITECTURE.md"
    page.write_text("<!-- rooms -->\n<!-- /rooms -->\n")
    assert structure.main(["--root", str(tmp_path), "--write"]) == 0
    assert "| `low` | Low |" in page.read_text()
    with (tmp_path / "heat_igl" / "low.py").open("a") as file:
        file.write("    return 0\n")
    assert structure.main(["--root", str(tmp_path)]) == 1
    assert capsys.readouterr().err == "longest bodies: 61, more than 60\n"
