"""The extended state: location and clocks of a formula's timed automaton as part of the observation."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from tickwise.automata.monitor import Monitor
from tickwise.envs.wrappers.forms import Places, make_form
from tickwise.envs.wrappers.labelled import FEATURES, feature_names
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Formula

TABLE_STATE = "table_state"
"""The key in ``info`` under which the number of the automaton's state is found."""


class ExtendedState(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    r"""Extend the observation by the location and the clocks of a formula's timed automaton (Section IV-B, Step 3).

    A task whose reward depends on *when* things happen is not Markovian in the observation; where the reward depends
    on the formula, it is Markovian in the extended state, so that ordinary agents can learn it.

    ```python
    env = Labelled(gymnasium.make("FrozenLake-v1"), {"row": lambda s: s // 4, "column": lambda s: s % 4})
    env = ExtendedState(env, "F[2,5] (row >= 2) & F[6,20] (row >= 3 & column >= 3)")
    observation, info = env.reset(seed=0)  # {"observation": 0, "location": 0, "clocks": [0.]}
    ```

    ## Observation
    | `form` | Observation | For |
    |--------|-------------|-----|
    | `"dict"` | the observation (its entries, if it is a dictionary, else as `observation`), `location`, `clocks` in ticks | SB3's `MultiInputPolicy` |
    | `"flat"` | one float32 vector: the flattened observation, the location one-hot, the clocks from 0 to 1 | SB3's `MlpPolicy` |
    | `"discrete"` | one number: table state × observations + observation | tables of Q-values |

    With several disjuncts, one is chosen at the start of an episode, the nearest (`Monitor.choose`); its locations
    and table states have numbers of their own, X = ∪ X_i.

    ## Information
    | Key | Meaning |
    |-----|---------|
    | `location` | the location's number, as in the observation |
    | `clocks` | the clock values in ticks, int64 |
    | `stage` | the primitive that is worked on, from 0 |
    | `verdict` | what is known of the whole formula: 1 true, 0 unknown, -1 false |
    | `table_state` | the number of the pair of location and clocks |

    Args:
        env: An environment with named features: wrap it in `Labelled` first.
        formula: The formula, or its text; its variables are features.
        form: The form of the observation, see above.
        reduce: Whether clocks are held at 0 where their location does not use them. Fewer states tell all that the
            formula needs; False keeps the paper's full valuations.

    Attributes:
        monitor: The formula's automata.
        places: Their locations and clocks in one numbering.

    Raises:
        ConfigurationError: If the environment has no named features, or the form does not fit the observation.
        FormulaError: If the formula has no sequential disjunctive normal form.
        UnknownVariableError: If the formula names a variable that is no feature.
    """  # noqa: E501 (a table's row is one line)

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        formula: str | Formula | SDNF,
        form: str = "dict",
        *,
        reduce: bool = True,
    ) -> None:
        RecordConstructorArgs.__init__(self, formula=formula, form=form, reduce=reduce)
        super().__init__(env)
        self.monitor = Monitor.of(formula, feature_names(env, "ExtendedState"), reduce=reduce)
        self.places = Places.of(self.monitor)
        self._form = make_form(form, env.observation_space, self.places)
        self.observation_space = self._form.space
        self._states = np.zeros(len(self.monitor.tables), dtype=np.int64)
        self._disjunct = np.zeros((), dtype=np.int64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; the automaton reads the letter of tick 0."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._disjunct = self.monitor.choose(info[FEATURES])
        self._states = self.monitor.start(info[FEATURES])
        return self._extended(observation), info | self._report()

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; the automaton reads its letter."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._states = self.monitor.advance(self._states, info[FEATURES])
        return self._extended(observation), reward, terminated, truncated, info | self._report()

    def extend(self, observation: Any, table_state: int) -> Any:
        """The extended observation of an observation and the number of a table state."""
        return self._form.extend(observation, np.asarray(table_state))

    def split(self, observation: Any) -> tuple[Any, int]:
        """The observation and the number of the table state that an extended observation is made of.

        Raises:
            DataError: If it is not made of any.
        """
        return self._form.split(observation)

    def _extended(self, observation: Any) -> Any:
        number = self.places.number(self._disjunct, self._states[self._disjunct])
        return self._form.extend(observation, number)

    def _report(self) -> dict[str, Any]:
        return report(self.monitor, self.places, self._disjunct, self._states)


def report(monitor: Monitor, places: Places, disjunct: NDArray[np.int64], states: NDArray[np.int64]) -> dict[str, Any]:
    """What ``info`` says of the extended state, for one environment or with a first axis for many.

    Args:
        monitor: The formula's automata.
        places: Their common numbering.
        disjunct: The chosen disjuncts, shape ``(...)``.
        states: Table states, shape ``(..., disjuncts)``.

    Returns:
        The entries of ``info``.
    """
    state = np.take_along_axis(states, np.expand_dims(np.asarray(disjunct), -1), axis=-1)[..., 0]
    number = places.number(disjunct, state)
    entries = {
        "location": places.location_of[number],
        "stage": places.stage_of[number],
        "verdict": monitor.verdict(states).astype(np.int64),
        TABLE_STATE: number,
    }
    single = np.ndim(disjunct) == 0
    plain: dict[str, Any] = {key: int(value) for key, value in entries.items()} if single else dict(entries)
    return plain | {"clocks": places.clocks_of[number].copy()}
