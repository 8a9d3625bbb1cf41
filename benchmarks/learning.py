"""Q-learning on extended states and greedy evaluation: steps a second, as the world grows.

The 9×9 world is the target of Case Study 1, the agent's states are the extended states of its formula, and ε is 0.02;
larger worlds have the same task in their corner. `learning.c` is the same algorithm over the same tables with the same
random numbers, so both must find the same Q-table to the bit. The two Python contenders learn the same extended
states through Gymnasium, so that their time holds the environment's; neither can draw the same numbers.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
import os
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from benchmarks.contest import Contender, Turn, contest
from benchmarks.native import Record, library, pointer
from benchmarks.result import OURS, Result
from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import CASE_STUDY_1_TARGET, EnvironmentSpec
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.logic.parse import parse
from tickwise.rl.kernels import greedy_returns
from tickwise.rl.qlearning import Problem, QSettings, learn
from tickwise.rl.states import Memory, automaton_memory
from tickwise.rl.stream import put_back, take_stream

FORMULA = "F[0,22] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[31,40] (4 <= x <= 7 & 0 <= y <= 2)"
SETTINGS = QSettings(epsilon=0.02)
WORLDS = (9, 15, 25, 50, 100)


class CProblem(Record):
    """The struct ``problem`` of `learning.c`."""

    _fields_ = (
        *((name, ctypes.c_long) for name in ("states", "actions", "outcomes", "task_letters", "letters", "horizon")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "start_thresholds", "successor", "thresholds", "task_start", "task_delta", "task_letter", "reward",
                "final_reward", "terminated", "memory_start", "memory_delta", "memory_letter",
            )
        ),
    )  # fmt: skip

    @classmethod
    def of(cls, problem: Problem) -> CProblem:
        """The struct of a problem."""
        arrays = [array for array in problem.arrays if isinstance(array, np.ndarray)]
        states, actions, outcomes = problem.mdp.successor.shape
        sizes = {
            "states": states, "actions": actions, "outcomes": outcomes,
            "task_letters": problem.task.delta.shape[1], "letters": problem.memory.delta.shape[1],
            "horizon": problem.task.horizon,
        }  # fmt: skip
        return cls(**sizes, **dict(zip([name for name, _ in cls._fields_[6:]], arrays, strict=True)))


class ExtendedStates(gymnasium.Env[int, np.int64]):
    """An environment whose observation is the number of the extended state."""

    def __init__(self, spec: EnvironmentSpec, memory: Memory) -> None:
        self.world, self.memory = GridWorldEnv(spec), memory
        self.start, self.delta = memory.start.tolist(), memory.delta.tolist()
        # the letter of a transition is that of the state it leads to
        letters = np.empty(spec.mdp().n_states, dtype=np.int64)
        letters[spec.mdp().successor] = memory.letter
        self.letters = letters.tolist()
        self.observation_space = spaces.Discrete(memory.n_states * len(self.start))
        self.action_space = self.world.action_space

    def reset(self, **options: Any) -> tuple[int, dict[str, Any]]:
        """Begin an episode."""
        _, info = self.world.reset(**options)
        self.u = self.start[info["state"]]
        return self.u * len(self.start) + info["state"], info

    def step(self, action: np.int64) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Go on by a tick."""
        _, reward, terminated, truncated, info = self.world.step(action)
        self.u = self.delta[self.u][self.letters[info["state"]]]
        return self.u * len(self.start) + info["state"], float(reward), terminated, truncated, info


@functools.cache
def world_spec(size: int) -> EnvironmentSpec:
    return EnvironmentSpec("Bench", GridWorld(size), CASE_STUDY_1_TARGET.task)


@functools.cache
def build_problem(size: int) -> Problem:
    spec = world_spec(size)
    mdp = spec.mdp()
    tables = [automaton.compile() for automaton in timed_automata(parse(FORMULA))]
    return Problem(mdp, spec.task_table(), automaton_memory(mdp, tables))


def ours(problem: Problem, episodes: int) -> Turn:
    rng, q = np.random.default_rng(0), problem.initial_q(SETTINGS)

    def turn() -> NDArray[np.float32]:
        learn(problem, q, SETTINGS, rng, episodes)
        return q

    return turn


