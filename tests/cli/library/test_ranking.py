"""``tickwise library rank``."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.test_cli import Tickwise
from tickwise.transfer.rehearsal import Goal

NUMBERS = ("rehearsal", "promise", "dissimilarity", "distance")


def test_rank_as_a_table_and_as_a_document(tickwise: Tickwise, tasks: Path, new: Path):
    asked = ("library", "rank", tasks, new, "--world", new.with_name("world.npz"))
    document = tickwise(*asked, "--json").document
    assert document["order"] == list(NUMBERS)
    assert [each["name"] for each in document["ranked"]] == ["reach", "mirrored"]
    first, second = document["ranked"]
    assert first["rehearsal"] < second["rehearsal"] < document["without"] < document["most"] == Goal().most
    assert document["level"] == Goal().level
    assert document["warning"] is None
    assert first["promise"] > second["promise"]
    assert first["distance"] < second["distance"]
    assert document["task"]["formula"] == first["fitted"]
    lines = tickwise(*asked).out.splitlines()
    assert lines[0] == f"task: {first['fitted']} (classification rate {first['rate']:.4f})"
    assert lines[1] == f"without transfer: about {document['without']:,.0f} episodes to 95 % of the best in a rehearsal"
    assert lines[2].split("\t") == ["name", "why", *NUMBERS]
    for line, each in zip(lines[3:], document["ranked"], strict=True):
        episodes, *shares = (each[key] for key in NUMBERS)
        cells = [f"{episodes:,.0f}", *(f"{share:.4f}" for share in shares)]
        assert line.split("\t") == [each["name"], each["why"], *cells]


def test_a_library_of_no_use_is_told_to_be(tickwise: Tickwise, poor: Path, new: Path):
    asked = ("library", "rank", poor, new, "--world", new.with_name("world.npz"))
    document = tickwise(*asked, "--json").document
    assert document["ranked"][0]["rehearsal"] > document["without"]
    assert document["warning"].startswith("No gain is foreseen from poor: its values need at least 100,000 ")
    lines = tickwise(*asked).out.splitlines()
    assert lines[2] == f"warning: {document['warning']}"
    assert lines[3].startswith("name\twhy")


def test_rank_by_another_number_and_without_a_world(tickwise: Tickwise, tasks: Path, new: Path):
    asked = ("library", "rank", tasks, new, "--by", "distance", "--rate", 0.9)
    found = tickwise(*asked, "--json").document
    assert found["order"] == ["distance", "rehearsal", "promise", "dissimilarity"]
    assert [(each["rehearsal"], each["promise"]) for each in found["ranked"]] == [(None, None)] * 2
    assert (found["without"], found["warning"]) == (None, None)
    assert found["ranked"][0]["distance"] <= found["ranked"][1]["distance"]
    header, *rows = (line.split("\t") for line in tickwise(*asked).out.splitlines()[1:])
    assert header == ["name", "why", *NUMBERS]
    assert [row[2:4] for row in rows] == [["", ""]] * 2


def test_what_is_refused_is_listed_with_the_reason(tickwise: Tickwise, tasks: Path, new: Path):
    asked = ("library", "rank", tasks, new, "--world", new.with_name("world.npz"), "--size", 1)
    document = tickwise(*asked, "--json").document
    assert (document["task"], document["ranked"], document["without"], document["warning"]) == (None, [], None, None)
    assert {each["why"] for each in document["refused"]} == {
        "The source's formula has size 2, more than the 1 that are allowed."
    }
    lines = tickwise(*asked).out.splitlines()
    assert lines[1].startswith("mirrored\tRefused: The source's formula has size 2")


@pytest.mark.usefixtures("studies")
def test_a_study_says_how_learning_goes_on(
    tickwise: Tickwise, finished: Path, study_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The form of Method IV is what is rehearsed."""
    from tests.experiments.tiny import TINY
    from tickwise.library import outlook

    used = []
    monkeypatch.setattr(outlook, "learning_times", lambda *_, form, **_more: used.append(form) or [None] * 10)
    monkeypatch.setattr(outlook, "rehearsal", lambda *_, form, goal: used.append(form) or float(goal.most))
    tickwise("library", "add", tmp_path / "tasks", "tiny", "--run", finished)
    found = tickwise("library", "rank", tmp_path / "tasks", study_data, "--study", "tiny")
    assert used == [TINY.learning.form("IV")] * 2
    said = found.out.splitlines()[1:3]
    assert said[0] == "without transfer: at least 100,000 episodes to 80 % of the best in a rehearsal"
    assert said[1].startswith("warning: Nothing is foreseen of tiny, and its other numbers rank it: within 100,000 ")
