"""Environments that others wrote, as arrays: read from their tables, or enumerated by trying every action."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from gymnasium import wrappers
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable, check_ticks
from tickwise.envs.wrappers.collect import CollectTrajectories
from tickwise.envs.wrappers.labelled import FeatureMap, Features, Labelled
from tickwise.errors import ConfigurationError, DataError

Outcome: TypeAlias = tuple[float, int, float]
"""Probability, number of the next state, and reward."""

_TRIALS = 3
"""Random streams under which a step has to go the same way for an environment to count as deterministic."""

_WATCHING = (
    wrappers.PassiveEnvChecker, wrappers.OrderEnforcing, wrappers.TimeLimit, wrappers.RecordEpisodeStatistics,
    Labelled, CollectTrajectories,
)  # fmt: skip
"""Wrappers that leave observations, rewards and ends as an environment's own table has them."""


@dataclass(frozen=True, slots=True, eq=False)
class Tabulation:
    """An environment as arrays.

    Attributes:
        mdp: The world; states with the same features but for the orientation are one cell.
        observations: The observation of each state; None for combinations of features that never occur.
        terminal: Whether the environment's own episode ends on arriving in a state, shape ``(states,)``.
        reward: The environment's own reward of each outcome, float64, shape ``(states, actions, outcomes)``. Where it
            depends on the count of steps too, it is that of the shortest way.
    """

    mdp: TabularMDP
    observations: tuple[Any, ...]
    terminal: NDArray[np.bool_]
    reward: NDArray[np.float64]

    def timed(self, task: TaskTable) -> TaskTable:
        """A task over this world whose episodes also end where the environment's own do.

        An episode that ends there gives what the deadline would have given at that tick.

        Args:
            task: A task over `mdp`, such as ``FormulaTask(...).table(tabulation.mdp)``.

        Returns:
            The task, with a second set of task states for episodes that are over.
        """
        count = task.n_states
        over = np.broadcast_to(np.arange(count, 2 * count)[:, None], task.delta.shape)
        delta = np.empty((2 * count, 2 * task.delta.shape[1]), dtype=np.int64)
        delta[:, 0::2] = np.concatenate([task.delta, over])
        delta[:, 1::2] = np.concatenate([task.delta + count, over])
        ending = task.reward + task.final_reward[:, None]
        return TaskTable(
            delta=delta.astype(np.int32),
            letter=2 * task.letter + self.terminal,
            reward=np.concatenate([task.reward, np.where(task.terminated[:, None], task.reward, ending)]),
            final_reward=np.concatenate([task.final_reward, np.zeros(count)]).astype(np.float32),
            terminated=np.concatenate([task.terminated, np.ones(count, dtype=np.bool_)]),
            success=np.concatenate([task.success, task.success]),
            horizon=task.horizon,
            stages=(*task.stages, *(f"over: {stage}" for stage in task.stages)),
        )

    def own_task(self, horizon: int) -> TaskTable:
        """The environment's own rewards and ends as a task.

        Args:
            horizon: The most ticks of an episode; it ends there for good.

        Returns:
            The task.

        Raises:
            DataError: If the reward depends on more than the state that is reached; learn with `learn_by_steps` then.
        """
        check_ticks("horizon", horizon, least=1)
        possible = (self.mdp.probability > 0) & ~self.terminal[:, None, None]
        successor, reward = self.mdp.successor[possible], self.reward[possible]
        arrival = np.zeros(self.mdp.n_states)
        arrival[successor] = reward
        if (arrival[successor] != reward).any():
            state = int(successor[np.argmax(arrival[successor] != reward)])
            raise DataError(
                f"the reward of reaching {_short(self.observations[state])} depends on how it is reached; "
                "learn over steps with tickwise.rl.stepping instead"
            )
        success = np.zeros(2, dtype=np.bool_)
        return TaskTable(
            delta=np.array([[0, 1], [1, 1]], dtype=np.int32),
            letter=self.terminal.astype(np.int32),
            reward=np.stack([arrival, arrival]).astype(np.float32),
            final_reward=np.zeros(2, dtype=np.float32),
            terminated=np.array([False, True]),
            success=success,
            horizon=horizon,
            stages=("going on", "over"),
        )


