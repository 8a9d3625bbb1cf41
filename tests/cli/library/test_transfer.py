"""``tickwise library transfer``."""

from __future__ import annotations

from pathlib import Path

from tests.experiments.test_store import files
from tests.test_cli import Tickwise
from tickwise.library.entry_files import read_entry


def test_transfer_from_a_named_entry(tickwise: Tickwise, tasks: Path, new: Path, tmp_path: Path):
    asked = ("library", "transfer", tasks, new, tmp_path / "start.npz", "--world", new.with_name("world.npz"))
    best = tickwise(*asked, "--json").document
    assert (best["name"], best["npz"], best["json"]) == (
        "reach",
        str(tmp_path / "start.npz"),
        str(tmp_path / "start.json"),
    )
    assert read_entry(tmp_path / "start.npz").provenance["from"] == "reach"
    assert best["warning"] is None
    assert tickwise(*asked, "--entry", "mirrored", "--json").document["name"] == "mirrored"
    assert read_entry(tmp_path / "start.npz").provenance["from"] == "mirrored"
    assert files(tmp_path) == {"start.npz", "start.json"}


def test_what_is_asked_for_is_transferred_with_a_warning(tickwise: Tickwise, poor: Path, new: Path, tmp_path: Path):
    start, world = tmp_path / "start.npz", new.with_name("world.npz")
    asked = ("library", "transfer", poor, new, start, "--world", world)
    document = tickwise(*asked, "--json").document
    assert document["rehearsal"] > document["without"]
    assert document["warning"].startswith("No gain is foreseen from poor")
    made = tickwise(*asked)
    assert (made.status, made.err) == (0, "")
    assert made.out.splitlines()[1:] == [
        document["why"], f"warning: {document['warning']}", f"Q-function: {start}, with start.json",
    ]  # fmt: skip
    assert read_entry(start).provenance["from"] == "poor"
