"""What an effect is measured by, on the finished run of the tiny study and on manifests written by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.experiments.tiny import TINY
from tickwise.experiments import effect_measures as m
from tickwise.experiments.effect_measures import Finished, Measure
from tickwise.experiments.measures import final_mean
from tickwise.experiments.store import Store


@pytest.fixture
def run(finished: Path) -> Finished:
    return Finished(TINY, Store(finished))


def by_hand(folder: Path, source: str | None, *attempts: str, tree: dict[str, Any] | None = None) -> Finished:
    """A run folder with formulas of our own and nothing else."""
    store = Store(folder)
    facts = {"rate": 0.9, "gain": 0.1, "size": 2, "satisfying": True}
    found = {
        "source": {"formula": source, "tree": tree, **(facts if source else dict.fromkeys(facts))},
        "target": {"transferable": bool(attempts), "attempts": [{"formula": text, **facts} for text in attempts]},
    }
    store.save("infer-0", found, {})
    return Finished(TINY, store)


def numbers(finished: Finished, *measures: Measure) -> list[float | None]:
    return [measure.number(finished) for measure in measures]


def test_formulas_and_their_facts(run: Finished):
    found = run.load("infer")
    assert m.SOURCE_RATE.number(run) == found["source"]["rate"]
    assert m.TARGET_RATE.number(run) == found["target"]["attempts"][-1]["rate"]
    assert str(run.formula("source")) == found["source"]["formula"]
    assert numbers(run, m.TRANSFERABLE, m.DISJUNCTS) == [1, 1]
    assert m.TRUE_RATE.number(run) == pytest.approx(found["source"]["rate"])


def test_the_overlap_is_the_mean_over_the_regions(tmp_path: Path):
    # exactly G of the source, and a half of Y, which is [2, 4] × [2, 4]
    source = "F[1,3] G[0,2] (0 <= x <= 2 & 0 <= y <= 2) & F[7,9] (2 <= x <= 4 & 2 <= y <= 3)"
    # twice as large as G of the target, which is [2, 4] × [0, 2]
    first, last = "F[1,3] (x <= 4)", "F[1,3] (2 <= x <= 4 & 0 <= y <= 4)"
    found = by_hand(tmp_path, source, first, last)
    assert m.STRUCTURE.number(found) == 1  # ◇□ and then ◇
    assert m.SOURCE_OVERLAP.number(found) == pytest.approx(0.75)
    assert m.TARGET_OVERLAP.number(found) == pytest.approx(0.5)  # of the last attempt


def test_splits_are_the_nodes_that_are_no_leaves(tmp_path: Path):
    leaf = {"left": None, "right": None}
    tree = {"left": {"left": leaf, "right": leaf}, "right": leaf}
    assert m.SPLITS.number(by_hand(tmp_path, "F[1,3] (x <= 4)", tree=tree)) == 2


def test_where_there_is_no_formula_there_is_no_number(tmp_path: Path):
    found = by_hand(tmp_path, None, tree={"left": None, "right": None})
    assert numbers(found, m.SOURCE_RATE, m.SOURCE_GAIN, m.SOURCE_OVERLAP, m.TARGET_RATE, m.TARGET_OVERLAP) == [None] * 5
    assert numbers(found, m.SOURCE_SIZE, m.DISJUNCTS, m.SPLITS, m.STRUCTURE, m.TRANSFERABLE) == [0] * 5
    assert m.RETURN_III.number(found) is None
    assert m.END_I.number(found) is None


def test_collections_are_counted(run: Finished):
    source, target = (run.load("collect", task) for task in ("source", "target"))
    assert m.TRAJECTORIES.number(run) == len(source["labels"])
    positives = target["positives_of_the_first"] * 1000 / TINY.collection.episodes
    assert m.TARGET_POSITIVES.number(run) == pytest.approx(positives)


def test_returns_are_those_of_the_window_and_of_the_end(run: Finished):
    blocks = run.load("learn", "I")["blocks"]
    assert m.RETURN_I.number(run) == pytest.approx(np.mean(blocks[:200]), abs=1e-4)  # 2,000 episodes in blocks of 10
    assert m.END_I.number(run) == final_mean(blocks)
    name, best = m.RETURN_III.mark(TINY) if m.RETURN_III.mark else ("", 0.0)
    assert (name, 0 < best <= 100) == ("V*", True)


def test_times_are_those_of_the_steps(run: Finished):
    assert m.ALGORITHM_1.number(run) == run.load("cost-infer")["step_seconds"]["tree"] > 0
    assert m.STEP_2.number(run) == run.load("cost-infer")["step_seconds"]["target"] > 0


def test_the_right_labels_are_those_without_noise(finished: Path):
    noisy = replace(TINY, collection=replace(TINY.collection, noise=0.2))
    # the formula is of the run without noise, so it does not matter that the labels are wrong now
    assert m.TRUE_RATE.number(Finished(noisy, Store(finished))) == m.TRUE_RATE.number(Finished(TINY, Store(finished)))
