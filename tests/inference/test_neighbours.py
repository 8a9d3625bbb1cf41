from __future__ import annotations

import pytest
from hypothesis import given

from tests.strategies import sdnfs
from tickwise.inference.neighbours import neighbours
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
