"""Environments that others wrote, with named features, to try the wrappers on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import FilterObservation, TransformObservation

from tickwise.envs.catalog import register_all
from tickwise.envs.wrappers import Labelled

register_all()

Env = gymnasium.Env[Any, Any]


def frozen_lake(**arguments: Any) -> Env:
    env = gymnasium.make("FrozenLake-v1", **arguments)
    return Labelled(env, {"row": lambda s: s // 4, "column": lambda s: s % 4})


def taxi() -> Env:
    # row, column, passenger and destination are digits of the state's number
    env = gymnasium.make("Taxi-v4")
    return Labelled(
        env, {"row": lambda s: s // 100, "column": lambda s: s // 20 % 5, "passenger": lambda s: s // 4 % 5}
    )


def cart_pole() -> Env:
    return Labelled(gymnasium.make("CartPole-v1"), ["position", "velocity", "angle", "turning"])


def cart_pole_in_bins() -> Env:
    """CartPole seen as one number: in which of ten bins the angle is."""
    edges = np.linspace(-0.2, 0.2, 9)
    env = TransformObservation(
        gymnasium.make("CartPole-v1"), lambda o: np.int64(np.digitize(o[2], edges)), spaces.Discrete(10)
    )
    return Labelled(env, ["bin"])


def gridworld() -> Env:
    return Labelled(gymnasium.make("CaseStudy1Source-v0"), ["i", "j", "heading"])


def minigrid(name: str = "MiniGrid-Empty-5x5-v0", **arguments: Any) -> Env:
    """A MiniGrid world whose observation is a dictionary of image, direction and mission."""
    module = pytest.importorskip("minigrid")
    assert module
    return gymnasium.make(name, **arguments)


def place(env: Env) -> Callable[[Any], np.ndarray]:
    """Where the agent of a MiniGrid world is and to which side it looks."""

    def at(_: Any) -> np.ndarray:
        agent: Any = env.unwrapped
        return np.array([*agent.agent_pos, agent.agent_dir], dtype=np.int64)

    return at


def minigrid_image() -> Env:
    env = minigrid()
    at = place(env)
    image = TransformObservation(env, lambda o: o["image"], env.observation_space["image"])  # type: ignore[index]
    return Labelled(image, {"i": lambda o: at(o)[0], "j": lambda o: at(o)[1]})


def minigrid_dictionary() -> Env:
    """What the agent sees and where it looks; the mission, a text, is left out."""
    env = minigrid()
    at = place(env)
    return Labelled(FilterObservation(env, ["image", "direction"]), {"i": lambda o: at(o)[0], "j": lambda o: at(o)[1]})


def minigrid_places() -> Env:
    """A MiniGrid world seen as three whole numbers."""
    env = minigrid()
    return Labelled(TransformObservation(env, place(env), spaces.MultiDiscrete([5, 5, 4])), ["i", "j", "heading"])


NUMBERED = ("frozen_lake", "taxi", "cart_pole_in_bins", "gridworld", "minigrid_places")
"""The names of those whose observations are whole numbers."""

FORMULAS: dict[Callable[[], Env], str] = {
    frozen_lake: "F[2,5] (row >= 2) & F[6,20] (row >= 3 & column >= 3)",
    taxi: "G[0,3] F[0,2] (row >= 1) & F[6,20] (passenger >= 4)",
    cart_pole: "G[0,20] (-0.1 <= angle <= 0.1) | F[1,9] G[0,3] (position >= 0.1)",
    cart_pole_in_bins: "G[0,20] (3 <= bin <= 6)",
    gridworld: "F[1,15] G[0,4] (3 <= i <= 4 & 3 <= j <= 5) & F[21,39] (7 <= i <= 8 & 5 <= j <= 8)",
    minigrid_image: "F[1,8] G[0,2] (i >= 2) & F[12,20] (j >= 3)",
    minigrid_dictionary: "F[1,8] G[0,2] (i >= 2) & F[12,20] (j >= 3)",
    minigrid_places: "F[1,8] G[0,2] (i >= 2) & F[12,20] (j >= 3)",
}


def random_episodes(env: Env, episodes: int, seed: int, longest: int = 60) -> Any:
    """Play at random; yields the list of (observation, reward, terminated, truncated, info) of each episode."""
    rng = np.random.default_rng(seed)
    for episode in range(episodes):
        observation, info = env.reset(seed=seed + episode)
        ticks = [(observation, 0.0, False, False, info)]
        while not (ticks[-1][2] or ticks[-1][3]) and len(ticks) < longest:
            ticks.append(env.step(int(rng.integers(env.action_space.n))))  # type: ignore[attr-defined]
        yield ticks
