"""Primitives and the sequential disjunctive normal form (the paper's P, Definitions 4 and 5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from typing import TypeAlias, cast

from tickwise._wording import brief
from tickwise.errors import FormulaError
from tickwise.logic.region import complement, intersect
from tickwise.logic.syntax import Always, And, Box, Constant, Eventually, Formula, Interval, Not, Or


class Operator(StrEnum):
    """The temporal operator O_T of a primitive: ◇, □, ◇□ or □◇."""

    EVENTUALLY = "F"
    ALWAYS = "G"
    EVENTUALLY_ALWAYS = "FG"
    ALWAYS_EVENTUALLY = "GF"

    @property
    def nested(self) -> bool:
        """Whether there is an inner operator, and so a duration."""
        return len(self.value) == 2

    @property
    def dual(self) -> Operator:
        """The operator of the negation: ¬◇ρ is □¬ρ."""
        return Operator(self.value.translate(str.maketrans("FG", "GF")))

    @property
    def symbol(self) -> str:
        """The operator in Unicode, for instance ``◇□``."""
        return self.value.translate(str.maketrans("FG", "◇□"))


@dataclass(frozen=True, slots=True)
class Primitive:
    """One primitive formula: ◇_I ρ, □_I ρ, ◇_I □_[0,d] ρ or □_I ◇_[0,d] ρ, with ρ a box or a complement.

    The negation of a primitive is a primitive too, by duality: ¬◇_I ρ is □_I ¬ρ.

    Attributes:
        operator: The temporal operator O_T.
        window: The outer interval I, in ticks.
        duration: The inner interval's length d in ticks, at least 1; 0 where the operator is not nested.
        predicate: A box or its complement.

    Raises:
        FormulaError: If the duration does not fit the operator, or the predicate is neither a box nor its
            complement.
    """

    operator: Operator
    window: Interval
    duration: int
    predicate: Box | Not

    def __post_init__(self) -> None:
        if self.operator.nested != (self.duration > 0):
            raise FormulaError(f"operator {self.operator} does not go with a duration of {self.duration} ticks")
        if not (isinstance(self.predicate, Box) or isinstance(self.predicate.operand, Box)):
            raise FormulaError(f"the predicate {self.predicate} of a primitive is neither a box nor its complement")

    @property
    def start(self) -> int:
        """The start-effect time t_s in ticks (Definition 4)."""
        return self.window.start

    @property
    def end(self) -> int:
        """The end-effect time t_e in ticks (Definition 4)."""
        return self.window.end + self.duration

    @property
    def box(self) -> Box:
        """The predicate's region, without the complement."""
        return cast(Box, self.predicate.operand if isinstance(self.predicate, Not) else self.predicate)

    @property
    def complemented(self) -> bool:
        """Whether the predicate is the complement of its box."""
        return isinstance(self.predicate, Not)

    @property
    def negation(self) -> Primitive:
        """The negation, by duality."""
        predicate = self.box if self.complemented else Not(self.box)
        return Primitive(self.operator.dual, self.window, self.duration, predicate)

    @property
    def formula(self) -> Formula:
        """The primitive as an MITL_f formula."""
        nodes = {"F": Eventually, "G": Always}
        inner: Formula = self.predicate
        if self.operator.nested:
            inner = nodes[self.operator.value[1]](Interval(0, self.duration), inner)
        return nodes[self.operator.value[0]](self.window, inner)

    def __str__(self) -> str:
        return str(self.formula)


@dataclass(frozen=True, slots=True)
class SequentialConjunction:
    """A sequential conjunctive subformula: primitives whose effect windows follow one another (Definition 5).

    Raises:
        FormulaError: If it is empty, or t_e of a primitive is not before t_s of the next.
    """

    primitives: tuple[Primitive, ...]

    def __post_init__(self) -> None:
        if not self.primitives:
            raise FormulaError("a sequential conjunction needs at least one primitive")
        for earlier, later in zip(self.primitives, self.primitives[1:], strict=False):
            if earlier.end >= later.start:
                raise FormulaError(
                    f"not sequential (Definition 5): {earlier} has effect until tick {earlier.end}, "
                    f"{later} from tick {later.start}; make the later window start at {earlier.end + 1} "
                    "or after"
                )

    @property
    def formula(self) -> Formula:
        """The conjunction as an MITL_f formula."""
        parts = tuple(primitive.formula for primitive in self.primitives)
        return parts[0] if len(parts) == 1 else And(parts)

    def __str__(self) -> str:
        return str(self.formula)


