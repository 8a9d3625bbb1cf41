"""Deep agents that carry over what they learned: DQN or PPO on two frozen lakes, the second one larger.

    python examples/deep.py --seeds 10 --out runs/deep

The requirement is to wait three ticks in the upper right corner and to be at the goal, the lower right one, at the end
and not before. A source agent learns it on a lake of 4 × 4 cells. On one of 7 × 7 three agents are compared: one that
sees the cell only, one that sees location and clocks too, and one that begins with the source's values by the mapped
observation.

Needs Stable-Baselines3: pip install '.[sb3]'.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from comparison import draw, table
from tickwise.envs.wrappers import ExtendedState, Labelled, PotentialShaping, TimedTask
from tickwise.transfer.deep import transfer_values
from tickwise.transfer.observations import ObservationMap

SIZES = (4, 7)
GAMMA = 0.98
SOURCE_STEPS = {"dqn": 10_000, "ppo": 25_000}
STEPS = {"dqn": 16_000, "ppo": 40_000}
EVALUATIONS = 40
"""Evaluations of an agent while it learns, beside the one before."""


def requirement(size: int) -> str:
    """Wait in the upper right corner, then be at the goal."""
    last = size - 1
    corner, goal = (f"({row} <= row <= {row} & {last} <= column <= {last})" for row in (0, last))
    return f"F[0,{2 * size}] G[0,2] {corner} & F[{3 * size},{4 * size}] {goal}"


def lake(size: int) -> TimedTask:
    """A lake without holes, and the requirement as its reward."""
    rows = ["S" + "F" * (size - 1), *["F" * size] * (size - 2), "F" * (size - 1) + "G"]
    env = gymnasium.make("FrozenLake-v1", desc=rows, is_slippery=False)
    named = Labelled(env, {"row": lambda cell: cell // size, "column": lambda cell: cell % size})
    return TimedTask(named, requirement(size), deadline=4 * size)


def extended(size: int) -> ExtendedState:
    """A lake whose observation has location and clocks."""
    return ExtendedState(lake(size), requirement(size), "flat")


def agent(algorithm: str, env: Any, seed: int, *, taught: bool = False) -> BaseAlgorithm:
    """A new agent; one that is taught explores little.

    PPO, which remembers no success, does not learn from a reward at the end alone: where there is an extended state, it
    is rewarded for progress.
    """
    common = {"learning_rate": 1e-3, "gamma": GAMMA, "seed": seed, "device": "cpu"}
    if algorithm == "ppo":
        felt = PotentialShaping(env, GAMMA) if isinstance(env, ExtendedState) else env
        return PPO("MlpPolicy", felt, n_steps=512, batch_size=128, ent_coef=0.0 if taught else 0.02, **common)
    return DQN(
        "MlpPolicy", env, buffer_size=20_000, learning_starts=500, target_update_interval=250,
        exploration_fraction=0.5, exploration_initial_eps=0.1 if taught else 1.0, **common
    )  # fmt: skip


def succeeds(model: BaseAlgorithm, env: Any) -> bool:
    """Whether the policy without exploration does what is required; nothing here is random."""
    observation, info = env.reset(seed=0)
    over = False
    while not over:
        action, _ = model.predict(observation, deterministic=True)
        observation, _, terminated, truncated, info = env.step(int(action))
        over = terminated or truncated
    return bool(info["is_success"])


class Watch(BaseCallback):
    """Says now and then while an agent learns whether it succeeds."""

    def __init__(self, env: Any, every: int) -> None:
        super().__init__()
        self.env, self.every, self.shares = env, every, list[float]()

    def _on_step(self) -> bool:
        if self.num_timesteps % self.every == 0:
            self.shares.append(float(succeeds(self.model, self.env)))
        return True


def curve(model: BaseAlgorithm, env: Any, steps: int) -> NDArray[np.float64]:
    """Success before learning and after each part of it."""
    before = float(succeeds(model, env))
    watch = Watch(env, steps // EVALUATIONS)
    model.learn(steps, callback=watch)
    return np.array([before, *watch.shares[:EVALUATIONS]])


def curves(algorithm: str, seed: int) -> dict[str, NDArray[np.float64]]:
    """Let every agent learn the larger lake once."""
    near, far = (extended(size) for size in SIZES)
    steps = STEPS[algorithm]
    source = agent(algorithm, near, seed).learn(SOURCE_STEPS[algorithm])
    taught = agent(algorithm, far, seed, taught=True)
    regression = transfer_values(source, taught, ObservationMap(near, far), seed=seed)
    learned = "learned" if succeeds(source, near) else "not learned"
    print(f"seed {seed}: source {learned}; {regression}", file=sys.stderr, flush=True)
    cells = lake(SIZES[1])
    return {
        "state": curve(agent(algorithm, cells, seed), cells, steps),
        "extended state": curve(agent(algorithm, far, seed), far, steps),
        "extended state, transferred values": curve(taught, far, steps),
    }


def main() -> None:
    """Learn for each seed, print the table and draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--algorithm", choices=sorted(STEPS), default="dqn")
    parser.add_argument("--seeds", type=int, default=10, help="seeds to learn with (default: 10)")
    parser.add_argument("--out", type=Path, default=Path("runs/deep"), help="folder for the figure")
    arguments = parser.parse_args()
    torch.set_num_threads(1)  # networks are small
    runs = [curves(arguments.algorithm, seed) for seed in range(arguments.seeds)]
    steps = STEPS[arguments.algorithm]
    print(table(runs, steps // EVALUATIONS))
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / f"{arguments.algorithm}.png"
    title = f"{arguments.algorithm.upper()} on a lake of 7 × 7, {len(runs)} seeds"
    draw(runs, steps, steps // EVALUATIONS, title, path, unit="steps")
    print(f"figure: {path}")


if __name__ == "__main__":
    main()
