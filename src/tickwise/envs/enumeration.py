"""Environments that others wrote, as arrays: read from their tables, or enumerated by trying every action."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable, check_ticks
from tickwise.envs.wrappers.labelled import FeatureMap, Features
from tickwise.errors import ConfigurationError, DataError

Outcome: TypeAlias = tuple[float, int, float]
"""Probability, number of the next state, and reward."""

_TRIALS = 3
"""Random streams under which a step has to go the same way for an environment to count as deterministic."""


@dataclass(frozen=True, slots=True, eq=False)
class Tabulation:
    """An environment as arrays.

    Attributes:
        mdp: The world; states with the same features but for the orientation are one cell.
        observations: The observation of each state; None for combinations of features that never occur.
        terminal: Whether the environment's own episode ends on arriving in a state, shape ``(states,)``.
        reward: The environment's own reward of each outcome, float64, shape ``(states, actions, outcomes)``.
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
                f"the reward of reaching {self.observations[state]!r} depends on where it is reached from; "
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
    whose observation tells its whole state (but for a count of steps); each of these is checked where it can be.
    Truncation is not part of the table: the task's deadline ends an episode.

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
        ConfigurationError: If the actions are not numbered, or a feature is wrong.
        DataError: If the environment is random, its observation does not tell its state, or it has too many states.
    """
    if not isinstance(env.action_space, gymnasium.spaces.Discrete):
        raise ConfigurationError(f"the actions are in {env.action_space}; a table needs numbered ones (Discrete)")
    mapped = Features(features, env.observation_space)
    unknown = set(orientation) - set(mapped.names)
    if unknown:
        raise ConfigurationError(f"the orientation {min(unknown)!r} is no feature; use {', '.join(mapped.names)}")
    found = _from_table(env) if hasattr(env.unwrapped, "P") else _enumerated(env, tuple(seeds), most)
    return _tabulation(found, mapped, tuple(orientation), int(env.action_space.n))


@dataclass(frozen=True, slots=True, eq=False)
class _Graph:
    """What was found: each state's observation, its outcomes by action, whether it is terminal; and the starts."""

    observations: list[Any]
    outcomes: list[list[list[Outcome]]]
    terminal: list[bool]
    initial: NDArray[np.float64]


def _from_table(env: gymnasium.Env[Any, Any]) -> _Graph:
    table: Any = env.unwrapped
    states = range(len(table.P))
    outcomes = [[list(_merged(table.P[s][a])) for a in range(len(table.P[s]))] for s in states]
    terminal = [False] * len(states)
    for rows in table.P.values():
        for row in rows.values():
            for _, following, _, over in row:
                terminal[following] |= bool(over)
    return _Graph(list(states), outcomes, terminal, np.asarray(table.initial_state_distrib, dtype=np.float64))


def _merged(row: Iterable[tuple[float, int, float, bool]]) -> Iterable[Outcome]:
    """Outcomes with the same next state and reward as one."""
    weights: dict[tuple[int, float], float] = {}
    for probability, following, reward, _ in row:
        place = (int(following), float(reward))
        weights[place] = weights.get(place, 0.0) + float(probability)
    return [(weight, following, reward) for (following, reward), weight in weights.items() if weight > 0]


def _enumerated(env: gymnasium.Env[Any, Any], seeds: tuple[int, ...], most: int) -> _Graph:
    graph = _Graph([], [], [], np.zeros(0))
    numbers: dict[Hashable, int] = {}
    waiting: deque[tuple[int, gymnasium.Env[Any, Any]]] = deque()

    def number(observation: Any, over: bool, world: Callable[[], gymnasium.Env[Any, Any]]) -> int:
        key = _key(observation)
        if key not in numbers:
            if len(numbers) == most:
                raise DataError(f"the environment has more than {most} states; raise most, or learn over steps instead")
            numbers[key] = len(numbers)
            graph.observations.append(observation)
            graph.outcomes.append([])
            graph.terminal.append(over)
            waiting.append((numbers[key], world()))
        return numbers[key]

    starts = []
    for seed in seeds:
        observation, _ = env.reset(seed=int(seed))
        starts.append(number(observation, False, lambda: copy.deepcopy(env)))
    while waiting:
        state, world = waiting.popleft()
        for action in range(int(env.action_space.n)):  # type: ignore[attr-defined]
            if graph.terminal[state]:  # nothing comes after it, so it stays where it is
                graph.outcomes[state].append([(1.0, state, 0.0)])
                continue
            after = copy.deepcopy(world)
            following, reward, over, _, _ = after.step(action)
            _check_certain(world, action, following)
            arrived = number(following, over, lambda after=after: after)  # type: ignore[misc]
            if graph.terminal[arrived] != over:
                raise DataError(
                    f"an episode ends in {following!r} on one way and goes on on another; "
                    "let the observation tell the whole state, with gymnasium.wrappers.TransformObservation"
                )
            graph.outcomes[state].append([(1.0, arrived, float(reward))])
    initial = np.bincount(starts, minlength=len(numbers)) / len(starts)
    return _Graph(graph.observations, graph.outcomes, graph.terminal, initial)


def _check_certain(world: gymnasium.Env[Any, Any], action: int, following: Any) -> None:
    for trial in range(_TRIALS):
        again = copy.deepcopy(world)
        again.unwrapped.np_random = np.random.default_rng(trial)
        if _key(again.step(action)[0]) != _key(following):
            raise DataError(
                f"action {action} leads to different observations by chance, so that its probabilities cannot be "
                "found by trying; learn over steps with tickwise.rl.stepping instead"
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
