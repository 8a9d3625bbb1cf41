"""Hidden tasks as data: what the reward depends on, compiled to a small table over ticks.

A task sees the world through letters: bit b of a state's letter is set iff the state lies in the task's
b-th region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import frozen_array
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError, DataError
from tickwise.logic.syntax import Box


@dataclass(frozen=True, slots=True)
class Landmark:
    """A region of a task as a map shows it.

    Attributes:
        label: One or two characters, such as ``G`` or ``B1``.
        colour: ``green``, ``yellow`` or ``blue``.
        box: The region, in world units.
    """

    label: str
    colour: str
    box: Box


class Task(Protocol):
    """What an environment needs of a hidden task."""

    @property
    def deadline(self) -> int:
        """The deadline L in ticks; an episode has at most L steps."""
        ...

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The regions for a map, in the order of drawing."""
        ...

    def table(self, mdp: TabularMDP) -> TaskTable:
        """The task over the states of an MDP."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class TaskTable:
    """A hidden task as arrays, over the states s of one MDP; the arrays are copied and cannot be written to.

    Task state 0 is the start, before any letter was read: ``w_0 = delta[0, letter[s_0]]`` and
    ``w_{t+1} = delta[w_t, letter[s_{t+1}]]``. Step t, for t = 1..L, gives ``reward[w_t, s_t]``, and at the
    deadline L ``final_reward[w_L]`` as well; nothing is given for s_0. An episode ends at the first tick t
    >= 1 at which ``terminated[w_t]`` holds or t = L.

    Attributes:
        delta: Next task state, int32, shape ``(task states, letters)``.
        letter: Letter of each MDP state, int32, shape ``(states,)``.
        reward: Reward of a tick on arriving, float32, shape ``(task states, states)``.
        final_reward: Reward added at the deadline, float32, shape ``(task states,)``.
        terminated: Whether arriving ends the episode, bool, shape ``(task states,)``.
        success: Whether an episode that ends here has kept the task, bool, shape ``(task states,)``.
        horizon: The deadline L in ticks.
        stages: What each task state means, in words.

    Raises:
        DataError: If a shape does not fit or a number is out of range.
    """

    delta: NDArray[np.int32]
    letter: NDArray[np.int32]
    reward: NDArray[np.float32]
    final_reward: NDArray[np.float32]
    terminated: NDArray[np.bool_]
    success: NDArray[np.bool_]
    horizon: int
    stages: tuple[str, ...]

    def __post_init__(self) -> None:
        for name, dtype in (
            ("delta", np.int32), ("letter", np.int32), ("reward", np.float32), ("final_reward", np.float32),
            ("terminated", np.bool_), ("success", np.bool_),
        ):  # fmt: skip
            object.__setattr__(self, name, frozen_array(getattr(self, name), dtype))
        if self.delta.ndim != 2 or self.letter.ndim != 1 or not self.delta.size or not self.letter.size:
            raise DataError(
                f"delta has shape {self.delta.shape} and letter {self.letter.shape}; "
                "use (task states, letters) and (states,), none zero"
            )
        row = (len(self.delta),)
        wanted = {
            "reward": (*row, len(self.letter)), "final_reward": row, "terminated": row, "success": row,
        }  # fmt: skip
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise DataError(f"{name} has shape {getattr(self, name).shape}; use {shape}")
        if len(self.stages) != len(self.delta):
            raise DataError(f"there are {len(self.stages)} stages for {len(self.delta)} task states; give one each")
        for name, array, count in (
            ("delta", self.delta, len(self.delta)),
            ("letter", self.letter, self.delta.shape[1]),
        ):
            if array.min() < 0 or array.max() >= count:
                raise DataError(f"{name} has a number outside 0..{count - 1}")
        check_ticks("horizon", self.horizon, least=1)

    @property
    def n_states(self) -> int:
        """The number of task states."""
        return len(self.delta)


@dataclass(frozen=True, slots=True)
class ReachStayReach:
    """Stay in one region without a break, later reach another, by the deadline (Case Study 1).

    The task is done iff there are a tick t with the robot in ``first`` at all of t..t+stay and a tick u with
    t+stay < u <= deadline at which it is in ``second``: ◇□[0,stay] first, then second. Nothing is given
    before the deadline; there, ``reward`` if it is done and ``penalty`` if not.

    Attributes:
        first: The region to stay in.
        stay: Ticks from the first to the last tick of the stay; it covers stay+1 ticks.
        second: The region to reach thereafter.
        deadline: The deadline L in ticks.
        reward: Given at the deadline if the task is done.
        penalty: Given at the deadline if it is not.

    Raises:
        ConfigurationError: If the numbers of ticks leave no time to do it.
    """

    first: Box
    stay: int
    second: Box
    deadline: int
    reward: float = 100.0
    penalty: float = -10.0

    def __post_init__(self) -> None:
        check_ticks("stay", self.stay, least=0)
        check_ticks("deadline", self.deadline, least=self.stay + 1)

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The regions for a map, in the order of drawing."""
        return Landmark("G", "green", self.first), Landmark("Y", "yellow", self.second)

    def table(self, mdp: TabularMDP) -> TaskTable:
        """The task over the states of an MDP.

        Task states 0..stay count the ticks that the robot has been in ``first`` without a break; then come
        *stayed* and *done*.

        Raises:
            ConfigurationError: If a region contains no cell of the world.
        """
        letter = _letters((self.first, self.second), mdp)
        stayed, done = self.stay + 1, self.stay + 2
        delta = np.zeros((done + 1, 4), dtype=np.int32)
        for run in range(stayed):
            delta[run, [0b01, 0b11]] = run + 1
        delta[stayed] = stayed, stayed, done, done
        delta[done] = done
        success = np.arange(done + 1) == done
        counting = (f"stay in G: {run} of {stayed} ticks" for run in range(stayed))
        return TaskTable(
            delta=delta,
            letter=letter,
            reward=np.zeros((done + 1, mdp.n_states), dtype=np.float32),
            final_reward=np.where(success, self.reward, self.penalty).astype(np.float32),
            terminated=np.zeros(done + 1, dtype=np.bool_),
            success=success,
            horizon=self.deadline,
            stages=(*counting, "stayed in G; now reach Y", "done"),
        )