def tabulate(
    env: gymnasium.Env[Any, Any],
    features: FeatureMap,
    *,
    orientation: Sequence[str] = (),
    seeds: Iterable[int] = (0,),
    most: int = 100_000,
) -> Tabulation:
    """Tabulate an environment, so that compiled kernels can learn in it and plan for it.

    An environment with a table of its own, as Gymnasium's toy texts have it (``P`` and ``initial_state_distrib``), is
    read from there. Any other one is enumerated: from the states that `seeds` lead to, each action is tried in a copy,
    until no new observation is found. That needs an environment that can be copied, whose steps are not random, and
    whose observation tells its whole state (but for a count of steps); each of these is checked where it can be: a
    step is tried with other random numbers, and a state that was reached on a second way has to go on as on the first.
    What wrappers make of an observation has to depend on the observation alone, not on the environment itself, which
    is not the copy. Truncation is not part of the table: the task's deadline ends an episode.

    Args:
        env: The environment, with numbered actions.
        features: As for `Labelled`; these are the variables of predicates.
        orientation: Those of the features that say how things stand in a cell, such as a heading, and are no
            coordinates of it; transfer keeps them as they are.
        seeds: The seeds of the resets from which an enumerated environment starts, equally likely.
        most: The most states.

    Returns:
        The tables.

    Raises:
        ConfigurationError: If the actions are not numbered from 0, a feature is wrong, there is no seed, or a wrapper
            changes what an environment's own table says.
        DataError: If the environment is random or cannot be copied, its observation does not tell its state, or it has
            too many states.
    """
    if not isinstance(env.action_space, gymnasium.spaces.Discrete) or env.action_space.start != 0:
        raise ConfigurationError(f"the actions are in {env.action_space}; a table needs numbers from 0 (Discrete)")
    mapped = Features(features, env.observation_space)
    unknown = set(orientation) - set(mapped.names)
    if unknown:
        raise ConfigurationError(f"the orientation {min(unknown)!r} is no feature; use {', '.join(mapped.names)}")
    own = hasattr(env.unwrapped, "P") and hasattr(env.unwrapped, "initial_state_distrib")
    found = _from_table(env, most) if own else _enumerated(env, tuple(seeds), most)
    return _tabulation(found, mapped, tuple(orientation), int(env.action_space.n))


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    """What was found: each state's observation, its outcomes by action, whether it is terminal; and the starts."""

    observations: list[Any]
    outcomes: list[list[list[Outcome]]]
    terminal: list[bool]
    initial: NDArray[np.float64]


def _from_table(env: gymnasium.Env[Any, Any], most: int) -> _Graph:
    below: Any = env
    while isinstance(below, gymnasium.Wrapper):
        if not isinstance(below, _WATCHING):
            raise ConfigurationError(
                f"the table of {env.unwrapped} knows nothing of {type(below).__name__}; tabulate what is below it"
            )
        below = below.env
    states = range(len(below.P))
    if len(states) > most:
        raise DataError(_too_many(most))
    outcomes = [[list(_merged(below.P[s][a])) for a in range(len(below.P[s]))] for s in states]
    initial = np.asarray(below.initial_state_distrib, dtype=np.float64)
    return _Graph(list(states), outcomes, _table_ends(below.P, initial), initial)


def _table_ends(table: Any, initial: NDArray[np.float64]) -> list[bool]:
    """In which states an episode ends; in what cannot be reached it does not."""
    ends: dict[int, bool] = {}
    waiting = [int(state) for state in np.flatnonzero(initial)]
    seen = set(waiting)
    while waiting:
        state = waiting.pop()
        for action in range(len(table[state])):
            for probability, following, _, over in table[state][action]:
                if probability <= 0:
                    continue
                if ends.setdefault(int(following), bool(over)) != bool(over):
                    raise DataError(_ambiguous(following))
                if not over and following not in seen:
                    seen.add(int(following))
                    waiting.append(int(following))
    return [ends.get(state, False) for state in range(len(table))]


