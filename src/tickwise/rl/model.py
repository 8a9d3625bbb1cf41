"""Model-based learning in the extended state: the world's transitions are counted, and planned on with the automaton.

The automaton's dynamics are known, so that a step teaches what the world does whatever the automaton's state was: the
counts are over (state, action, outcome) alone and shared by all extended states. So are those of the rewards but for
what the automaton says on arriving; a formula that says what is rewarded makes that enough.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import check_form, first_values
from tickwise.rl.loop import run_episodes
from tickwise.rl.planning import CLASSES, Counts, imagine, plan, play
from tickwise.rl.qlearning import Problem
from tickwise.rl.stream import put_back, take_stream
from tickwise.rl.unrolled import Unrolled, unroll

_FALSE = slice(0, 2)  # the classes of what the automaton says is false


def no_counts(mdp: TabularMDP) -> Counts:
    """The counts of a world of which nothing was seen."""
    by_class = (CLASSES, mdp.n_states)
    return Counts(
        np.zeros(mdp.successor.shape, np.int32),
        np.zeros(by_class),
        np.zeros(by_class, np.int32),
        np.zeros(by_class, np.int32),
    )


@dataclass(frozen=True, slots=True)
class ModelBased:
    """Model-based learning with optimism: what was not met often enough is taken to be as good as anything.

    Attributes:
        known: A state and an action count as known once they were met so often.
        hope: The reward that satisfying the formula is taken to give before any such reward was seen, in units of
            reward.
        pooling: The weight, in arrivals, of the mean reward of all states where the automaton says the same in the
            estimate for one of them.
        form: The name of the form.

    Raises:
        ConfigurationError: If a setting is out of range.
    """

    known: int = 1
    hope: float = 50.0
    pooling: float = 0.01
    form: str = field(default="model", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)
        if not isinstance(self.known, int) or self.known < 1:
            raise ConfigurationError(f"known is {self.known}; use a whole number, 1 or more")
        if not (np.isfinite(self.hope) and 0 < self.pooling < np.inf):
            raise ConfigurationError(
                f"hope is {self.hope} and pooling {self.pooling}; use a finite number, and one above 0"
            )

    def learner(
        self, problem: Problem, q: NDArray[np.float32] | None = None, counts: Counts | None = None
    ) -> ModelLearner:
        """What learns a problem on a model; see `tickwise.rl.learner.LearningForm`.

        Args:
            problem: What to learn; the tick is put into its memory.
            q: What pairs of a state and an action that are not known yet are taken to be worth, such as transferred
                values, shape ``(memory states, states, actions)``; None for the best that was seen or is hoped for.
            counts: What is known of the world already; it is gone on with, not copied. Its rewards and ends are by what
                the automaton said when they were met, even if that was another formula's.

        Raises:
            ConfigurationError: If the values or the counts have another shape than the problem.
        """
        unrolled = unroll(problem.memory, problem.task.horizon)
        nothing = no_counts(problem.mdp)
        counts = nothing if counts is None else counts
        for name in Counts._fields:
            found, wanted = getattr(counts, name).shape, getattr(nothing, name).shape
            if found != wanted:
                raise ConfigurationError(f"{name} of the counts has shape {found}; use {wanted}")
        given = np.empty((0, 1, 1), np.float32) if q is None else first_values(problem, 0.0, q)[unrolled.state]
        return ModelLearner(Problem(problem.mdp, problem.task, unrolled.memory), unrolled, counts, self, given)


@dataclass(slots=True, eq=False)
class ModelLearner:
    """A world as far as it was met, and plans on it; a `tickwise.rl.learner.Learner`.

    Attributes:
        problem: What is learned; its memory has the tick in it.
        unrolled: That memory with what its states mean.
        counts: What was met.
        settings: The settings.
        given: Values of what is not known yet; of no memory states where there are none.
    """

    problem: Problem
    unrolled: Unrolled
    counts: Counts
    settings: ModelBased
    given: NDArray[np.float32]
    _q: NDArray[np.float32] = field(init=False)
    _stale: bool = field(default=True, init=False)

    def __post_init__(self) -> None:
        shape = (self.problem.memory.n_states, self.problem.mdp.n_states, self.problem.mdp.n_actions)
        self._q = np.zeros(shape, np.float32)

    @property
    def q(self) -> NDArray[np.float32]:
        """The values of the empirical model, planned when they are asked for."""
        if self._stale:
            self.replan()
        return self._q

    @property
    def indifferent(self) -> NDArray[np.float32]:
        """A table to play that leaves every action to chance."""
        return np.zeros_like(self._q)

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Play some episodes, with a new plan after each; see `tickwise.rl.learner.Learner`."""
        returns = np.empty(episodes, np.float32)
        paths = np.empty((episodes, self.problem.task.horizon + 1), np.int32)
        for episode in range(episodes):
            returns[episode : episode + 1], paths[episode : episode + 1] = self.play(rng)
            self._stale = True
        return returns, paths

    def play(
        self, rng: np.random.Generator, q: NDArray[np.float32] | None = None
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Play one episode greedily, ties at random, and count what is met.

        Args:
            rng: The generator that all draws come from.
            q: The table to play, of the plan's shape; None for the plan.

        Returns:
            As `learn`, for one episode.

        Raises:
            ConfigurationError: If the table has another shape.
        """
        table = self.q if q is None else q
        if table.shape != self._q.shape:
            raise ConfigurationError(
                f"the table to play has shape {table.shape}; use that of the plan, {self._q.shape}"
            )
        return run_episodes(play, self.problem, (self.unrolled.verdict, table, self.counts), rng, 1)

    def recount(self, paths: NDArray[np.int32]) -> None:
        """Count rewards and ends by what this memory's automaton says, from episodes that were had with another.

        Args:
            paths: The MDP states of all episodes so far, -1 after their end, shape ``(episodes, horizon + 1)``.
        """
        problem, memory, counts = self.problem, self.problem.memory, self.counts
        rewards, ended = problem.replayed(paths)
        horizon, rows = problem.task.horizon, np.arange(len(paths))
        read = np.zeros(problem.mdp.n_states, np.int32)  # an automaton's letter is that of the state arrived in
        read[problem.mdp.successor] = memory.letter
        u, last = memory.start[paths[:, 0]], (paths >= 0).sum(axis=1) - 1
        for part in (counts.rewards, counts.arrivals, counts.ends):
            part[:] = 0
        for t in range(1, horizon + 1):
            rows = rows[paths[rows, t] >= 0]
            s = paths[rows, t]
            u[rows] = memory.delta[u[rows], read[s]]
            kinds = 2 * (self.unrolled.verdict[u[rows]] + 1) + (t == horizon)
            np.add.at(counts.rewards, (kinds, s), rewards[rows, t - 1])
            np.add.at(counts.arrivals, (kinds, s), 1)
            np.add.at(counts.ends, (kinds, s), (last[rows] == t) & (ended[rows] | (t == horizon)))
        self._stale = True

    def replan(self) -> None:
        """Plan for the rewards on what was counted so far."""
        self._stale = False
        reward, ends = expectations(self.counts, self.settings)
        left = self.problem.task.horizon - self.unrolled.tick
        # where a formula is decided by the end, "unknown at the last tick" is never seen, and would be hoped for always
        occurring = np.unique(2 * (self.unrolled.verdict + 1) + (left == 0))
        best = np.zeros(CLASSES)
        best[occurring] = np.maximum(reward[occurring].max(axis=1), 0.0)
        worth = np.maximum(left - 1, 0) * best[::2].max() + best[1::2].max()
        sweep(self.problem, self.unrolled, self.counts, self.settings.known, reward, ends, worth, self.given, self._q)


def expectations(counts: Counts, settings: ModelBased) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The expected reward on arriving, and the probability that the episode ends there, by class and state.

    Returns:
        Two arrays of shape ``(CLASSES, states)``.
    """
    met = counts.arrivals.sum(axis=1, keepdims=True)
    hoped = np.zeros((CLASSES, 1))
    hoped[1::2] = settings.hope  # at the last tick
    hoped[_FALSE] = 0.0
    pooled = np.where(met > 0, counts.rewards.sum(axis=1, keepdims=True) / np.maximum(met, 1), hoped)
    ending = counts.ends.sum(axis=1, keepdims=True) / np.maximum(met, 1)
    weight = counts.arrivals + settings.pooling
    return (counts.rewards + settings.pooling * pooled) / weight, (counts.ends + settings.pooling * ending) / weight


def sweep(
    problem: Problem,
    unrolled: Unrolled,
    counts: Counts,
    known: int,
    reward: NDArray[np.float64],
    ends: NDArray[np.float64],
    worth: NDArray[np.float64],
    given: NDArray[np.float32],
    q: NDArray[np.float32],
) -> None:
    """Plan on what was counted; the arguments are those of `tickwise.rl.planning.plan`."""
    memory = problem.memory
    plan(
        problem.mdp.successor, memory.delta, memory.letter, unrolled.tick, unrolled.verdict, problem.task.horizon,
        counts.outcomes, known, reward, ends, worth, given, q,
    )  # fmt: skip


def satisfying_plan(learner: ModelLearner) -> NDArray[np.float32]:
    """Plan to satisfy the memory's formula, in the world as far as it was met; rewards and ends play no part.

    Args:
        learner: What was met. What is not known is taken to satisfy, unless the formula is false already.

    Returns:
        The greatest probability that the formula is satisfied, in the weak view: it is not false at the last tick.
        Shape ``(memory states, states, actions)``, 0 at that tick. Of several disjuncts it is the one that the memory
        follows.
    """
    problem, unrolled = learner.problem, learner.unrolled
    q = np.zeros((problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions), np.float32)
    reward = np.zeros((CLASSES, problem.mdp.n_states))
    reward[[3, 5]] = 1.0  # unknown or true at the last tick
    hope, nothing = np.where(unrolled.verdict < 0, 0.0, 1.0), np.empty((0, 1, 1), np.float32)
    sweep(problem, unrolled, learner.counts, learner.settings.known, reward, np.zeros_like(reward), hope, nothing, q)
    return q


def imagined(
    learner: ModelLearner,
    starts: NDArray[np.int32],
    episodes: int,
    rng: np.random.Generator,
    q: NDArray[np.float32] | None = None,
) -> NDArray[np.int32]:
    """Episodes of the plan in the world as far as it was met; see `tickwise.rl.planning.imagine`.

    Args:
        learner: The plan, and what was met.
        starts: MDP states, one of which is drawn at the beginning of each episode, shape ``(n,)``.
        episodes: How many.
        rng: The generator that all draws come from.
        q: The table to play, of the plan's shape; None for the plan.

    Returns:
        MDP states, shape ``(episodes, horizon + 1)``.

    Raises:
        ConfigurationError: If there is no state to begin in, or it is none of the world.
    """
    problem, memory = learner.problem, learner.problem.memory
    if not len(starts) or starts.min() < 0 or starts.max() >= problem.mdp.n_states:
        raise ConfigurationError(
            f"the starts to imagine from are {starts}; use states from 0 to {problem.mdp.n_states - 1}"
        )
    paths = np.empty((episodes, problem.task.horizon + 1), np.int32)
    stream = take_stream(rng)
    arrays = (problem.mdp.successor, memory.start, memory.delta, memory.letter)
    imagine(starts, *arrays, learner.counts.outcomes, stream, learner.q if q is None else q, paths)
    put_back(rng, stream)
    return paths
