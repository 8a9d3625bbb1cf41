"""Method V in a study: the closed loop from the source's formula on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from tests.experiments.tiny import HOPELESS, TINY
from tickwise.automata.run import EdgeStep
from tickwise.automata.run import run as run_of
from tickwise.errors import ConfigurationError
from tickwise.experiments.closing import closed_loop
from tickwise.experiments.job import Job
from tickwise.experiments.jobs import perform
from tickwise.experiments.progress import Display
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.runner import available_methods, run_study
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec
from tickwise.experiments.summary import gather
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.structure import structurally_transferable
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import QSettings
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.settings import LoopSettings


def closed(spec: StudySpec, **more: Any) -> StudySpec:
    learning = replace(spec.learning, most_episodes={"V": 600}, loop=LoopSettings(hypotheses=400), **more)
    return replace(spec, learning=learning, collections=1, full=0)


SPEC = closed(TINY)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return run_study(SPEC, tmp_path_factory.mktemp("closed"), 1, Display(Console(quiet=True)))


def test_the_loop_is_there_within_its_episodes(store: Store):
    for run in range(SPEC.runs):
        found = store.load(f"learn-V-{run}")
        assert found["episodes"] == 600
        assert found["evaluation_episodes"].tolist() == list(range(0, 601, 20))
        assert len(found["blocks"]) == 60
        assert 0 < found["first_good"] < found["collected"] <= 600
        assert sum(attempt["episodes"] for attempt in found["attempts"]) <= 600 - found["first_good"]
        source = store.load("infer-0")["source"]["formula"]
        # a tiny collection gives a structure that the target may not have; the loop goes on without it, and says so
        assert found["transferable"] != found["reason"].startswith("Logical transferability is not identified")
        assert not found["transferable"] or structurally_transferable(parse(found["formula"]), parse(source))
        assert found["evaluation_returns"].max() >= 90  # V* is nearly 100


def test_each_recording_has_the_formula_that_the_loop_had_then(store: Store):
    for number in range(SPEC.runs):
        found = store.load(f"learn-V-{number}")
        assert found[PREFIX + "at"].tolist() == [0, 20, 60, 600]
        formulas = found[PREFIX + "formulas"]
        assert formulas[-1] == found["formula"]
        assert len(set(formulas)) > 1
        for point, formula in enumerate(formulas):
            (table,) = tick_tables(to_sdnf(parse(formula)), SPEC.target.task.deadline)
            memory, states = (found[PREFIX + name][point] for name in ("memory", "states"))
            assert (found[PREFIX + "disjunct"][point] == 0).all()
            for path, remembered in zip(SPEC.target.mdp().coordinates[states], memory, strict=True):
                own = run_of(table.automaton, path, variables=("x", "y"))
                steps = [step.target for step in own.steps if isinstance(step, EdgeStep)]
                assert [table.location[u] for u in remembered] == steps


def test_what_is_assumed_is_acted_on_once_there_is_enough(store: Store):
    loop = closed_loop(SPEC, store, 0)
    rng = np.random.default_rng(3)
    assert loop.formula is None
    guess = loop.assumed
    assert structurally_transferable(guess, loop.source)
    while loop.formula is None:
        loop.learn(rng, 1)
    assert loop.assumed == loop.formula != guess


def test_the_summary_counts_every_episode(store: Store):
    method = gather(SPEC, store, "1.2.3")["summary"]["methods"]["V"]
    for spent, loop, there in zip(method["target_episodes"], method["loops"], method["reached_95"], strict=True):
        assert spent["collection"] == loop["collected"]
        assert spent["learning"] == (None if there is None else max(there - loop["collected"], 0))
    assert method["statistics"]["target_episodes"]["collection"]["reached"] == SPEC.runs


def test_the_same_seed_gives_the_same_run(store: Store, tmp_path: Path):
    again = Store.open(tmp_path, SPEC.as_dict())
    for name in ("collect-source-0", "collect-target-0", "infer-0"):
        content = store.load(name)
        arrays = {key: value for key, value in content.items() if isinstance(value, np.ndarray)}
        again.save(name, {key: value for key, value in content.items() if key not in arrays}, arrays)
    perform(Job("learn", "V", 1), SPEC, again, lambda _done, _total: None)
    first, second = (each.load("learn-V-1") for each in (store, again))
    assert first.keys() == second.keys()
    for key, value in first.items():
        np.testing.assert_array_equal(second[key], value)


def test_without_a_source_formula_there_is_no_loop(tmp_path: Path):
    spec = closed(HOPELESS)
    found = run_study(spec, tmp_path, 1, Display(Console(quiet=True)))
    assert available_methods(spec, found) == ()
    with pytest.raises(ConfigurationError, match="V needs a satisfying formula of the source"):
        closed_loop(spec, found, 0)


def test_a_study_names_the_form_of_each_method():
    learning = closed(TINY, forms={"III": QLearning(QSettings(alpha=0.1))}).learning
    assert learning.form("III") == QLearning(QSettings(alpha=0.1))
    assert learning.form("IV") == QLearning(learning.settings)