def _too_many(most: int) -> str:
    return f"the environment has more than {most} states; raise most, or learn over steps instead"


def _ambiguous(observation: Any) -> str:
    return (
        f"an episode ends in {_short(observation)} on one way and goes on on another; let the observation tell the "
        "whole state, with gymnasium.wrappers.TransformObservation"
    )


def _short(observation: Any) -> str:
    """An observation in one line."""
    text = " ".join(repr(observation).split())
    return text if len(text) <= 80 else f"{text[:80]}…"


def _merged(row: Iterable[tuple[float, int, float, bool]]) -> Iterable[Outcome]:
    """Outcomes with the same next state and reward as one."""
    weights: dict[tuple[int, float], float] = {}
    for probability, following, reward, _ in row:
        place = (int(following), float(reward))
        weights[place] = weights.get(place, 0.0) + float(probability)
    return [(weight, following, reward) for (following, reward), weight in weights.items() if weight > 0]


class _Search:
    """Tries every action from every state, breadth first, each in a copy of the environment."""

    def __init__(self, actions: int, most: int) -> None:
        self.graph = _Graph([], [], [], np.zeros(0))
        self.waiting: deque[tuple[int, gymnasium.Env[Any, Any]]] = deque()
        self.numbers: dict[Hashable, int] = {}
        self._second: dict[int, gymnasium.Env[Any, Any]] = {}
        self._compared: set[int] = set()
        self._actions, self._most = actions, most

    def number(self, observation: Any, over: bool, world: gymnasium.Env[Any, Any], origin: int = -1) -> int:
        """The number of a state that was reached; the world there is kept if it is new, or reached a second time."""
        key = _key(observation)
        found = self.numbers.get(key)
        if found is None:
            if len(self.numbers) == self._most:
                raise DataError(_too_many(self._most))
            found = self.numbers[key] = len(self.numbers)
            self.graph.observations.append(observation)
            self.graph.outcomes.append([])
            self.graph.terminal.append(over)
            self.waiting.append((found, world))
        elif self.graph.terminal[found] != over:
            raise DataError(_ambiguous(observation))
        elif not over and origin != found and found not in self._compared:
            self._compared.add(found)
            if self.graph.outcomes[found]:
                self._compare(found, world)
            else:
                self._second[found] = world
        return found

    def expand(self, state: int, world: gymnasium.Env[Any, Any]) -> None:
        """Try every action in a state."""
        if self.graph.terminal[state]:  # nothing comes after it, so it stays where it is
            self.graph.outcomes[state] = [[(1.0, state, 0.0)] for _ in range(self._actions)]
            return
        rows: list[list[Outcome]] = []
        for action in range(self._actions):
            after = _copied(world)
            following, reward, over, _, _ = after.step(action)
            _check_certain(world, action, (_key(following), float(reward), bool(over)))
            rows.append([(1.0, self.number(following, bool(over), after, state), float(reward))])
        self.graph.outcomes[state] = rows
        if state in self._second:
            self._compare(state, self._second.pop(state))

    def _compare(self, state: int, world: gymnasium.Env[Any, Any]) -> None:
        """Check that a state goes on from a second way to it as it does from the first."""
        for action in range(self._actions):
            following = _copied(world).step(action)[0]
            if self.numbers.get(_key(following)) != self.graph.outcomes[state][action][0][1]:
                raise DataError(
                    f"action {action} in {_short(self.graph.observations[state])} leads on by how it was reached; let "
                    "the observation tell the whole state, or learn over steps with tickwise.rl.stepping instead"
                )


def _enumerated(env: gymnasium.Env[Any, Any], seeds: tuple[int, ...], most: int) -> _Graph:
    if not seeds:
        raise ConfigurationError("there is no seed; give at least one, from whose reset states can be found")
    search = _Search(int(env.action_space.n), most)  # type: ignore[attr-defined]
    starts = []
    for seed in seeds:
        observation, _ = env.reset(seed=int(seed))
        starts.append(search.number(observation, False, _copied(env)))
    while search.waiting:
        search.expand(*search.waiting.popleft())
    graph = search.graph
    initial = np.bincount(starts, minlength=len(graph.observations)) / len(starts)
    return _Graph(graph.observations, graph.outcomes, graph.terminal, initial)


