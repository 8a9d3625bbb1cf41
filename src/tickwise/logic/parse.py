"""Text to formulas; the grammar is in ``grammar.lark`` beside this file."""

from __future__ import annotations

import math
import re
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

from lark import Lark, Token, Transformer, UnexpectedInput, UnexpectedToken, v_args

from tickwise._wording import brief
from tickwise.errors import FormulaError, ParseError
from tickwise.logic.region import intersect
from tickwise.logic.syntax import Always, And, Bound, Box, Constant, Eventually, Formula, Interval, Not, Or

# deep enough for any formula a person writes; every later recursion over the tree stays within Python's limit
_DEEPEST = 100

# characters shown on either side of an error
_MARGIN = 60

# the last tick: what follows a formula, such as the guards of its automaton, counts in 32 bits
_LAST_TICK = 2**31 - 2

_EXPECTED = {
    "LSQB": "an interval such as [0,5]",
    "TICK": "a whole number of ticks",
    "_COMMA": "','",
    "_RSQB": "']'",
    "_RBRACE": "'}'",
    "COMPARE": "a comparison sign such as >=",
    "NUMBER": "a number",
    "NAME": "a variable's name",
    "_AND": "&",
    "_OR": "|",
    "_RPAR": "')'",
    "$END": "the end of the text",
}
_EXPECTED_FORMULA = "a predicate such as x >= 3, an operator such as F[0,5], or '('"

# a quoted name (to skip it), or a ~ that could be a negation or LaTeX's space
_AMBIGUOUS_TIE = re.compile(
    r'"(?:[^"\\]|\\[\s\S])*"|'
    r"(?:\\(?:wedge|land|vee|lor)|\})\s*(?P<tie>~)"
    r"(?!~*\s*(?:$|[)<>=≤≥&∧|∨]|\\(?:wedge|land|vee|lor|leq|geq|le|ge|lt|gt|right)(?![A-Za-z])))"
)

_COMPARISONS = {"≤": "<=", "≥": ">=", "=": "==", "lt": "<", "gt": ">"} | dict.fromkeys(("le", "leq"), "<=")
_COMPARISONS |= dict.fromkeys(("ge", "geq"), ">=")
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


def parse(text: str) -> Formula:
    """Read a formula.

    In a conjunction, neighbouring comparisons without parentheses make one box, as in
    ``3 <= x <= 4 & 3 <= y <= 5``. A temporal operator binds tighter than ``&``, and ``&`` tighter than ``|``.
    A variable whose name is not a plain word, or is a word of the language such as F, goes in double quotes.

    Args:
        text: Plain text (``F[1,15] G[0,4] (x >= 3)``), Unicode (``◇[1,15] □[0,4] (x ≥ 3)``), words
            (``eventually``, ``always``, ``and``, ``or``, ``not``), Breach's ``ev_`` and ``alw_``, or the
            LaTeX of the paper.

    Returns:
        The formula; ``parse(str(phi)) == phi``.

    Raises:
        FormulaError: If it is not text at all.
        ParseError: If the text is not a formula. The message has one line that says what was found where and
            what was expected, then the line of the text, then a caret under the place.
    """
    if not isinstance(text, str):
        raise FormulaError(f"the formula {brief(text)} is of type {type(text).__name__}; give it as text")
    for tie in _AMBIGUOUS_TIE.finditer(text):
        if tie["tie"]:
            message = "found '~', which could be a space or a negation; leave it out, or write \\lnot"
            raise _error(text, tie.start("tie"), message)
    try:
        piece: _Piece = _parser().parse(text)  # type: ignore[assignment]
    except UnexpectedInput as problem:
        raise _unexpected(text, problem) from None
    except _Problem as problem:
        raise _error(text, problem.position, problem.message) from None
    return piece.formula


class _Problem(Exception):  # noqa: N818 - never leaves this module
    """Something that the grammar lets pass but that is wrong, and where."""

    def __init__(self, place: Token, message: object) -> None:
        super().__init__(message)
        self.position = place.start_pos or 0
        self.message = str(message)


class _Piece(NamedTuple):
    """What a rule gives; `bare` marks comparisons without parentheses, which may merge with others."""

    formula: Formula
    place: Token
    bare: bool = False
    depth: int = 1


def _above(formula: Formula, pieces: tuple[_Piece, ...]) -> _Piece:
    """A piece over others; refuses a tree that is too deep for a recursion over it."""
    deepest = max(pieces, key=lambda piece: piece.depth)
    if deepest.depth >= _DEEPEST:
        raise _Problem(deepest.place, f"the formula is nested more than {_DEEPEST} deep; write it flatter")
    return _Piece(formula, pieces[0].place, depth=deepest.depth + 1)