@dataclass(frozen=True, slots=True)
class Recurrence:
    """Come back to a region time and again, and gather rewards meanwhile (Case Study 2).

    The rule is □[0,deadline]◇[0,period] region, for one and the same region throughout. It is broken as
    soon as, for every region, some window of ticks t..t+period, t >= 0, has passed without a visit to it. A
    window that reaches beyond the deadline breaks nothing.

    Each tick from tick 1 on in one of the ``greens`` gives ``green_reward``. The tick that breaks the rule
    gives ``penalty`` alone and ends the episode.

    Attributes:
        regions: The regions; visits to any one of them, the same throughout, keep the rule.
        period: Length of the window in ticks: the longest time without a visit that keeps the rule.
        greens: The regions that give rewards.
        deadline: The deadline L in ticks.
        green_reward: Given for each tick in a green region.
        penalty: Given for breaking the rule.

    Raises:
        ConfigurationError: If there is no region, or a number of ticks is too small.
    """

    regions: tuple[Box, ...]
    period: int
    greens: tuple[Box, ...]
    deadline: int
    green_reward: float = 100.0
    penalty: float = -800.0

    def __post_init__(self) -> None:
        if not self.regions:
            raise ConfigurationError("a recurrence task has no region to come back to; give at least one")
        check_ticks("period", self.period, least=1)
        check_ticks("deadline", self.deadline, least=1)

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The regions for a map, in the order of drawing."""
        greens = tuple(Landmark("G", "green", box) for box in self.greens)
        blues = (Landmark(label, "blue", box) for label, box in zip(self._labels(), self.regions, strict=True))
        return (*greens, *blues)

    def _labels(self) -> tuple[str, ...]:
        count = len(self.regions)
        return ("B",) if count == 1 else tuple(f"B{number}" for number in range(1, count + 1))

    def table(self, mdp: TabularMDP) -> TaskTable:
        """The task over the states of an MDP.

        A task state counts, for each region, the ticks without a visit up to now; a region is lost at
        period+1, and the rule is broken when all are lost.

        Raises:
            ConfigurationError: If a region contains no cell of the world.
        """
        lost = self.period + 1
        found = [(0,) * len(self.regions)]
        numbers = {found[0]: 0}
        rows: list[list[int]] = []
        while len(rows) < len(found):  # breadth first, from the start
            row = []
            for letter in range(2 ** len(self.regions)):
                following = tuple(
                    count if count == lost else 0 if letter >> bit & 1 else count + 1
                    for bit, count in enumerate(found[len(rows)])
                )
                if following not in numbers:
                    numbers[following] = len(found)
                    found.append(following)
                row.append(numbers[following])
            rows.append(row)
        broken = np.array([min(counts) == lost for counts in found])
        green = np.zeros(mdp.n_states, dtype=np.bool_)
        for box in self.greens:
            green |= inside(box, mdp)
        reward = np.where(green, self.green_reward, 0.0)
        return TaskTable(
            delta=np.array(rows, dtype=np.int32),
            letter=_letters(self.regions, mdp),
            reward=np.where(broken[:, None], self.penalty, reward).astype(np.float32),
            final_reward=np.zeros(len(found), dtype=np.float32),
            terminated=broken,
            success=~broken,
            horizon=self.deadline,
            stages=tuple(self._stage(counts) for counts in found),
        )

    def _stage(self, counts: tuple[int, ...]) -> str:
        if min(counts) > self.period:
            return "the rule is broken"
        parts = (
            f"{label} is lost" if count > self.period else f"{label} {count} of {self.period} ticks away"
            for label, count in zip(self._labels(), counts, strict=True)
        )
        return ", ".join(parts)


class TaskMonitor:
    """Follows one episode through a task table.

    Args:
        table: The task.

    Attributes:
        tick: The current tick; 0 at the start of an episode.
        state: The current task state.
    """

    def __init__(self, table: TaskTable) -> None:
        self._table = table
        self.tick = 0
        self.state = 0

    @property
    def success(self) -> bool:
        """Whether the task is kept if the episode ends here."""
        return bool(self._table.success[self.state])

    @property
    def stage(self) -> str:
        """What the current task state means, in words."""
        return self._table.stages[self.state]

    def start(self, state: int) -> None:
        """Begin an episode in an MDP state, at tick 0."""
        self.tick = 0
        self.state = int(self._table.delta[0, self._table.letter[state]])

    def advance(self, state: int) -> tuple[float, bool]:
        """Go to the next tick, at which the MDP is in a state.

        Returns:
            The reward of the tick, and whether the episode ends with it.
        """
        table = self._table
        self.tick += 1
        self.state = int(table.delta[self.state, table.letter[state]])
        reward = float(table.reward[self.state, state])
        due = self.tick == table.horizon
        if due:
            reward += float(table.final_reward[self.state])
        return reward, due or bool(table.terminated[self.state])


def inside(box: Box, mdp: TabularMDP) -> NDArray[np.bool_]:
    """Which states of an MDP lie in a region, shape ``(states,)``.

    Raises:
        ConfigurationError: If none does.
    """
    # imported late: it brings compiled kernels, too heavy for merely listing the environments
    from tickwise.logic.semantics import holds

    member: NDArray[np.bool_] = holds(box, mdp.coordinates, mdp.variables)
    if not member.any():
        raise ConfigurationError(
            f"the region {box} contains no cell of the world with limits {mdp.limits}; move it inside"
        )
    return member


def _letters(boxes: Sequence[Box], mdp: TabularMDP) -> NDArray[np.int32]:
    letter = np.zeros(mdp.n_states, dtype=np.int32)
    for bit, box in enumerate(boxes):
        letter |= inside(box, mdp).astype(np.int32) << bit
    return letter


def check_ticks(name: str, ticks: int, least: int) -> None:
    """Make sure that a setting is a whole number of ticks.

    Raises:
        ConfigurationError: If it is not, or less than `least`.
    """
    if isinstance(ticks, bool) or not isinstance(ticks, int) or ticks < least:
        raise ConfigurationError(f"{name} is {ticks!r}; use a whole number of ticks, {least} or more")
