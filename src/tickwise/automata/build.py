"""From a sequential conjunction to its timed automaton (the paper's Section IV-B, Step 3).

Each primitive has one fixed fragment, whatever its numbers: structurally equivalent formulas get automata
that are isomorphic by position. The fragments are chained, since each primitive's effect ends before the next
one's begins.
"""

from __future__ import annotations

from typing import NamedTuple

from tickwise.automata.model import ClockConstraint, Edge, TimedAutomaton, live_clocks
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction, to_sdnf
from tickwise.logic.syntax import Formula


class _Rule(NamedTuple):
    """An edge of a fragment before its numbers are filled in.

    Places: W waits, S is within a stay (or a gap), "next" is the next fragment's W or the accepting location,
        "rej"
    is the fragment's rejecting location. Guards compare the global clock c with the window's a and b, and the
    stay clock d with the duration k. An edge that begins a stay resets d.
    """

    source: str
    holds: bool | None
    guard: tuple[str, ...]
    target: str
    begins: bool = False


_FRAGMENTS: dict[Operator, tuple[_Rule, ...]] = {
    Operator.EVENTUALLY: (
        _Rule("W", False, ("c<b",), "W"),
        _Rule("W", True, ("c<a",), "W"),
        _Rule("W", True, ("c>=a", "c<=b"), "next"),
        _Rule("W", False, ("c>=b",), "rej"),
    ),
    Operator.ALWAYS: (
        _Rule("W", None, ("c<a",), "W"),
        _Rule("W", True, ("c>=a", "c<b"), "W"),
        _Rule("W", True, ("c>=b",), "next"),
        _Rule("W", False, ("c>=a",), "rej"),
    ),
    # S: the predicate has held since a tick in the window, for d ticks
    Operator.EVENTUALLY_ALWAYS: (
        _Rule("W", False, ("c<b",), "W"),
        _Rule("W", True, ("c<a",), "W"),
        _Rule("W", True, ("c>=a",), "S", begins=True),
        _Rule("W", False, ("c>=b",), "rej"),
        _Rule("S", True, ("d<k",), "S"),
        _Rule("S", True, ("d>=k",), "next"),
        _Rule("S", False, ("c<b",), "W"),
        _Rule("S", False, ("c>=b",), "rej"),
    ),
    # S: the predicate has failed since a tick in the window, for d ticks
    Operator.ALWAYS_EVENTUALLY: (
        _Rule("W", True, ("c<b",), "W"),
        _Rule("W", False, ("c<a",), "W"),
        _Rule("W", False, ("c>=a",), "S", begins=True),
        _Rule("W", True, ("c>=b",), "next"),
        _Rule("S", False, ("d<k",), "S"),
        _Rule("S", False, ("d>=k",), "rej"),
        _Rule("S", True, ("c<b",), "W"),
        _Rule("S", True, ("c>=b",), "next"),
    ),
}

_CLOCKS = {"c": 0, "d": 1}


def timed_automata(phi: Formula | SDNF) -> tuple[TimedAutomaton, ...]:
    """The timed automata of a formula, one for each sequential conjunctive subformula φ_i (Step 3).

    Args:
        phi: A formula that can be brought into SDNF, or one that is.

    Returns:
        The automata in the order of the disjuncts; the formula is satisfied where one of them accepts.

    Raises:
        FormulaError: If the formula has no SDNF.
    """
    return tuple(build(conjunction) for conjunction in to_sdnf(phi).disjuncts)


def build(conjunction: SequentialConjunction) -> TimedAutomaton:
    """The deterministic timed automaton that accepts exactly what satisfies a sequential conjunction.

    The working locations are ``q0``, ``q1``, … in the order of the primitives, then come the accepting
    ``acc`` and one rejecting ``rej1``, ``rej2``, … for each primitive. Clock ``c1`` counts from tick 0 and is
    never reset; clock ``c2``, there if a primitive is nested, is reset where a stay begins. A verdict is
    reached at the first tick at which the three-valued semantics determines it.

    Args:
        conjunction: The sequential conjunctive subformula φ_i.

    Returns:
        The automaton; its size and its edges depend on the operators O_T only, its constants on the numbers.
    """
    primitives = conjunction.primitives
    places = [(stage, place) for stage, primitive in enumerate(primitives) for place in _working(primitive.operator)]
    working, stages = len(places), [stage for stage, _ in places]
    index = {key: number for number, key in enumerate(places)}
    index[(len(primitives), "W")] = working
    index |= {(stage, "rej"): working + 1 + stage for stage in range(len(primitives))}
    count = working + 1 + len(primitives)
    rejecting = range(working + 1, count)
    edges = [
        _edge(rule, stage, primitive, index)
        for stage, primitive in enumerate(primitives)
        for rule in _FRAGMENTS[primitive.operator]
    ]
    edges += [Edge(location, (), location) for location in (working, *rejecting)]
    return TimedAutomaton(
        predicates=tuple(primitive.predicate for primitive in primitives),
        locations=(
            *(f"q{number}" for number in range(working)),
            "acc",
            *(f"rej{stage + 1}" for stage in range(len(primitives))),
        ),
        initial=0,
        clocks=("c1", "c2") if any(primitive.operator.nested for primitive in primitives) else ("c1",),
        accepting=frozenset({working}),
        rejecting=frozenset(rejecting),
        edges=tuple(edges),
        stages=(*stages, len(primitives) - 1, *range(len(primitives))),
        active=live_clocks(edges, count),
        conjunction=conjunction,
    )


def _working(operator: Operator) -> tuple[str, ...]:
    return ("W", "S") if operator.nested else ("W",)


def _edge(rule: _Rule, stage: int, primitive: Primitive, index: dict[tuple[int, str], int]) -> Edge:
    numbers = {"a": primitive.window.start, "b": primitive.window.end, "k": primitive.duration}
    target = (stage + 1, "W") if rule.target == "next" else (stage, rule.target)
    return Edge(
        source=index[(stage, rule.source)],
        literals=() if rule.holds is None else ((stage, rule.holds),),
        target=index[target],
        guard=tuple(ClockConstraint(_CLOCKS[atom[0]], atom[1:-1], numbers[atom[-1]]) for atom in rule.guard),
        resets=frozenset({_CLOCKS["d"]}) if rule.begins else frozenset(),
    )
