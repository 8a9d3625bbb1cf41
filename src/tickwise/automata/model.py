"""Deterministic timed automata over discrete time (the paper's Definition 1; tick automata, Remark 1).

One letter, a set of predicates, is read at every tick from tick 0. Clocks are 0 when the first letter is read
and grow by one a tick; then the one edge is taken whose letter and guard fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import brief
from tickwise.errors import AutomatonError
from tickwise.logic.sdnf import SequentialConjunction
from tickwise.logic.syntax import Predicate, Verdict

if TYPE_CHECKING:
    from tickwise.automata.ticks import TickTable
    from tickwise.logic.semantics import Trajectories

UNBOUNDED: Final = 2**31 - 1
"""The upper end of a guard's range on a clock that it does not bound from above."""

COMPARISONS: Final = ("<", "<=", ">", ">=")


@dataclass(frozen=True, slots=True)
class ClockConstraint:
    """The comparison of one clock with a number of ticks, an atom c ⋈ k of the clock constraints.

    Attributes:
        clock: The clock, as an index.
        comparison: One of ``<``, ``<=``, ``>``, ``>=``.
        value: The constant k, in ticks.

    Raises:
        AutomatonError: If the comparison is not one of the four, or a number is not a whole number from 0.
    """

    clock: int
    comparison: str
    value: int

    def __post_init__(self) -> None:
        if self.comparison not in COMPARISONS:
            raise AutomatonError(f"comparison {brief(self.comparison)} is unknown; use one of {', '.join(COMPARISONS)}")
        _check_index("clock", self.clock, UNBOUNDED)
        _check_index("constant of a clock constraint", self.value, UNBOUNDED)

    @property
    def interval(self) -> tuple[int, int]:
        """The values that satisfy it: a closed range, in ticks; empty where the first is the greater."""
        match self.comparison:
            case "<":
                return 0, self.value - 1
            case "<=":
                return 0, self.value
            case ">":
                return self.value + 1, UNBOUNDED
            case _:
                return self.value, UNBOUNDED

    @property
    def ceiling(self) -> int:
        """The clock's value from which on the constraint's answer no longer changes, in ticks."""
        return self.value if self.comparison in ("<", ">=") else self.value + 1


@dataclass(frozen=True, slots=True)
class Edge:
    """A transition e = (q, σ, q', φ_C, r_C) for all letters σ of a cube.

    Attributes:
        source: The location q, as an index.
        literals: Pairs (predicate, whether it must hold); a predicate that is not named is free.
        target: The location q', as an index.
        guard: The conjunction φ_C of clock constraints; empty is ⊤.
        resets: The clocks r_C that are set to 0.

    Raises:
        AutomatonError: If the literals name a predicate twice.
    """

    source: int
    literals: tuple[tuple[int, bool], ...]
    target: int
    guard: tuple[ClockConstraint, ...] = ()
    resets: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        named = [predicate for predicate, _ in self.literals]
        for predicate in named:
            if named.count(predicate) > 1:
                raise AutomatonError(
                    f"an edge from location {self.source} names predicate {predicate} twice; keep one literal"
                )

    @property
    def cube(self) -> tuple[int, int]:
        """The letters as bits: a letter fits where ``letter & cube[0] == cube[1]``."""
        mask = sum(1 << predicate for predicate, _ in self.literals)
        return mask, sum(1 << predicate for predicate, holds in self.literals if holds)

    def ranges(self, clocks: int) -> tuple[tuple[int, int], ...]:
        """The guard as one closed range of values, in ticks, for each of so many clocks."""
        low, high = [0] * clocks, [UNBOUNDED] * clocks
        for constraint in self.guard:
            least, most = constraint.interval
            low[constraint.clock] = max(low[constraint.clock], least)
            high[constraint.clock] = min(high[constraint.clock], most)
        return tuple(zip(low, high, strict=True))

    def enabled(self, letter: int, valuation: Sequence[int]) -> bool:
        """Whether the edge can be taken on a letter with a clock valuation, in ticks."""
        mask, wanted = self.cube
        ranges = zip(self.ranges(len(valuation)), valuation, strict=True)
        return letter & mask == wanted and all(low <= value <= high for (low, high), value in ranges)


