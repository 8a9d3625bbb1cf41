"""The bijections ξ between automata of structurally equivalent conjunctions (Section IV-C, Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.model import Edge, TimedAutomaton, describe
from tickwise.errors import AutomatonError

_Shape: TypeAlias = tuple[Any, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Bijections:
    """ξ_Σ, ξ_Q and ξ_C from a target's automaton to a source's; all arrays are read-only.

    Attributes:
        letters: ξ_Σ, int64 (2**n,): the source's letter for each letter of the target.
        locations: ξ_Q, int64 (Q,): the source's location for each location of the target.
        clocks: ξ_C, int64 (C,): the source's clock for each clock of the target.
    """

    letters: NDArray[np.int64]
    locations: NDArray[np.int64]
    clocks: NDArray[np.int64]


def bijections(target: TimedAutomaton, source: TimedAutomaton) -> Bijections:
    """The bijections by position that preserve structure, from a target's automaton to a source's (IV-C).

    An edge (q, ρ, q', φ, r) is in the target's automaton if and only if (ξ_Q(q), ξ_Σ(ρ), ξ_Q(q'), φ', ξ_C[r])
    is in the source's, where φ' compares the clocks ξ_C of φ in the same way with constants of its own.

    Args:
        target: The automaton of a sequential conjunctive subformula φ_i^T.
        source: The automaton of φ_î^S.

    Returns:
        The bijections.

    Raises:
        AutomatonError: If some part of the structure differs.
    """
    _same("number of predicates", len(target.predicates), len(source.predicates))
    _same("number of clocks", len(target.clocks), len(source.clocks))
    _same("number of locations", len(target.locations), len(source.locations))
    _same("initial location", target.initial, source.initial)
    _same("accepting locations", sorted(target.accepting), sorted(source.accepting))
    _same("rejecting locations", sorted(target.rejecting), sorted(source.rejecting))
    _same("stages of the locations", target.stages, source.stages)
    _check_edges(target, source)
    return Bijections(
        letters=_identity(target.letters_count),
        locations=_identity(len(target.locations)),
        clocks=_identity(len(target.clocks)),
    )


def _same(what: str, target: object, source: object) -> None:
    if target != source:
        raise AutomatonError(
            f"the automata are not isomorphic: the {what} is {target} in the target's and {source} in "
            "the source's; use formulas that are structurally equivalent"
        )


def _check_edges(target: TimedAutomaton, source: TimedAutomaton) -> None:
    """Compare the edges as sorted multisets, so that their order does not matter."""
    pairs = zip_longest(_by_shape(target), _by_shape(source))
    for ours, theirs in pairs:
        if ours is None or theirs is None or ours[0] != theirs[0]:
            _same("edge", _show(target, ours), _show(source, theirs))


def _by_shape(automaton: TimedAutomaton) -> list[tuple[_Shape, Edge]]:
    return sorted(((_shape(edge), edge) for edge in automaton.edges), key=lambda pair: pair[0])


def _shape(edge: Edge) -> _Shape:
    """All of an edge but the constants of its guard."""
    comparisons = tuple(sorted((atom.clock, atom.comparison) for atom in edge.guard))
    return edge.source, tuple(sorted(edge.literals)), edge.target, comparisons, tuple(sorted(edge.resets))


def _show(automaton: TimedAutomaton, pair: tuple[_Shape, Edge] | None) -> str:
    if pair is None:
        return "missing"
    return f"'{automaton.locations[pair[1].source]}: {describe(automaton, pair[1])}'"


def _identity(size: int) -> NDArray[np.int64]:
    positions = np.arange(size, dtype=np.int64)
    positions.flags.writeable = False
    return positions
