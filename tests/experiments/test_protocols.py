"""The two protocols of inference: the paper's as it was before there was another, and the full one beside it."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from tests.experiments.tiny import TINY
from tickwise.envs.catalog import CASE_STUDY_1_TARGET, CASE_STUDY_2_TARGET, EnvironmentSpec
from tickwise.errors import ConfigurationError
from tickwise.experiments.case_studies import CASE_STUDY_1, CASE_STUDY_2, STUDIES, find_study
from tickwise.experiments.inferences import labelled_data, settings_of, study_formulas
from tickwise.experiments.job import Job, formulas_job
from tickwise.experiments.jobs import compute
from tickwise.experiments.progress import Display
from tickwise.experiments.protocols import exactly
from tickwise.experiments.publish import publish, republish
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.runner import planned_jobs, run_study
from tickwise.experiments.store import Store, read_json
from tickwise.experiments.study import StudySpec, full_settings
from tickwise.experiments.suites import find_suite, suite_of
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.parse import parse
from tickwise.logic.structure import structurally_transferable

# what there was before the full protocol: digests of all arrays, and formulas
ARRAYS = {
    "collect-source-0": "6592c82bc54f727d",
    "collect-target-1": "85e580266364f111",
    "learn-source-0": "3c21b603c5728be3",
    "learn-IV-1": "0fdea2f1ac71ed9c",
}
FORMULAS = (
    (
        "F[2,6] (1 <= x <= 2 & 0 <= y <= 2) & F[7,14] (2 <= x <= 4 & 2 <= y <= 4)",
        "F[2,6] (2 <= x <= 4 & 0 <= y <= 2) & F[7,14] (0 <= x <= 2 & 2 <= y <= 3)",
        "F[0,6] (2 <= x <= 4 & 0 <= y <= 2) & F[7,14] (0 <= x <= 2 & 2 <= y <= 3)",
    ),
    (
        "F[4,6] (0 <= x <= 2 & 0 <= y <= 4) & F[7,14] (2 <= x <= 3 & 2 <= y <= 3)",
        "F[2,6] (2 <= x <= 4 & 0 <= y <= 2) & F[8,14] (0 <= x <= 2 & 2 <= y <= 4)",
        "F[1,6] (2 <= x <= 4 & 0 <= y <= 2) & F[7,14] (0 <= x <= 2 & 2 <= y <= 4)",
    ),
)
FULL = replace(
    TINY,
    protocol="full",
    full=1,
    learning=replace(TINY.learning, source_episodes=500, most_episodes=dict.fromkeys(("I", "II", "III", "IV"), 500)),
)


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder of the tiny study that learned with the formulas of the full protocol."""
    folder = tmp_path_factory.mktemp("protocol") / "full"
    publish(FULL, run_study(FULL, folder, 1, Display(Console(quiet=True))), 1, 1.5)
    return folder


def store_of(folder: Path, spec: StudySpec) -> Store:
    return Store.open(folder, spec.as_dict())


# ---------------------------------------------------------------- the paper's protocol


def test_the_papers_results_are_what_they_were(finished: Path):
    store = store_of(finished, TINY)
    for name, wanted in ARRAYS.items():
        content = store.load(name)
        keys = [key for key in sorted(content) if key != "rest" and not key.startswith(PREFIX)]
        arrays = (content[key] for key in keys if isinstance(content[key], np.ndarray))
        assert hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()[:16] == wanted, name
    for run, wanted in enumerate(FORMULAS):
        found = store.load(f"infer-{run}")
        keys = ("source", "target", "target_without_information")
        assert tuple(found[key]["formula"] for key in keys) == wanted


def test_without_the_full_protocol_a_collection_is_smaller(finished: Path):
    store = store_of(finished, TINY)
    _, alone = compute(Job("collect", "source", 0), replace(TINY, full=0), store, lambda *_: None)
    ours, theirs = alone.content(), store.load("collect-source-0")
    assert set(theirs) - set(ours) == {"rest"}
    assert all(np.array_equal(ours[key], theirs[key]) for key in ours)


# ---------------------------------------------------------------- the full protocol


def test_the_full_protocol_has_every_trajectory(finished: Path):
    store = store_of(finished, TINY)
    content = store.load("collect-target-0")
    assert content["rest"].dtype == np.int8  # 64 states
    assert content["paths"].dtype == np.int32
    sample, everything = (labelled_data(TINY, store, "target", 0, protocol) for protocol in ("paper", "full"))
    assert len(everything) == content["episodes"]
    assert (everything.positives, everything.negatives) == (content["positives"], content["candidates"])
    np.testing.assert_array_equal(everything.values[: len(sample)], sample.values)
    np.testing.assert_array_equal(everything.labels[: len(sample)], sample.labels)
    assert set(everything.labels[len(sample) :]) == {-1}


