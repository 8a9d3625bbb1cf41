"""The gridworld of the case studies: how the robot moves, as an exact transition kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError

HEADINGS = ("east", "north", "west", "south")
"""Names of the headings, by number: a left turn adds one."""

STEPS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
"""Change of the cell (i, j) by one step in each heading, shape ``(4, 2)``."""

ACTIONS = ("straight", "turn left", "turn right")
"""Names of the actions, by number."""


@dataclass(frozen=True, slots=True)
class GridWorld:
    """A square world of unit cells in which a robot goes straight or turns (Section V; dynamics only).

    The world spans [0, size]² in world units; cell (i, j) is the unit square from (i, j), numbered ``i *
    size + j``, and the robot is at its cell's centre. A state is a cell and a heading, numbered ``4 * cell
    + heading``.

    Going straight keeps the heading and moves one cell forward or, with probability ``slip`` each, one cell
    to the left or right of the heading; a move that would leave the world stays instead. A turn rotates in
    place and, with probability ``turn_failure``, does nothing. Every state is equally likely at tick 0.

    Attributes:
        size: Number of cells along a side.
        slip: Probability of slipping to the left, and again to the right.
        turn_failure: Probability that a turn keeps the heading.

    Raises:
        ConfigurationError: If a number is out of range.
    """

    size: int
    slip: float = 0.04
    turn_failure: float = 0.03

    def __post_init__(self) -> None:
        if isinstance(self.size, bool) or not isinstance(self.size, int) or self.size < 1:
            raise ConfigurationError(f"the world's size is {self.size!r}; use a whole number of cells, 1 or more")
        if not 0 <= self.slip <= 0.5:
            raise ConfigurationError(f"slip is {self.slip!r}; use a probability for each side, from 0 to 0.5")
        if not 0 <= self.turn_failure <= 1:
            raise ConfigurationError(f"turn_failure is {self.turn_failure!r}; use a probability from 0 to 1")

    def state(self, i: int, j: int, heading: int) -> int:
        """The number of the state in cell (i, j) with a heading."""
        return (i * self.size + j) * 4 + heading

    def place(self, state: int) -> tuple[int, int, int]:
        """The cell (i, j) and the heading of a numbered state."""
        cell, heading = divmod(state, 4)
        return cell // self.size, cell % self.size, heading

    def mdp(self) -> TabularMDP:
        """The world as arrays, with three outcomes an action.

        Straight has the outcomes forward, left and right; a turn has turned and not turned (and one of
        probability 0).
        """
        i, j, heading = np.indices((self.size, self.size, 4)).reshape(3, -1)
        here = np.arange(len(heading))

        def turned(turn: int) -> np.ndarray:
            return here - heading + (heading + turn) % 4

        def moved(turn: int) -> np.ndarray:
            di, dj = STEPS[(heading + turn) % 4].T
            inside = (i + di >= 0) & (i + di < self.size) & (j + dj >= 0) & (j + dj < self.size)
            return np.where(inside, here + 4 * (di * self.size + dj), here)

        outcomes = (
            (moved(0), moved(1), moved(-1)),
            (turned(1), here, here),
            (turned(-1), here, here),
        )
        odds = (
            (1 - 2 * self.slip, self.slip, self.slip),
            (1 - self.turn_failure, self.turn_failure, 0.0),
            (1 - self.turn_failure, self.turn_failure, 0.0),
        )
        successor = np.moveaxis(np.array(outcomes), -1, 0)
        corners = np.indices((self.size, self.size)).reshape(2, -1).T.astype(np.float64)
        side = (0.0, float(self.size))
        return TabularMDP(
            successor=successor.astype(np.int32),
            probability=np.broadcast_to(np.array(odds), successor.shape),
            initial=np.full(len(here), 1 / len(here)),
            cell=(here // 4).astype(np.int32),
            cell_coordinates=corners + 0.5,
            variables=("x", "y"),
            limits=(side, side),
        )
