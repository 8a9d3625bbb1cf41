"""Hypothesis strategies for boxes, formulas, primitives, SDNF formulas and trajectories, shared by all tests.

Numbers lie on a small grid by default, so that trajectories often meet the bounds of the boxes exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import (
    Always,
    And,
    Bound,
    Box,
    Constant,
    Eventually,
    Formula,
    Interval,
    Not,
    Or,
)

VARIABLES = ("x", "y")

grid_numbers = st.integers(-1, 6).map(float)
all_numbers = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def bounds(draw: st.DrawFn, variable: str = "x", numbers: st.SearchStrategy[float] = grid_numbers) -> Bound:
    """One range: open below, open above or two-sided, with any strictness that leaves it non-empty."""
    lower, upper = sorted((draw(numbers), draw(numbers)))
    shape = draw(st.sampled_from(("both", "lower", "upper")))
    may_be_strict = lower < upper or shape != "both"
    strict = [may_be_strict and draw(st.booleans()) for _ in range(2)]
    if shape == "lower":
        return Bound(variable, lower=lower, lower_strict=strict[0])
    if shape == "upper":
        return Bound(variable, upper=upper, upper_strict=strict[1])
    return Bound(variable, lower, upper, *strict)


@st.composite
def boxes(
    draw: st.DrawFn, variables: Sequence[str] = VARIABLES, numbers: st.SearchStrategy[float] = grid_numbers
) -> Box:
    """A box over some of the variables, in any order."""
    names = draw(st.lists(st.sampled_from(variables), min_size=1, max_size=len(variables), unique=True))
    return Box(tuple(draw(bounds(name, numbers)) for name in names))


def predicates(variables: Sequence[str] = VARIABLES) -> st.SearchStrategy[Box | Not]:
    """A box or its complement."""
    return boxes(variables).flatmap(lambda box: st.sampled_from((box, Not(box))))


@st.composite
def intervals(draw: st.DrawFn, longest: int = 6) -> Interval:
    """A closed interval within [0, longest]; a single tick is possible."""
    start, end = sorted((draw(st.integers(0, longest)), draw(st.integers(0, longest))))
    return Interval(start, end)


def formulas(
    variables: Sequence[str] = VARIABLES,
    *,
    numbers: st.SearchStrategy[float] = grid_numbers,
    longest: int = 4,
    max_leaves: int = 6,
    constants: bool = True,
) -> st.SearchStrategy[Formula]:
    """Any formula tree: nested conjunctions in conjunctions, double negations and constants included."""
    leaves: st.SearchStrategy[Formula] = boxes(variables, numbers)
    if constants:
        leaves = st.one_of(leaves, leaves, st.booleans().map(Constant))

    def extend(children: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        several = st.lists(children, min_size=2, max_size=3).map(tuple)
        return st.one_of(
            children.map(Not),
            several.map(And),
            several.map(Or),
            st.builds(Eventually, intervals(longest), children),
            st.builds(Always, intervals(longest), children),
        )

    return st.recursive(leaves, extend, max_leaves=max_leaves)


@st.composite
def primitives(
    draw: st.DrawFn, variables: Sequence[str] = VARIABLES, *, earliest: int = 0, longest: int = 5
) -> Primitive:
    """A primitive with any operator, whose window starts at `earliest` at the soonest."""
    operator = draw(st.sampled_from(Operator))
    start = earliest + draw(st.integers(0, longest))
    window = Interval(start, start + draw(st.integers(0, longest)))
    duration = draw(st.integers(1, longest)) if operator.nested else 0
    return Primitive(operator, window, duration, draw(predicates(variables)))


@st.composite
def sequential_conjunctions(
    draw: st.DrawFn, variables: Sequence[str] = VARIABLES, *, most: int = 3, longest: int = 4
) -> SequentialConjunction:
    """One to `most` primitives whose effect windows follow one another (Definition 5)."""
    parts: list[Primitive] = []
    for _ in range(draw(st.integers(1, most))):
        earliest = parts[-1].end + 1 if parts else 0
        parts.append(draw(primitives(variables, earliest=earliest, longest=longest)))
    return SequentialConjunction(tuple(parts))


def sdnfs(
    variables: Sequence[str] = VARIABLES, *, most: int = 3, disjuncts: int = 3, longest: int = 4
) -> st.SearchStrategy[SDNF]:
    """A formula in SDNF with one to `disjuncts` disjuncts of one to `most` primitives."""
    conjunctions = sequential_conjunctions(variables, most=most, longest=longest)
    return st.lists(conjunctions, min_size=1, max_size=disjuncts).map(lambda parts: SDNF(tuple(parts)))


@st.composite
def equivalents(
    draw: st.DrawFn, conjunction: SequentialConjunction, variables: Sequence[str] = VARIABLES, *, longest: int = 4
) -> SequentialConjunction:
    """A structurally equivalent conjunction (Definition 6) with other numbers and predicates."""
    parts: list[Primitive] = []
    for primitive in conjunction.primitives:
        start = (parts[-1].end + 1 if parts else 0) + draw(st.integers(0, longest))
        window = Interval(start, start + draw(st.integers(0, longest)))
        duration = draw(st.integers(1, longest)) if primitive.operator.nested else 0
        parts.append(Primitive(primitive.operator, window, duration, draw(predicates(variables))))
    return SequentialConjunction(tuple(parts))


@st.composite
def transferable_pairs(draw: st.DrawFn, *, disjuncts: int = 2, most: int = 2, longest: int = 3) -> tuple[SDNF, SDNF]:
    """A formula, and another of one to three times as many disjuncts that is transferable from it (Definition 7)."""
    source = draw(sdnfs(most=most, disjuncts=disjuncts, longest=longest))
    copies = source.disjuncts * draw(st.integers(1, 3))
    return source, SDNF(tuple(draw(equivalents(disjunct, longest=longest)) for disjunct in copies))


@st.composite
def trajectories(
    draw: st.DrawFn, variables: int = len(VARIABLES), *, shortest: int = 1, longest: int = 20
) -> NDArray[np.float64]:
    """One trajectory, shape (ticks, variables), on half steps of the grid of the boxes' bounds."""
    ticks = draw(st.integers(shortest, longest))
    return random_trajectories(draw(st.integers(0, 2**32 - 1)), 1, ticks, variables)[0]


@st.composite
def batches(
    draw: st.DrawFn, variables: int = len(VARIABLES), *, most: int = 5, longest: int = 20
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A batch, shape (n, ticks, variables) and NaN past each trajectory's length, with the lengths."""
    ticks = draw(st.integers(1, longest))
    lengths = np.array(draw(st.lists(st.integers(1, ticks), min_size=1, max_size=most)), dtype=np.int64)
    values = random_trajectories(draw(st.integers(0, 2**32 - 1)), len(lengths), ticks, variables)
    values[np.arange(ticks) >= lengths[:, None]] = math.nan
    return values, lengths


def random_trajectories(seed: int, count: int, ticks: int, variables: int) -> NDArray[np.float64]:
    """Trajectories that dwell: a value is kept with probability 0.6, else drawn from the half-step grid.

    Returns:
        Shape (count, ticks, variables).
    """
    rng = np.random.default_rng(seed)
    values = rng.integers(-4, 15, size=(count, ticks, variables)) / 2
    keep = rng.random((count, ticks)) < 0.6
    for tick in range(1, ticks):
        values[:, tick] = np.where(keep[:, tick, None], values[:, tick - 1], values[:, tick])
    return values
