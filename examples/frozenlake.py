"""Wait on the ice, then cross it: learn a timed task on firm ice, and use it on Gymnasium's FrozenLake 8×8 that slips.

From tick 4 to tick 12 the agent has to stay in the corner where it began, and then it has to be at the goal by tick 36.
One move in ten slips; in the source it is one in twenty. Nobody tells the times: there is a reward at the end of an
episode in which all went right. When to be where is inferred from logs of an agent that merely wants the goal.

    python examples/frozenlake.py --out runs/frozenlake
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import numpy as np

from comparison import Learning, Place, curves, draw, inferred, logged, table
from tickwise.envs.enumeration import tabulate
from tickwise.inference.exact import ExactSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.rl.qlearning import QSettings

DEADLINE = 36

LOG = QSettings(alpha=0.1, epsilon=0.05, initial=100.0)
EPISODES = 50_000
KEPT = 3_000
"""How the agent whose episodes are logged learns, for how long, and how many logs of it are kept."""

LEARNING = Learning(
    target=QSettings(alpha=0.1, epsilon=0.05, initial=50.0),
    source=QSettings(alpha=0.1, epsilon=0.05, initial=50.0),
    source_episodes=100_000,
    episodes=100_000,
    step=500,
    plays=300,
)


def place(success_rate: float) -> Place:
    """The lake with the requirement; a move goes where it should with this probability, and to a side otherwise."""
    env = gymnasium.make("FrozenLake-v1", map_name="8x8", success_rate=success_rate)
    features = {"row": lambda cell: cell // 8, "column": lambda cell: cell % 8}
    goal = "(row >= 7 & column >= 7)"
    requirement = f"G[4,12] (row <= 2 & column <= 1) & F[13,{DEADLINE}] {goal}"
    return Place.of(tabulate(env, features), requirement, f"F[0,{DEADLINE}] {goal}", DEADLINE)


def main() -> None:
    """Infer, decide, transfer, and print and draw what it bought."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/frozenlake"), help="where the figure goes")
    parser.add_argument("--seeds", type=int, default=20, help="runs of each agent")
    parser.add_argument("--threads", type=int, default=2, help="threads of each search")
    arguments = parser.parse_args()
    rng = np.random.default_rng(0)
    near, far = place(0.95), place(0.9)
    source, target = (logged([lake], LOG, EPISODES, KEPT, rng) for lake in (near, far))
    print(f"logs: {source.positives} good of {len(source)}, and {target.positives} good of {len(target)} kept")
    constants = InferenceSettings(size=2, rate=0.99, information_weight=0.001)
    found = inferred(source, target, constants, ExactSettings(joint=True, threads=arguments.threads))
    print(f"source: {found.formulas[0]}\ntarget: {found.formulas[1]}\n{found.reason}")
    runs = [curves(found, near, far, LEARNING, seed) for seed in range(arguments.seeds)]
    print(table(runs, LEARNING.step))
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw(
        runs,
        LEARNING.episodes,
        LEARNING.step,
        f"FrozenLake 8×8, one move in ten slips, {len(runs)} runs",
        arguments.out / "frozenlake.png",
    )
    print(f"the curves are in {arguments.out / 'frozenlake.png'}")


if __name__ == "__main__":
    main()
