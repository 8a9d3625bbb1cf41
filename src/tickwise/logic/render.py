"""Formulas to text, Unicode, LaTeX and English; the first three parse back to an equal formula."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from tickwise.errors import FormulaError
from tickwise.logic.sdnf import Operator, Primitive, SequentialConjunction, to_sdnf
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Not, Or


@runtime_checkable
class HasFormula(Protocol):
    """Anything that stands for a formula: a primitive, a sequential conjunction, an SDNF."""

    @property
    def formula(self) -> Formula:
        """The formula."""


@dataclass(frozen=True, slots=True)
class _Notation:
    """How the parts of a formula are written."""

    eventually: str
    always: str
    negation: str
    conjunction: str
    disjunction: str
    true: str
    false: str
    at_most: str
    at_least: str
    equal: str
    name: Callable[[str], str]


# names that are read as something else; grammar.lark has the same words
_RESERVED = re.compile(r"F_?|G_?|ev_?|alw_?|(?i:(eventually|finally|always|globally)_?|and|or|not|true|false)")
_PLAIN_NAME = re.compile(r"[^\W\d]\w*(\.\w+)*")
_SYMBOL = re.compile(r"[^\W\d_]")
_SUBSCRIPTED = re.compile(r"([^\W\d_])_([^\W_]+)")


def _text_name(name: str) -> str:
    if _PLAIN_NAME.fullmatch(name) and not _RESERVED.fullmatch(name):
        return name
    return '"' + re.sub(r'(["\\])', r"\\\1", name) + '"'


def _latex_name(name: str) -> str:
    if _SYMBOL.fullmatch(name) and not _RESERVED.fullmatch(name):
        return name
    if _SUBSCRIPTED.fullmatch(name):
        return _SUBSCRIPTED.sub(r"\1_{\2}", name)
    return r"\mathit{" + re.sub(r"([\\{}_#$%&~^ ])", r"\\\1", name) + "}"


_TEXT = _Notation("F{} ", "G{} ", "!", " & ", " | ", "true", "false", "<=", ">=", "==", _text_name)
_UNICODE = _Notation("◇{} ", "□{} ", "¬", " ∧ ", " ∨ ", "⊤", "⊥", "≤", "≥", "=", _text_name)
_LATEX = _Notation(
    r"\Diamond_{{{}}}",
    r"\Box_{{{}}}",
    r"\lnot ",
    r" \wedge ",
    r" \vee ",
    r"\top",
    r"\bot",
    r"\le",
    r"\ge",
    "=",
    _latex_name,
)


def to_text(phi: Formula | HasFormula) -> str:
    """A formula as plain text, for instance ``F[1,15] G[0,4] (3 <= x <= 4 & y >= 3)``.

    Args:
        phi: A formula, or what has one.

    Returns:
        Text that `tickwise.logic.parse.parse` reads back to an equal formula; numbers have their shortest
        form.
    """
    return _render(_formula(phi), _TEXT)


def to_unicode(phi: Formula | HasFormula) -> str:
    """A formula in symbols, for instance ``◇[1,15] □[0,4] (3 ≤ x ≤ 4 ∧ y ≥ 3)``; see `to_text`."""
    return _render(_formula(phi), _UNICODE)


def to_latex(phi: Formula | HasFormula) -> str:
    r"""A formula in the paper's LaTeX, such as ``\Diamond_{[1,15]}\Box_{[0,4]}(x \ge 3)``; see `to_text`."""
    return _render(_formula(phi), _LATEX)


def _formula(phi: Formula | HasFormula) -> Formula:
    return phi.formula if isinstance(phi, HasFormula) else phi


def _render(node: Formula, notation: _Notation) -> str:
    if isinstance(node, Box):
        return notation.conjunction.join(_range(bound, notation) for bound in node.bounds)
    if isinstance(node, Constant):
        return notation.true if node.value else notation.false
    if isinstance(node, Not):
        return notation.negation + _operand(node.operand, notation)
    if isinstance(node, Eventually):
        return notation.eventually.format(node.interval) + _operand(node.operand, notation)
    if isinstance(node, Always):
        return notation.always.format(node.interval) + _operand(node.operand, notation)
    symbol = notation.conjunction if isinstance(node, And) else notation.disjunction
    return symbol.join(_operand(child, notation) for child in node.children)


def _operand(node: Formula, notation: _Notation) -> str:
    inner = _render(node, notation)
    return f"({inner})" if isinstance(node, Box | And | Or) else inner


