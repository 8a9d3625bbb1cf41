"""What an automaton does on a trajectory: letters, timed words and runs (the paper's Sections II-A and II-B).

The paper's timed word keeps only the ticks at which the letter changes, and the last tick. A tick automaton
(Remark 1) reads one letter at *every* tick, that is, it runs on the same word with each letter repeated until
the next one: every flow-step lasts one tick. `TimedWord.letters` is that word, so nothing is lost by the
compression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tickwise._wording import brief
from tickwise.automata.model import TimedAutomaton, letter_text
from tickwise.errors import AutomatonError, DataError
from tickwise.logic.semantics import Batch, Trajectories, as_batch, holds
from tickwise.logic.syntax import Predicate, Verdict

Valuation: TypeAlias = tuple[int, ...]
"""The value of each clock, in ticks."""


def encode(predicates: Sequence[Predicate], batch: Batch, variables: Sequence[str]) -> NDArray[np.int64]:
    """The labeling function L on checked trajectories: bit j of a letter is set where predicate j holds.

    Args:
        predicates: AP, by position.
        batch: Trajectories whose columns are `variables`.
        variables: The names of the columns.

    Returns:
        int64 (n, ticks); -1 past a trajectory's length.
    """
    count, ticks, _ = batch.values.shape
    letters = np.zeros((count, ticks), dtype=np.int64)
    for bit, predicate in enumerate(predicates):
        letters |= holds(predicate, batch.values, variables).astype(np.int64) << bit
    letters[np.arange(ticks) >= batch.lengths[:, None]] = -1
    return letters


def letters_of(
    automaton: TimedAutomaton,
    X: Trajectories,
    *,
    variables: Sequence[str] | None = None,
    lengths: NDArray[Any] | None = None,
) -> NDArray[np.int64]:
    """The letters that an automaton reads on trajectories.

    Args:
        automaton: The timed automaton.
        X: One trajectory or a batch, as for `tickwise.logic.semantics.verdict`.
        variables: The names of the columns; by default the conjunction's, in order of appearance.
        lengths: The number of states of each trajectory in a padded batch.

    Returns:
        int64 (ticks,) for one trajectory, (n, ticks) for a batch; -1 past a trajectory's length.

    Raises:
        DataError: If the trajectories are malformed.
    """
    names = automaton.conjunction.formula.variables
    batch = as_batch(X, names, variables=variables, lengths=lengths)
    letters = encode(automaton.predicates, batch, names)
    return letters[0] if batch.single else letters


@dataclass(frozen=True, slots=True)
class TimedWord:
    """The timed word (L(s_{t_1}), t_1), …, (L(s_{t_m}), t_m) of a trajectory (Section II-A).

    Attributes:
        symbols: Pairs (letter, tick): the first tick, every tick at which the letter changes, and the last
            tick L.

    Raises:
        DataError: If it is empty, does not begin at tick 0, or its ticks do not increase.
    """

    symbols: tuple[tuple[int, int], ...]

    def __post_init__(self) -> None:
        ticks = [tick for _, tick in self.symbols]
        if not ticks or ticks[0] != 0 or any(a >= b for a, b in pairwise(ticks)):
            raise DataError(f"a timed word's ticks must increase from 0; got {ticks}")

    @property
    def letters(self) -> tuple[int, ...]:
        """The letter of every tick from 0 to L: what a tick automaton reads."""
        spread = [letter for (letter, tick), (_, following) in pairwise(self.symbols) for _ in range(tick, following)]
        return (*spread, self.symbols[-1][0])


def timed_word(letters: Sequence[int] | NDArray[Any]) -> TimedWord:
    """Compress the letters of every tick of one trajectory to its timed word (Section II-A).

    Args:
        letters: One letter a tick from tick 0, shape (ticks,), for instance from `letters_of`.

    Returns:
        The timed word; its `TimedWord.letters` are the letters given.

    Raises:
        DataError: If there are no letters.
    """
    word = [int(letter) for letter in letters]
    last = len(word) - 1
    kept = [tick for tick in range(len(word)) if tick in (0, last) or word[tick] != word[tick - 1]]
    return TimedWord(tuple((word[tick], tick) for tick in kept))


@dataclass(frozen=True, slots=True)
class EdgeStep:
    """An edge-step (q, v) → (q', v') on the letter of a tick.

    Attributes:
        tick: The tick at which the letter is read.
        letter: The letter.
        source: The location q.
        before: The clock valuation v, in ticks.
        target: The location q'.
        after: The clock valuation v' after the resets, in ticks.
    """

    tick: int
    letter: int
    source: int
    before: Valuation
    target: int
    after: Valuation


@dataclass(frozen=True, slots=True)
class FlowStep:
    """A flow-step (q, v) ~1~> (q, v + 1): one tick passes.

    Attributes:
        tick: The tick at which it begins.
        location: The location q.
        before: The clock valuation v, in ticks.
        after: The clock valuation v + 1, in ticks.
    """

    tick: int
    location: int
    before: Valuation
    after: Valuation


@dataclass(frozen=True, slots=True)
class Run:
    """The run of a deterministic timed automaton on one trajectory (Section II-B).

    Attributes:
        automaton: The timed automaton.
        steps: An edge-step at every tick from 0 to L, with a flow-step of one tick between each two.
    """

    automaton: TimedAutomaton
    steps: tuple[EdgeStep | FlowStep, ...]

    @property
    def verdict(self) -> Verdict:
        """What the last location says of the conjunction; the run is accepting where it is TRUE."""
        last = self.steps[-1]
        return self.automaton.outcome(last.target if isinstance(last, EdgeStep) else last.location)

    def __str__(self) -> str:
        return "\n".join(self._line(step) for step in self.steps)

    def _line(self, step: EdgeStep | FlowStep) -> str:
        if isinstance(step, FlowStep):
            arrow = "~1~>"
            source = target = step.location
        else:
            arrow = f"--{letter_text(step.letter, len(self.automaton.predicates))}-->"
            source, target = step.source, step.target
        return f"{step.tick}: {self._pair(source, step.before)} {arrow} {self._pair(target, step.after)}"

    def _pair(self, location: int, valuation: Valuation) -> str:
        values = (f"{name}={value}" for name, value in zip(self.automaton.clocks, valuation, strict=True))
        return f"({', '.join((self.automaton.locations[location], *values))})"


def run(automaton: TimedAutomaton, X: Trajectories, *, variables: Sequence[str] | None = None) -> Run:
    """The run of an automaton on one trajectory, with the paper's clocks: all run everywhere, none stops.

    Args:
        automaton: The timed automaton.
        X: One trajectory, an array (ticks, variables) or a data frame.
        variables: The names of the columns; by default the conjunction's, in order of appearance.

    Returns:
        The run, to be read step by step or printed.

    Raises:
        DataError: If the trajectory is malformed, or a batch was given.
    """
    letters = letters_of(automaton, X, variables=variables)
    if letters.ndim != 1:
        raise DataError(f"a run is of one trajectory, but a batch of {len(letters)} was given; index it")
    return run_on(automaton, [int(letter) for letter in letters])


def run_on(automaton: TimedAutomaton, letters: Sequence[int]) -> Run:
    """The run of an automaton on a word with one letter a tick from tick 0; see `run`.

    Raises:
        AutomatonError: If no edge can be taken on a letter.
    """
    location, valuation = automaton.initial, (0,) * len(automaton.clocks)
    steps: list[EdgeStep | FlowStep] = []
    for tick, letter in enumerate(letters):
        if tick > 0:
            flowed = tuple(value + 1 for value in valuation)
            steps.append(FlowStep(tick - 1, location, valuation, flowed))
            valuation = flowed
        edge = next(
            (e for e in automaton.edges if e.source == location and e.enabled(letter, valuation)),
            None,
        )
        if edge is None:
            raise AutomatonError(
                f"not complete: no edge of {brief(automaton.locations[location])} can be taken at tick {tick} on "
                f"{letter_text(letter, len(automaton.predicates))}; add one"
            )
        after = tuple(0 if clock in edge.resets else value for clock, value in enumerate(valuation))
        steps.append(EdgeStep(tick, letter, location, valuation, edge.target, after))
        location, valuation = edge.target, after
    return Run(automaton, tuple(steps))
