"""The Gymnasium environment of a gridworld with a hidden task."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from tickwise.envs.catalog import EnvironmentSpec, find
from tickwise.envs.gridworld import ACTIONS
from tickwise.envs.rendering import Map, Scene, picture, text_map
from tickwise.envs.tabulate import cumulative, draw
from tickwise.envs.tasks import TaskMonitor
from tickwise.errors import ConfigurationError

if TYPE_CHECKING:  # it brings compiled kernels, which only random tasks need
    from tickwise.envs.random_tasks import RandomTaskSettings, Structure


class GridWorldEnv(gymnasium.Env[NDArray[np.int64], np.int64]):
    r"""A robot in a square world, rewarded for a temporal task that it is not told.

    ## Description
    These are the environments of the paper's case studies. The reward depends on what the robot did and
    *when*, not on its state alone, so the task is not Markovian in the observation: it has to be learnt
    that, for instance, the robot first has to stay in one region for five ticks and later to reach another.

    | Id | World | Deadline | Hidden task |
    |----|-------|----------|-------------|
    | `CaseStudy1Source-v0` | 9×9 | 40 | be in [3,4]×[3,5] for 5 ticks in a row, later in [7,8]×[5,8] |
    | `CaseStudy1Target-v0` | 9×9 | 40 | be in [5,6]×[6,7] for 6 ticks in a row, later in [4,7]×[0,2] |
    | `CaseStudy2Source-v0` | 5×5 | 25 | visit [2,3]×[2,3] in every window of ticks [t, t+8] |
    | `CaseStudy2Target-v0` | 7×7 | 40 | the same with [t, t+10] and [2,3]×[3,4], or with [4,5]×[3,4] |

    An n×n world spans [0,n]²; cell (i, j) is the unit square from (i, j), and the robot is at its cell's
    centre.

    ```python
    import gymnasium

    env = gymnasium.make("tickwise:CaseStudy1Source-v0", render_mode="ansi")
    observation, info = env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(0)
    print(env.render())
    ```

    ## Action Space
    `Discrete(3)`:

    | Num | Action | What happens |
    |-----|--------|--------------|
    | 0 | go straight | 0.92: one cell forward; 0.04 each: one to the left, to the right; heading kept |
    | 1 | turn left | 0.97: the heading turns by 90° to the left; 0.03: nothing |
    | 2 | turn right | 0.97: the heading turns by 90° to the right; 0.03: nothing |

    A move that would leave the world stays in the cell instead.

    ## Observation Space
    `MultiDiscrete([n, n, 4])`, int64:

    | Num | Observation | Values |
    |-----|-------------|--------|
    | 0 | cell i, along x | 0 to n-1 |
    | 1 | cell j, along y | 0 to n-1 |
    | 2 | heading | 0 east (+x), 1 north (+y), 2 west, 3 south |

    ## Rewards
    - Case Study 1: nothing before the deadline; at the deadline +100 if the task is done, -10 if it is not.
    - Case Study 2: +100 for each tick, from tick 1 on, in a green region (source: [0,1]×[2,3] and
      [4,5]×[2,3]; target: [2,3]×[1,2], [2,3]×[5,6], [4,5]×[1,2] and [4,5]×[5,6]). The tick that breaks the
      rule gives -800 instead.

    ## Starting State
    Each cell and heading is equally likely. `reset(options={"state": s})` starts in the state of number
    `s = 4 * (i * n + j) + heading`.

    ## Episode End
    The episode terminates at the deadline, which belongs to the task: its reward is given then and nothing
    can come after. In Case Study 2 it also terminates at the tick that breaks the rule. It is never
    truncated.

    ## Information
    `reset` and `step` give `tick` and `state` (the number above). The last step of an episode also gives
    `is_success`: whether the task is done (Case Study 1) or the rule was kept until the deadline (Case
    Study 2).

    ## Randomness
    `reset` draws one uniform number (none if the start is given) and each `step` one more, from
    `np_random.random()`. The number selects the start or the outcome by inverse CDF, in the order of state
    numbers and of the table above (forward, left, right; turned, not turned), so that a walk on
    `specification.mdp()` with the same numbers is the same.

    ## Arguments
    - `specification`: a name of the catalog, or an `EnvironmentSpec` with a world and a task of your own.
      The ids above set it.
    - `slip=0.04`: probability of slipping to the left, and again to the right.
    - `turn_failure=0.03`: probability that a turn does nothing.
    - `render_mode=None`: `"rgb_array"` draws a picture, with a bar of the time passed; `"ansi"` gives a
      text map.

    ## Version History
    - v0: initial version.

    Raises:
        ConfigurationError: If there is no environment of that name, or a number is out of range.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (declared so by the base class)
        "render_modes": ["rgb_array", "ansi"],
        "render_fps": 4,
    }

    def __init__(
        self,
        specification: EnvironmentSpec | str,
        *,
        slip: float | None = None,
        turn_failure: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ConfigurationError(f"render_mode is {render_mode!r}; use 'rgb_array', 'ansi' or None")
        spec = find(specification) if isinstance(specification, str) else specification
        world = replace(
            spec.world,
            slip=spec.world.slip if slip is None else slip,
            turn_failure=spec.world.turn_failure if turn_failure is None else turn_failure,
        )
        self.specification = replace(spec, world=world)
        self.render_mode = render_mode
        self.observation_space = spaces.MultiDiscrete([world.size, world.size, 4])
        self.action_space = spaces.Discrete(len(ACTIONS))
        mdp = world.mdp()
        self._map = Map.of(world.size, mdp, spec.task.landmarks)
        self._successor = mdp.successor
        self._thresholds = cumulative(mdp.probability)
        self._start_thresholds = cumulative(mdp.initial)
        self._monitor = TaskMonitor(spec.task.table(mdp))
        self._state: int | None = None
        self._ended = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.int64], dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Restarts the random stream.
            options: ``{"state": s}`` starts in the state of number s.

        Returns:
            The first observation and the information.

        Raises:
            ConfigurationError: If an option is not known or the state does not exist.
        """
        super().reset(seed=seed)
        start = self._start(options or {})
        if start is None:
            start = draw(self._start_thresholds, self.np_random.random())
        self._state, self._ended = start, False
        self._monitor.start(start)
        return self._observation(start), self._information(start)

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.int64], float, bool, bool, dict[str, Any]]:
        """Go to the next tick; see the class for the meaning of actions, rewards and information.

        Raises:
            ConfigurationError: If the action does not exist.
            ResetNeeded: If no episode is going on.
        """
        if self._state is None or self._ended:
            raise ResetNeeded("no episode is going on; call reset() before step()")
        if not self.action_space.contains(action):
            raise ConfigurationError(f"there is no action {action!r}; use 0 (straight), 1 (left) or 2 (right)")
        outcome = draw(self._thresholds[self._state, action], self.np_random.random())
        self._state = int(self._successor[self._state, action, outcome])
        reward, self._ended = self._monitor.advance(self._state)
        return self._observation(self._state), reward, self._ended, False, self._information(self._state)

    def render(self) -> NDArray[np.uint8] | str | None:
        """Draw the current tick in the render mode; ``None`` without one.

        Raises:
            ResetNeeded: If no episode has begun.
        """
        if self.render_mode is None:
            return None
        if self._state is None:
            raise ResetNeeded("there is nothing to draw yet; call reset() before render()")
        scene = Scene(
            place=self.specification.world.place(self._state),
            tick=self._monitor.tick,
            deadline=self.specification.task.deadline,
            stage=self._monitor.stage,
            success=self._monitor.success if self._ended else None,
        )
        return text_map(self._map, scene) if self.render_mode == "ansi" else picture(self._map, scene)

    def _start(self, options: dict[str, Any]) -> int | None:
        unknown = options.keys() - {"state"}
        if unknown:
            raise ConfigurationError(f"there is no reset option {min(unknown)!r}; use 'state'")
        if options.get("state") is None:
            return None
        count, state = len(self._successor), options["state"]
        if not isinstance(state, (int, np.integer)) or not 0 <= state < count:
            raise ConfigurationError(f"there is no state {state!r}; use a number from 0 to {count - 1}")
        return int(state)

    def _observation(self, state: int) -> NDArray[np.int64]:
        return np.array(self.specification.world.place(state), dtype=np.int64)

    def _information(self, state: int) -> dict[str, Any]:
        information: dict[str, Any] = {"tick": self._monitor.tick, "state": state}
        if self._ended:
            information["is_success"] = self._monitor.success
        return information


class RandomTaskEnv(GridWorldEnv):
    """A robot in a random square world, rewarded for a random temporal formula that it is not told.

    ## Description
    The world, the deadline and the formula are those of `tickwise.envs.random_tasks.random_task`: the task can
    be achieved almost certainly by who knows it, and now and then by chance. In all else the environment is a
    `GridWorldEnv`.

    ```python
    import gymnasium

    env = gymnasium.make("tickwise:RandomTask-v0", task_seed=17)
    print(env.unwrapped.specification.task.formula)
    ```

    ## Rewards
    +100 if the formula is satisfied and -10 if it is violated: at the deadline, or, where the task's `early` is
    set, at the first tick from 1 on at which that is certain. Nothing before.

    ## Arguments
    - `task_seed=0`: what the world and the task are drawn from, a whole number; the seed of `reset` is another.
    - `structure=None`: the operators of the formula, see `random_task`; by default drawn.
    - `settings=None`: the `RandomTaskSettings`; by default their defaults.
    - `render_mode=None`: as for `GridWorldEnv`.

    ## Version History
    - v0: initial version.

    Raises:
        ConfigurationError: If an argument is out of range, or no task of the structure was found.
    """

    def __init__(
        self,
        task_seed: int = 0,
        *,
        structure: Structure | None = None,
        settings: RandomTaskSettings | None = None,
        render_mode: str | None = None,
    ) -> None:
        from tickwise.envs.random_tasks import random_task

        if isinstance(task_seed, bool) or not isinstance(task_seed, (int, np.integer)) or task_seed < 0:
            raise ConfigurationError(f"task_seed is {task_seed!r}; use a whole number of 0 or more")
        specification = random_task(np.random.default_rng(task_seed), structure, settings=settings)
        super().__init__(specification, render_mode=render_mode)
