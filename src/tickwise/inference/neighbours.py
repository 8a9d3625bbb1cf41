"""Formulas that differ from one in the structure of a single primitive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from tickwise.inference.space import least_span
from tickwise.inference.tree import STRUCTURES
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Interval, Not

_WEAKER = {
    Operator.EVENTUALLY: (),
    Operator.ALWAYS: (Operator.EVENTUALLY_ALWAYS, Operator.ALWAYS_EVENTUALLY, Operator.EVENTUALLY),
    Operator.EVENTUALLY_ALWAYS: (Operator.EVENTUALLY,),
    Operator.ALWAYS_EVENTUALLY: (Operator.EVENTUALLY,),
}
"""Which operators ask for less of the same ticks."""


def neighbours(formula: SDNF) -> Iterator[SDNF]:
    """The formulas with another operator, or the other polarity, in one primitive, which affects the same ticks.

    Args:
        formula: A formula.

    Yields:
        For each of its primitives one for each other structure (see `tickwise.inference.tree.STRUCTURES`) that its
        effect interval has room for. A new inner interval takes half of that.
    """
    return _changed(formula, lambda _: STRUCTURES)


def weaker_neighbours(formula: SDNF) -> Iterator[SDNF]:
    """Those of its neighbours that hold wherever the formula does.

    Args:
        formula: A formula.

    Yields:
        As of `neighbours`, but only operators that ask for less.
    """
    return _changed(formula, lambda primitive: [(each, primitive.complemented) for each in _WEAKER[primitive.operator]])


def _changed(formula: SDNF, structures: Callable[[Primitive], Iterable[tuple[Operator, bool]]]) -> Iterator[SDNF]:
    """The formulas in which one primitive has another one of the structures that there are for it."""
    for i, disjunct in enumerate(formula.disjuncts):
        for j, primitive in enumerate(disjunct.primitives):
            for other in _others(primitive, structures(primitive)):
                primitives = (*disjunct.primitives[:j], other, *disjunct.primitives[j + 1 :])
                disjuncts = (*formula.disjuncts[:i], SequentialConjunction(primitives), *formula.disjuncts[i + 1 :])
                yield replace(formula, disjuncts=disjuncts)


def _others(primitive: Primitive, structures: Iterable[tuple[Operator, bool]]) -> Iterator[Primitive]:
    span = primitive.end - primitive.start
    for operator, complemented in structures:
        known = (operator, complemented) == (primitive.operator, primitive.complemented)
        if not known and span >= least_span(operator.nested):
            duration = _duration(primitive, operator, span)
            window = Interval(primitive.start, primitive.end - duration)
            yield Primitive(operator, window, duration, Not(primitive.box) if complemented else primitive.box)


def _duration(primitive: Primitive, operator: Operator, span: int) -> int:
    if not operator.nested:
        return 0
    return primitive.duration or span // 2
