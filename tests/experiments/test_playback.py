"""What a page gets to play: regions, automata and episodes as plain data."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.experiments import recorded, synthetic
from tests.experiments.tiny import TINY
from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import CASE_STUDY_2_TARGET
from tickwise.experiments.playback import playback
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.store import Store
from tickwise.experiments.summary import gather
from tickwise.logic.parse import parse

SPEC = synthetic.small()
METHODS = {"I": "without", "II": "plain", "III": "formula", "IV": "transfer", "V": "closed"}


@pytest.fixture(scope="module")
def played() -> dict[str, Any]:
    data = playback(recorded.results(SPEC), SPEC, METHODS)
    assert data is not None
    return data


def test_what_was_recorded_is_offered(played: dict[str, Any]):
    assert [method["key"] for method in played["methods"]] == ["I", "III", "V", "source"]
    tau, extended, _, source = played["methods"]
    assert (tau["title"], tau["formula"], tau["follows"]) == ("I: without", "target", False)
    assert (extended["title"], extended["formula"], extended["follows"]) == ("III: formula", "target", True)
    assert (source["task"], source["formula"]) == ("source", "source")
    assert [run["run"] for run in extended["runs"]] == [1, 2, 3]
    assert [point["learned"] for point in extended["runs"][0]["points"]] == [0, 1_000]


def test_each_point_of_method_v_has_its_own_formula(played: dict[str, Any]):
    tau, extended, loop, _ = played["methods"]
    assert (loop["title"], loop["formula"], loop["follows"]) == ("V: closed", None, True)
    for run in loop["runs"]:
        assert [point["formula"] for point in run["points"]] == list(recorded.GUESSES)
        assert [point["tested"] for point in run["points"]] == [False, True]
    assert not any(
        "formula" in point for method in (tau, extended) for run in method["runs"] for point in run["points"]
    )
    # a formula that several runs have is there once, beside those of the other methods
    assert list(played["formulas"]) == ["target", "target_without_information", "source", *recorded.GUESSES]
    guess, final = (played["formulas"][text] for text in recorded.GUESSES)
    assert guess["symbol"] == final["symbol"] == "φᵀ"
    assert len(guess["automata"][0]["parts"]) == 1
    assert [region["name"] for region in final["regions"]] == ["Ḡᵀ", "Ȳᵀ"]


def test_a_run_folder_whose_method_v_did_not_record_plays_the_others():
    results = recorded.results(SPEC)
    for run in results["methods"]["V"]:
        for name in [name for name in run if name.startswith(PREFIX)]:
            del run[name]
    data = playback(results, SPEC, METHODS)
    assert data is not None
    assert [method["key"] for method in data["methods"]] == ["I", "III", "source"]
    assert list(data["formulas"]) == ["target", "target_without_information", "source"]


def test_it_is_plain_data(played: dict[str, Any]):
    assert json.loads(json.dumps(played, ensure_ascii=False))["actions"] == ["straight", "turn left", "turn right"]


def test_nothing_recorded_is_nothing_to_play():
    assert playback(synthetic.results(SPEC), SPEC, METHODS) is None


def test_without_a_formula_there_is_still_the_world():
    data = playback(recorded.results(SPEC, formula=None), SPEC, METHODS)
    assert data is not None
    assert data["formulas"]["target"] is None
    assert data["methods"][0]["formula"] is None
    assert data["tasks"]["target"]["size"] == 9


def test_a_region_says_which_cells_lie_in_it():
    data = playback(recorded.results(SPEC, formula=synthetic.TARGET), SPEC, METHODS)
    assert data is not None
    first, second = data["formulas"]["target"]["regions"]
    assert (first["name"], first["ranges"], first["rectangle"]) == ("Ḡᵀ", "[5, 6] × [6, 7]", (5, 6, 6, 7))
    # cell (i, j) is number 9 i + j: the only one of [5, 6] × [6, 7] is (5, 6)
    assert [number for number, inside in enumerate(first["cells"]) if inside == "1"] == [51]
    assert second["cells"].count("1") == 3 * 2
    assert (first["colour"], second["colour"]) == ("green", "yellow")


def test_the_edges_are_the_automatons(played: dict[str, Any]):
    automata = timed_automata(parse(recorded.EVERY_OPERATOR))
    for given, automaton in zip(played["formulas"]["target"]["automata"], automata, strict=True):
        clocks = len(automaton.clocks)
        possible = [edge for edge in automaton.edges if all(low <= high for low, high in edge.ranges(clocks))]
        assert len(given["edges"]) == len(possible) < len(automaton.edges) + 1
        for shown, edge in zip(given["edges"], possible, strict=True):
            assert (shown["source"], shown["target"]) == (edge.source, edge.target)
            assert (shown["mask"], shown["wanted"]) == edge.cube
            assert shown["resets"] == sorted(edge.resets)
        assert [place["kind"] for place in given["locations"]].count("accepting") == 1
        assert {place["stage"] for place in given["locations"]} == set(range(len(automaton.predicates)))


def test_guards_and_meanings_read_well():
    data = playback(recorded.results(SPEC, formula=synthetic.TARGET), SPEC, METHODS)
    assert data is not None
    (automaton,) = data["formulas"]["target"]["automata"]
    labels = [edge["label"] for edge in automaton["edges"]]
    assert ["Ḡᵀ, c₁ ≥ 3", "c₂ ≔ 0"] in labels
    assert ["Ȳᵀ, 27 ≤ c₁ ≤ 40"] in labels
    assert [place["meaning"] for place in automaton["locations"]] == [
        "waiting for a stay in Ḡᵀ", "within a stay in Ḡᵀ", "waiting for Ȳᵀ", "satisfied", "violated, by ◇□ Ḡᵀ",
        "violated, by ◇ Ȳᵀ",
    ]  # fmt: skip


def test_an_episode_has_the_hidden_tasks_rewards(finished: Path):
    results = gather(TINY, Store(finished), "0")
    data = playback(results, TINY, METHODS)
    assert data is not None
    assert [method["key"] for method in data["methods"]] == ["I", "II", "III", "IV", "source"]
    seen = set()
    for method in data["methods"]:
        stages = data["tasks"][method["task"]]["stages"]
        for run in method["runs"]:
            for point in run["points"]:
                for episode in point["episodes"]:
                    assert sum(episode["rewards"]) == episode["return"]
                    assert len(episode["states"]) == len(episode["rewards"]) == len(episode["stages"]) == 15
                    assert len(episode["actions"]) == 14
                    assert (stages[episode["stages"][-1]] == "done") == episode["success"] == (episode["return"] > 0)
                    seen.add(episode["success"])
    assert seen == {True, False}
    at = results["methods"]["III"][1][PREFIX + "at"]
    points = data["methods"][2]["runs"][1]["points"]
    assert [point["learned"] for point in points] == at.tolist()
    assert points[-1]["mean"] == round(float(results["methods"]["III"][1]["evaluation_returns"][-1]), 1)


def test_an_episode_that_ended_early_ends_there():
    spec = replace(SPEC, target=CASE_STUDY_2_TARGET)
    data = playback(recorded.results(spec, formula="G[0,30] F[0,9] (2 <= x <= 3 & 3 <= y <= 4)"), spec, METHODS)
    assert data is not None
    *_, early = data["methods"][1]["runs"][0]["points"][-1]["episodes"]
    assert len(early["states"]) == 39
    assert len(early["actions"]) == 38
