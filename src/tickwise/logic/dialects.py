"""Formulas in the languages of other monitoring tools: rtamt, Breach, MoonLight and py-metric-temporal-logic.

Every tool has conventions of its own for intervals and for what lies beyond the end of a trace. The text says
the same as our formula, in verdict and (but for MoonLight) in robustness, on every trace that reaches the
formula's horizon `Formula.end_effect`. On shorter ones the tools differ; rtamt and py-metric-temporal-logic agree
with our verdict wherever it is not UNKNOWN, since they only fill in what is unknown:

- **rtamt** (discrete time, closed intervals) cuts a window at the trace's end: of an empty window `always` is
  inf and `eventually` -inf.
- **py-metric-temporal-logic** (intervals [a, b), so ``b + 1`` is written) holds the last value for ever. It
  reads an interval [a, a] as [0, 0]; none is ever written.
- **MoonLight** (dense time, closed intervals, values constant between ticks) has no answer for a time whose
  windows do not fit: its result is empty, or a NullPointerException is raised; of a window whose first tick
  is the trace's last it answers for that tick. Give it whole traces. Its verdicts (domain boolean) are ours;
  its robustness (domain minmax) is not always: version 0.3.1 notices some changes within a window too late.
- **Breach** (dense time, closed intervals) holds the last value, and puts values between two ticks on a
  straight line, which may cross a region that no tick is in. This is read from its source: it needs MATLAB.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from tickwise.errors import ConfigurationError, FormulaError
from tickwise.logic.propositions import propositions
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or


@dataclass(frozen=True, slots=True)
class _Dialect:
    """How one tool writes a formula.

    Attributes:
        tool: The tool's name, for messages.
        negation: Not, with `{}` for an operand that has its own parentheses where it needs them.
        conjunction: And, between operands.
        disjunction: Or, between operands.
        eventually: ◇, with `{start}` and `{end}`.
        always: □, likewise.
        value: A variable's value at the present time.
        number: A number.
        after: Ticks added to an interval's end, where the tool's intervals are open there.
        timed: Whether an interval is in units of time, so that a period can scale it.
        numeric: Whether predicates compare variables with numbers; otherwise regions are propositions.
        document: The whole text, from the formula and its text.
        name: What a variable can be called.
        reserved: Words of the language, which no variable can be called.
    """

    tool: str
    negation: str
    conjunction: str
    disjunction: str
    eventually: str
    always: str
    value: str = "{}"
    number: Callable[[float], str] = repr
    after: int = 0
    timed: bool = True
    numeric: bool = True
    document: Callable[[Formula, str], str] = lambda _, text: text
    name: re.Pattern[str] = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
    reserved: re.Pattern[str] = re.compile(r"(?!)")


def _words(text: str) -> re.Pattern[str]:
    return re.compile("|".join(text.split()))


_RTAMT: Final = _Dialect(
    tool="rtamt",
    negation="not {}",
    conjunction=" and ",
    disjunction=" or ",
    eventually="eventually[{start}:{end}] ",
    always="always[{start}:{end}] ",
    # "time" is the key of the time stamps in the data
    reserved=_words(
        "abs sqrt exp pow input output const real float long complex int bool assertion specification from import "
        "topic internal xor rise fall always eventually until since once historically next prev X Y F G U S H O W "
        "iff implies and or not true false TRUE FALSE s ms us ns ps unless s_next s_prev time"
    ),
)

_BREACH: Final = _Dialect(
    tool="Breach",
    negation="not {}",
    conjunction=" and ",
    disjunction=" or ",
    eventually="ev_[{start}, {end}] ",
    always="alw_[{start}, {end}] ",
    value="{}[t]",
    name=re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}"),
    # the four long words are replaced wherever they occur; the others are its operators and MATLAB's keywords
    reserved=re.compile(
        r".*(?:eventually|always|true|false).*|"
        + _words(
            "and or not ev alw until t inf break case catch classdef continue else elseif end for function global if "
            "otherwise parfor persistent return spmd switch try while"
        ).pattern
    ),
)


def _script(phi: Formula, text: str) -> str:
    signals = " ".join(f"real {name};" for name in phi.variables)
    return f"signal {{ {signals} }}\ndomain boolean;\nformula phi = {text};\n"


_MOONLIGHT: Final = _Dialect(
    tool="MoonLight",
    negation="!{}",
    conjunction=" & ",
    disjunction=" | ",
    eventually="eventually [{start}, {end}] ",
    always="globally [{start}, {end}] ",
    # a whole number is an int of 32 bits there, an exponent needs a point before it and takes no plus
    number=lambda value: re.sub(r"^(-?\d+)e", r"\1.0e", repr(value)).replace("e+", "e").replace("e", "E"),
    reserved=_words(
        "const default formula int real bool type minmax boolean domain signal space edges until since reach escape "
        "eventually globally once historically somewhere everywhere next inf true false atan2 hypot max min pow abs "
        "acos asin atan cbrt ceil cos cosh exp expm1 floor log log10 log1p signum sin sinh sqrt tan"
    ),
    document=_script,
)

_MTL: Final = _Dialect(
    tool="py-metric-temporal-logic",
    negation="~{}",
    conjunction=" & ",
    disjunction=" | ",
    eventually="F[{start}, {end}] ",
    always="G[{start}, {end}] ",
    after=1,
    timed=False,
    numeric=False,
)


def translate(phi: Formula, dialect: str, *, period: float = 1.0) -> str:
    """A formula in another tool's language; see this module for what the tools make of it.

    Args:
        phi: A formula. Constants within it are simplified away, since two of the tools have none.
        dialect: One of

            - ``rtamt``: the text of a `StlDiscreteTimeSpecification`, with a variable declared for each of
              ``phi.variables``;
            - ``breach``: the second argument of `STL_Formula`;
            - ``moonlight``: a script for `ScriptLoader.loadFromText` whose one formula is called ``phi`` and
              whose signals are ``phi.variables``, in that order; its domain is boolean until
              `setMinMaxDomain`;
            - ``mtl``: the text for `mtl.parse`. That language has no numbers, so the regions are the
              propositions ``p1``, ``p2``, …: see `tickwise.logic.propositions`.

        period: The time between two ticks, in the tool's unit of time; intervals are multiplied by it. MoonLight
            compares sums of such times as floats: take one that is exact, such as 0.5 or 0.125. ``mtl``
            counts in ticks.

    Returns:
        The text.

    Raises:
        ConfigurationError: If there is no such dialect, or the period is not positive, or given for ``mtl``.
        FormulaError: If the formula is a constant, or a variable cannot be called so in the tool.
    """
    known = DIALECTS.get(dialect)
    if known is None:
        raise ConfigurationError(f"dialect {dialect!r} is unknown; use one of {', '.join(DIALECTS)}")
    if not (math.isfinite(period) and period > 0):
        raise ConfigurationError(f"the period between two ticks is {period!r}; give a positive number")
    if not known.timed and period != 1:
        raise ConfigurationError(f"{known.tool} counts in ticks here; leave the period of {period!r} out")
    simple = _without_constants(phi)
    if isinstance(simple, Constant):
        raise FormulaError(f"the formula is always {str(simple.value).lower()}: {known.tool} has nothing to monitor")
    return _Writer(known, Decimal(repr(float(period))), phi).text(simple)


DIALECTS: Final = {"rtamt": _RTAMT, "breach": _BREACH, "moonlight": _MOONLIGHT, "mtl": _MTL}
"""The languages, by the name that `translate` takes."""


@dataclass(frozen=True, slots=True)
class _Writer:
    """Writes a formula; variables and regions that were simplified away keep their places."""

    dialect: _Dialect
    period: Decimal
    formula: Formula

    def text(self, simple: Formula) -> str:
        for name in self.formula.variables if self.dialect.numeric else ():
            self._check(name)
        return self.dialect.document(self.formula, self._write(simple))

    def _write(self, node: Formula) -> str:
        """Text that stands for itself as an operand: what has a binary connective is in parentheses."""
        match node:
            case Box():
                return self._region(node)
            case Not(operand):
                # rtamt and Breach let a negation reach as far as it can, so it is enclosed as a whole
                return f"({self.dialect.negation.format(self._write(operand))})"
            case And(operands):
                return f"({self.dialect.conjunction.join(map(self._write, operands))})"
            case Or(operands):
                return f"({self.dialect.disjunction.join(map(self._write, operands))})"
            case Eventually(interval, operand):
                return f"({self._operator(self.dialect.eventually, interval)}{self._write(operand)})"
            case Always(interval, operand):
                return f"({self._operator(self.dialect.always, interval)}{self._write(operand)})"
        raise TypeError(f"{type(node).__name__} is not a formula node of this library")

    def _operator(self, text: str, interval: Interval) -> str:
        return text.format(start=self._time(interval.start), end=self._time(interval.end + self.dialect.after))

    def _time(self, ticks: int) -> str:
        return f"{(self.period * ticks).normalize():f}"

    def _region(self, box: Box) -> str:
        if not self.dialect.numeric:
            return next(name for name, known in propositions(self.formula).items() if known == box)
        sides = [side for bound in box.bounds for side in self._sides(bound)]
        return sides[0] if len(sides) == 1 else f"({self.dialect.conjunction.join(sides)})"

    def _sides(self, bound: Bound) -> list[str]:
        value, number = self.dialect.value.format(bound.variable), self.dialect.number
        sides = []
        if not math.isinf(bound.lower):
            sides.append(f"({value} {'>' if bound.lower_strict else '>='} {number(bound.lower)})")
        if not math.isinf(bound.upper):
            sides.append(f"({value} {'<' if bound.upper_strict else '<='} {number(bound.upper)})")
        return sides

    def _check(self, name: str) -> None:
        if self.dialect.reserved.fullmatch(name):
            raise FormulaError(f"variable {name!r} is a word of {self.dialect.tool}'s language; rename it")
        if not self.dialect.name.fullmatch(name):
            raise FormulaError(
                f"{self.dialect.tool} cannot have a variable called {name!r}; rename it to ASCII letters, digits and _"
            )


def _without_constants(node: Formula) -> Formula:
    """An equivalent formula that has no constant in it, or is one; on short trajectories too."""
    match node:
        case Not(operand):
            inner = _without_constants(operand)
            return Constant(not inner.value) if isinstance(inner, Constant) else Not(inner)
        case Eventually(interval, operand) | Always(interval, operand):
            inner = _without_constants(operand)
            return inner if isinstance(inner, Constant) else type(node)(interval, inner)
        case And(operands) | Or(operands):
            decides = isinstance(node, Or)
            inners = [_without_constants(operand) for operand in operands]
            if Constant(decides) in inners:
                return Constant(decides)
            kept = tuple(inner for inner in inners if not isinstance(inner, Constant))
            if len(kept) < 2:
                return kept[0] if kept else Constant(not decides)
            return type(node)(kept)
    return node
