from __future__ import annotations

import math

import pytest
from hypothesis import given, settings

from tests.strategies import formulas, sdnfs
from tickwise.logic.parse import parse
from tickwise.logic.render import to_english, to_latex, to_text, to_unicode
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.syntax import And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or

PAPER = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"


def test_the_paper_s_formula_in_every_notation() -> None:
    phi = parse(PAPER)
    assert to_text(phi) == str(phi) == PAPER
    assert to_unicode(phi) == "◇[1,15] □[0,4] (3 ≤ x ≤ 4 ∧ 3 ≤ y ≤ 5) ∧ ◇[21,39] (7 ≤ x ≤ 8 ∧ 5 ≤ y ≤ 8)"
    assert to_latex(phi) == (
        r"\Diamond_{[1,15]}\Box_{[0,4]}(3 \le x \le 4 \wedge 3 \le y \le 5) \wedge "
        r"\Diamond_{[21,39]}(7 \le x \le 8 \wedge 5 \le y \le 8)"
    )


@pytest.mark.parametrize(
    ("text", "unicode", "latex"),
    [
        ("x >= 3", "x ≥ 3", r"x \ge 3"),
        ("!(x > 3)", "¬(x > 3)", r"\lnot (x > 3)"),
        ("!!(x < 3)", "¬¬(x < 3)", r"\lnot \lnot (x < 3)"),
        ("!F[0,3] (x == 3)", "¬◇[0,3] (x = 3)", r"\lnot \Diamond_{[0,3]}(x = 3)"),
        ("G[0,3] !(x <= 3)", "□[0,3] ¬(x ≤ 3)", r"\Box_{[0,3]}\lnot (x \le 3)"),
        ("true | !false", "⊤ ∨ ¬⊥", r"\top \vee \lnot \bot"),
        (
            "((x > 1) & (y > 1)) | F[0,1] true",
            "((x > 1) ∧ (y > 1)) ∨ ◇[0,1] ⊤",
            r"((x > 1) \wedge (y > 1)) \vee \Diamond_{[0,1]}\top",
        ),
        (
            "((x > 1) & true) & true",
            "((x > 1) ∧ ⊤) ∧ ⊤",
            r"((x > 1) \wedge \top) \wedge \top",
        ),
        (
            '1 < x_1 <= 2 & "F" >= -1e-07 & speed < 0.1',
            '1 < x_1 ≤ 2 ∧ "F" ≥ -1e-07 ∧ speed < 0.1',
            r"1 < x_{1} \le 2 \wedge \mathit{F} \ge -1e-07 \wedge \mathit{speed} < 0.1",
        ),
    ],
)
def test_notations(text: str, unicode: str, latex: str) -> None:
    phi = parse(text)
    assert to_text(phi) == text
    assert to_unicode(phi) == unicode
    assert to_latex(phi) == latex


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (3.0, "3"),
        (-0.5, "-0.5"),
        (0.1, "0.1"),
        (1e22, "1e+22"),
        (123456789.0, "123456789"),
        (5e-324, "5e-324"),
    ],
)
def test_numbers_are_short(number: float, text: str) -> None:
    assert to_text(Box((Bound("x", upper=number),))) == f"x <= {text}"


@given(sdnfs())
def test_whatever_has_a_formula_is_printed(phi: SDNF) -> None:
    assert to_text(phi) == str(phi) == to_text(phi.formula)
    assert str(phi.disjuncts[0]) == to_text(phi.disjuncts[0])
    assert str(phi.disjuncts[0].primitives[0]) == to_text(phi.disjuncts[0].primitives[0].formula)


GREEN, YELLOW = Box.of(x=(3, 4), y=(3, 5)), Box.of(x=(7, 8), y=(5, 8))
NAMES = {GREEN: "G", YELLOW: "Y"}
IN_GREEN, IN_YELLOW = f"({GREEN})", f"({YELLOW})"


