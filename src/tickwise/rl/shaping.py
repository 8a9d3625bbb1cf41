"""Potential-based shaping: Q-learning with rewards for progress in the automaton that leave the optimum as it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.distance import acceptance_potential, progress_potential
from tickwise.automata.ticks import TickTable
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import QLearner, check_form, first_values
from tickwise.rl.qlearning import Problem, QSettings

Potential = Callable[[Sequence[TickTable], float], NDArray[np.float64]]
"""The potential of each table state, from 0 to 1, given the tables and the discount: shape ``(table states,)``."""

POTENTIALS: dict[str, Potential] = {
    "progress": lambda tables, gamma: progress_potential(tables),  # noqa: ARG005
    "acceptance": acceptance_potential,
}
"""The potentials by name; another may be added here."""


@dataclass(frozen=True, slots=True)
class Shaping:
    """Q-learning in which each step from memory state u to u′ gives γ·Φ(u′) − Φ(u) beside the task's reward.

    Φ at an episode's end is 0. Along an episode the added rewards sum up to −Φ(u₀), discounted, whatever the agent
    does: every policy's value changes by the same amount, and the optimal policies stay optimal, for any task, formula
    and potential (Ng, Harada and Russell, 1999). With Q* the values of the task alone, those with shaping are
    Q*(u, s, a) − Φ(u).

    Nothing is added in the loop. Q-learning with these rewards, from some values to begin with, chooses the same
    actions and has at each moment the same values less Φ(u) as Q-learning without them from values that are higher by
    Φ(u) (Wiewiora, 2003). The learner does the latter. So its values are those of the task's own rewards, to be
    compared and transferred as others are. Values to begin with, such as transferred ones, are those of the agent that
    is shaped, and the learner adds Φ to them.

    The defaults were measured in the target task of Case Study 1, over ten runs of 40,000 episodes each with the true
    formula and the paper's inferred one. The mean training return is 76 and 78; for scales of 25 and 50 and initial
    values of 0 to 20 it is 72 to 78. Q-learning has 58 to 60. So has the potential of acceptance: the second window
    alone says how soon acceptance can come, and what is done before does not show.

    Attributes:
        settings: Learning rate, discount, exploration and initial values, to which the potential is added.
        scale: What acceptance is worth; a quarter of what the task gives for success is a good choice.
        potential: The name of a potential, one of `POTENTIALS`.
        form: The name of the form.

    Raises:
        ConfigurationError: If a setting is out of range, or the name is that of another form.
    """

    settings: QSettings = field(default_factory=lambda: QSettings(initial=10.0))
    scale: float = 25.0
    potential: str = "progress"
    form: str = field(default="shaping", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)
        if not np.isfinite(self.scale):
            raise ConfigurationError(f"the scale of the potential is {self.scale}; use a finite number")
        if self.potential not in POTENTIALS:
            raise ConfigurationError(
                f"there is no potential {self.potential!r}; use {', '.join(POTENTIALS)}, or add yours to POTENTIALS"
            )

    def phi(self, problem: Problem) -> NDArray[np.float32]:
        """The potential Φ of each memory state of a problem, shape ``(memory states,)``.

        Raises:
            ConfigurationError: If the memory is not one of automata, or the potential has another shape.
        """
        if not problem.memory.tables:
            raise ConfigurationError(
                "a potential needs an automaton, and this memory follows none; "
                "use automaton_memory, or another form of learning such as QLearning"
            )
        values = self.scale * POTENTIALS[self.potential](problem.memory.tables, self.settings.gamma)
        if values.shape != (problem.memory.n_states,):
            raise ConfigurationError(
                f"the potential {self.potential!r} has shape {values.shape}; give one number a memory state, "
                f"{problem.memory.n_states}"
            )
        return values.astype(np.float32)

    def learner(self, problem: Problem, q: NDArray[np.float32] | None = None) -> QLearner:
        """What learns a problem with shaping; see `tickwise.rl.learner.LearningForm`.

        Raises:
            ConfigurationError: If the memory is not one of automata, or the values have another shape.
        """
        start = first_values(problem, self.settings.initial, q)
        return QLearner(problem, start + self.phi(problem)[:, None, None], self.settings)
