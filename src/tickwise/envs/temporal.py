"""Hidden tasks that are any formula in sequential disjunctive normal form, compiled through their timed automata."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import cycle
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import Landmark, TaskTable, check_ticks, inside
from tickwise.errors import ConfigurationError
from tickwise.logic.sdnf import SDNF, Operator, Primitive, to_sdnf
from tickwise.logic.syntax import Box

if TYPE_CHECKING:  # compiled kernels and the parser are too heavy for merely listing the environments
    from tickwise.automata.ticks import TickTable

MOST_ENTRIES = 2**26
"""A task table whose rewards would have more entries is refused."""

# an automaton's second clock runs within a stay, or within a gap between visits, and is active nowhere else
_STAY_CLOCK = 1

_COLOURS = ("green", "yellow", "blue")

Ending: TypeAlias = Literal["deadline", "violated", "decided"]

ENDINGS: dict[str, tuple[int, ...]] = {"deadline": (), "violated": (-1,), "decided": (-1, 1)}
"""The ends of an episode that there are, with the verdicts that bring it about before the deadline."""


@dataclass(frozen=True, slots=True)
class FormulaTask:
    """Satisfy a formula by the deadline; it decides at tick 0 of the trajectory s_0 … s_L (Section II-A).

    The episode gives ``reward`` if the formula is satisfied and ``penalty`` if not, at its end and nothing
    before. That is the deadline, or the first tick from 1 on at which the three-valued semantics determines
    what `ends` says, so what tick 0 decides is paid at tick 1.

    Attributes:
        formula: The formula as text; it has to have a sequential disjunctive normal form (Definition 5).
        deadline: The deadline L in ticks; no effect of the formula may reach beyond it.
        reward: Given if the formula is satisfied.
        penalty: Given if it is violated.
        ends: When an episode ends: at the ``deadline``, or before it as soon as the formula is ``violated``, or
            ``decided`` either way.

    Raises:
        FormulaError: If the text is no formula, or one without a sequential disjunctive normal form.
        ConfigurationError: If the deadline is before the formula's end-effect time (Definition 4), or there is no
            such end.
    """

    formula: str
    deadline: int
    reward: float = 100.0
    penalty: float = -10.0
    ends: Ending = "deadline"

    def __post_init__(self) -> None:
        if self.ends not in ENDINGS:
            raise ConfigurationError(f"there is no end of an episode {self.ends!r}; use {', '.join(ENDINGS)}")
        check_ticks("deadline", self.deadline, least=1)
        check_end(self.sdnf, self.deadline)

    @property
    def sdnf(self) -> SDNF:
        """The formula in sequential disjunctive normal form."""
        from tickwise.logic.parse import parse

        return to_sdnf(parse(self.formula))

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The regions for a map: ``A``, ``B``, … in order of appearance, each once."""
        colours = cycle(_COLOURS)
        return tuple(Landmark(label, next(colours), box) for box, label in _labels(self.sdnf).items())

    def table(self, mdp: TabularMDP) -> TaskTable:
        """The task over the states of an MDP.

        A task state is one state of each disjunct's tick table. All that are satisfied are one state, and all
        that are violated. A letter is a combination of predicates that occurs in the world.

        Raises:
            ConfigurationError: If a region contains no cell of the world, or the table would be too large.
        """
        return sdnf_table(self.sdnf, mdp, self.deadline, reward=self.reward, penalty=self.penalty, ends=self.ends)


def check_end(sdnf: SDNF, deadline: int) -> None:
    """Check that a formula has no effect past a deadline.

    Raises:
        ConfigurationError: If the deadline is before its end-effect time (Definition 4).
    """
    end = max(disjunct.primitives[-1].end for disjunct in sdnf.disjuncts)
    if end > deadline:
        raise ConfigurationError(
            f"{sdnf} has effect until tick {end}, past the deadline {deadline}; use a deadline of {end} or more"
        )