@pytest.mark.parametrize(
    ("text", "english"),
    [
        (
            PAPER,
            "within ticks 1 to 15, reach G and stay for 4 more ticks; then, within ticks 21 to 39, reach Y",
        ),
        (f"F[0,3] !{IN_GREEN}", "within ticks 0 to 3, leave G"),
        (f"F[3,3] {IN_GREEN}", "at tick 3, be in G"),
        (f"F[3,3] !{IN_GREEN}", "at tick 3, be outside G"),
        (f"G[2,9] {IN_GREEN}", "throughout ticks 2 to 9, stay in G"),
        (f"G[2,9] !{IN_GREEN}", "throughout ticks 2 to 9, avoid G"),
        (f"!F[2,9] {IN_GREEN}", "throughout ticks 2 to 9, avoid G"),
        (f"G[2,2] {IN_GREEN}", "at tick 2, stay in G"),
        (f"F[2,9] G[0,1] {IN_GREEN}", "within ticks 2 to 9, reach G and stay for 1 more tick"),
        (f"F[2,2] G[0,5] {IN_GREEN}", "at tick 2, reach G and stay for 5 more ticks"),
        (f"F[2,9] G[0,5] !{IN_GREEN}", "within ticks 2 to 9, leave G and stay outside for 5 more ticks"),
        (f"G[0,25] F[0,8] {IN_GREEN}", "at every tick from 0 to 25, return to G within 8 ticks"),
        (f"G[0,25] F[0,8] !{IN_GREEN}", "at every tick from 0 to 25, leave G within 8 ticks"),
        (f"G[4,4] F[0,1] {IN_GREEN}", "at tick 4, return to G within 1 tick"),
        (
            f"F[0,3] {IN_GREEN} | G[0,3] {IN_YELLOW}",
            "either within ticks 0 to 3, reach G, or throughout ticks 0 to 3, stay in Y",
        ),
        (
            f"(F[0,3] {IN_GREEN} & F[4,5] {IN_YELLOW}) | G[0,3] {IN_YELLOW}",
            "either (within ticks 0 to 3, reach G; then, within ticks 4 to 5, reach Y), "
            "or (throughout ticks 0 to 3, stay in Y)",
        ),
        ("G[0,3] (x > 21 & 1 <= y < 2)", "throughout ticks 0 to 3, stay in the region x > 21 and 1 ≤ y < 2"),
        # no normal form: told node by node
        (f"{IN_GREEN}", "the state is in G"),
        (f"!{IN_GREEN}", "the state is outside G"),
        (
            f"F[0,9] G[1,2] F[3,3] {IN_GREEN}",
            "within ticks 4 to 13, reach G and stay for 1 more tick",
        ),
        (
            f"F[0,9] G[1,2] F[3,4] {IN_GREEN}",
            "at some tick from 0 to 9, at every tick from 1 to 2 later, at some tick from 3 to 4 later, "
            "the state is in G",
        ),
        (
            f"!({IN_GREEN} & {IN_YELLOW}) | true | false",
            "either it is not the case that (both the state is in G and the state is in Y), "
            "or anything holds, or nothing holds",
        ),
        (
            f"{IN_GREEN} & {IN_YELLOW} & G[5,5] true",
            "all of these hold: the state is in G; the state is in Y; at tick 5, anything holds",
        ),
        (
            f"F[0,2] ({IN_GREEN} & (G[1,1] {IN_YELLOW} | true))",
            "at some tick from 0 to 2, (both the state is in G and "
            "(either 1 tick later, the state is in Y or anything holds))",
        ),
    ],
)
def test_english(text: str, english: str) -> None:
    assert to_english(parse(text), NAMES) == english


def test_english_without_names() -> None:
    assert to_english(to_sdnf(parse(PAPER))) == (
        "within ticks 1 to 15, reach the region 3 ≤ x ≤ 4 and 3 ≤ y ≤ 5 and stay for 4 more ticks; "
        "then, within ticks 21 to 39, reach the region 7 ≤ x ≤ 8 and 5 ≤ y ≤ 8"
    )


@settings(max_examples=200)
@given(formulas())
def test_every_formula_has_one_english_line(phi: Formula) -> None:
    sentence = to_english(phi)
    assert sentence
    assert "\n" not in sentence
    assert sentence.count("(") == sentence.count(")")


def test_parentheses_are_few() -> None:
    box = Box((Bound("x", lower=1.0), Bound("y", upper=math.pi)))
    inner = Eventually(Interval(0, 1), box)
    assert to_text(And((inner, Or((Not(inner), Constant(True)))))) == (
        "F[0,1] (x >= 1 & y <= 3.141592653589793) & (!F[0,1] (x >= 1 & y <= 3.141592653589793) | true)"
    )
