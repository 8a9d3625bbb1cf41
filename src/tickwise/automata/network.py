"""Timed automata beside an environment that plays their letters: what model checkers are given.

At every tick from 0 the environment chooses in which of the regions the state is, and each automaton takes the
edge that fits. The environment plays exactly the letters that some state has: regions may overlap, or one may
lie within another.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tickwise.automata.model import Edge, TimedAutomaton
from tickwise.errors import AutomatonError
from tickwise.logic.region import complement, intersect
from tickwise.logic.syntax import Bound, Box, Formula, Not

MOST_LETTERS: Final = 4096
"""Automata on more letters than this are refused: no tool would show or check them."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_TAKEN = re.compile(
    # words of UPPAAL and of TChecker, and what the systems written here declare themselves
    "abs after_update and assign before_update bool break broadcast case chan clock commit const continue deadlock "
    "default do double dynamic edge else enum event exists exit false fint fmax fmin for forall foreach guard hybrid "
    "if imply init int location meta not numOf or priority process progress rate return scalar select simulation "
    "spawn state string struct sum switch sync system trans true typedef urgent void while "
    r"k t choose elapse read\d* wait tick\d* p\d+ LETTERS? Environment Automaton\d*".replace(" ", "|")
)


@dataclass(frozen=True, slots=True)
class Component:
    """An automaton in a network, under names that other programs can read.

    Attributes:
        automaton: The timed automaton.
        number: Its number from 1 as text; empty where it is the only one.
        locations: An identifier for each location.
        clocks: An identifier for each clock, unique in the component.
        literals: For each predicate the region's index, and whether the predicate is its complement.
    """

    automaton: TimedAutomaton
    number: str
    locations: tuple[str, ...]
    clocks: tuple[str, ...]
    literals: tuple[tuple[int, bool], ...]

    def reads(self, edge: Edge) -> list[tuple[int, bool]]:
        """An edge's literals on the network's regions: pairs (region, whether the state must be in it)."""
        pairs = [(self.literals[predicate], holds) for predicate, holds in edge.literals]
        return [(region, holds != complemented) for (region, complemented), holds in pairs]


@dataclass(frozen=True, slots=True)
class Network:
    """Automata that read the same letters.

    Attributes:
        components: The automata.
        regions: The different boxes of their predicates, in order of appearance.
        letters: Which truth values of the regions some state has, in increasing order.
    """

    components: tuple[Component, ...]
    regions: tuple[Box, ...]
    letters: tuple[tuple[bool, ...], ...]

    @property
    def notes(self) -> list[str]:
        """What the automata decide and what the regions are, one line each."""
        lines = [plain(f"Automaton{part.number}: {part.automaton.conjunction}") for part in self.components]
        return lines + [plain(f"p{number}: {box}") for number, box in enumerate(self.regions, start=1)]


def network(automata: Sequence[TimedAutomaton]) -> Network:
    """Put automata side by side.

    Args:
        automata: One automaton or more.

    Returns:
        The network.

    Raises:
        AutomatonError: If there is no automaton, or the regions meet in more than `MOST_LETTERS` ways.
    """
    if not automata:
        raise AutomatonError("a system of no automata was asked for; give one or more")
    predicates = [predicate for automaton in automata for predicate in automaton.predicates]
    regions = tuple(dict.fromkeys(_box(predicate) for predicate in predicates))
    numbers = [""] if len(automata) == 1 else [str(number) for number in range(1, len(automata) + 1)]
    components = tuple(
        Component(
            automaton,
            number,
            *_identifiers(automaton),
            literals=tuple((regions.index(_box(part)), isinstance(part, Not)) for part in automaton.predicates),
        )
        for automaton, number in zip(automata, numbers, strict=True)
    )
    return Network(components, regions, _possible_letters(regions))


def plain(text: str) -> str:
    """Text on one line that a comment of any language can hold."""
    return "".join(sign if sign.isprintable() else " " for sign in text)


def _box(predicate: Formula) -> Box:
    box = predicate.operand if isinstance(predicate, Not) else predicate
    if not isinstance(box, Box):
        raise AutomatonError(f"{predicate} is no predicate; give a box or its complement")
    return box


def _identifiers(automaton: TimedAutomaton) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the locations and of the clocks: their own where all can be kept, numbered ones otherwise."""
    locations, clocks = automaton.locations, automaton.clocks
    names = (*locations, *clocks)
    if len(set(names)) == len(names) and all(_NAME.fullmatch(name) and not _TAKEN.fullmatch(name) for name in names):
        return locations, clocks
    return tuple(f"q{index}" for index in range(len(locations))), tuple(f"c{index}" for index in range(len(clocks)))


def _possible_letters(regions: Sequence[Box]) -> tuple[tuple[bool, ...], ...]:
    """The truth values of the regions that some state has.

    The states of each letter so far are a list of boxes (None is the whole space) that each region splits.
    """
    cells: dict[tuple[bool, ...], list[Box | None]] = {(): [None]}
    for region in regions:
        split: dict[tuple[bool, ...], list[Box | None]] = {}
        for letter, pieces in cells.items():
            inside: list[Box | None] = [both for piece in pieces if (both := _meet(piece, region)) is not None]
            outside = [part for piece in pieces for part in _without(piece, region)]
            split |= {(*letter, holds): parts for holds, parts in ((False, outside), (True, inside)) if parts}
        cells = split
        if len(cells) > MOST_LETTERS:
            raise AutomatonError(
                f"the formula's regions meet in more than {MOST_LETTERS} ways, too many for a model checker; "
                "write fewer primitives, or choose dot or json"
            )
    return tuple(sorted(cells))


def _meet(piece: Box | None, box: Box) -> Box | None:
    return box if piece is None else intersect(piece, box)


def _without(piece: Box | None, box: Box) -> list[Box | None]:
    """A box without another, as boxes that do not overlap."""
    parts: list[Box | None] = []
    rest = piece
    for side in _half_spaces(box):
        beyond = complement(side)
        if beyond is None:
            raise AssertionError(f"{side} is a half-space")
        if (part := _meet(rest, beyond)) is not None:
            parts.append(part)
        rest = _meet(rest, side)
        if rest is None:
            break
    return parts


def _half_spaces(box: Box) -> list[Box]:
    sides = []
    for bound in box.bounds:
        if bound.lower != float("-inf"):
            sides.append(Box((Bound(bound.variable, lower=bound.lower, lower_strict=bound.lower_strict),)))
        if bound.upper != float("inf"):
            sides.append(Box((Bound(bound.variable, upper=bound.upper, upper_strict=bound.upper_strict),)))
    return sides
