from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import all_numbers, boxes, formulas
from tickwise.errors import ParseError
from tickwise.logic.parse import parse
from tickwise.logic.render import to_latex, to_text, to_unicode
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or

LOW = Box((Bound("x", lower=3.0),))
HIGH = Box((Bound("x", upper=4.0),))
# words of the language, and names that need quotes or a backslash somewhere
AWKWARD = ("F", "ev_", "alw", "Not", "true", "finally_", "speed (m/s)", 'a"b', "a}~b", "", "x_1", "x_1_2")
AWKWARD += (
    "größe",
    "a.b",
    "x[t]",
    "a\\b",
    "two\nlines",
    "\\",
    "e",
    "1st",
    "in{side}",
    "50%",
    "x__y",
    "_",
    "²",
)


def assert_parses_back(phi: Formula) -> None:
    for render in (to_text, to_unicode, to_latex):
        assert parse(render(phi)) == phi


@settings(max_examples=300)
@given(formulas())
def test_printed_formulas_parse_back(phi: Formula) -> None:
    assert_parses_back(phi)


@settings(max_examples=150)
@given(formulas(AWKWARD, numbers=all_numbers))
def test_any_name_and_number_parses_back(phi: Formula) -> None:
    assert_parses_back(phi)


@settings(max_examples=100)
@given(st.text(max_size=6))
def test_any_text_can_be_a_name(name: str) -> None:
    assert_parses_back(Box((Bound(name, lower=1.0),)))


@settings(max_examples=100)
@given(boxes(numbers=all_numbers))
def test_a_box_alone_has_no_parentheses(box: Box) -> None:
    assert "(" not in str(box)


def test_the_paper_s_formula() -> None:
    phi = parse("F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)")
    assert phi == And(
        (
            Eventually(Interval(1, 15), Always(Interval(0, 4), Box.of(x=(3, 4), y=(3, 5)))),
            Eventually(Interval(21, 39), Box.of(x=(7, 8), y=(5, 8))),
        )
    )


