"""How the closed loop of collecting, inferring and learning goes about it."""

from __future__ import annotations

from dataclasses import dataclass, field

from tickwise.errors import ConfigurationError
from tickwise.rl.learner import LearningForm
from tickwise.rl.model import ModelBased


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """The numbers that the closed loop goes by.

    Attributes:
        form: How it learns while it acts on a formula.
        batch: Explored episodes between two selections of hypotheses.
        hypotheses: How many formulas are kept that agree best with the episodes.
        candidates: How many of them are planned for before an explored episode.
        imagined: Episodes of each plan that are imagined, to see how many hypotheses accept them.
        random: The share of explored episodes whose actions are random.
        rounds: Selections of hypotheses before a formula is acted on.
        positives: Good episodes before a formula is acted on.
        fresh: Fresh episodes that a formula has to judge rightly, but for a share of 1 - ζ, for collecting to end; at
            least `positives` of them good.
        patience: Good episodes that are enough to go on with other structures where no number of copies of the
            source's is satisfying. It is taken back if a formula of that structure is found to be right after all.

    Raises:
        ConfigurationError: If a number is out of range.
    """

    form: LearningForm = field(default_factory=ModelBased)
    batch: int = 10
    hypotheses: int = 4_000
    candidates: int = 6
    imagined: int = 4
    random: float = 0.1
    rounds: int = 4
    positives: int = 3
    fresh: int = 30
    patience: int = 10

    def __post_init__(self) -> None:
        for name in ("batch", "hypotheses", "candidates", "imagined", "rounds", "positives", "fresh", "patience"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"{name} of the closed loop is {getattr(self, name)}; use 1 or more")
        if not 0 <= self.random <= 1:
            raise ConfigurationError(f"random of the closed loop is {self.random}; use a share from 0 to 1")
