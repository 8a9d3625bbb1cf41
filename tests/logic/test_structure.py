from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import predicates, sdnfs
from tickwise.errors import FormulaError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.structure import structurally_equivalent, structurally_transferable, structure
from tickwise.logic.syntax import Box, Interval, Not

SOURCE = parse("F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)")
TARGET = parse("F[5,18] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[24,39] (4 <= x <= 7 & 1 <= y <= 2)")


def renumbered(phi: SDNF, predicate: Box | Not) -> SDNF:
    """The same structure with other windows, durations and predicates."""
    disjuncts = []
    for disjunct in phi.disjuncts:
        parts: list[Primitive] = []
        for old in disjunct.primitives:
            start = parts[-1].end + 2 if parts else 1
            duration = 2 if old.operator.nested else 0
            parts.append(Primitive(old.operator, Interval(start, start + 3), duration, predicate))
        disjuncts.append(SequentialConjunction(tuple(parts)))
    return SDNF(tuple(disjuncts))


def test_the_paper_s_formulas() -> None:
    assert structure(SOURCE) == ((Operator.EVENTUALLY_ALWAYS, Operator.EVENTUALLY),)
    assert structurally_equivalent(SOURCE, TARGET)
    assert structurally_transferable(TARGET, SOURCE)


def test_the_second_case_study() -> None:
    source = parse("G[0,25] F[0,8] (2 <= x <= 3 & 2 <= y <= 3)")
    target = parse("G[0,40] F[0,10] (2 <= x <= 3 & 3 <= y <= 4) | G[0,40] F[0,10] (4 <= x <= 5 & 3 <= y <= 4)")
    assert not structurally_equivalent(target, source)
    assert structurally_transferable(target, source)
    assert not structurally_transferable(source, target)


@settings(max_examples=50)
@given(sdnfs(), predicates())
def test_numbers_and_predicates_do_not_matter(phi: SDNF, predicate: Box | Not) -> None:
    other = renumbered(phi, predicate)
    assert structurally_equivalent(phi, other)
    assert structurally_equivalent(phi.formula, other)


@settings(max_examples=50)
@given(sdnfs(), predicates(), st.integers(2, 4))
def test_disjunctions_of_equivalents_are_transferable(source: SDNF, predicate: Box | Not, copies: int) -> None:
    other = renumbered(source, predicate)
    target = SDNF(source.disjuncts + other.disjuncts * (copies - 1))
    assert structurally_transferable(target, source)
    assert not structurally_equivalent(target, source)
    assert structurally_transferable(source, source)


@settings(max_examples=50)
@given(sdnfs(), sdnfs())
def test_equivalence_is_definition_6(a: SDNF, b: SDNF) -> None:
    same = len(a.disjuncts) == len(b.disjuncts)
    for one, other in zip(a.disjuncts, b.disjuncts, strict=False):
        same = same and len(one.primitives) == len(other.primitives)
        for left, right in zip(one.primitives, other.primitives, strict=False):
            same = same and left.operator == right.operator
    assert structurally_equivalent(a, b) == structurally_equivalent(b, a) == same


@pytest.mark.parametrize(
    ("target", "source"),
    [
        ("F[0,1] (x >= 3)", "G[0,1] (x >= 3)"),
        ("F[0,1] (x >= 3)", "F[0,1] G[0,1] (x >= 3)"),
        ("F[0,1] (x >= 3)", "F[0,1] (x >= 3) & F[2,3] (x >= 3)"),
        ("F[0,1] (x >= 3) & F[2,3] (x >= 3)", "F[0,1] (x >= 3)"),
        ("F[0,1] (x >= 3)", "F[0,1] (x >= 3) | F[0,1] (y >= 3)"),
        ("F[0,1] (x >= 3) | G[0,1] (y >= 3)", "F[0,1] (x >= 3)"),
        ("F[0,1] (x >= 3) | G[0,1] (y >= 3)", "G[0,1] (x >= 3) | F[0,1] (y >= 3)"),
        (
            "F[0,1] (x >= 3) | G[0,1] (y >= 3) | F[0,1] (x >= 3)",
            "F[0,1] (x >= 3) | G[0,1] (y >= 3)",
        ),
    ],
)
def test_not_transferable(target: str, source: str) -> None:
    assert not structurally_equivalent(parse(target), parse(source))
    assert not structurally_transferable(parse(target), parse(source))


def test_a_negated_primitive_counts_by_its_dual_operator() -> None:
    assert structurally_equivalent(parse("!F[0,1] (x >= 3)"), parse("G[0,1] (y <= 2)"))


def test_a_formula_without_a_normal_form_is_refused() -> None:
    with pytest.raises(FormulaError, match="stands outside every temporal operator"):
        structure(parse("x >= 3"))