@pytest.mark.parametrize(
    "text",
    [
        "F[1,15] G[0,4] (x >= 3) & !(x <= 4)",
        "F_[1,15] G_[0,4] (x >= 3) && not (x <= 4)",
        "eventually[1,15] always[0,4] (x >= 3) and not x <= 4",
        "Finally [1, 15] GLOBALLY [ 0 , 4 ] x>=3 AND ~(4>=x)",
        "ev_[1,15] (alw_[0,4] (x[t] >= 3)) /\\ !(x[t] <= 4)",
        "ev [1,15] alw [0,4] (x >= 3) & !(x <= 4)",
        "◇[1,15]□[0,4](x≥3)∧¬(x≤4)",
        "◊_[1,15] □_{[0,4]} (3 ≤ x) ∧ ¬(4 ≥ x)",
        r"\Diamond_{[1,15]}\Box_{[0,4]}(x\ge 3)\wedge\lnot(x\le4)",
        r"$\Diamond _{[1,15]} \Box_{[0, 4]} \left(x \geq 3\right) ~\land\; \neg (x~\leq~4)$",
        r"\lozenge_{[1,15]}\square_{[0,4]}(\mathit{x}\ge3)\wedge\lnot(\mathrm{x}\le4)",
        "F[1,15]\n  G[0,4] (x >= 3)\n& ! (x <= 4)",
    ],
)
def test_dialects(text: str) -> None:
    assert parse(text) == And((Eventually(Interval(1, 15), Always(Interval(0, 4), LOW)), Not(HIGH)))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("true", Constant(True)),
        ("False", Constant(False)),
        ("⊤", Constant(True)),
        (r"\bot", Constant(False)),
        (r"\top \vee \bot", Or((Constant(True), Constant(False)))),
        (r"x>=3 \/ x<=4", Or((LOW, HIGH))),
        ("x>=3 || x<=4", Or((LOW, HIGH))),
        ("x>=3 or x<=4", Or((LOW, HIGH))),
        ("!!(x >= 3)", Not(Not(LOW))),
        ("~~x >= 3", Not(Not(LOW))),
        ("(((x >= 3)))", LOW),
        ("x == 3", Box.of(x=(3, 3))),
        ("3 = x", Box.of(x=(3, 3))),
        ("3 <= x < 4", Box((Bound("x", 3.0, 4.0, False, True),))),
        ("4 > x >= 3", Box((Bound("x", 3.0, 4.0, False, True),))),
        ("x > -1.5e-3", Box((Bound("x", lower=-1.5e-3, lower_strict=True),))),
        ("x < +.5", Box((Bound("x", upper=0.5, upper_strict=True),))),
        ("x ≥ −2", Box((Bound("x", lower=-2.0),))),
        ("x_{1} >= 2.", Box((Bound("x_1", lower=2.0),))),
        ("robot.x >= 2", Box((Bound("robot.x", lower=2.0),))),
        ("F1 >= 2", Box((Bound("F1", lower=2.0),))),
        ("evening >= 2", Box((Bound("evening", lower=2.0),))),
        ('"F" >= 2', Box((Bound("F", lower=2.0),))),
    ],
)
def test_small_texts(text: str, expected: Formula) -> None:
    assert parse(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3 <= x <= 4 & 3 <= y <= 5", Box.of(x=(3, 4), y=(3, 5))),
        ("(3 <= x <= 4) & (3 <= y <= 5)", And((Box.of(x=(3, 4)), Box.of(y=(3, 5))))),
        ("x >= 3 & x <= 4", Box.of(x=(3, 4))),
        ("x >= 3 & y == 1 & x <= 4", Box.of(x=(3, 4), y=(1, 1))),
        ("x >= 4 & x <= 3", And((Box((Bound("x", lower=4.0),)), Box((Bound("x", upper=3.0),))))),
        ("x >= 3 & (x <= 4)", And((LOW, HIGH))),
        ("(x >= 3 & y >= 3) & x <= 4", And((Box((Bound("x", 3.0), Bound("y", 3.0))), HIGH))),
        ("x >= 3 & x <= 4 | x >= 3", Or((Box.of(x=(3, 4)), LOW))),
        ("x >= 3 & true & x <= 4", And((LOW, Constant(True), HIGH))),
        ("F[0,1] x >= 3 & x <= 4", And((Eventually(Interval(0, 1), LOW), HIGH))),
        ("!x >= 3 & x <= 4", And((Not(LOW), HIGH))),
        ("F[0,1] (x >= 3 & x <= 4)", Eventually(Interval(0, 1), Box.of(x=(3, 4)))),
        ("(true & true) & true", And((And((Constant(True),) * 2), Constant(True)))),
    ],
)
def test_what_merges_to_one_box(text: str, expected: Formula) -> None:
    assert parse(text) == expected


