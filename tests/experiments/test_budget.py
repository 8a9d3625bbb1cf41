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


def methods(closed: list[int | None], rival: list[int | None] | None, plain: list[int | None]) -> dict[str, Any]:
    def of(values: list[int | None], collection: int, most: int, **more: Any) -> dict[str, Any]:
        return {
            "target_episodes": [{"collection": collection, "learning": value} for value in values],
            "episodes": [most] * len(values), **more,
        }  # fmt: skip

    loops = [{"transferable": True}] * len(closed)
    found = {"I": of(plain, 0, 200_000), "V": of(closed, 100, 1_000, loops=loops)}
    return found if rival is None else found | {"III": of(rival, 5_000, 200_000), "IV": of(rival, 5_000, 200_000)}


def test_a_pair_is_compared_with_method_iv_and_with_learning_without_transfer():
    spec = synthetic.small()
    found = pair_budget(spec, methods([100, None], [1_000, 3_000], [None, None]))
    assert found["totals"]["V"] == [200, None]
    assert found["ratio"] == pytest.approx((6_000 + 8_000) / (200 + 1_000))
    assert (found["plain"], found["negative"], found["transferable"]) == ("III", False, 2)
    alone = pair_budget(spec, methods([100, 100], None, [50, 60]))
    assert (alone["ratio"], alone["plain"], alone["negative"]) == (None, "I", True)
    assert pair_budget(spec, {"I": methods([], None, [1])["I"]})["totals"] == {}


def test_a_suite_counts_where_the_loop_did_worse():
    spec = synthetic.small()
    rows = [
        {"budget": pair_budget(spec, found)}
        for found in (methods([0], [1_000], [9]), methods([100], None, [50]), {"I": methods([], None, [1])["I"]})
    ]
    found = suite_budget(rows, 0)
    assert (found["of"], found["reached"], found["negative"]) == (2, 2, [spec.name])
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
