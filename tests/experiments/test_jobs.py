from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.experiments.tiny import HOPELESS, TINY
from tickwise._seeding import generator
from tickwise.errors import ConfigurationError, DataError, MissingFileError, StoreError
from tickwise.experiments import jobs
from tickwise.experiments.artefacts import Artefact, Parcel
from tickwise.experiments.inferences import STEPS, labelled_data, study_formulas
from tickwise.experiments.job import Job
from tickwise.experiments.jobs import compute, evaluation_points, learning_problem, perform
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec
from tickwise.logic.structure import structurally_transferable
from tickwise.rl.qlearning import Problem, collect
from tickwise.rl.states import tau_memory


def silent(done: int, total: int) -> None:
    assert 0 <= done <= total


def open_store(folder: Path, spec: StudySpec = TINY) -> Store:
    return Store.open(folder, spec.as_dict())


@pytest.mark.parametrize(
    ("job", "name", "title", "unit"),
    [
        (Job("collect", "source", 0), "collect-source-0", "collect in the source task, run 1", "episodes"),
        (Job("infer", "", 3), "infer-3", "infer formulas, run 4", "formulas"),
        (Job("infer", "full", 0), "infer-full-0", "infer formulas from all trajectories, run 1", "formulas"),
        (Job("learn", "source", 1), "learn-source-1", "learn the source task, run 2", "episodes"),
        (Job("learn", "IV", 9), "learn-IV-9", "Method IV, run 10", "episodes"),
    ],
)
def test_names(job: Job, name: str, title: str, unit: str):
    assert (job.name, job.title, job.unit) == (name, title, unit)


def with_learning(spec: StudySpec = TINY, **changes: Any) -> StudySpec:
    return replace(spec, learning=replace(spec.learning, **changes))


@pytest.mark.parametrize(
    ("steps", "episodes", "points"),
    [
        (((300, 100), (0, 1_000)), 2_500, [0, 100, 200, 300, 1_000, 2_000, 2_500]),
        (((0, 100),), 250, [0, 100, 200, 250]),
        (((50, 30), (0, 40)), 100, [0, 30, 60, 80, 100]),
        (((0, 1_000),), 10, [0, 10]),
    ],
)
def test_evaluation_points(steps: tuple[tuple[int, int], ...], episodes: int, points: list[int]):
    assert evaluation_points(with_learning(evaluation_steps=steps), episodes) == points


def test_collection_is_the_first_episodes_in_one_go(tmp_path: Path):
    store, phase = open_store(tmp_path), TINY.collection
    perform(Job("collect", "target", 1), TINY, store, silent)
    found = store.load("collect-target-1")
    # the twin: all episodes with one call, then the choice
    mdp = TINY.target.mdp()
    problem = Problem(mdp, TINY.target.task_table(), tau_memory(mdp, phase.tau))
    rng = generator(TINY.seed, "tiny", "collect", "target", 1)
    settings = TINY.learning.settings
    returns, paths = collect(problem, problem.initial_q(settings), settings, rng, found["episodes"])
    positive = np.flatnonzero(returns > 0)
    assert found["positives"] == len(positive)
    np.testing.assert_array_equal(found["paths"][: len(positive)], paths[positive])
    np.testing.assert_array_equal(found["labels"], [1] * len(positive) + [-1] * found["negatives"])
    others = {path.tobytes() for path in paths[returns <= 0]}
    assert all(path.tobytes() in others for path in found["paths"][len(positive) :])
    assert found["candidates"] == found["episodes"] - len(positive)
    assert found["negatives"] == min(phase.negatives, found["candidates"])
    assert found["positives_of_the_first"] == (returns[: phase.episodes] > 0).sum()
    assert (found["run"], found["of_the_first"]) == (1, phase.episodes)


def test_collection_goes_on_in_tenths_until_there_are_enough(tmp_path: Path):
    phase = replace(TINY.collection, positives={"source": 10_000, "target": 1}, episodes=105, most_episodes=200)
    spec = replace(TINY, collection=phase)
    store = open_store(tmp_path, spec)
    for task in ("source", "target"):
        perform(Job("collect", task, 0), spec, store, silent)
    assert store.load("collect-target-0")["episodes"] == 105
    # 105 and steps of 10 until there are at least 200
    assert store.load("collect-source-0")["episodes"] == 205