START = "a predicate such as x >= 3, an operator such as F[0,5], or '('"
ERRORS = [
    ("", 1, f"found the end of the text, expected {START}"),
    ("F[0,5]", 7, f"found the end of the text, expected {START}"),
    ("F[0,5] @ x", 8, f"found '@', expected {START}"),
    ("x >= 3 & & y >= 3", 10, f"found '&', expected {START}"),
    ("F (x >= 3)", 3, "found '(', expected an interval such as [0,5]"),
    (r"\Diamond(x >= 3)", 9, "found '(', expected an interval such as [0,5]"),
    ("F[9,3] (x >= 3)", 2, "interval [9,3] is reversed; write [3,9]"),
    ("F[-1,3] (x >= 3)", 3, "the interval bound -1 is before tick 0; use 0 or more"),
    ("F[0,2.5] (x >= 3)", 5, "the interval bound 2.5 is not a whole number of ticks; round it"),
    ("F[0,inf] (x >= 3)", 5, "found 'inf', expected a whole number of ticks"),
    ("F[0 5] (x >= 3)", 5, "found '5', expected ','"),
    ("F[0,5 (x >= 3)", 7, "found '(', expected ']'"),
    ("F_{[0,5] (x >= 3)", 10, "found '(', expected '}'"),
    ("(x >= 3", 8, "found the end of the text, expected ')' (closing the '(' of line 1, column 1)"),
    ("x >= 3)", 7, "found ')', expected the end of the text; there is no '(' before it"),
    ("x >= 3 y", 8, "found 'y', expected &, | or the end of the text"),
    ("x", 2, "found the end of the text, expected a comparison sign such as >="),
    ("x != 3", 3, "found '!', expected a comparison sign such as >="),
    ("x >= y", 6, "found 'y', expected a number"),
    ("3 <= 4", 6, "found '4', expected a variable's name"),
    ("3 <= x >= 4", 8, "<= and >= do not make a range; write one such as 3 <= x <= 4"),
    ("4 <= x <= 3", 1, "the range of 'x' is empty: 4 > 3; swap the bounds"),
    ("3 < x < 3", 1, "the range of 'x' is empty: both bounds are 3; use <= or >="),
    ("x >= 1e999", 6, "the number 1e999 is too large"),
    (
        r"(x>3)\wedge~(y>3)",
        12,
        "found '~', which could be a space or a negation; leave it out, or write \\lnot",
    ),
    (
        r"\Box_{[0,4]} ~(x>3)",
        14,
        "found '~', which could be a space or a negation; leave it out, or write \\lnot",
    ),
]


@pytest.mark.parametrize(("text", "column", "message"), ERRORS)
def test_errors_say_what_where_and_what_would_fit(text: str, column: int, message: str) -> None:
    with pytest.raises(ParseError) as caught:
        parse(text)
    assert str(caught.value) == f"line 1, column {column}: {message}\n{text}\n{' ' * (column - 1)}^"


def test_an_error_shows_its_own_line() -> None:
    with pytest.raises(ParseError) as caught:
        parse("F[0,5] (x >= 3)\n\t& G[0,5] x <\n& y >= 2")
    assert str(caught.value) == "line 3, column 1: found '&', expected a number\n& y >= 2\n^"


def test_of_a_long_line_the_surroundings_are_shown() -> None:
    text = " & ".join(["(x >= 3)"] * 100) + " & (x >> 3)" + " & (x >= 3)" * 100
    with pytest.raises(ParseError) as caught:
        parse(text)
    summary, shown, caret = str(caught.value).split("\n")
    assert summary == "line 1, column 1105: found '>', expected a number"
    assert len(shown) == 120
    assert shown[len(caret) - 1 :].startswith("> 3)")


def test_deep_nesting_is_refused_and_deep_parentheses_are_not() -> None:
    assert parse("(" * 10_000 + "x >= 3" + ")" * 10_000) == LOW
    assert parse(str(parse("!" * 99 + "(x >= 3)"))) == parse("!" * 99 + "(x >= 3)")
    for text in (
        "!" * 100 + "(x >= 3)",
        "!" * 10_000 + "(x >= 3)",
        "(true & " * 10_000 + "true" + ")" * 10_000,
    ):
        with pytest.raises(ParseError, match="the formula is nested more than 100 deep; write it flatter"):
            parse(text)


@settings(max_examples=300)
@given(st.text(alphabet='FGxy[]{}(),&|!~<>=.0123456789 \\_"\n◇□∧⊤ev_', max_size=20))
def test_any_text_gives_a_formula_or_a_parse_error(text: str) -> None:
    try:
        phi = parse(text)
    except ParseError as error:
        summary, _, caret = str(error).split("\n")
        assert summary.startswith("line ")
        assert caret.strip() == "^"
    else:
        assert parse(str(phi)) == phi
