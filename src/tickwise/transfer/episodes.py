"""All episodes that an agent had in a task, as labelled trajectories."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.rl.qlearning import Problem

Good = Callable[[NDArray[np.float32], NDArray[np.bool_]], NDArray[np.bool_]]
"""Which episodes were good, from their returns and whether the task ended them, both of shape ``(n,)``."""

SHARES = (0.5, 0.4, 0.1)
"""What all bad episodes, all good ones, and all that nothing was wrong with before their last state weigh together."""


def good_return(returns: NDArray[np.float32], ended: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Good is an episode with a return above 0 (Case Study 1)."""
    del ended
    return np.asarray(returns > 0)


def unbroken(returns: NDArray[np.float32], ended: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Good is an episode that the task did not end before its time (Case Study 2)."""
    del returns
    return ~ended


@dataclass(slots=True, eq=False)
class Episodes:
    """A growing record of episodes.

    Attributes:
        problem: The world and the hidden task, which tells whether it ended an episode.
        is_good: Which episodes are good.
    """

    problem: Problem
    is_good: Good
    _returns: list[NDArray[np.float32]] = field(default_factory=list)
    _paths: list[NDArray[np.int32]] = field(default_factory=list)

    def __len__(self) -> int:
        return sum(map(len, self._returns))

    def add(self, returns: NDArray[np.float32], paths: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Record episodes.

        Args:
            returns: Their undiscounted returns, shape ``(n,)``.
            paths: Their MDP states with -1 after their end, shape ``(n, horizon + 1)``.

        Returns:
            Which of them were good, shape ``(n,)``.
        """
        self._returns.append(returns)
        self._paths.append(paths)
        return self.is_good(returns, self.problem.terminated(paths))

    @property
    def returns(self) -> NDArray[np.float32]:
        """The undiscounted return of each episode, shape ``(n,)``."""
        return _joined(self._returns) if self._returns else np.zeros(0, np.float32)

    @property
    def paths(self) -> NDArray[np.int32]:
        """The MDP states of each episode, -1 after its end, shape ``(n, horizon + 1)``."""
        empty = np.zeros((0, self.problem.task.horizon + 1), np.int32)
        return _joined(self._paths) if self._paths else empty

    @property
    def starts(self) -> NDArray[np.int32]:
        """The states that episodes began in, shape ``(n,)``; all states where there was none."""
        found = self.paths[:, 0]
        return found if len(found) else np.arange(self.problem.mdp.n_states, dtype=np.int32)

    @property
    def good(self) -> NDArray[np.bool_]:
        """Which episodes were good, shape ``(n,)``."""
        return self.is_good(self.returns, self.problem.terminated(self.paths))

    def labelled(self, *, prefixes: bool = True) -> tuple[LabelledTrajectories, NDArray[np.float64]]:
        """The episodes as labelled trajectories, and what an error in each costs.

        A bad episode that the task ended has broken a rule with its last state. Without that state it is one more
        trajectory with label 1: nothing was broken yet.

        Args:
            prefixes: Whether to add these.

        Returns:
            The trajectories, and weights that sum up to 1 where there are all kinds (see `SHARES`).
        """
        paths, good = self.paths, self.good
        lengths = (paths >= 0).sum(axis=1)
        broken = ~good & self.problem.terminated(paths) & (lengths > 2)
        rows = np.flatnonzero(broken & prefixes)
        cut = paths[rows]
        cut[np.arange(len(cut)), lengths[rows] - 1] = -1
        labels = np.concatenate([np.where(good, 1, -1), np.ones(len(cut), int)]).astype(np.int8)
        weights = np.zeros(len(labels))
        kinds = (np.flatnonzero(~good), np.flatnonzero(good), np.arange(len(good), len(labels)))
        for members, share in zip(kinds, SHARES, strict=True):
            weights[members] = share / max(len(members), 1)
        return self.trajectories(np.concatenate([paths, cut]), labels), weights

    def trajectories(self, paths: NDArray[np.int32], labels: NDArray[np.int8]) -> LabelledTrajectories:
        """Paths of the MDP as trajectories of its coordinates; they are named by their number."""
        mdp, lengths = self.problem.mdp, (paths >= 0).sum(axis=1)
        values = np.where(paths[..., None] >= 0, mdp.coordinates[paths], np.nan)
        return LabelledTrajectories(values, lengths, labels, mdp.variables, tuple(map(str, range(len(paths)))))


def _joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """All parts as one array, which takes their place: it is asked for several times an episode."""
    if len(parts) > 1:
        parts[:] = [np.concatenate(parts)]
    return parts[0]