@dataclass(frozen=True, slots=True)
class SDNF:
    """A formula in sequential disjunctive normal form (Definition 5).

    Raises:
        FormulaError: If there is no disjunct.
    """

    disjuncts: tuple[SequentialConjunction, ...]

    def __post_init__(self) -> None:
        if not self.disjuncts:
            raise FormulaError("a formula in SDNF needs at least one disjunct")

    @property
    def size(self) -> int:
        """The size ϱ(φ): the number of primitives."""
        return sum(len(disjunct.primitives) for disjunct in self.disjuncts)

    @property
    def formula(self) -> Formula:
        """The whole as an MITL_f formula."""
        parts = tuple(disjunct.formula for disjunct in self.disjuncts)
        return parts[0] if len(parts) == 1 else Or(parts)

    def __str__(self) -> str:
        return str(self.formula)


# Rewriting turns a formula into a disjunction of conjunctions of terms: bare predicates and primitives.
_Term: TypeAlias = Box | Not | Primitive
_Conjunction: TypeAlias = tuple[_Term, ...]
_Disjunction: TypeAlias = tuple[_Conjunction, ...]

_MOST_CONJUNCTIONS = 4096


def to_sdnf(phi: Formula | SDNF) -> SDNF:
    """Rewrite a formula to sequential disjunctive normal form (Definition 5), keeping its meaning.

    Negations move inward by duality; below a temporal operator a conjunction of boxes becomes one box, and
    equal operators in a row, or a late inner window, are merged; ◇ distributes over ∨ and □ over ∧; what is
    left becomes a disjunction of conjunctions, each ordered by start-effect time. The result has the same
    verdict on every trajectory, also on one that ends early. A formula in SDNF is returned as it is.

    Args:
        phi: An MITL_f formula.

    Returns:
        The normal form.

    Raises:
        FormulaError: If it is no formula, or has no normal form: a predicate stands outside every temporal
            operator, operators alternate three times, a constant or a combination of predicates that is no box
            or complement occurs, or the effect windows of a conjunction overlap.
    """
    if isinstance(phi, SDNF):
        return phi
    if not isinstance(phi, Formula):
        raise FormulaError(f"{brief(phi)} is of type {type(phi).__name__}; give a formula, as parse reads it from text")
    return SDNF(tuple(_sequential(conjunction) for conjunction in _expand(phi, positive=True)))


def _sequential(conjunction: _Conjunction) -> SequentialConjunction:
    parts = []
    for term in conjunction:
        if not isinstance(term, Primitive):
            raise FormulaError(
                f"the predicate {term} stands outside every temporal operator; "
                f"say when it must hold, for instance {Eventually(Interval(0, 0), term)}"
            )
        parts.append(term)
    return SequentialConjunction(tuple(sorted(parts, key=lambda part: part.start)))


def _expand(node: Formula, *, positive: bool) -> _Disjunction:
    """The disjunction of conjunctions of terms that a formula, or its negation, is equal to."""
    if isinstance(node, Box):
        return ((node if positive else Not(node),),)
    if isinstance(node, Not):
        return _expand(node.operand, positive=not positive)
    if isinstance(node, Eventually):
        found = _eventually(node, _expand(node.operand, positive=True), dual=False)
        return found if positive else _negate(found)
    if isinstance(node, Always):  # □φ is ¬◇¬φ
        found = _eventually(node, _expand(node.operand, positive=False), dual=True)
        return _negate(found) if positive else found
    if isinstance(node, Constant):
        raise FormulaError(f"the constant {node} has no place in a normal form of primitives; leave it out")
    parts = [_expand(child, positive=positive) for child in node.children]
    if isinstance(node, And) == positive:
        return _conjoin(parts)
    return tuple(conjunction for part in parts for conjunction in part)


def _conjoin(parts: Iterable[_Disjunction]) -> _Disjunction:
    found: _Disjunction = ((),)
    for part in parts:
        if len(found) * len(part) > _MOST_CONJUNCTIONS:
            raise FormulaError(f"the normal form has more than {_MOST_CONJUNCTIONS} disjuncts; split the formula up")
        found = tuple(tuple(dict.fromkeys(left + right)) for left, right in product(found, part))
    return found


def _negate(disjunction: _Disjunction) -> _Disjunction:
    return _conjoin(tuple((_negated(term),) for term in conjunction) for conjunction in disjunction)


def _negated(term: _Term) -> _Term:
    if isinstance(term, Primitive):
        return term.negation
    return term.operand if isinstance(term, Not) else Not(term)  # type: ignore[return-value]