@dataclass(frozen=True, slots=True)
class TimedAutomaton:
    """A deterministic timed automaton (Σ = 2^AP, Q, q⁰, C, F, Δ) for a sequential conjunction (Definition 1).

    A letter is an integer in ``[0, 2**len(predicates))``; bit j is set where predicate j holds.

    Attributes:
        predicates: AP: the predicate of each primitive, by position.
        locations: The names of the locations Q.
        initial: The location q⁰, as an index.
        clocks: The names of the clocks C.
        accepting: The accepting locations F; they absorb.
        rejecting: The locations in which the conjunction is violated; they absorb.
        edges: The transitions Δ.
        stages: For each location the primitive that it works on, as an index.
        active: For each location the clocks whose value can still matter there.
        conjunction: The sequential conjunctive subformula that it decides.

    Raises:
        AutomatonError: If a part names something that does not exist, two edges of one location can be
            enabled at once, an accepting or rejecting location can be left, or a clock that matters is not
            active.
    """

    predicates: tuple[Predicate, ...]
    locations: tuple[str, ...]
    initial: int
    clocks: tuple[str, ...]
    accepting: frozenset[int]
    rejecting: frozenset[int]
    edges: tuple[Edge, ...]
    stages: tuple[int, ...]
    active: tuple[frozenset[int], ...]
    conjunction: SequentialConjunction

    def __post_init__(self) -> None:
        _check_parts(self)
        for number, edge in enumerate(self.edges):
            _check_edge(self, number, edge)
        _check_deterministic(self)
        _check_activity(self)

    @property
    def letters_count(self) -> int:
        """The size of the alphabet 2^AP."""
        return 1 << len(self.predicates)

    def letters(self, edge: Edge) -> tuple[int, ...]:
        """The letters of 2^AP that an edge's literals allow, in increasing order."""
        mask, wanted = edge.cube
        return tuple(letter for letter in range(self.letters_count) if letter & mask == wanted)

    def outcome(self, location: int) -> Verdict:
        """The verdict that a location means."""
        if location in self.accepting:
            return Verdict.TRUE
        return Verdict.FALSE if location in self.rejecting else Verdict.UNKNOWN

    def verdict(
        self, X: Trajectories, *, variables: Sequence[str] | None = None, lengths: NDArray[Any] | None = None
    ) -> Verdict | NDArray[np.int8]:
        """The verdict of the conjunction on trajectories, by running the automaton.

        Args:
            X: One trajectory ``(ticks, variables)`` or a batch, as for `tickwise.logic.semantics.verdict`.
            variables: The names of the columns; by default the conjunction's, in order of appearance.
            lengths: The number of states of each trajectory in a padded batch.

        Returns:
            One verdict, or an int8 array ``(n,)`` for a batch.
        """
        from tickwise.automata.run import encode
        from tickwise.logic.semantics import as_batch

        names = self.conjunction.formula.variables
        batch = as_batch(X, names, variables=variables, lengths=lengths)
        letters = encode(self.predicates, batch, names)
        verdicts = self.compile().verdicts(letters, batch.lengths)
        return Verdict(int(verdicts[0])) if batch.single else verdicts

    def accepts(
        self, X: Trajectories, *, variables: Sequence[str] | None = None, lengths: NDArray[Any] | None = None
    ) -> bool | NDArray[np.bool_]:
        """Whether the run on each trajectory ends in an accepting location; the arguments are `verdict`'s."""
        verdicts = self.verdict(X, variables=variables, lengths=lengths)
        return verdicts is Verdict.TRUE if isinstance(verdicts, Verdict) else verdicts == Verdict.TRUE

    def compile(self, horizon: int | None = None, *, reduce: bool = True) -> TickTable:
        """The automaton as integer arrays; see `tickwise.automata.ticks.compile_table`."""
        from tickwise.automata.ticks import compile_table

        return compile_table(self, horizon, reduce=reduce)

    def to(self, format: str) -> str:
        """The automaton as text in a format of `tickwise.automata.formats`, for instance ``dot``."""
        from tickwise.automata.formats import export

        return export(self, format)

    def __str__(self) -> str:
        names = (f"ρ{index + 1} = {predicate}" for index, predicate in enumerate(self.predicates))
        lines = [f"timed automaton of {self.conjunction}", *names]
        for location, name in enumerate(self.locations):
            notes = [f"stage {self.stages[location] + 1}"]
            notes += ["initial"] if location == self.initial else []
            notes += ["accepting"] if location in self.accepting else []
            notes += ["rejecting"] if location in self.rejecting else []
            lines.append(f"{name} ({', '.join(notes)})")
            lines += [f"  {describe(self, edge)}" for edge in self.edges if edge.source == location]
        return "\n".join(lines)


def letter_text(letter: int, predicates: int) -> str:
    """A letter as a set of predicates, for instance ``{ρ1, ρ3}`` for 5."""
    return f"{{{', '.join(f'ρ{index + 1}' for index in range(predicates) if letter >> index & 1)}}}"


def describe(automaton: TimedAutomaton, edge: Edge) -> str:
    """An edge in one line, for instance ``ρ1, c1 >= 1 → q1, c2 := 0``."""
    resets = "".join(f", {automaton.clocks[clock]} := 0" for clock in sorted(edge.resets))
    return f"{condition(automaton, edge)} → {automaton.locations[edge.target]}{resets}"


