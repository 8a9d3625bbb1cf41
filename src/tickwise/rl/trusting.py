"""Q-learning that overwrites values slowly where it trusts them, such as values that were transferred.

A value that moves by a share α with each update is a mean over about 1 / α of them. Confidence c in the value that an
entry begins with counts as c more, and fades as the entry is updated: the n-th update, from n = 0, has the rate

    1 / (1 / α + c h / (h + n)),

where h is the patience. So a trusted value is not lost to the first few outcomes, and the longer an entry is learned
the less it matters where it began. Without confidence the rate is α.

It ends where Q-learning ends. The rate is α times a factor from 1 / (1 + α c) to 1 that grows to 1. Where the rates of
Q-learning meet the conditions of its convergence, Σ α_n = ∞ and Σ α_n² < ∞, these do too: the first sum is at least
1 / (1 + c) of what it was, the second at most what it was. Where α is constant and nothing is random, each update goes
at least a fixed share of the way, so that the error shrinks as it does in Q-learning, only by a smaller share at first;
and where chance keeps values moving around the optimum, they move in the end as in Q-learning, since the rates have
become the same.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError, DataError
from tickwise.rl.kernels import q_learning
from tickwise.rl.learner import check_form, first_values
from tickwise.rl.loop import run_episodes
from tickwise.rl.qlearning import Problem, QSettings


@dataclass(frozen=True, slots=True)
class Trusting:
    """Q-learning with confidence in what it begins with; without any it is Q-learning to the bit.

    Attributes:
        settings: Learning rate, discount, exploration and initial values.
        patience: The updates h of an entry after which half of the confidence in it is left.
        form: The name of the form.

    Raises:
        ConfigurationError: If the patience is not above 0, or the name is that of another form.
    """

    settings: QSettings = field(default_factory=QSettings)
    patience: float = 3.0
    form: str = field(default="trusting", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)
        if not 0 < self.patience < np.inf:
            raise ConfigurationError(f"the patience is {self.patience}; use a number of updates above 0")

    def learner(
        self,
        problem: Problem,
        q: NDArray[np.float32] | None = None,
        confidence: NDArray[np.float32] | None = None,
    ) -> TrustingLearner:
        """What learns a problem in this form; see `tickwise.rl.learner.LearningForm`.

        Args:
            problem: What to learn.
            q: Values to begin with, which are copied; None for those of the settings.
            confidence: The confidence in each of them, in updates, of the same shape; None for none.

        Raises:
            ConfigurationError: If the values have another shape than the problem.
            DataError: If the confidence has another shape or is out of range.
        """
        values = first_values(problem, self.settings.initial, q)
        trust = np.zeros(values.shape, dtype=np.float32) if confidence is None else confidence
        if trust.shape != values.shape:
            raise DataError(f"the confidence has shape {trust.shape} and the values {values.shape}; use the same")
        if not ((trust >= 0) & (trust < np.inf)).all():
            raise DataError("a confidence is below 0 or not finite")
        visits = np.zeros(values.shape, dtype=np.uint32)
        return TrustingLearner(problem, values, self, np.ascontiguousarray(trust, dtype=np.float32), visits)


@dataclass(slots=True, eq=False)
class TrustingLearner:
    """Q-learning with confidence as a `tickwise.rl.learner.Learner`.

    Attributes:
        problem: What is learned.
        q: What was learned so far, shape ``(memory states, states, actions)``.
        form: The form of learning.
        confidence: The confidence in the values that it began with, of the same shape.
        visits: How often each entry was updated, uint32, of the same shape.
    """

    problem: Problem
    q: NDArray[np.float32]
    form: Trusting
    confidence: NDArray[np.float32]
    visits: NDArray[np.uint32]

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Learn for some episodes; see `tickwise.rl.learner.Learner`."""
        settings = self.form.settings
        rates = float(settings.alpha), float(settings.gamma), float(settings.epsilon)
        trust = self.visits, self.confidence, float(self.form.patience)

        def kernel(world: tuple[Any, ...], stream: Any, returns: Any, paths: Any) -> None:
            arguments: tuple[Any, ...] = (*world, *rates, stream, self.q, returns, paths, *trust)
            q_learning(*arguments)

        return run_episodes(kernel, self.problem, (), rng, episodes)
