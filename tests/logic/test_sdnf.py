from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import (
    VARIABLES,
    formulas,
    intervals,
    predicates,
    primitives,
    random_trajectories,
    sdnfs,
    sequential_conjunctions,
)
from tickwise.errors import FormulaError
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction, to_sdnf
from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Interval, Not, Or

IN_X = Box.of(x=(3, 4))


@st.composite
def rewritable(draw: st.DrawFn) -> Formula:
    """A formula that often has a normal form: stages one after another, each with redundant structure."""
    stages: list[Formula] = []
    for _ in range(draw(st.integers(1, 3))):
        inner: Formula = draw(
            formulas(constants=False, longest=2, max_leaves=2) if draw(st.booleans()) else predicates()
        )
        if draw(st.booleans()):
            extra = draw(st.lists(predicates(), min_size=1, max_size=2))
            inner = draw(st.sampled_from((And, Or)))((inner, *extra))
        for _ in range(draw(st.integers(1, 3))):
            inner = draw(st.builds(draw(st.sampled_from((Eventually, Always))), intervals(3), st.just(inner)))
        if draw(st.booleans()):
            inner = Not(inner)
        start = max((stage.end_effect + 1 for stage in stages), default=0)
        shift = draw(st.sampled_from((Eventually, Always)))
        stages.insert(draw(st.integers(0, len(stages))), shift(Interval(start, start), inner))
    if len(stages) == 1:
        return stages[0]
    return And(tuple(stages)) if draw(st.booleans()) else Or(tuple(stages))


def assert_same_meaning(phi: Formula, seed: int) -> None:
    """The normal form has the same verdict and robustness, also on trajectories that end early."""
    normal = to_sdnf(phi).formula
    ticks = phi.end_effect + 2
    values = random_trajectories(seed, 30, ticks, len(VARIABLES))
    lengths = np.random.default_rng(seed).integers(1, ticks + 1, size=len(values))
    lengths[:15] = ticks
    options = {"variables": VARIABLES, "lengths": lengths}
    assert np.array_equal(phi.verdict(values, **options), normal.verdict(values, **options))  # type: ignore[arg-type]
    np.testing.assert_equal(phi.robustness(values, **options), normal.robustness(values, **options))  # type: ignore[arg-type]


@settings(max_examples=250)
@given(st.one_of(rewritable(), formulas(constants=False)), st.integers(0, 2**32 - 1))
def test_the_normal_form_means_the_same(phi: Formula, seed: int) -> None:
    with contextlib.suppress(FormulaError):
        assert_same_meaning(phi, seed)


@settings(max_examples=100)
@given(sdnfs())
def test_a_normal_form_passes_through_unchanged(phi: SDNF) -> None:
    assert to_sdnf(phi) is phi
    assert to_sdnf(phi.formula) == phi
    assert to_sdnf(parse(str(phi))) == phi


@settings(max_examples=200)
@given(primitives())
def test_negation_is_the_dual_primitive(primitive: Primitive) -> None:
    assert to_sdnf(Not(primitive.formula)).formula == primitive.negation.formula
    assert primitive.negation.negation == primitive
    assert_same_meaning(Not(primitive.formula), 7)


@given(sequential_conjunctions())
def test_order_in_a_conjunction_does_not_matter(conjunction: SequentialConjunction) -> None:
    parts = tuple(reversed(conjunction.primitives))
    shuffled = And(tuple(part.formula for part in parts)) if len(parts) > 1 else parts[0].formula
    assert to_sdnf(shuffled).disjuncts == (conjunction,)


