"""How far two formulas are from each other, on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.test_cli import answer_of

SOURCE = "F[1,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 4) & F[9,12] (3 <= x <= 5)"
TARGET = "F[3,7] G[0,3] (4 <= x <= 6 & 1 <= y <= 4) & F[11,15] (6 <= x <= 8)"


def test_displacement_and_what_remains():
    lines = answer_of("compare", SOURCE, TARGET).out.splitlines()
    assert lines[-2:] == [
        "target is displaced by: x 3, y 0.5, 2 ticks",
        "mean difference that remains: x 0.25, y 0.5, 0.4 ticks",
    ]


@pytest.mark.parametrize("labels", ["1", "-1", None])
def test_how_often_trajectories_tell_them_apart(labels: str | None, tmp_path: Path):
    """Two ticks from 0 to 4, with labels and without."""
    logs = tmp_path / "logs.csv"
    rows = [
        ("trajectory", "tick", "x", "label"),
        ("a", 0, 0, "1"),
        ("a", 1, 4, "1"),
        ("b", 0, 1, "-1"),
        ("b", 1, 2, "-1"),
    ]
    cut = None if labels else -1
    logs.write_text("".join(",".join(map(str, row[:cut])) + "\n" for row in rows), encoding="utf-8")
    formulas = ("F[0,1] (x >= 3)", "F[0,1] (x >= 2)")
    shown = answer_of("compare", *formulas, "--data", logs).out.splitlines()
    # the first with probability 7/16, the second with 12/16, and whenever the first is satisfied
    assert shown[-2:] == ["probability that they disagree: 0.3125", "the same where either is satisfied: 0.4167"]
    found = json.loads(answer_of("compare", *formulas, "--data", logs, "--json").out)
    assert found["disagreement"] == pytest.approx(5 / 16)
    assert found["dissimilarity"] == pytest.approx(5 / 12)


def test_formulas_that_are_not_transferable_can_disagree_too(tmp_path: Path):
    logs = tmp_path / "logs.csv"
    logs.write_text("trajectory,tick,x\na,0,0\na,1,4\n", encoding="utf-8")
    shown = answer_of("compare", "G[0,1] (x >= 3)", "F[0,1] (x >= 3)", "--data", logs).out.splitlines()
    assert [line.split(":")[0] for line in shown[-3:-2]] == ["why not"]
    assert shown[-2] == "probability that they disagree: 0.375"  # 7/16 - 1/16


def test_the_picture_has_a_box_for_each_part_and_variable(tmp_path: Path):
    picture = tmp_path / "both.svg"
    assert answer_of("compare", SOURCE, TARGET, "--picture", picture).status == 0
    text = picture.read_text(encoding="utf-8")
    ElementTree.fromstring(text)
    again = tmp_path / "again.svg"
    answer_of("compare", SOURCE, TARGET, "--picture", again)
    assert again.read_text(encoding="utf-8") == text
    # three boxes of each formula, filled and framed; two dashed frames in the legend and the boxes of the target
    assert text.count("stroke-dasharray") >= 4


def test_what_does_not_fit_is_told_in_one_line(tmp_path: Path):
    logs = tmp_path / "logs.csv"
    logs.write_text("trajectory,tick,z\na,0,0\na,1,4\n", encoding="utf-8")
    for arguments, message in (
        (("--data", logs), "'x'"),
        (("--data", tmp_path / "no.csv"), "no.csv"),
        (("--picture", logs / "both.svg"), "logs.csv"),
    ):
        answer = answer_of("compare", SOURCE, TARGET, *arguments)
        assert answer.status == 1
        assert message in answer.err
        assert len(answer.err.splitlines()) == 1
