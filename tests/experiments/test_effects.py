"""Effects: what each varies, and what comes of two values of one on the tiny study."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from tests.experiments.tiny import TINY
from tickwise.errors import ConfigurationError
from tickwise.experiments import effects
from tickwise.experiments.case_studies import CASE_STUDY_1, STUDIES
from tickwise.experiments.effect_catalog import EFFECTS, find_effect
from tickwise.experiments.effects import Effect, effect_results, effect_units
from tickwise.experiments.progress import Display
from tickwise.experiments.runner import Unit, run_units
from tickwise.experiments.store import Store

pytestmark = pytest.mark.usefixtures("studies")

DEPTH = replace(EFFECTS["depth"], values=(1, 2), few=(2,), study="tiny", episodes={"III": 0})
CATALOG = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)


@CATALOG
def test_an_effect_varies_its_setting_and_keeps_the_draws(effect: Effect):
    spec = STUDIES[effect.study]
    for value in effect.values:
        varied = effect.vary(spec, value)
        assert effect.value(varied) == value
        assert (varied.name, varied.seed) == (spec.name, spec.seed)
        assert (varied.source, varied.target, varied.learning) == (spec.source, spec.target, spec.learning)


@CATALOG
def test_an_effect_has_the_studys_own_value_and_a_quick_form(effect: Effect):
    assert effect.value(STUDIES[effect.study]) in effect.values
    assert set(effect.few) < set(effect.values)
    assert sorted(effect.values) == list(effect.values)
    measures = (*effect.measures, *effect.times)
    assert set(effect.headline) <= set(measures)
    assert len({measure.key for measure in measures}) == len(measures)


def test_an_unknown_effect_is_told_which_there_are():
    assert find_effect("tau") is EFFECTS["tau"]
    with pytest.raises(ConfigurationError, match=r"there is no effect 'gamma'; choose trajectories, depth, .*, tau"):
        find_effect("gamma")


def test_more_data_is_more_of_everything():
    effect = EFFECTS["trajectories"]
    assert effect.vary(CASE_STUDY_1, 200) == CASE_STUDY_1
    phase = effect.vary(CASE_STUDY_1, 50).collection
    assert (phase.negatives, phase.positives, phase.episodes) == (50, {"source": 10, "target": 5}, 2_500)
    assert phase.most_episodes == CASE_STUDY_1.collection.most_episodes
    assert effect.vary(CASE_STUDY_1, 400).collection.most_episodes == 2 * CASE_STUDY_1.collection.most_episodes


def test_the_units_of_an_effect():
    units = effect_units(EFFECTS["information-weight"], Path("out"), runs=2, seed=5)
    assert [unit.label for unit in units][:3] == ["λ = 0, seed 5", "λ = 0, seed 6", "λ = 0.0001, seed 5"]
    assert [str(unit.folder) for unit in units][1:3] == ["out/0/run-2", "out/0.0001/run-1"]
    for unit in units:
        learning = unit.spec.learning
        assert (unit.spec.name, unit.spec.runs, unit.spec.short) == ("case1", 1, False)
        assert learning.most_episodes == {"III": learning.window}
    assert {unit.spec.seed for unit in units} == {5, 6}


def test_the_quick_form_has_few_values_and_one_collection():
    effect = EFFECTS["rate"]
    units = effect_units(effect, Path(), quick=True)
    assert [effect.value(unit.spec) for unit in units] == list(effect.few)
    assert all(unit.spec.short and unit.spec.name == "case2" for unit in units)
    assert units[0].label == "ζ = 0.9"


def test_what_cannot_be_carried_out_is_left_out():
    effect = EFFECTS["tau"]
    assert effect.value(effect_units(effect, Path())[0].spec) == 1
    assert effect.value(effect_units(effect, Path(), study="case1")[0].spec) == 2


def test_units_need_a_study_and_a_collection():
    with pytest.raises(ConfigurationError, match="no study 'case9'"):
        effect_units(EFFECTS["tau"], Path(), study="case9")
    with pytest.raises(ConfigurationError, match="0 runs shows nothing; use --runs 1 or more"):
        effect_units(EFFECTS["tau"], Path(), runs=0)


@pytest.fixture(scope="module")
def carried_out(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Unit], list[Store]]:
    """The depths 1 and 2 on two collections of the tiny study."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(STUDIES, "tiny", TINY)
        units = effect_units(DEPTH, tmp_path_factory.mktemp("effect"), runs=2)
    return units, run_units(units, 1, Display(Console(quiet=True)))


@pytest.fixture
def results(carried_out: tuple[list[Unit], list[Store]]) -> dict[str, Any]:
    return effect_results(DEPTH, *carried_out)


def test_results_have_a_number_for_each_value_and_collection(results: dict[str, Any]):
    summary = results["summary"]
    assert (summary["effect"], summary["study"], summary["runs"], summary["values"]) == ("depth", "tiny", 2, [1, 2])
    assert summary["own"] == TINY.inference.depth
    assert summary["command"] == "tickwise effect depth --study tiny --runs 2 --seed 0"
    assert list(summary["measures"]) == [measure.key for measure in DEPTH.measures]
    for measure in summary["measures"].values():
        assert [len(row) for row in measure["runs"]] == [2, 2]
        for low, middle, high in zip(measure["low"], measure["middle"], measure["high"], strict=True):
            assert middle is None or low <= middle <= high
    sizes = summary["measures"]["source_size"]
    assert sizes["runs"][0] == [1, 1]  # a tree of depth 1 is one primitive
    assert sizes["mark"] == {"name": "ϱₜₕ", "value": 4}
    assert summary["measures"]["splits"]["middle"][0] == 1
    assert max(summary["measures"]["splits"]["runs"][1]) > 1
    assert summary["measures"]["return_III"]["unit"] == "first 2,000 episodes"


def test_results_are_plain_and_times_are_apart(results: dict[str, Any]):
    assert json.loads(json.dumps(results)) == results
    assert "seconds" not in json.dumps(results["summary"])
    assert list(results["times"]["measures"]) == ["algorithm_1"]
    assert all(second > 0 for row in results["times"]["measures"]["algorithm_1"]["runs"] for second in row)


def test_each_collection_is_the_same_for_all_values(carried_out: tuple[list[Unit], list[Store]]):
    _, stores = carried_out
    paths = [(store.folder / "artefacts" / "collect-source-0.npz").read_bytes() for store in stores]
    assert paths[0] == paths[2] != paths[1] == paths[3]


def test_a_second_call_does_nothing_and_gives_the_same(
    carried_out: tuple[list[Unit], list[Store]], results: dict[str, Any]
):
    units, stores = carried_out
    files = {path: path.stat().st_mtime_ns for store in stores for path in store.folder.rglob("*") if path.is_file()}
    again = run_units(units, 1, Display(Console(quiet=True)))
    assert effect_results(DEPTH, units, again) == results
    assert {path: path.stat().st_mtime_ns for path in files} == files


def test_the_growth_of_time_is_a_straight_line_from_the_own_value_on():
    sizes = [[10.0, 20.0], [100.0, 200.0], [400.0, 800.0]]
    # t = 2 + 3 N / 1,000 from the value 2 on, whatever comes before and whatever is missing
    seconds = [[70.0, 80.0], [2.3, 2.6], [None, 4.4]]
    growth = effects._growth([1, 2, 4], 2, sizes, seconds)
    assert growth == pytest.approx({"fixed": 2.0, "per_thousand": 3.0, "from": 100.0})
    assert effects._growth([1, 2, 4], 4, sizes, seconds) is None  # one number only
    assert effects._growth([1, 2, 4], 9, sizes, seconds) is None
