"""Q-learning that overwrites values slowly where it trusts them, such as values that were transferred.

The n-th update of an entry, from n = 0, takes the rate α (1 - c h / (h + n)), where c in [0, 1) is the confidence in
the value that the entry began with and h is the patience: as if c h updates of h had been made before. So a trusted
value is not lost to the first few outcomes, and the longer an entry is learned the less it matters where it began.

It ends where Q-learning ends. An entry's rates are those of Q-learning times factors from 1 - c to 1 that grow to 1.
Where the rates α_n of Q-learning meet the conditions of its convergence, Σ α_n = ∞ and Σ α_n² < ∞, these do too: the
first sum is at least (1 - c) Σ α_n, the second at most Σ α_n². Where α is constant, a deterministic world's values
come nearer to the optimum by a share of at least α (1 - c) in each round of updates, as they do by α; and where
chance keeps values moving around the optimum, they move in the end as they do in Q-learning, since the factors have
come to 1. Confidence of 1 would never overwrite at first, so it is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError, DataError
from tickwise.rl.kernels import q_learning
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.stream import put_back, take_stream


@dataclass(frozen=True, slots=True)
class Trusting:
    """Q-learning with confidence in what it begins with; without any, it is Q-learning to the bit.

    Attributes:
        settings: Learning rate, discount, exploration and initial values.
        patience: The updates h of an entry after which half of the confidence in it is left.

    Raises:
        ConfigurationError: If the patience is not above 0.
    """

    settings: QSettings = field(default_factory=QSettings)
    patience: float = 10.0

    def __post_init__(self) -> None:
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
            confidence: The confidence in each of them, in [0, 1), of the same shape; None for none.

        Raises:
            DataError: If the confidence has another shape or is out of range.
        """
        values = problem.initial_q(self.settings) if q is None else q.copy()
        trust = np.zeros(values.shape, dtype=np.float32) if confidence is None else confidence
        if trust.shape != values.shape:
            raise DataError(f"the confidence has shape {trust.shape} and the values {values.shape}; use the same")
        if not ((trust >= 0) & (trust < 1)).all():
            raise DataError("a confidence is not in [0, 1)")
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
        returns = np.empty(episodes, dtype=np.float32)
        paths = np.empty((episodes, self.problem.task.horizon + 1), dtype=np.int32)
        stream = take_stream(rng)
        arguments: tuple[Any, ...] = (
            *self.problem.arrays, float(settings.alpha), float(settings.gamma), float(settings.epsilon), stream,
            self.q, returns, paths, self.visits, self.confidence, float(self.form.patience),
        )  # fmt: skip
        q_learning(*arguments)
        put_back(rng, stream)
        return returns, paths
