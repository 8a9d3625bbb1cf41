from __future__ import annotations

import json

import pytest

from tickwise.envs.planning import best_success_probability
from tickwise.envs.temporal import FormulaTask
from tickwise.experiments.case_studies import find_study
from tickwise.experiments.random_pairs import SIZE, can_say, find_pair, random_pair, random_pairs
from tickwise.logic.sdnf import SDNF, Operator
from tickwise.logic.structure import structurally_transferable

F, G, FG, GF = Operator


def formula(task: object) -> SDNF:
    assert isinstance(task, FormulaTask)
    return task.sdnf


def test_every_other_pair_is_similar():
    pairs = random_pairs(8, seed=3, runs=2)
    assert [pair.similar for pair in pairs] == [True, False] * 4
    assert [pair.name for pair in pairs[:2]] == ["pair-00", "pair-01"]
    for pair in pairs:
        source, target = formula(pair.source.task), formula(pair.target.task)
        assert structurally_transferable(target, source) == pair.similar
        assert target.size <= SIZE
        assert (pair.runs, list(pair.inferences)) == (2, [0])
        assert pair.true == {"source": pair.source.task.formula, "target": pair.target.task.formula}
        for environment in (pair.source, pair.target):
            assert environment.task.ends in ("deadline", "violated")
            assert best_success_probability(environment.mdp(), environment.task_table()) >= 0.95


def test_a_pair_follows_from_its_number_and_the_seed():
    assert random_pair(5, 1) == random_pair(5, 1)
    assert random_pair(5, 1).source != random_pair(5, 2).source
    assert find_study("pair-05", seed=1, runs=3) == random_pair(5, 1, runs=3)
    assert find_pair("case1", 0, None) is None
    json.dumps(random_pair(5, 1).as_dict())  # it goes into the run folder


@pytest.mark.parametrize(
    ("source", "target", "answer"),
    [
        ((F,), (F,), True),
        ((F,), (G,), False),
        ((GF,), (F,), True),  # with the shortest window
        ((FG,), (GF,), False),
        ((F, G), (G, F), False),  # in this order only
        ((F, FG), (FG,), True),  # ◇ can be made to hold always
        ((FG,), (F, FG), False),  # one cannot say two
        ((GF, F), (G, F), True),
    ],
)
def test_what_a_structure_can_say(source: tuple[Operator, ...], target: tuple[Operator, ...], answer: bool):
    def plain(operators: tuple[Operator, ...]) -> tuple[tuple[Operator, bool], ...]:
        return tuple((operator, False) for operator in operators)

    assert can_say((plain(source),), (plain(target),)) == answer
    assert can_say((plain(source),), (plain(target), plain(source))) == answer  # each disjunct has to be said