@given(
    rate=st.floats(0.5, 1), weight=st.floats(0, 1), positives=st.integers(1, 300),
    negatives=st.integers(1, 60_000), sampled=st.integers(1, 600),
)  # fmt: skip
def test_an_error_counts_what_it_counts_in_a_sample(
    rate: float, weight: float, positives: int, negatives: int, sampled: int
):
    settings = InferenceSettings(size=3, rate=rate, information_weight=weight, depth=1, class_weight="balanced")
    found = full_settings(settings, positives, negatives, sampled)
    few, all_of_them = positives + min(sampled, negatives), positives + negatives
    # the errors that are allowed, and the information that an error costs: the same number
    assert (1 - found.rate) * all_of_them == pytest.approx((1 - rate) * few, abs=1e-9)
    assert found.information_weight * all_of_them == pytest.approx(weight * few)
    assert found == replace(settings, rate=found.rate, information_weight=found.information_weight, class_weight=None)


def test_the_settings_of_each_task_are_its_own(finished: Path):
    store = store_of(finished, TINY)
    tasks = {task: labelled_data(TINY, store, task, 0, "full") for task in ("source", "target")}
    found = {task: settings_of(TINY, "full", data) for task, data in tasks.items()}
    for task, data in tasks.items():
        share = (data.positives + TINY.collection.negatives) / len(data)
        assert found[task].information_weight == pytest.approx(TINY.inference.information_weight * share)
        assert settings_of(TINY, "paper", data) is TINY.inference
    assert found["source"] != found["target"]


def test_its_formulas_meet_their_own_rate(finished: Path):
    store = store_of(finished, TINY)
    found = store.load("infer-full-0")
    assert found["source"]["tree"] is None
    assert found["target_without_information"] is None  # nobody learns with it
    assert structurally_transferable(parse(found["target"]["formula"]), parse(found["source"]["formula"]))
    for task, rate in (("source", found["source"]["rate"]), ("target", found["target"]["attempts"][-1]["rate"])):
        data = labelled_data(TINY, store, task, 0, "full")
        least = settings_of(TINY, "full", data).rate
        assert least > TINY.inference.rate
        assert rate >= least
        few = data.positives + TINY.collection.negatives
        assert round((1 - rate) * len(data)) <= math.floor((1 - TINY.inference.rate) * few + 1e-9)


def test_methods_learn_with_the_formulas_of_the_protocol(learned: Path):
    store = store_of(learned, FULL)
    assert formulas_job(FULL).name == "infer-full-0"
    found, formulas = store.load("infer-full-0"), study_formulas(FULL, store)
    assert str(formulas["target"]) == found["target"]["formula"]
    assert str(formulas["target_without_information"]) == found["target_without_information"]["formula"]
    assert store.load("infer-0")["target_without_information"] is None
    inferred = [job.name for job in planned_jobs(FULL, store) if job.kind == "infer"]
    assert inferred == ["infer-0", "infer-1", "infer-full-0"]
    assert Job("learn", "IV", 1).needs(FULL) == ("infer-full-0", "learn-source-1")
    assert "rest" not in store.load("collect-source-1")
    assert set(read_json(learned / "summary.json")["methods"]) == {"I", "II", "III", "IV"}


def test_both_protocols_are_reported(learned: Path, finished: Path, studies: None, monkeypatch: pytest.MonkeyPatch):
    del studies
    for folder, chosen, of in (
        (learned, "full", {"paper": 2, "full": 1}),
        (finished, "paper", {"paper": 2, "full": 2}),
    ):
        summary = read_json(folder / "summary.json")
        found = summary["protocols"]
        assert {name: each["of"] for name, each in found.items()} == of
        assert [name for name, each in found.items() if each["chosen"]] == [chosen]
        assert summary["formulas"]["source"] == found[chosen]["runs"][0]["source"]["formula"]
        assert summary["structures"]["of"] == of[chosen]
        seconds = read_json(folder / "times" / "inference.json")
        assert {name: len(each) for name, each in seconds.items()} == of
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert 'id="protocols"' in page
        assert page.count(" wrong") >= 2 * sum(of.values())
    run = read_json(learned / "summary.json")["protocols"]["full"]["runs"][0]
    counts = read_json(learned / "artefacts" / "collect-source-0.json")
    assert run["source"]["of"] == counts["episodes"]
    assert run["source"]["errors"] == round((1 - run["source"]["rate"]) * counts["episodes"])
    monkeypatch.setitem(STUDIES, "tiny", FULL)
    monkeypatch.setattr("tickwise.experiments.publish.draw_figures", lambda *_: {})
    before = (learned / "summary.json").read_bytes()
    assert json.loads(before) == republish(learned)
    assert (learned / "summary.json").read_bytes() == before
    assert read_json(learned / "summary.json")["command"] == "tickwise reproduce tiny --protocol full --runs 2 --seed 0"


