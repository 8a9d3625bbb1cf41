from __future__ import annotations

import os
from dataclasses import replace
from datetime import datetime, timedelta
from importlib.metadata import version
from pathlib import Path

import pytest

from tests.experiments.test_store import files, no_room
from tests.library.learned import REACH, learned
from tests.library.test_entry import same
from tickwise.errors import ConfigurationError, MissingFileError, StoreError
from tickwise.library.entry import Entry
from tickwise.library.folder import Library


def entry(name: str = "reach") -> Entry:
    return replace(learned(episodes=100), name=name, provenance={"version": "1", "date": "2026-01-31T12:00:00Z"})


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library.open(tmp_path / "tasks", create=True)


def test_what_is_added_is_there(library: Library):
    assert library.names() == ()
    path = library.add(entry())
    library.add(entry("pair-07.b"))
    assert path == library.folder / "entries" / "reach.json"
    assert library.names() == ("pair-07.b", "reach")
    assert same(library.read("reach"), entry())
    assert library.manifest("reach")["formula"] == REACH
    assert library.manifest("pair-07.b")["name"] == "pair-07.b"
    assert same(Library.open(library.folder).read("reach"), entry())
    assert files(library.folder) == {
        "library.json", "entries/reach.json", "entries/reach.npz", "entries/pair-07.b.json", "entries/pair-07.b.npz",
    }  # fmt: skip


def test_what_has_no_date_gets_one(library: Library):
    library.add(learned(episodes=100))
    found = library.read("reach").provenance
    assert found.keys() == {"version", "date", "episodes"}
    assert datetime.fromisoformat(found["date"]).utcoffset() == timedelta(0)
    assert found["version"] == version("tickwise")


@pytest.mark.parametrize("name", ["reach", "REACH"])
def test_a_name_is_given_once(library: Library, name: str):
    library.add(entry())
    before = files(library.folder)
    with pytest.raises(ConfigurationError, match=r"has an entry reach already; choose another name, or remove .*json"):
        library.add(entry(name))
    assert files(library.folder) == before


@pytest.mark.parametrize("name", ["none", "reac", "reach.json"])
def test_an_entry_that_is_not_there_is_told_with_those_there_are(library: Library, name: str):
    with pytest.raises(ConfigurationError, match=rf"there is no entry '{name}' in .*; it has none yet"):
        library.read(name)
    library.add(entry())
    for read in (library.read, library.manifest):
        with pytest.raises(ConfigurationError, match=r"; it has reach$"):
            read(name)


def test_no_name_leads_out_of_the_folder(library: Library):
    for name in ("../library", "/etc/passwd", ".."):
        with pytest.raises(ConfigurationError, match="is no name of an entry"):
            library.read(name)


def test_folders_that_are_none(tmp_path: Path):
    with pytest.raises(MissingFileError, match=r"there is no library .*none; check the path, or make one with"):
        Library.open(tmp_path / "none")
    with pytest.raises(MissingFileError, match="there is no library"):
        Library.open(tmp_path)  # empty
    assert files(tmp_path) == set()
    (tmp_path / "thesis.tex").write_text("dear reader")
    for create in (False, True):
        with pytest.raises(StoreError, match=r"holds files but no library .*; choose another folder"):
            Library.open(tmp_path, create=create)
        with pytest.raises(StoreError, match=r"cannot read the folder .*: Not a directory; choose another one"):
            Library.open(tmp_path / "thesis.tex", create=create)
    assert files(tmp_path) == {"thesis.tex"}


@pytest.mark.parametrize("content", ["", "{", "[]", '{"format": "tickwise library", "version": 2}'])
def test_a_mark_that_is_none(library: Library, content: str):
    (library.folder / "library.json").write_text(content)
    for create in (False, True):
        with pytest.raises(StoreError, match=r"library\.json is not that of a library which this Tickwise can read"):
            Library.open(library.folder, create=create)


def test_what_a_killed_process_left_is_no_entry(tmp_path: Path):
    (tmp_path / ".library.json.123.tmp").write_bytes(b"half")
    library = Library.open(tmp_path, create=True)
    (tmp_path / "entries").mkdir()
    for left in (".reach.json.123.tmp", "reach.npz"):  # killed before the manifest was there
        (tmp_path / "entries" / left).write_bytes(b"half")
    assert library.names() == ()
    library.add(entry())
    assert same(library.read("reach"), entry())
    assert files(tmp_path) == {"library.json", "entries/reach.json", "entries/reach.npz"}


def test_a_file_that_is_missing_or_misnamed_is_told(library: Library):
    library.add(entry())
    folder = library.folder / "entries"
    (folder / "reach.json").rename(folder / "other.json")
    for read in (library.read, library.manifest):
        with pytest.raises(StoreError, match=r"other\.json is damaged \(it is named 'reach' within\)"):
            read("other")
    (folder / "other.json").rename(folder / "reach.json")
    (folder / "reach.npz").unlink()
    with pytest.raises(MissingFileError, match=r"there is no file .*reach\.npz"):
        library.read("reach")


def test_a_full_disk_leaves_what_was_there(library: Library, monkeypatch: pytest.MonkeyPatch):
    library.add(entry())
    before = files(library.folder)
    monkeypatch.setattr(os, "fsync", no_room)
    with pytest.raises(StoreError, match="No space left on device"):
        library.add(entry("other"))
    assert files(library.folder) == before
    with pytest.raises(StoreError, match="No space left on device"):
        Library.open(library.folder.parent / "new", create=True)