@pytest.mark.parametrize(
    ("text", "normal"),
    [
        # negations inward
        ("!F[1,5] (x >= 3)", "G[1,5] !(x >= 3)"),
        ("!G[1,5] F[0,2] !(x >= 3)", "F[1,5] G[0,2] (x >= 3)"),
        ("!!F[1,5] !!(x >= 3)", "F[1,5] (x >= 3)"),
        ("!(F[1,2] (x >= 3) & G[3,4] (y >= 3))", "G[1,2] !(x >= 3) | F[3,4] !(y >= 3)"),
        ("!(F[1,2] (x >= 3) | G[3,4] (y >= 3))", "G[1,2] !(x >= 3) & F[3,4] !(y >= 3)"),
        # one box below an operator
        ("F[1,5] ((x >= 3) & (y >= 3))", "F[1,5] (x >= 3 & y >= 3)"),
        ("G[1,5] ((x >= 3) & (x <= 4))", "G[1,5] (3 <= x <= 4)"),
        ("G[1,5] ((x >= 3) & !(x > 4))", "G[1,5] (3 <= x <= 4)"),
        ("F[1,5] ((x >= 3) & !(x > 4))", "F[1,5] (3 <= x <= 4)"),
        ("G[1,5] ((x < 3) | (x > 4))", "G[1,5] !(3 <= x <= 4)"),
        ("F[1,5] !(x >= 3 & y >= 3)", "F[1,5] !(x >= 3 & y >= 3)"),
        ("F[1,5] (!(3 <= x <= 4) | !(3 <= y <= 4))", "F[1,5] !(3 <= x <= 4 & 3 <= y <= 4)"),
        ("G[1,5] (!(3 <= x <= 4) | !(3 <= y <= 4))", "G[1,5] !(3 <= x <= 4 & 3 <= y <= 4)"),
        ("G[1,5] G[0,2] ((x >= 3) & F[0,0] F[0,0] (x >= 3) | (x >= 3))", None),
        # operators in a row
        ("F[1,5] F[2,3] (x >= 3)", "F[3,8] (x >= 3)"),
        ("G[1,5] G[2,3] (x >= 3)", "G[3,8] (x >= 3)"),
        ("F[1,5] G[2,6] (x >= 3)", "F[3,7] G[0,4] (x >= 3)"),
        ("G[1,5] F[2,6] (x >= 3)", "G[3,7] F[0,4] (x >= 3)"),
        ("F[1,5] G[2,2] (x >= 3)", "F[3,7] (x >= 3)"),
        ("G[1,5] F[0,0] (x >= 3)", "G[1,5] (x >= 3)"),
        ("F[1,5] F[1,1] G[2,6] (x >= 3)", "F[4,8] G[0,4] (x >= 3)"),
        ("F[1,1] G[2,6] F[0,3] (x >= 3)", "G[3,7] F[0,3] (x >= 3)"),
        ("F[1,5] G[2,2] F[0,3] (x >= 3)", "F[3,10] (x >= 3)"),
        # distribution
        ("F[1,5] ((x >= 3) | (y >= 3))", "F[1,5] (x >= 3) | F[1,5] (y >= 3)"),
        ("F[1,5] ((x >= 3) | G[0,2] (y >= 3))", "F[1,5] (x >= 3) | F[1,5] G[0,2] (y >= 3)"),
        ("G[1,2] ((x >= 3) & F[2,3] (y >= 3))", "G[1,2] (x >= 3) & G[3,4] F[0,1] (y >= 3)"),
        ("F[1,1] ((x >= 3) & F[2,3] (y >= 3))", "F[1,1] (x >= 3) & F[3,4] (y >= 3)"),
        (
            "F[0,1] (x >= 3) & (G[2,3] (y >= 3) | G[4,5] (x >= 3))",
            "(F[0,1] (x >= 3) & G[2,3] (y >= 3)) | (F[0,1] (x >= 3) & G[4,5] (x >= 3))",
        ),
        ("F[1,5] ((x >= 3) & ((y >= 3) | (y <= 1)))", "F[1,5] (x >= 3 & y >= 3) | F[1,5] (x >= 3 & y <= 1)"),
        # order and repetition
        ("F[4,5] (x >= 3) & F[0,1] (y >= 3)", "F[0,1] (y >= 3) & F[4,5] (x >= 3)"),
        ("F[0,1] (y >= 3) & F[0,1] (y >= 3)", "F[0,1] (y >= 3)"),
    ],
)
def test_rewriting_by_hand(text: str, normal: str | None) -> None:
    if normal is None:
        with pytest.raises(FormulaError):
            to_sdnf(parse(text))
    else:
        assert str(to_sdnf(parse(text))) == normal
        assert_same_meaning(parse(text), 1)