# ---------------------------------------------------------------- what is exactly right


@pytest.mark.parametrize(
    ("formula", "environment", "right"),
    [
        ("F[2,9] G[0,3] (5 <= x <= 6 & 6 <= y <= 7) & F[20,40] (4 <= x <= 7 & y <= 2)", CASE_STUDY_1_TARGET, True),
        (
            "F[2,9] G[0,3] (5 <= x <= 6 & 6 <= y <= 7) & F[20,40] (4 <= x <= 7 & 1 <= y <= 2)",
            CASE_STUDY_1_TARGET,
            False,
        ),
        ("F[2,9] (5 <= x <= 6 & 6 <= y <= 7) & F[20,40] (4 <= x <= 7 & 0 <= y <= 2)", CASE_STUDY_1_TARGET, False),
        ("F[2,9] G[0,3] (5 <= x <= 6 & 6 <= y <= 7)", CASE_STUDY_1_TARGET, False),
        (
            "F[2,9] G[0,3] (4 <= x <= 7 & 0 <= y <= 2) & F[20,40] (5 <= x <= 6 & 6 <= y <= 7)",
            CASE_STUDY_1_TARGET,
            False,
        ),
        (
            "G[0,30] F[0,9] (4 <= x <= 5 & 3 <= y <= 4) | G[0,40] F[0,10] (2 <= x <= 3 & 3 <= y <= 4)",
            CASE_STUDY_2_TARGET,
            True,
        ),
        ("G[0,30] F[0,9] (4 <= x <= 5 & 3 <= y <= 4)", CASE_STUDY_2_TARGET, False),
        (None, CASE_STUDY_2_TARGET, False),
    ],
)
def test_exactly_right(formula: str | None, environment: EnvironmentSpec, right: bool):
    study = CASE_STUDY_1 if environment is CASE_STUDY_1_TARGET else CASE_STUDY_2
    assert exactly(formula, study.true["target"], environment) is right


@pytest.mark.parametrize("study", [CASE_STUDY_1, CASE_STUDY_2, TINY])
def test_true_formulas_have_the_true_regions(study: StudySpec):
    for task, environment in (("source", study.source), ("target", study.target)):
        assert exactly(study.true[task], study.true[task], environment)
    assert structurally_transferable(parse(study.true["target"]), parse(study.true["source"]))


# ---------------------------------------------------------------- what is asked for


def test_which_collections_a_protocol_infers_from():
    assert list(replace(TINY, runs=3).inferred("full")) == [0, 1, 2]
    assert list(replace(TINY, runs=3, full=1).inferred("full")) == [0]
    assert list(replace(TINY, runs=3, full=1).inferred("paper")) == [0, 1, 2]
    quick = find_study("case1", quick=True, protocol="full")
    assert (list(quick.inferred("full")), quick.protocol) == ([0], "full")
    assert find_study("case1").full is None
    # a pair costs minutes, and there are fifty
    assert [list(find_study("pair-03", protocol=name).inferred("full")) for name in ("paper", "full")] == [[], [0]]


def test_a_suite_has_one_protocol(tmp_path: Path):
    suite = find_suite("all", tasks=2, protocol="full")
    units = suite.units(tmp_path)
    assert {unit.spec.protocol for unit in (*units.studies, *units.pairs)} == {"full"}
    assert all(
        unit.spec.protocol == "paper" and unit.spec.full == 0 for each in units.effects.values() for unit in each
    )
    assert suite.command == "tickwise reproduce all --tasks 2 --protocol full --seed 0"
    assert suite_of(suite.as_dict(), tmp_path) == suite
    assert "--protocol" not in find_suite("all", tasks=2).command


@pytest.mark.parametrize("find", [find_study, find_suite])
def test_another_protocol_is_refused(find: object):
    for name in ("case1", "pair-01") if find is find_study else ("all",):
        with pytest.raises(ConfigurationError, match="there is no protocol 'best'; choose paper or full"):
            find(name, protocol="best")  # type: ignore[operator]