def in_c(problem: Problem, episodes: int) -> Turn:
    function, record = library("learning").q_learning, CProblem.of(problem)
    stream, q = take_stream(np.random.default_rng(0)), problem.initial_q(SETTINGS)
    rates = [ctypes.c_double(rate) for rate in (SETTINGS.alpha, SETTINGS.gamma, SETTINGS.epsilon)]

    def turn() -> NDArray[np.float32]:
        returns = np.empty(episodes, dtype=np.float32)
        function(ctypes.byref(record), *rates, pointer(stream), pointer(q), pointer(returns), ctypes.c_long(episodes))
        return q

    return turn


def textbook(size: int, episodes: int) -> Turn:
    """The loop of a textbook: Gymnasium, a NumPy table, and nothing else."""
    env, rng = ExtendedStates(world_spec(size), build_problem(size).memory), np.random.default_rng(0)
    actions = int(env.action_space.n)
    q = np.full((int(env.observation_space.n), actions), SETTINGS.initial, dtype=np.float32)
    env.reset(seed=0)

    def turn() -> NDArray[np.float32]:
        for _ in range(episodes):
            state, _ = env.reset()
            over = False
            while not over:
                row = q[state]
                if rng.random() < SETTINGS.epsilon:
                    action = rng.integers(actions)
                else:
                    action = rng.choice(np.flatnonzero(row == row.max()))
                after, reward, over, _, _ = env.step(action)
                target = reward if over else reward + SETTINGS.gamma * q[after].max()
                row[action] += SETTINGS.alpha * (target - row[action])
                state = after
        return q

    return turn


def bettermdptools(size: int, episodes: int) -> Turn:
    """It keeps the whole table after every episode, and its time holds that."""
    os.environ.setdefault("TQDM_DISABLE", "1")
    learner = importlib.import_module("bettermdptools.algorithms.rl").RL
    env = ExtendedStates(world_spec(size), build_problem(size).memory)
    rates = {f"{kind}_{name}": getattr(SETTINGS, name) for kind in ("init", "min") for name in ("alpha", "epsilon")}
    return lambda: learner(env).q_learning(gamma=SETTINGS.gamma, n_episodes=episodes, seed=0, **rates)


def play_ours(problem: Problem, q: NDArray[np.float32], episodes: int) -> Turn:
    rng = np.random.default_rng(1)

    def turn() -> NDArray[np.float32]:
        returns, stream = np.empty(episodes, dtype=np.float32), take_stream(rng)
        greedy_returns(*problem.arrays, stream, q, returns)
        put_back(rng, stream)
        return returns

    return turn


def play_in_c(problem: Problem, q: NDArray[np.float32], episodes: int) -> Turn:
    function, record = library("learning").greedy_returns, CProblem.of(problem)
    stream = take_stream(np.random.default_rng(1))

    def turn() -> NDArray[np.float32]:
        returns = np.empty(episodes, dtype=np.float32)
        function(ctypes.byref(record), pointer(stream), pointer(q), pointer(returns), ctypes.c_long(episodes))
        return returns

    return turn


def measure(quick: bool) -> list[Result]:
    results = []
    for size in WORLDS[:3] if quick else WORLDS:
        problem = build_problem(size)
        episodes, repetitions = (2_500, 5) if quick else (15_000, 21)
        steps, few = problem.task.horizon, 10 if quick else 50
        q = problem.initial_q(SETTINGS)
        learn(problem, q, SETTINGS, np.random.default_rng(0), episodes)
        learners = [
            Contender(OURS, functools.partial(ours, problem, episodes), episodes * steps, repetitions),
            Contender("C", functools.partial(in_c, problem, episodes), episodes * steps, repetitions),
        ]
        if size == WORLDS[0]:  # what an interpreted step costs does not depend on the world
            learners += [
                Contender("Gymnasium loop", functools.partial(textbook, size, few), few * steps, 3),
                Contender("bettermdptools", functools.partial(bettermdptools, size, few), few * steps, 3),
            ]
        players = [
            Contender(OURS, functools.partial(play_ours, problem, q, episodes), episodes * steps, repetitions),
            Contender("C", functools.partial(play_in_c, problem, q, episodes), episodes * steps, repetitions),
        ]
        results += contest("Q-learning", "step", learners, axis="world", size=size, agree=np.array_equal)
        results += contest("greedy evaluation", "step", players, axis="world", size=size, agree=np.array_equal)
    return results
