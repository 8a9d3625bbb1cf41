"""The directives of the documentation: what they make of the code, and what they refuse."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason="Sphinx is not installed; the documentation cannot be built")

import markdown
import papermap
import sourcelines


def test_every_row_of_the_map_is_found():
    found = dict(papermap.rows())
    assert [place.name for place in found["IV-C, Algorithm 2"]] == ["transfer_q"]
    assert len(found) > 40


def test_every_number_of_the_paper_is_somewhere():
    for item in papermap.ITEMS:
        assert papermap.mapped(item), item


def test_rows_name_lines():
    assert papermap.numbers("8-9, 11") == {8, 9, 11}
    assert papermap.numbers("all") == set()


def test_every_line_of_an_algorithm_has_a_row():
    page = (papermap.ROOT / "docs" / "reference" / "paper.md").read_text(encoding="utf-8")
    for item, last in papermap.LINES.items():
        (block,) = re.findall(rf"```{{paper-lines}} {item[-1]}\n(.*?)```", page, flags=re.DOTALL)
        told = [line for row in block.splitlines() for line in papermap.numbers(row.split(" | ")[0])]
        assert sorted(told) == list(range(1, last + 1))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("| Definition 9 | `logic/nothing.py` | `name` |", "no module tickwise.logic.nothing.*Definition 9"),
        ("| Definition 9 | `logic/sdnf.py` | `SDNF`, `nothing` |", "tickwise.logic.sdnf has no nothing.*Definition 9"),
    ],
)
def test_a_name_that_does_not_exist_is_told(row: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "CONTRIBUTING.md").write_text(f"{row}\n", encoding="utf-8")
    monkeypatch.setattr(papermap, "CONTRIBUTING", tmp_path / "CONTRIBUTING.md")
    with pytest.raises(LookupError, match=message):
        papermap.rows()


def test_lines_of_source_get_anchors():
    assert sourcelines.with_anchors("a\n<b>\n</pre></div>") == (
        '<span id="L1"></span>a\n<span id="L2"></span><b>\n<span id="L3"></span></pre></div>'
    )


def test_markdown_becomes_restructured_text():
    given = ["## Rewards", "One.", "", "| a | b |", "|---|:-:|", "| 1 | 2 |", "", "```python", "| x |", "```", "End."]
    assert markdown.restructured(given) == [
        ".. rubric:: Rewards", "", "One.", "",
        ".. list-table::", "   :header-rows: 1", "", "   * - a", "     - b", "   * - 1", "     - 2", "", "",
        ".. code-block:: python", "", "   | x |", "", "End.",
    ]  # fmt: skip
