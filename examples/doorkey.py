"""Keys, doors and times in MiniGrid: learn in DoorKey 5×5 what is due when, and use it in DoorKey 8×8.

The agent has to pick up the key within 8 ticks, must leave the door locked until tick 15, has to open it by tick 21 and
to be at the goal by tick 34. Nobody tells it: it gets a reward at the end of an episode in which all went right. The
requirement is the same in both, the building is larger. What is known of the times is inferred from logs of an agent
that merely wants the goal, in ten layouts each; learning is then compared in layouts that no log is from.

    pip install minigrid
    python examples/doorkey.py --out runs/doorkey
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import minigrid  # noqa: F401, registers the environments
import numpy as np
from minigrid.core.constants import OBJECT_TO_IDX, STATE_TO_IDX
from minigrid.wrappers import FullyObsWrapper
from numpy.typing import NDArray

from comparison import Learning, Place, curves, draw, inferred, logged, table
from tickwise.envs.enumeration import tabulate
from tickwise.inference.exact import ExactSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.rl.qlearning import QSettings

DEADLINE = 34
TIMES = "F[0,8] (carrying >= 1) & G[9,15] (door <= 0) & F[16,21] (door >= 2)"

ACTIONS = (0, 1, 2, 3, 5)
"""MiniGrid's turn left, turn right, forward, pick up and toggle; dropping things and "done" are left out."""

FEATURES = {name: (lambda state, column=column: state[column]) for column, name in enumerate(
    ("x", "y", "heading", "carrying", "door")
)}  # fmt: skip

LOGS = {
    5: (QSettings(alpha=0.8, epsilon=0.5, initial=100.0), 10_000),
    8: (QSettings(alpha=0.8, epsilon=0.3, initial=100.0), 30_000),
}
"""How the agent whose episodes are logged learns, and for how many, by the size of the world."""

KEPT = 4_000
"""Logs of each size that are kept."""

LEARNING = Learning(
    target=QSettings(alpha=0.8, initial=40.0),
    source=QSettings(alpha=0.8, epsilon=0.1, initial=40.0),
    source_episodes=50_000,
    episodes=60_000,
    step=100,
    plays=1,
)


class Facts(gymnasium.Wrapper[Any, Any, Any, Any]):
    """DoorKey's whole state in five numbers: where the agent is and looks, whether it has the key, and the door."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(FullyObsWrapper(env))
        self.observation_space = gymnasium.spaces.MultiDiscrete([env.unwrapped.width, env.unwrapped.height, 4, 2, 3])
        self.action_space = gymnasium.spaces.Discrete(len(ACTIONS))

    def reset(self, **options: Any) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """Begin an episode."""
        observation, info = self.env.reset(**options)
        return self._facts(observation), info

    def step(self, action: Any) -> tuple[NDArray[np.int64], SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick."""
        observation, *rest = self.env.step(ACTIONS[action])
        return self._facts(observation), *rest

    def _facts(self, observation: Any) -> NDArray[np.int64]:
        """The agent hides the door while it stands in the doorway; the door is open then."""
        world: Any = self.unwrapped
        objects = observation["image"]
        doors = objects[objects[..., 0] == OBJECT_TO_IDX["door"]]
        state = int(doors[0, 2]) if len(doors) else STATE_TO_IDX["open"]
        door = (STATE_TO_IDX["locked"], STATE_TO_IDX["closed"], STATE_TO_IDX["open"]).index(state)
        return np.array([*world.agent_pos, world.agent_dir, world.carrying is not None, door])


def place(size: int, layout: int) -> Place:
    """DoorKey of a size: layout ``layout``, tabulated, with the requirement."""
    env = Facts(gymnasium.make(f"MiniGrid-DoorKey-{size}x{size}-v0", max_steps=10_000))
    tabulation = tabulate(env, FEATURES, orientation=("heading",), seeds=(layout,))
    goal = f"(x >= {size - 2} & y >= {size - 2})"
    return Place.of(tabulation, f"{TIMES} & F[22,{DEADLINE}] {goal}", f"F[0,{DEADLINE}] {goal}", DEADLINE)


def places(size: int, layouts: Iterable[int]) -> Iterator[Place]:
    """Some layouts of DoorKey, told of on a terminal as they come, since tabulating takes seconds."""
    for layout in layouts:
        if sys.stderr.isatty():
            print(f"DoorKey {size}×{size}: tabulating layout {layout} ", end="\r", file=sys.stderr, flush=True)
        yield place(size, layout)


def pairs(count: int) -> list[tuple[Place, Place]]:
    """The first layouts of both sizes in which all can be done in time."""
    near, far = ((each for each in places(size, itertools.count()) if each.best > 0) for size in LOGS)
    return list(itertools.islice(zip(near, far, strict=True), count))


def main() -> None:
    """Infer, decide, transfer, and print and draw what it bought."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("runs/doorkey"), help="where the figure goes")
    parser.add_argument("--seeds", type=int, default=20, help="layouts to learn in")
    parser.add_argument("--threads", type=int, default=2, help="threads of each search")
    arguments = parser.parse_args()
    rng = np.random.default_rng(0)
    source, target = (logged(list(places(size, range(100, 110))), *how, KEPT, rng) for size, how in LOGS.items())
    print(f"logs: {source.positives} good of {len(source)}, and {target.positives} good of {len(target)} kept")
    constants = InferenceSettings(size=4, rate=0.99, information_weight=0.001)
    found = inferred(source, target, constants, ExactSettings(joint=True, threads=arguments.threads))
    print(f"source: {found.formulas[0]}\ntarget: {found.formulas[1]}\n{found.reason}")
    runs = [curves(found, near, far, LEARNING, seed) for seed, (near, far) in enumerate(pairs(arguments.seeds))]
    print(table(runs, LEARNING.step))
    arguments.out.mkdir(parents=True, exist_ok=True)
    draw(runs, LEARNING.episodes, LEARNING.step, f"DoorKey 8×8, {len(runs)} layouts", arguments.out / "doorkey.png")
    print(f"the curves are in {arguments.out / 'doorkey.png'}")


if __name__ == "__main__":
    main()