NO_FORM = "has no sequential disjunctive normal form:"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "F[0,1] (x >= 3) & (y >= 3)",
            "the predicate y >= 3 stands outside every temporal operator; say when it must hold, "
            "for instance F[0,0] (y >= 3)",
        ),
        (
            "F[0,1] true",
            "the constant true has no place in a normal form of primitives; leave it out",
        ),
        (
            "F[0,5] G[0,2] F[0,3] (x >= 3)",
            f"F[0,5] G[0,2] F[0,3] (x >= 3) {NO_FORM} its operators alternate three times; use F, G, F G or G F",
        ),
        (
            "F[0,5] ((x >= 3) & G[1,2] (y >= 3))",
            f"F[0,5] ((x >= 3) & G[1,2] (y >= 3)) {NO_FORM} its operand has a conjunction of x >= 3, "
            "G[1,2] (y >= 3) that is neither a box nor a complement; "
            "distribute the operator over ∨ only, or write the operand as one box",
        ),
        (
            "G[0,5] ((3 <= x <= 4) | F[1,2] (y >= 3))",
            f"G[0,5] ((3 <= x <= 4) | F[1,2] (y >= 3)) {NO_FORM} its operand has a disjunction of "
            "3 <= x <= 4, F[1,2] (y >= 3) that is neither a box nor a complement; "
            "distribute the operator over ∧ only, or write the operand as one box",
        ),
        (
            "F[0,5] ((x >= 3) & (x <= 2))",
            f"F[0,5] ((x >= 3) & (x <= 2)) {NO_FORM} x >= 3 and x <= 2 exclude each other; make the regions overlap",
        ),
        (
            "G[0,5] ((x >= 3) & (x <= 2))",
            f"G[0,5] ((x >= 3) & (x <= 2)) {NO_FORM} x >= 3 and x <= 2 exclude each other; make the regions overlap",
        ),
        (
            "G[0,5] ((x >= 3) | (x <= 4))",
            f"G[0,5] ((x >= 3) | (x <= 4)) {NO_FORM} a part of its operand holds everywhere; leave that part out",
        ),
        (
            "F[0,5] (x >= 3) & G[5,6] (y >= 3)",
            "not sequential (Definition 5): F[0,5] (x >= 3) has effect until tick 5, "
            "G[5,6] (y >= 3) from tick 5; make the later window start at 6 or after",
        ),
        (
            " & ".join(f"(F[{i},{i}] (x >= 3) | F[{i},{i}] (y >= 3))" for i in range(13)),
            "the normal form has more than 4096 disjuncts; split the formula up",
        ),
    ],
)
def test_what_has_no_normal_form(text: str, message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        to_sdnf(parse(text))
    assert str(caught.value) == message


def test_complements_that_cover_everything_stay_apart_under_eventually() -> None:
    assert str(to_sdnf(parse("F[0,5] (!(x >= 3) | !(x <= 2))"))) == "F[0,5] !(x >= 3) | F[0,5] !(x <= 2)"


def test_operators() -> None:
    assert [operator.symbol for operator in Operator] == ["◇", "□", "◇□", "□◇"]
    assert [operator.nested for operator in Operator] == [False, False, True, True]
    assert [operator.dual.value for operator in Operator] == ["G", "F", "GF", "FG"]


def test_the_paper_s_formula() -> None:
    text = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"
    phi = to_sdnf(parse(text))
    assert phi.size == 2
    assert str(phi) == text
    reach, then = phi.disjuncts[0].primitives
    assert (reach.operator, reach.start, reach.end, reach.duration) == (Operator.EVENTUALLY_ALWAYS, 1, 19, 4)
    assert (then.operator, then.start, then.end, then.duration) == (Operator.EVENTUALLY, 21, 39, 0)
    assert reach.box == reach.predicate == Box.of(x=(3, 4), y=(3, 5))
    assert not reach.complemented
    assert (reach.start, reach.end) == (reach.formula.start_effect, reach.formula.end_effect)


def test_malformed_parts() -> None:
    with pytest.raises(FormulaError, match="operator F does not go with a duration of 3 ticks"):
        Primitive(Operator.EVENTUALLY, Interval(0, 1), 3, IN_X)
    with pytest.raises(FormulaError, match="operator GF does not go with a duration of 0 ticks"):
        Primitive(Operator.ALWAYS_EVENTUALLY, Interval(0, 1), 0, IN_X)
    with pytest.raises(FormulaError, match="the predicate !true of a primitive is neither a box nor its complement"):
        Primitive(Operator.EVENTUALLY, Interval(0, 1), 0, Not(Constant(True)))
    with pytest.raises(FormulaError, match="a sequential conjunction needs at least one primitive"):
        SequentialConjunction(())
    with pytest.raises(FormulaError, match="a formula in SDNF needs at least one disjunct"):
        SDNF(())