def sdnf_table(
    sdnf: SDNF,
    mdp: TabularMDP,
    deadline: int,
    *,
    reward: float = 100.0,
    penalty: float = -10.0,
    ends: Ending = "deadline",
) -> TaskTable:
    """The table of a `FormulaTask` whose formula is at hand in normal form; its numbers are not checked.

    Args:
        sdnf: The formula.
        mdp: The world.
        deadline: The deadline L in ticks.
        reward: Given if the formula is satisfied.
        penalty: Given if it is violated.
        ends: When an episode ends.

    Returns:
        The table.

    Raises:
        ConfigurationError: If a region contains no cell of the world, or the table would be too large.
    """
    from tickwise.automata.build import timed_automata

    tables = [automaton.compile() for automaton in timed_automata(sdnf)]
    combinations, letter = _letters(sdnf, tables, mdp)
    most = MOST_ENTRIES // mdp.n_states
    nothing = _Decider(
        np.zeros((1, len(combinations[0])), np.int64), np.full(1, -1, np.int8), np.zeros((1, 0), np.int64)
    )
    parts = (_part(table, letters) for table, letters in zip(tables, combinations, strict=True))
    whole = reduce(lambda left, right: _either(left, right, most), parts, nothing)
    success = whole.verdict > 0
    gained = np.where(success, reward, penalty).astype(np.float32)
    ended = np.isin(whole.verdict, ENDINGS[ends])
    on_arrival = np.where(ended, gained, 0.0).astype(np.float32)
    return TaskTable(
        delta=whole.delta.astype(np.int32),
        letter=letter.astype(np.int32),
        reward=np.broadcast_to(on_arrival[:, None], (len(ended), mdp.n_states)),
        final_reward=np.where(ended, 0.0, gained).astype(np.float32),
        terminated=ended,
        success=success,
        horizon=deadline,
        stages=_stages(sdnf, tables, whole),
    )


@dataclass(frozen=True, slots=True)
class _Decider:
    """A deterministic automaton over a world's letters that decides a disjunction.

    Attributes:
        delta: Next state, shape ``(states, letters)``; state 0 has read nothing.
        verdict: 1 true, 0 unknown, -1 false, shape ``(states,)``; all true states are one, and all false.
        members: A state of each disjunct's tick table, shape ``(states, disjuncts)``.
    """

    delta: NDArray[np.int64]
    verdict: NDArray[np.int8]
    members: NDArray[np.int64]


def _letters(
    sdnf: SDNF, tables: Sequence[TickTable], mdp: TabularMDP
) -> tuple[list[NDArray[np.int64]], NDArray[np.int64]]:
    """For each table the letter it reads at each letter of the task, and the task's letter in each MDP state."""
    member = {box: inside(box, mdp) for box in _labels(sdnf)}
    rows = []
    for disjunct in sdnf.disjuncts:
        row = np.zeros(mdp.n_states, dtype=np.int64)
        for bit, primitive in enumerate(disjunct.primitives):
            # the automaton's predicate is the primitive's, so a complement is true outside its box
            row |= (member[primitive.box] != primitive.complemented).astype(np.int64) << bit
        rows.append(row)
    combinations, code = np.unique(np.stack(rows), axis=1, return_inverse=True)
    return [combinations[index] for index in range(len(tables))], np.asarray(code.reshape(-1), dtype=np.int64)


def _part(table: TickTable, letters: NDArray[np.int64]) -> _Decider:
    """One disjunct over the letters of the task."""
    delta = table.delta[:, letters].astype(np.int64)
    return _merged(delta, table.verdict, np.arange(len(delta))[:, None])