@v_args(inline=True)
class _Builder(Transformer[Token, _Piece]):
    """One method a rule of the grammar; called while parsing, so that no tree is walked."""

    def start(self, piece: _Piece) -> _Piece:
        return piece

    def disjunction(self, *pieces: _Piece) -> _Piece:
        if len(pieces) == 1:
            return pieces[0]
        return _above(Or(tuple(piece.formula for piece in pieces)), pieces)

    def conjunction(self, *pieces: _Piece) -> _Piece:
        merged: list[_Piece] = []
        for piece in pieces:
            both = _merge(merged[-1], piece) if merged else None
            if both is None:
                merged.append(piece)
            else:
                merged[-1] = piece._replace(formula=both, place=merged[-1].place)
        if len(merged) == 1:
            return merged[0]
        return _above(And(tuple(piece.formula for piece in merged)), tuple(merged))

    def group(self, piece: _Piece) -> _Piece:
        return piece._replace(bare=False)

    def negation(self, _: Token, piece: _Piece) -> _Piece:
        return _above(Not(piece.formula), (piece,))

    def eventually(self, interval: Interval, piece: _Piece) -> _Piece:
        return _above(Eventually(interval, piece.formula), (piece,))

    def always(self, interval: Interval, piece: _Piece) -> _Piece:
        return _above(Always(interval, piece.formula), (piece,))

    def true(self, token: Token) -> _Piece:
        return _Piece(Constant(True), token)

    def false(self, token: Token) -> _Piece:
        return _Piece(Constant(False), token)

    def comparison(self, name: Token, symbol: Token, number: Token) -> _Piece:
        return _compare(name, name, (_symbol(symbol), number))

    def reversed_comparison(self, number: Token, symbol: Token, name: Token) -> _Piece:
        return _compare(number, name, (_MIRRORED[_symbol(symbol)], number))

    def chain(self, first: Token, left: Token, name: Token, right: Token, last: Token) -> _Piece:
        if _symbol(left)[0] != _symbol(right)[0] or "==" in (_symbol(left), _symbol(right)):
            message = f"{left} and {right} do not make a range; write one such as 3 <= {_cut(name)} <= 4"
            raise _Problem(right, message)
        return _compare(first, name, (_MIRRORED[_symbol(left)], first), (_symbol(right), last))

    def interval(self, opening: Token, start: Token, end: Token) -> Interval:
        for tick in (start, end):
            if re.fullmatch(r"[−-]\d+", tick):
                raise _Problem(tick, f"the interval bound {_cut(tick)} is before tick 0; use 0 or more")
            if not re.fullmatch(r"\+?\d+", tick):
                raise _Problem(tick, f"the interval bound {_cut(tick)} is not a whole number of ticks; round it")
            if len(tick.lstrip("+0")) > len(str(_LAST_TICK)) or int(tick) > _LAST_TICK:
                raise _Problem(tick, f"the interval bound {_cut(tick)} is too large; use {_LAST_TICK} at the most")
        try:
            return Interval(int(start), int(end))
        except FormulaError as error:
            raise _Problem(opening, error) from None


def _merge(first: _Piece, second: _Piece) -> Box | None:
    """The box of two neighbours in a conjunction, if both are bare comparisons with a point in common."""
    if first.bare and second.bare and isinstance(first.formula, Box) and isinstance(second.formula, Box):
        return intersect(first.formula, second.formula)
    return None


def _compare(place: Token, name: Token, *sides: tuple[str, Token]) -> _Piece:
    """The box of one comparison or two, each read as ``name symbol number``."""
    lower, upper, strict = -math.inf, math.inf, {">": False, "<": False}
    for symbol, token in sides:
        number = float(token.replace("−", "-"))
        if math.isinf(number):
            raise _Problem(token, f"the number {_cut(token)} is too large")
        if symbol[0] in ">=":
            lower = number
        if symbol[0] in "<=":
            upper = number
        strict[symbol] = True
    try:
        bound = Bound(_name(name), lower, upper, strict[">"], strict["<"])
    except FormulaError as error:
        raise _Problem(place, error) from None
    return _Piece(Box((bound,)), place, bare=True)


def _cut(token: Token) -> str:
    """A token as a message shows it."""
    return token if len(token) <= 40 else f"{token[:39]}…"


def _symbol(token: Token) -> str:
    plain = token.lstrip("\\")
    return _COMPARISONS.get(plain, plain)


def _name(token: Token) -> str:
    if token.startswith('"'):
        return re.sub(r"\\([\s\S])", r"\1", token[1:-1])
    if token.startswith("\\"):
        return re.sub(r"\\([\s\S])", r"\1", token[token.index("{") + 1 : -1])
    return re.sub(r"[{}]", "", token.removesuffix("[t]"))


@cache
def _parser() -> Lark:
    grammar = files("tickwise.logic").joinpath("grammar.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", transformer=_Builder())


def _unexpected(text: str, problem: UnexpectedInput) -> ParseError:
    """The parse error for a token or a character that does not fit."""
    state: Any = problem.interactive_parser
    accepted: set[str] = state.accepts()
    openings = [token for token in state.parser_state.value_stack if getattr(token, "type", "") == "_LPAR"]
    if isinstance(problem, UnexpectedToken) and problem.token.type == "$END":
        position, found = len(text.rstrip()), "the end of the text"
    else:
        position = problem.pos_in_stream or 0
        word = re.compile(r"\w+|\\[A-Za-z]+|[\s\S]").match(text, position)
        found = brief(word.group(), 40) if word else "nothing"
    expected = _expectation(accepted)
    if "_RPAR" in accepted and openings:
        expected += f" (closing the '(' of {_place(text, openings[-1].start_pos)})"
    elif found == "')'" and not openings:
        expected += "; there is no '(' before it"
    return _error(text, position, f"found {found}, expected {expected}")


def _expectation(accepted: set[str]) -> str:
    """The terminals that would fit, in words."""
    if "_LPAR" in accepted:
        return _EXPECTED_FORMULA
    names = [words for terminal, words in _EXPECTED.items() if terminal in accepted]
    return " or ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _place(text: str, position: int) -> str:
    start = text.rfind("\n", 0, position) + 1
    return f"line {text.count(chr(10), 0, position) + 1}, column {position - start + 1}"


def _error(text: str, position: int, message: str) -> ParseError:
    """A parse error with the line of the text and a caret under the place."""
    start = text.rfind("\n", 0, position) + 1
    line = text[start:].partition("\n")[0]
    column = position - start
    # of a long line only the surroundings of the place are shown
    first = max(0, column - _MARGIN)
    shown = re.sub(r"\s", " ", line[first : column + _MARGIN])
    return ParseError(f"{_place(text, position)}: {message}\n{shown}\n{' ' * (column - first)}^")