def test_a_collection_without_success_says_so(tmp_path: Path):
    never = replace(TINY.source, task=replace(TINY.source.task, reward=-1.0))
    spec = replace(TINY, source=never)
    store = open_store(tmp_path, spec)
    with pytest.raises(DataError, match="no trajectory of the source task got label 1 in 600 episodes; raise"):
        perform(Job("collect", "source", 0), spec, store, silent)
    assert not (tmp_path / "artefacts").exists()


def test_labelled_data_are_the_positions(finished: Path):
    store = open_store(finished)
    data, content = labelled_data(TINY, store, "source", 0), store.load("collect-source-0")
    assert data.variables == ("x", "y")
    assert data.values.shape == (len(content["paths"]), 15, 2)
    assert (data.lengths == 15).all()
    np.testing.assert_array_equal(data.labels, content["labels"])
    first = content["paths"][0]
    np.testing.assert_array_equal(data.values[0], np.stack([first // 16, first // 4 % 4], axis=1) + 0.5)


def test_what_is_done_is_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    store, job = open_store(tmp_path), Job("collect", "source", 0)
    perform(job, TINY, store, silent)
    before = {path.name: path.read_bytes() for path in (tmp_path / "artefacts").iterdir()}
    monkeypatch.setitem(jobs._KINDS, "collect", lambda *_: pytest.fail("done again"))
    perform(job, TINY, store, silent)
    assert {path.name: path.read_bytes() for path in (tmp_path / "artefacts").iterdir()} == before


def test_an_artefact_is_there_only_with_its_cost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    saved: list[str] = []
    put = Store.put

    def fails_later(self: Store, artefact: Artefact) -> None:
        saved.append(artefact.name)
        if len(saved) == 2:
            raise StoreError("the disk is full")
        put(self, artefact)

    monkeypatch.setattr(Store, "put", fails_later)
    store, job = open_store(tmp_path), Job("collect", "source", 0)
    with pytest.raises(StoreError):
        perform(job, TINY, store, silent)
    assert saved == ["cost-collect-source-0", "collect-source-0"]
    assert not store.has(job.name)
    cost = store.load("cost-collect-source-0")
    assert cost["seconds"] >= 0
    assert cost["memory_mib"] > 1


def test_inference_finds_a_transferable_structure(finished: Path):
    store = open_store(finished)
    found, formulas = store.load("infer-0"), study_formulas(TINY, store)
    assert found["source"]["satisfying"]
    assert found["target"]["transferable"]
    source, target, plain = (formulas[key] for key in ("source", "target", "target_without_information"))
    assert source is not None
    assert structurally_transferable(target, source)
    assert structurally_transferable(plain, source)
    assert str(source) == found["source"]["formula"]
    assert found["target"]["attempts"][-1]["formula"] == str(target)
    tree = found["source"]["tree"]
    counts = store.load("collect-source-0")
    assert (tree["positives"], tree["negatives"]) == (counts["positives"], counts["negatives"])
    assert tree["path"] == "true"
    for side, label in (("left", tree["left"]), ("right", tree["right"])):
        assert label is not None, side


def test_formulas_that_do_not_satisfy_are_not_learned_with(tmp_path: Path):
    store = open_store(tmp_path)
    fit = {"formula": "F[0,3] (x >= 3)", "satisfying": False}
    manifest = {"source": fit, "target": {"formula": None}, "target_without_information": fit}
    store.save("infer-0", manifest, {})
    formulas = study_formulas(TINY, store)
    assert str(formulas["source"]) == "F[0,3] (x >= 3)"
    assert formulas["target"] is None
    assert formulas["target_without_information"] is None
    with pytest.raises(ConfigurationError, match="III needs a formula, and none was inferred"):
        learning_problem(TINY, store, "III")
    assert learning_problem(TINY, store, "I").memory.tables == ()


def test_learning_needs_the_formulas(tmp_path: Path):
    with pytest.raises(MissingFileError, match=r"infer-0\.json"):
        perform(Job("learn", "III", 0), TINY, open_store(tmp_path), silent)


def test_memories_of_the_methods(finished: Path):
    store = open_store(finished)
    formulas = study_formulas(TINY, store)
    for subject, key in (("source", "source"), ("II", "target_without_information"), ("III", "target")):
        problem = learning_problem(TINY, store, subject)
        formula = formulas[key]
        assert formula is not None
        assert tuple(table.automaton.conjunction for table in problem.memory.tables) == formula.disjuncts
        task = TINY.source.task if subject == "source" else TINY.target.task
        assert problem.task.horizon == task.deadline


def test_blocks_do_not_depend_on_when_it_is_evaluated(finished: Path, tmp_path: Path):
    spec = with_learning(evaluation_steps=((50, 7), (0, 333)), evaluation_episodes=3)
    store = open_store(tmp_path, spec)
    perform(Job("learn", "I", 0), spec, store, silent)
    found, other = store.load("learn-I-0"), open_store(finished).load("learn-I-0")
    assert len(found["blocks"]) == 2_000
    assert found["blocks"].dtype == np.float32
    np.testing.assert_array_equal(found["blocks"], other["blocks"])
    assert found["evaluation_episodes"].tolist()[:9] == [0, 7, 14, 21, 28, 35, 42, 49, 56]
    assert len(found["evaluation_returns"]) == len(found["evaluation_episodes"])


def test_the_source_keeps_its_values_and_method_iv_begins_with_them(finished: Path):
    store = open_store(finished)
    problem = learning_problem(TINY, store, "source")
    q = store.load("learn-source-0")["q"]
    assert q.shape == (problem.memory.n_states, 64, 3)
    assert "q" not in store.load("learn-IV-0")
    # before any learning IV acts on what it was given, III on a table of equal values
    three, four = (store.load(f"learn-{method}-0")["evaluation_returns"][0] for method in ("III", "IV"))
    assert three != four


def test_a_study_that_fails_says_why(tmp_path: Path):
    store = open_store(tmp_path, HOPELESS)
    for task in ("source", "target"):
        perform(Job("collect", task, 0), HOPELESS, store, silent)
    perform(Job("infer", "", 0), HOPELESS, store, silent)
    found = store.load("infer-0")
    assert not found["source"]["satisfying"]
    assert found["target"]["formula"] is None
    assert "violates a constraint of Problem 1" in found["target"]["reason"]
    assert found["target_without_information"] is None


def test_the_cost_of_an_inference_has_its_steps(finished: Path, tmp_path: Path):
    cost = open_store(finished).load("cost-infer-0")["step_seconds"]
    assert tuple(cost) == STEPS
    assert all(seconds > 0 for seconds in cost.values())
    folder = shutil.copytree(finished, tmp_path / "run")
    (folder / "artefacts" / "infer-0.json").unlink()
    store = Store(folder)
    perform(Job("infer", "", 0), with_learning(most_episodes={}), store, silent)
    assert tuple(store.load("cost-infer-0")["step_seconds"]) == STEPS[:3]
    assert store.load("infer-0")["target_without_information"] is None  # nobody would learn with it
    for part in ("source", "target"):
        assert store.load("infer-0")[part] == open_store(finished).load("infer-0")[part]


def test_an_inference_that_ends_at_step_1_costs_no_more(tmp_path: Path):
    store = open_store(tmp_path, HOPELESS)
    for task in ("source", "target"):
        perform(Job("collect", task, 0), HOPELESS, store, silent)
    told: list[tuple[int, ...]] = []
    perform(Job("infer", "", 0), HOPELESS, store, lambda *step: told.append(step))
    assert tuple(store.load("cost-infer-0")["step_seconds"]) == STEPS[:2]
    assert told == [(0, 4), (1, 4), (2, 4)]


def test_noise_turns_the_labels_of_a_share_round(finished: Path):
    store = open_store(finished)
    clean = labelled_data(TINY, store, "source", 0)
    spec = replace(TINY, collection=replace(TINY.collection, noise=0.25))
    noisy = labelled_data(spec, store, "source", 0)
    assert (noisy.labels != clean.labels).sum() == round(0.25 * len(clean))
    assert set(noisy.labels) == {-1, 1}
    np.testing.assert_array_equal(noisy.values, clean.values)
    np.testing.assert_array_equal(labelled_data(spec, store, "source", 0).labels, noisy.labels)


@pytest.mark.parametrize(
    "job",
    [
        Job("collect", "target", 1),
        Job("infer", "", 1),
        Job("infer", "full", 1),
        *(Job("learn", who, 1) for who in ("I", "II", "IV")),
    ],
)
def test_a_job_needs_nothing_but_what_it_says(finished: Path, job: Job):
    store = open_store(finished)
    needed = job.needs(TINY)
    parcel = Parcel({name: store.get(name) for name in needed})
    cost, artefact = compute(job, TINY, parcel, silent)
    assert cost.name == f"cost-{job.name}"
    ours, theirs = artefact, store.get(job.name)
    assert (ours.name, ours.manifest, ours.arrays) == (theirs.name, theirs.manifest, theirs.arrays)
    for name in needed:
        with pytest.raises(KeyError, match=name):
            compute(job, TINY, Parcel({other: store.get(other) for other in needed if other != name}), silent)
