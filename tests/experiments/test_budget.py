"""All target episodes of a method and of pairs of tasks, by hand."""

from __future__ import annotations

from typing import Any

import pytest

from tests.experiments import synthetic
from tickwise.experiments.budget import budget_statistics, target_episodes, totals
from tickwise.experiments.budget_rows import budget_rows, loop_rows
from tickwise.experiments.pair_budget import pair_budget, suite_budget


def a_run(reached: int | None, collected: int | None = None, episodes: int = 1_000) -> dict[str, Any]:
    return {"reached": {"95": reached}, "collected": collected, "episodes": episodes}


def test_collection_counts_where_a_formula_comes_from_one():
    runs = [a_run(700), a_run(None)]
    assert target_episodes("I", runs, 5_000) == [
        {"collection": 0, "learning": 700},
        {"collection": 0, "learning": None},
    ]
    assert target_episodes("IV", runs, 5_000)[0] == {"collection": 5_000, "learning": 700}


def test_the_closed_loop_collects_until_its_formula_is_satisfying():
    runs = [a_run(300, 200), a_run(150, 200), a_run(150, None), a_run(None, 200)]
    found = target_episodes("V", runs, 5_000)
    assert found == [
        {"collection": 200, "learning": 100},
        {"collection": 200, "learning": 0},  # it was there, but nobody knew
        {"collection": 1_000, "learning": 0},  # nobody ever knew
        {"collection": 200, "learning": None},
    ]
    assert totals(found) == [300, 200, 1_000, None]
    statistics = budget_statistics(found[:3], 0)
    assert statistics["total"]["mean"] == pytest.approx(500)
    assert statistics["collection"]["mean"] == pytest.approx(1_400 / 3)


def summary_of(
    closed: list[int | None],
    rival: list[int | None] | None,
    plain: list[int | None],
    ends: tuple[list[float], list[float]] = ([9.0, 9.0], [9.0, 9.0]),
) -> dict[str, Any]:
    """A pair whose runs end with some returns, the closed loop's and all others'."""

    def of(values: list[int | None], collection: int, most: int, **more: Any) -> dict[str, Any]:
        return {
            "target_episodes": [{"collection": collection, "learning": value} for value in values],
            "episodes": [most] * len(values), "final": ends["loops" not in more], **more,
        }  # fmt: skip

    loops = [{"transferable": True}] * len(closed)
    found = {"I": of(plain, 0, 200_000), "V": of(closed, 100, 1_000, loops=loops)}
    if rival is not None:
        found |= {"III": of(rival, 5_000, 200_000), "IV": of(rival, 5_000, 200_000)}
    return {"methods": found, "v_star": 10.0, "fail": -10.0}


WITHOUT = {"methods": {"I": summary_of([], None, [1])["methods"]["I"]}}
"""A pair for which the closed loop was not carried out."""


def test_a_pair_is_compared_with_method_iv_and_with_learning_without_transfer():
    spec = synthetic.small()
    found = pair_budget(spec, summary_of([100, None], [1_000, 3_000], [None, None]))
    assert found["totals"]["V"] == [200, None]
    assert found["ratio"] == pytest.approx((6_000 + 8_000) / (200 + 1_000))
    assert (found["plain"], found["slower"], found["transferable"]) == ("III", False, 2)
    alone = pair_budget(spec, summary_of([100, 100], None, [50, 60]))
    assert (alone["ratio"], alone["plain"], alone["slower"]) == (None, "I", True)
    assert pair_budget(spec, WITHOUT)["totals"] == {}


def test_transfer_is_negative_where_the_loop_ends_worse_by_more_than_noise():
    def ends(ours: list[float], theirs: list[float]) -> dict[str, Any]:
        return pair_budget(synthetic.small(), summary_of([100] * len(ours), None, [50] * len(ours), (ours, theirs)))

    found = ends([5.0, 5.0, 6.0], [9.0, 9.0, 9.0])
    assert found["negative"]
    assert found["ends"]["value"] == pytest.approx((16 / 3 - 9) / 20)
    assert found["ends"]["low"] < found["ends"]["value"] < found["ends"]["high"] < 0
    assert not ends([2.0, 9.0, 9.0], [9.0, 9.0, 8.0])["negative"]  # noise
    assert not ends([9.0, 9.0], [5.0, 5.0])["negative"]
    assert not ends([5.0], [9.0])["negative"]  # of one run nobody knows the noise
    assert ends([5.0, 5.0], [9.0, 9.0])["ends"] == {"value": -0.2, "low": -0.2, "high": -0.2}


def test_a_suite_counts_where_the_loop_did_worse():
    spec = synthetic.small()
    rows = [
        {"budget": pair_budget(spec, found)}
        for found in (
            summary_of([0, 0], [1_000], [9]),
            summary_of([100], None, [50], ([5.0, 5.0], [9.0, 9.0])),
            WITHOUT,
        )
    ]
    found = suite_budget(rows, 0)
    assert (found["of"], found["reached"], found["slower"]) == (2, 2, [spec.name])
    assert found["negative"] == {spec.name: pytest.approx(0.2)}
    assert found["ratio"]["median"] == pytest.approx(60.0)
    assert (found["median"]["IV"]["median"], found["median"]["V"]["median"]) == (6_000.0, 100.0)


def test_the_rows_of_the_report():
    spec = synthetic.small()
    summary = synthetic.results(spec)["summary"]
    rows = {row["name"]: row for row in budget_rows(summary, spec, {"I": "plain", "IV": "fast", "V": "closed"})}
    assert (rows["I"]["paper"], rows["IV"]["paper"], rows["V"]["paper"]) == ("834,590", "12,220", "–")
    assert rows["V"]["cells"][0]["text"] == "300"
    (first, *_) = loop_rows(summary, spec)
    assert (first["run"], first["first"], first["attempts"], first["collected"]) == (1, "240", 1, "300")
    assert "◇" in first["named"]
    del summary["methods"]["V"]
    assert loop_rows(summary, spec) == []
    assert budget_rows(summary, spec, {"V": "closed"})[0]["cells"] is None