def _either(left: _Decider, right: _Decider, most: int) -> _Decider:
    """The disjunction of two, over the pairs of states that some word reaches, by breadth-first search."""
    width = len(right.delta)
    found = [np.zeros(1, dtype=np.int64)]  # pairs as single numbers; the start is 0
    following = []
    seen = np.zeros(len(left.delta) * width, dtype=np.bool_)
    seen[0] = True
    count = 1
    while len(found[-1]):
        first, second = np.divmod(found[-1], width)
        after = left.delta[first] * width + right.delta[second]
        following.append(after)
        fresh = np.unique(after)
        fresh = fresh[~seen[fresh]]
        seen[fresh] = True
        found.append(fresh)
        count += len(fresh)
        if count > most:
            raise ConfigurationError(
                f"the task's table needs more than {most} states for a disjunction; use fewer disjuncts, shorter "
                "durations or a smaller world"
            )
    pairs = np.concatenate(found)
    number = np.zeros(len(seen), dtype=np.int64)
    number[pairs] = np.arange(len(pairs))
    first, second = np.divmod(pairs, width)
    verdict = np.maximum(left.verdict[first], right.verdict[second])
    members = np.concatenate([left.members[first], right.members[second]], axis=1)
    return _merged(number[np.concatenate(following)], verdict, members)


def _merged(delta: NDArray[np.int64], verdict: NDArray[np.int8], members: NDArray[np.int64]) -> _Decider:
    """Make all true states one, and all false ones: a verdict stays, so nothing further can be told apart."""
    states = np.arange(len(delta))
    chosen = states.copy()
    for decided in (verdict > 0, verdict < 0):
        if decided.any():
            chosen[decided] = states[decided][0]
    kept = np.flatnonzero(chosen == states)
    number = np.zeros(len(delta), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    return _Decider(number[chosen[delta[kept]]], verdict[kept], members[kept])


def _labels(sdnf: SDNF) -> dict[Box, str]:
    """A label of one letter, after 26 boxes with a digit, for each distinct box in order of appearance."""
    boxes = dict.fromkeys(primitive.box for disjunct in sdnf.disjuncts for primitive in disjunct.primitives)
    return {
        box: chr(ord("A") + number % 26) + (str(number // 26) if number >= 26 else "")
        for number, box in enumerate(boxes)
    }


def _stages(sdnf: SDNF, tables: Sequence[TickTable], whole: _Decider) -> tuple[str, ...]:
    """What each task state means, in words."""
    names = _labels(sdnf)
    phrases = [_phrases(table, names) for table in tables]
    words = []
    for verdict, members in zip(whole.verdict, whole.members, strict=True):
        parts = [phrases[index][state] for index, state in enumerate(members) if tables[index].verdict[state] == 0]
        undecided = parts[0] if len(parts) == 1 else f"either {', or '.join(parts)}"
        words.append({1: "satisfied", -1: "violated"}.get(int(verdict), undecided))
    return tuple(words)


def _phrases(table: TickTable, names: dict[Box, str]) -> list[str]:
    """What each state of one disjunct's tick table still waits for."""
    from tickwise.logic.render import to_english

    automaton = table.automaton
    primitives = automaton.conjunction.primitives
    several = len(primitives) > 1
    steps = [
        (f"step {number} of {len(primitives)}: " if several else "") + to_english(primitive.formula, names)
        for number, primitive in enumerate(primitives, start=1)
    ]
    phrases = []
    for state, (location, stage) in enumerate(zip(table.location, table.stage, strict=True)):
        staying = _STAY_CLOCK in automaton.active[location]
        since = int(table.clocks[state, _STAY_CLOCK]) + 1 if staying else 0
        phrases.append(steps[stage] + (_progress(primitives[stage], since) if staying else ""))
    return phrases


def _progress(primitive: Primitive, ticks: int) -> str:
    """How far a stay, or a gap between visits, has come after some ticks."""
    if primitive.operator is Operator.EVENTUALLY_ALWAYS:
        return f" ({ticks} of {primitive.duration + 1} ticks)"
    return f" (ticks left: {primitive.duration + 1 - ticks})"
