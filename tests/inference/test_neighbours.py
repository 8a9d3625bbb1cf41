from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.strategies import VARIABLES, random_trajectories, sdnfs
from tickwise.inference.neighbours import neighbours, weaker_neighbours
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, Primitive, to_sdnf


def primitives(formula: SDNF) -> list[Primitive]:
    return [primitive for disjunct in formula.disjuncts for primitive in disjunct.primitives]


@given(sdnfs())
def test_one_structure_is_another_and_all_else_the_same(formula: SDNF):
    found = list(neighbours(formula))
    for other in found:
        assert [len(each.primitives) for each in other.disjuncts] == [
            len(each.primitives) for each in formula.disjuncts
        ]
        pairs = zip(primitives(formula), primitives(other), strict=True)
        ((before, after),) = [pair for pair in pairs if pair[0] != pair[1]]
        assert (before.operator, before.complemented) != (after.operator, after.complemented)
        assert (before.box, before.start, before.end) == (after.box, after.start, after.end)
    assert len(set(map(str, found))) == len(found)
    assert len(found) == sum(map(room, primitives(formula)))


def room(primitive: Primitive) -> int:
    """How many other structures an effect interval has room for: two operators need a tick more than the others."""
    span = primitive.end - primitive.start
    fitting = [each for each in Operator for _ in range(2) if span >= (2 if each.nested else 1)]
    return len(fitting) - (primitive.operator in fitting)


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("G[8,10] (x <= 2)", "G[8,9] F[0,1] (x <= 2)"),
        ("F[2,9] (x <= 2)", "F[2,6] G[0,3] !(x <= 2)"),
        ("G[4,10] F[0,4] (x <= 2)", "G[4,14] (x <= 2)"),
        ("G[4,10] F[0,4] (x <= 2)", "F[4,10] G[0,4] (x <= 2)"),
    ],
)
def test_by_hand(text: str, other: str):
    assert to_sdnf(parse(other)) in list(neighbours(to_sdnf(parse(text))))


@given(sdnfs(), st.integers(0, 2**32 - 1))
def test_what_asks_for_less_holds_wherever_the_formula_does(formula: SDNF, seed: int):
    everything = list(neighbours(formula))
    values = random_trajectories(seed, 20, 1 + max(each.end for each in primitives(formula)), len(VARIABLES))
    holds = formula.formula.verdict(values, variables=VARIABLES) > 0
    for other in weaker_neighbours(formula):
        assert other in everything
        assert (other.formula.verdict(values, variables=VARIABLES)[holds] > 0).all()


@pytest.mark.parametrize(
    ("text", "others"),
    [
        ("F[2,9] (x <= 2)", []),
        ("F[2,6] G[0,3] (x <= 2)", ["F[2,9] (x <= 2)"]),
        ("G[2,6] F[0,3] !(x <= 2)", ["F[2,9] !(x <= 2)"]),
        ("G[2,9] (x <= 2)", ["F[2,6] G[0,3] (x <= 2)", "G[2,6] F[0,3] (x <= 2)", "F[2,9] (x <= 2)"]),
        ("F[0,1] (x <= 2) & G[2,3] (x <= 1)", ["F[0,1] (x <= 2) & F[2,3] (x <= 1)"]),
    ],
)
def test_what_asks_for_less_by_hand(text: str, others: list[str]):
    assert list(weaker_neighbours(to_sdnf(parse(text)))) == [to_sdnf(parse(other)) for other in others]
