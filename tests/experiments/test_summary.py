from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.experiments.tiny import HOPELESS, TINY
from tickwise.errors import MissingFileError
from tickwise.experiments.job import Job
from tickwise.experiments.jobs import perform
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.store import Store
from tickwise.experiments.summary import command, gather

SOURCE = "F[0,5] G[0,2] (x <= 2 & y <= 2) & F[8,14] (x >= 2 & y >= 2)"
TARGET = "F[0,5] G[0,2] (x >= 2 & y <= 2) & F[8,14] (x <= 2 & y >= 2)"
ALONE = replace(TINY, full=0)
TREE = {"label": None, "formula": None}


@pytest.fixture(scope="module")
def by_hand(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Collections as they are, and made-up formulas and curves of methods I and III."""
    store = Store.open(tmp_path_factory.mktemp("by_hand"), ALONE.as_dict())
    for run in (0, 1):
        for task in ("source", "target"):
            perform(Job("collect", task, run), ALONE, store, lambda _done, _total: None)
        fit = {"formula": SOURCE if run == 0 else "F[0,3] (x >= 3)", "satisfying": True, "tree": TREE}
        target = {
            "formula": TARGET if run == 0 else None,
            "transferable": run == 0,
            "reason": "because",
            "attempts": [],
        }
        manifest = {"run": run, "source": fit, "target": target, "target_without_information": None}
        store.save(f"infer-{run}", manifest, {})
    save_curve(store, "I", 0, [0, 0, 100, 0], [-10, 0, 80, 20], 30)
    save_curve(store, "I", 1, [0, 12, 24, 12], [-10, -10, -10, -10], None)
    save_curve(store, "III", 0, [0] * 7 + [100], [-10, 100, 90, 100], 80)
    save_curve(store, "III", 1, [100, 4], [100, 100, 100, 100], 10)
    for run in (0, 1):
        save_curve(store, "source", run, [1.0], [0, 1, 2, 3], None)
        save_curve(store, "IV", run, [100], [0, 1, 2, 3], 10)
    return store


def save_curve(
    store: Store, method: str, run: int, blocks: list[float], returns: list[float], goal: int | None
) -> None:
    arrays = {
        "blocks": np.array(blocks, dtype=np.float32),
        "evaluation_episodes": np.array([0, 100, 200, 300]),
        "evaluation_returns": np.array(returns, dtype=np.float64),
    }
    store.save(f"learn-{method}-{run}", {"run": run, "episodes": 20_000, "goal": goal}, arrays)


@pytest.fixture(scope="module")
def results(by_hand: Store) -> dict[str, Any]:
    return gather(ALONE, by_hand, "1.2.3")


def test_the_summary_of_curves_that_were_made_up(results: dict[str, Any]):
    summary = results["summary"]
    one, three = summary["methods"]["I"], summary["methods"]["III"]
    # the levels are at 77.5, 88.5 and 93.97: shares of the way from -10 to V*
    assert 99 < summary["v_star"] < 100
    assert summary["fail"] == pytest.approx(-10, abs=0.01)
    assert one["goal"] == [30, None]
    assert one["reached_80"] == [200, None]
    assert one["reached_90"] == [None, None]
    assert one["stays_80"] == [None, None]
    assert three["goal"] == [80, 10]
    assert three["reached_95"] == [100, 0]
    assert three["stays_90"] == [100, 0]
    assert three["stays_95"] == [300, 0]
    assert one["episodes"] == three["episodes"] == [20_000, 20_000]
    assert one["window_mean"] == [25.0, 12.0]
    assert one["end_mean"] == [0.0, 12.0]  # a fifth of four blocks is at least one
    assert one["statistics"]["window_mean"]["iqm"] == 18.5
    assert one["statistics"]["goal"]["reached"] == 1
    assert three["statistics"]["goal"]["mean"] == 45


def test_ratios_say_where_they_are_lower_bounds(results: dict[str, Any]):
    ratios = results["summary"]["ratios"]
    # 30 and the limit of 20,000 over 80 and 10
    assert ratios["I/III"]["goal"] == {"value": pytest.approx(20_030 / 90), "at_least": True}
    assert ratios["I/III"]["reached_95"] == {"value": pytest.approx(40_000 / 101), "at_least": True}
    assert ratios["III/IV"]["goal"] == {"value": pytest.approx(90 / 20), "at_least": False}


def test_structures_are_counted(results: dict[str, Any]):
    summary = results["summary"]
    # the regions of both formulas of the first run are those of the tiny worlds; x >= 3 is none
    exact = {"source": 1, "target": 1}
    assert summary["structures"] == {"found": 1, "transferable": 1, "exact": exact, "of": 2}
    assert (summary["transferable"], summary["reason"]) == (True, "because")
    assert summary["formulas"]["target_without_information"] is None
    assert set(summary["methods"]) == {"I", "III", "IV"}  # II has no formula


def test_a_window_is_the_first_blocks_only(by_hand: Store):
    spec = replace(ALONE, learning=replace(TINY.learning, window=20))
    found = gather(spec, by_hand, "1.2.3")["summary"]["methods"]["III"]
    assert found["window_mean"] == [0.0, 52.0]


def test_all_that_a_report_needs_is_there(finished: Path):
    store = Store.open(finished, TINY.as_dict())
    results = gather(TINY, store, "1.2.3")
    assert set(results) == {"summary", "collections", "inferences", "data", "methods", "source_learning"}
    summary = results["summary"]
    assert list(summary["methods"]) == ["I", "II", "III", "IV"]
    assert set(summary["ratios"]) == {"I/III", "III/IV"}
    assert (summary["study"], summary["seed"], summary["runs"]) == ("tiny", 0, 2)
    assert (summary["quick"], summary["version"]) == (False, "1.2.3")
    assert summary["command"] == "tickwise reproduce tiny --runs 2 --seed 0"
    assert summary["source_v_star"] > 90
    assert [set(each) for each in results["collections"]] == [{"run", "source", "target"}] * 2
    assert results["collections"] == summary["collections"]
    assert results["collections"][0]["source"]["episodes"] >= TINY.collection.episodes
    assert len(results["data"]["target"]) == sum(
        results["collections"][0]["target"][key] for key in ("positives", "negatives")
    )
    assert len(results["source_learning"]) == 2
    wanted = {key for key in results["source_learning"][0] if not key.startswith(PREFIX)}
    assert wanted == {"run", "evaluation_episodes", "evaluation_returns"}
    run = results["methods"]["IV"][1]
    assert len(run["blocks"]) == 2_000
    assert set(run["reached"]) == set(run["stays"]) == {"80", "90", "95"}


def test_a_summary_is_plain_data_and_the_same_each_time(finished: Path):
    store = Store.open(finished, TINY.as_dict())
    one, two = (json.dumps(gather(TINY, store, "1.2.3")["summary"], allow_nan=False) for _ in range(2))
    assert one == two
    assert "seconds" not in one


def test_the_command_says_what_the_numbers_depend_on():
    assert command(replace(TINY, short=True, runs=5, seed=9)) == "tickwise reproduce tiny --quick --runs 5 --seed 9"


def test_what_is_missing_is_named(tmp_path: Path):
    with pytest.raises(MissingFileError, match=r"collect-source-0\.json"):
        gather(HOPELESS, Store.open(tmp_path, HOPELESS.as_dict()), "1.2.3")