def _copied(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    try:
        return copy.deepcopy(env)
    except (TypeError, NotImplementedError, RecursionError) as error:
        raise DataError(
            f"{env} cannot be copied ({error}), so that its states cannot be tried; learn over steps with "
            "tickwise.rl.stepping instead"
        ) from None


def _check_certain(world: gymnasium.Env[Any, Any], action: int, expected: tuple[Hashable, float, bool]) -> None:
    for trial in range(_TRIALS):
        again = _copied(world)
        again.unwrapped.np_random = np.random.default_rng(trial)
        observation, reward, over, _, _ = again.step(action)
        if (_key(observation), float(reward), bool(over)) != expected:
            raise DataError(
                f"action {action} leads to different observations, rewards or ends by chance, so that its "
                "probabilities cannot be found by trying; learn over steps with tickwise.rl.stepping instead"
            )


def _key(observation: Any) -> Hashable:
    if isinstance(observation, dict):
        return tuple((name, _key(observation[name])) for name in sorted(observation))
    if isinstance(observation, tuple):
        return tuple(_key(part) for part in observation)
    array = np.asarray(observation)
    return (array.shape, array.tobytes())


def _tabulation(graph: _Graph, features: Features, orientation: tuple[str, ...], actions: int) -> Tabulation:
    """Sort states into cells, and lay out their outcomes as arrays."""
    values = np.array([features(observation) for observation in graph.observations])
    turned = [features.names.index(name) for name in orientation]
    placed = [column for column in range(values.shape[1]) if column not in turned]
    if not placed:
        raise ConfigurationError("every feature is an orientation; at least one has to tell the place")
    cells, cell = np.unique(values[:, placed], axis=0, return_inverse=True)
    cell = np.asarray(cell).reshape(-1)
    number, cell_of = np.arange(len(cell)), cell
    if turned:
        number, cell_of = _by_orientation(cell, values[:, turned], len(cells))
    count = len(cell_of)
    most = max(len(row) for rows in graph.outcomes for row in rows)
    successor = np.repeat(np.arange(count), actions * most).reshape(count, actions, most)
    probability = np.zeros(successor.shape)
    probability[:, :, 0] = 1.0  # what never occurs stays where it is
    reward = np.zeros(successor.shape)
    for state, rows in enumerate(graph.outcomes):
        for action, row in enumerate(rows):
            place = number[state], action
            probability[place] = 0.0
            for outcome, (weight, following, gained) in enumerate(row):
                successor[*place, outcome] = number[following]
                probability[*place, outcome] = weight
                reward[*place, outcome] = gained
    observations: list[Any] = [None] * count
    terminal, initial = np.zeros(count, dtype=np.bool_), np.zeros(count)
    for state, observation in enumerate(graph.observations):
        observations[number[state]] = observation
    terminal[number], initial[number] = graph.terminal, graph.initial
    names = tuple(features.names[column] for column in placed)
    limits = tuple((float(low), float(high)) for low, high in zip(cells.min(axis=0), cells.max(axis=0), strict=True))
    mdp = TabularMDP(successor.astype(np.int32), probability, initial, cell_of.astype(np.int32), cells, names, limits)
    return Tabulation(mdp, tuple(observations), terminal, reward)


def _by_orientation(
    cell: NDArray[np.int64], turned: NDArray[np.float64], cells: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The number of each found state, and the cell of each number: every cell has every orientation, in order."""
    ways, way = np.unique(turned, axis=0, return_inverse=True)
    number = cell * len(ways) + np.asarray(way).reshape(-1)
    if len(np.unique(number)) < len(number):
        raise DataError(
            "two states have the same features; give features that tell all states apart, or no orientation"
        )
    return number, np.repeat(np.arange(cells), len(ways))