def _eventually(node: Eventually | Always, operand: _Disjunction, *, dual: bool) -> _Disjunction:
    """◇_I over a disjunction.

    For □_I, as ¬◇_I¬, `dual` is set: the disjunction is the operand's negation. `node` is what was given.
    """
    interval = node.interval
    disjuncts = [_fold(conjunction, node, dual=dual) for conjunction in operand]
    found = []
    for terms in _fold_complements(disjuncts, node, dual=dual):
        # at a single tick ◇ is but a shift, and so distributes over ∧ too
        if len(terms) > 1 and interval.start < interval.end:
            inner, outer = ("disjunction", "∧") if dual else ("conjunction", "∨")
            parts = ", ".join(str(_negated(term) if dual else term) for term in terms)
            raise _misfit(
                node,
                f"its operand has a {inner} of {parts} that is neither a box nor a complement",
                f"distribute the operator over {outer} only, or write the operand as one box",
            )
        found.append(tuple(_delayed(interval, term, node) for term in terms))
    return tuple(found)


def _fold(conjunction: _Conjunction, node: Formula, *, dual: bool) -> _Conjunction:
    """Intersect the bare boxes of a conjunction; the complement of a half-space counts as a box."""
    literals = [term for term in conjunction if not isinstance(term, Primitive)]
    if len(literals) < 2:
        return conjunction
    region: Box | None = None
    rest: list[_Term] = []
    for term in conjunction:
        box = _as_box(term)
        if box is None:
            rest.append(term)
        elif region is None:
            region = box
        else:
            both = intersect(region, box)
            if both is None and dual:
                raise _misfit(node, "a part of its operand holds everywhere", "leave that part out")
            if both is None:
                raise _misfit(node, f"{region} and {box} exclude each other", "make the regions overlap")
            region = both
    return (*rest,) if region is None else (region, *rest)


def _fold_complements(disjuncts: list[_Conjunction], node: Formula, *, dual: bool) -> list[_Conjunction]:
    """Unite the complements among the disjuncts: that is the complement of an intersection.

    Under ◇ only what was written as a complement counts, and boxes are left to distribution; under □ any
    half-space does, since by duality it was part of a conjunction of boxes.
    """
    chosen = [
        index
        for index, terms in enumerate(disjuncts)
        if len(terms) == 1
        and not isinstance(terms[0], Primitive)
        and (_as_box(_negated(terms[0])) is not None if dual else isinstance(terms[0], Not))
    ]
    if len(chosen) < 2:
        return disjuncts
    regions = [cast(Box, _as_box(_negated(disjuncts[index][0]))) for index in chosen]
    region = regions[0]
    for box in regions[1:]:
        both = intersect(region, box)
        if both is None:
            if not dual:
                return disjuncts
            raise _misfit(node, f"{region} and {box} exclude each other", "make the regions overlap")
        region = both
    kept = [terms for index, terms in enumerate(disjuncts) if index not in chosen[1:]]
    kept[chosen[0]] = (Not(region),)
    return kept


def _as_box(term: _Term) -> Box | None:
    if isinstance(term, Not):
        return complement(cast(Box, term.operand))
    return term if isinstance(term, Box) else None


def _delayed(interval: Interval, term: _Term, node: Formula) -> Primitive:
    """◇_I over a term."""
    first, last = interval.start, interval.end
    if not isinstance(term, Primitive):
        return Primitive(Operator.EVENTUALLY, interval, 0, term)
    inner, duration = term.window, term.duration
    if term.operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS):
        window = Interval(first + inner.start, last + inner.end)
        return Primitive(term.operator, window, duration, term.predicate)
    if term.operator is Operator.ALWAYS:
        duration = inner.end - inner.start
        operator = Operator.EVENTUALLY_ALWAYS if duration else Operator.EVENTUALLY
        window = Interval(first + inner.start, last + inner.start)
        return Primitive(operator, window, duration, term.predicate)
    if first == last:  # a shift
        window = Interval(first + inner.start, first + inner.end)
        return Primitive(Operator.ALWAYS_EVENTUALLY, window, duration, term.predicate)
    if inner.start == inner.end:  # ◇ over a shifted ◇
        window = Interval(first + inner.start, last + inner.end + duration)
        return Primitive(Operator.EVENTUALLY, window, 0, term.predicate)
    raise _misfit(node, "its operators alternate three times", "use F, G, F G or G F")


def _misfit(node: Formula, why: str, remedy: str) -> FormulaError:
    return FormulaError(f"{node} has no sequential disjunctive normal form: {why}; {remedy}")
