"""Switches beyond Algorithm 2 in a study: what is counted in the source, and what Method IV begins with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.experiments.tiny import TINY
from tickwise._seeding import seed_sequence
from tickwise.experiments.jobs import learning_problem
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import run_study
from tickwise.experiments.study import StudySpec
from tickwise.rl.qlearning import evaluate
from tickwise.transfer.variants import Confidence, Transfer, transfer

BEYOND = Transfer(visited=True, within=2.0, progress=True, travel=True, confidence=Confidence())


def with_transfer(how: Transfer) -> StudySpec:
    learning = replace(TINY.learning, source_episodes=500, most_episodes={"IV": 200}, transfer=how)
    return replace(TINY, learning=learning, runs=1, collections=1, full=0)


@pytest.mark.parametrize("how", [Transfer(), BEYOND], ids=["Algorithm 2", "beyond it"])
def test_method_iv_begins_with_what_the_switches_give(how: Transfer, tmp_path: Path):
    spec = with_transfer(how)
    store = run_study(spec, tmp_path, 1, Display(Console(quiet=True)))
    learned = store.load("learn-source-0")
    assert ("visits" in learned) == how.needs_visits
    source, target = (learning_problem(spec, store, subject) for subject in ("source", "IV"))
    moved = transfer(source, learned["q"], learned.get("visits"), target, spec.learning.settings.initial, how)
    fixed = seed_sequence(spec.seed, spec.name, "evaluate")
    first = evaluate(target, moved.q, fixed, spec.learning.evaluation_episodes)
    assert store.load("learn-IV-0")["evaluation_returns"][0] == first
    if how.needs_visits:  # every step of learning is an update
        steps = 500 * target.task.horizon
        assert learned["visits"].sum() == steps
        assert np.any(moved.confidence > 0)
