"""What the map of the paper is made from: names with their lines, and citations in docstrings and comments."""

from __future__ import annotations

from pathlib import Path

import pytest
import sources

MODULE = '''"""Algorithm 2: a module of it."""

LIMIT: int = 3


class Reader:
    """Definitions 2 and 3, and Step 1."""

    def read(self):
        """Lines 7 to 9: three of them; see Algorithm 1, line 11."""
        first = 1  # line 3: the first
        return first


def last():
    """Steps 1-3; line 2 of Algorithm 1."""
'''


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "tickwise").mkdir()
    (tmp_path / "tickwise" / "sample.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.setattr(sources, "SOURCE", tmp_path)
    for cached in (sources.places, sources.citations, sources._tree):
        cached.cache_clear()
    yield "tickwise.sample"
    for cached in (sources.places, sources.citations, sources._tree):
        cached.cache_clear()


def test_names_have_their_lines(module: str):
    found = sources.places(module)
    assert {name: place.line for name, place in found.items()} == {
        "LIMIT": 3, "Reader": 6, "Reader.read": 9, "last": 15,
    }  # fmt: skip
    assert found["last"].file == "sample.py"
    assert found["last"].page == "_modules/tickwise/sample"


def test_citations_have_their_places(module: str):
    found = {
        (each.item, tuple(sorted(each.lines)), each.place.name, each.place.line) for each in sources.citations(module)
    }
    assert found == {
        ("Algorithm 2", (), "", 1),
        ("Definition 2", (), "Reader", 6),
        ("Definition 3", (), "Reader", 6),
        ("Step 1", (), "Reader", 6),
        ("Algorithm 2", (7, 8, 9), "Reader.read", 9),
        ("Algorithm 1", (11,), "Reader.read", 9),
        ("Algorithm 2", (3,), "Reader.read", 11),
        ("Step 1", (), "last", 15),
        ("Step 2", (), "last", 15),
        ("Step 3", (), "last", 15),
        ("Algorithm 1", (2,), "last", 15),
        ("Algorithm 1", (), "last", 15),
    }


def test_public_modules_have_no_private_ones():
    found = sources.public_modules("tickwise")
    assert {"tickwise", "tickwise.errors", "tickwise.logic.sdnf", "tickwise.experiments.figures.maps"} <= set(found)
    assert not [name for name in found if "._" in name]


def test_a_missing_module_is_told():
    with pytest.raises(FileNotFoundError, match=r"no module tickwise.nothing"):
        sources.path_of("tickwise.nothing")