def _range(bound: Bound, notation: _Notation) -> str:
    name, lower, upper = notation.name(bound.variable), _number(bound.lower), _number(bound.upper)
    at_least = ">" if bound.lower_strict else notation.at_least
    at_most = "<" if bound.upper_strict else notation.at_most
    if bound.lower == bound.upper:
        return f"{name} {notation.equal} {lower}"
    if bound.upper == float("inf"):
        return f"{name} {at_least} {lower}"
    if bound.lower == float("-inf"):
        return f"{name} {at_most} {upper}"
    below = "<" if bound.lower_strict else notation.at_most
    return f"{lower} {below} {name} {at_most} {upper}"


def _number(value: float) -> str:
    """The shortest text that reads back as the same number, without a point where it is whole."""
    return repr(float(value)).removesuffix(".0")


def to_english(phi: Formula | HasFormula, names: Mapping[Box, str] | None = None) -> str:
    """A formula as an English sentence, without a full stop.

    A formula with a sequential disjunctive normal form is told stage by stage, for instance "within ticks 1
    to 15, reach G and stay for 4 more ticks; then, within ticks 21 to 39, reach Y". Any other is told node
    by node.

    Args:
        phi: A formula, or what has one.
        names: Names of regions; a box without one is described by its ranges.

    Returns:
        The sentence.
    """
    formula, names = _formula(phi), names or {}
    try:
        disjuncts = to_sdnf(formula).disjuncts
    except FormulaError:
        return _clause(formula, names, nested=False)
    if len(disjuncts) == 1:
        return _stages(disjuncts[0], names)
    alternatives = [_stages(disjunct, names) for disjunct in disjuncts]
    if any(len(disjunct.primitives) > 1 for disjunct in disjuncts):
        alternatives = [f"({alternative})" for alternative in alternatives]
    return f"either {', or '.join(alternatives)}"


def _stages(conjunction: SequentialConjunction, names: Mapping[Box, str]) -> str:
    return "; then, ".join(_stage(primitive, names) for primitive in conjunction.primitives)


def _stage(primitive: Primitive, names: Mapping[Box, str]) -> str:
    region, window = _region(primitive.box, names), primitive.window
    duration = _ticks(primitive.duration)
    outside, single = primitive.complemented, window.start == window.end
    when = f"at tick {window.start}" if single else f"ticks {window.start} to {window.end}"
    if primitive.operator is Operator.EVENTUALLY:
        if single:
            return f"{when}, be {'outside' if outside else 'in'} {region}"
        return f"within {when}, {'leave' if outside else 'reach'} {region}"
    if primitive.operator is Operator.ALWAYS:
        return f"{'' if single else 'throughout '}{when}, {'avoid' if outside else 'stay in'} {region}"
    if primitive.operator is Operator.EVENTUALLY_ALWAYS:
        act = f"leave {region} and stay outside" if outside else f"reach {region} and stay"
        return f"{'' if single else 'within '}{when}, {act} for {duration.replace(' ', ' more ', 1)}"
    act = f"leave {region}" if outside else f"return to {region}"
    when = when if single else f"at every tick from {window.start} to {window.end}"
    return f"{when}, {act} within {duration}"


def _clause(node: Formula, names: Mapping[Box, str], *, nested: bool) -> str:
    """A statement on a node; one nested in a temporal operator counts ticks from that operator's tick."""
    if isinstance(node, Box):
        return f"the state is in {_region(node, names)}"
    if isinstance(node, Constant):
        return "anything holds" if node.value else "nothing holds"
    if isinstance(node, Not):
        if isinstance(node.operand, Box):
            return f"the state is outside {_region(node.operand, names)}"
        return f"it is not the case that {_part(node.operand, names, nested=nested)}"
    if isinstance(node, Eventually | Always):
        return f"{_when(node, nested)}, {_part(node.operand, names, nested=True)}"
    opening, link = ("both ", " and ") if isinstance(node, And) else ("either ", " or ")
    if len(node.children) > 2:
        opening, link = ("all of these hold: ", "; ") if isinstance(node, And) else ("either ", ", or ")
    return opening + link.join(_part(child, names, nested=nested) for child in node.children)


def _part(node: Formula, names: Mapping[Box, str], *, nested: bool) -> str:
    clause = _clause(node, names, nested=nested)
    return f"({clause})" if isinstance(node, And | Or) else clause


def _when(node: Eventually | Always, nested: bool) -> str:
    interval = node.interval
    if interval.start == interval.end:
        return f"{_ticks(interval.start)} later" if nested else f"at tick {interval.start}"
    which = "some" if isinstance(node, Eventually) else "every"
    return f"at {which} tick from {interval.start} to {interval.end}{' later' * nested}"


def _region(box: Box, names: Mapping[Box, str]) -> str:
    if box in names:
        return names[box]
    return "the region " + " and ".join(_range(bound, _UNICODE) for bound in box.bounds)


def _ticks(count: int) -> str:
    return f"{count} tick" if count == 1 else f"{count} ticks"
