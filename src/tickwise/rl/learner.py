"""The interface of all forms of learning: what a study, the closed loop and an experiment need of them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError
from tickwise.rl.qlearning import Problem, QSettings, collect


class Learner(Protocol):
    """What learns one problem, a number of episodes at a time; a later call goes on where an earlier one ended."""

    @property
    def problem(self) -> Problem:
        """What is learned."""
        ...

    @property
    def q(self) -> NDArray[np.float32]:
        """The table whose greedy policy, ties to the lower action, is what was learned so far.

        It has the shape ``(memory states, states, actions)``; `tickwise.rl.qlearning.evaluate` plays it.
        """
        ...

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Learn for some episodes.

        Args:
            rng: The generator that all draws come from.
            episodes: The number of episodes.

        Returns:
            The undiscounted return of each episode, shape ``(episodes,)``, and its MDP states with -1 after its end,
            shape ``(episodes, horizon + 1)``.
        """
        ...


class LearningForm(Protocol):
    """A form of learning as data: its settings, which make a learner of a problem."""

    @property
    def form(self) -> str:
        """The name of the form, so that its settings as plain data tell which form they are of."""
        ...

    def learner(self, problem: Problem, q: NDArray[np.float32] | None = None) -> Learner:
        """What learns a problem in this form.

        Args:
            problem: What to learn.
            q: Values to begin with, such as transferred ones, shape ``(memory states, states, actions)``; they are
                copied. None for those of the settings.

        Raises:
            ConfigurationError: If the form cannot learn the problem, or the values have another shape.
        """
        ...


@dataclass(frozen=True, slots=True)
class QLearning:
    """Q-learning (Section IV-B, Step 3), the paper's form.

    Attributes:
        settings: Learning rate, discount, exploration and initial values.
        form: The name of the form.

    Raises:
        ConfigurationError: If the name is that of another form.
    """

    settings: QSettings = field(default_factory=QSettings)
    form: str = field(default="q", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)

    def learner(self, problem: Problem, q: NDArray[np.float32] | None = None) -> QLearner:
        """What learns a problem by Q-learning; see `LearningForm`."""
        return QLearner(problem, first_values(problem, self.settings.initial, q), self.settings)


def first_values(problem: Problem, initial: float, q: NDArray[np.float32] | None) -> NDArray[np.float32]:
    """A table of its own to begin with: a copy of given values, or one value throughout.

    Raises:
        ConfigurationError: If the given values have another shape than the problem.
    """
    shape = (problem.memory.n_states, problem.mdp.n_states, problem.mdp.n_actions)
    if q is None:
        return np.full(shape, initial, dtype=np.float32)
    if q.shape != shape:
        raise ConfigurationError(
            f"the values to begin with have shape {q.shape}; give (memory states, states, actions), here {shape}"
        )
    return np.array(q, dtype=np.float32, order="C")


def check_form(form: LearningForm) -> None:
    """Check that the settings of a form have its own name and not that of another.

    The name is a field that can be given, so that what `dataclasses.asdict` made is read back by the class.

    Raises:
        ConfigurationError: If they have another.
    """
    own = next(field.default for field in fields(form) if field.name == "form")  # type: ignore[arg-type]
    if form.form != own:
        raise ConfigurationError(f"the form of {type(form).__name__} is {own!r}, not {form.form!r}; leave it out")


@dataclass(slots=True, eq=False)
class QLearner:
    """Q-learning as a `Learner`."""

    problem: Problem
    q: NDArray[np.float32]
    settings: QSettings

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Learn for some episodes; see `Learner`."""
        return collect(self.problem, self.q, self.settings, rng, episodes)