def condition(automaton: TimedAutomaton, edge: Edge) -> str:
    """An edge's letters and guard, for instance ``¬ρ1, c1 < 15``; ``any letter`` where all letters fit."""
    letters = [f"{'' if holds else '¬'}ρ{predicate + 1}" for predicate, holds in edge.literals]
    guard = [f"{automaton.clocks[atom.clock]} {atom.comparison} {atom.value}" for atom in edge.guard]
    return ", ".join((letters or ["any letter"]) + guard)


def live_clocks(edges: Iterable[Edge], locations: int) -> tuple[frozenset[int], ...]:
    """The clocks that matter in each location: a later guard can read them before they are reset.

    Args:
        edges: The transitions.
        locations: The number of locations.

    Returns:
        For each location its set of clocks; the least solution of the usual backward equations.
    """
    edges = tuple(edges)
    live: list[frozenset[int]] = [frozenset()] * locations
    while True:
        before = list(live)
        for edge in edges:
            read = frozenset(constraint.clock for constraint in edge.guard)
            live[edge.source] |= read | (live[edge.target] - edge.resets)
        if live == before:
            return tuple(live)


def _check_index(what: str, index: object, limit: int) -> None:
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < limit:
        raise AutomatonError(f"{what} {brief(index)} is out of range; use a whole number from 0 to {limit - 1}")


def _check_names(what: str, names: tuple[str, ...]) -> None:
    for name in names:
        if not isinstance(name, str) or not name:
            raise AutomatonError(f"the {what} name {brief(name)} is not a name; use text of one character or more")
        if names.count(name) > 1:
            raise AutomatonError(f"two {what}s are called {brief(name)}; use different names")


def _check_parts(automaton: TimedAutomaton) -> None:
    _check_names("location", automaton.locations)
    _check_names("clock", automaton.clocks)
    count, primitives = len(automaton.locations), automaton.conjunction.primitives
    if automaton.predicates != tuple(primitive.predicate for primitive in primitives):
        raise AutomatonError("the predicates are not the conjunction's primitives'; list them by position")
    _check_index("initial location", automaton.initial, count)
    for location in automaton.accepting | automaton.rejecting:
        _check_index("accepting or rejecting location", location, count)
    for location in automaton.accepting & automaton.rejecting:
        raise AutomatonError(
            f"location {brief(automaton.locations[location])} is both accepting and rejecting; choose one"
        )
    if len(automaton.stages) != count or len(automaton.active) != count:
        raise AutomatonError(
            f"there are {count} locations, but {len(automaton.stages)} stages and {len(automaton.active)} "
            "sets of active clocks; give one of each a location"
        )
    for stage in automaton.stages:
        _check_index("stage", stage, len(primitives))
    for clock in frozenset().union(*automaton.active):
        _check_index("active clock", clock, len(automaton.clocks))


def _check_edge(automaton: TimedAutomaton, number: int, edge: Edge) -> None:
    count = len(automaton.locations)
    _check_index(f"source location of edge {number}", edge.source, count)
    _check_index(f"target location of edge {number}", edge.target, count)
    for predicate, _ in edge.literals:
        _check_index(f"predicate of edge {number}", predicate, len(automaton.predicates))
    for clock in {constraint.clock for constraint in edge.guard} | edge.resets:
        _check_index(f"clock of edge {number}", clock, len(automaton.clocks))
    if edge.source in automaton.accepting | automaton.rejecting and edge.target != edge.source:
        raise AutomatonError(
            f"edge {number} leaves {brief(automaton.locations[edge.source])}; accepting and rejecting locations absorb"
        )


def _clash(first: Edge, second: Edge, clocks: int) -> bool:
    """Whether some letter and some clock valuation enable both edges (exact: both are products of ranges)."""
    (mask_1, wanted_1), (mask_2, wanted_2) = first.cube, second.cube
    if (wanted_1 ^ wanted_2) & mask_1 & mask_2:
        return False
    pairs = zip(first.ranges(clocks), second.ranges(clocks), strict=True)
    return all(max(low_1, low_2) <= min(high_1, high_2) for (low_1, high_1), (low_2, high_2) in pairs)


def _check_deterministic(automaton: TimedAutomaton) -> None:
    for first, second in combinations(automaton.edges, 2):
        if first.source == second.source and _clash(first, second, len(automaton.clocks)):
            raise AutomatonError(
                f"not deterministic: two edges of {brief(automaton.locations[first.source])} can be enabled at "
                f"once, {describe(automaton, first)} and {describe(automaton, second)}; make their letters "
                "or guards disjoint"
            )


def _check_activity(automaton: TimedAutomaton) -> None:
    live = live_clocks(automaton.edges, len(automaton.locations))
    for name, needed, active in zip(automaton.locations, live, automaton.active, strict=True):
        for clock in sorted(needed - active):
            raise AutomatonError(
                f"clock {brief(automaton.clocks[clock])} matters in {brief(name)} but is not active there; add it"
            )
