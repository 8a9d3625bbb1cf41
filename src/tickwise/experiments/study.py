"""What a study is, as data: a source and a target task, and every setting of what is done with them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.errors import ConfigurationError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.rl.learner import LearningForm, QLearning
from tickwise.rl.qlearning import QSettings
from tickwise.transfer.settings import LoopSettings
from tickwise.transfer.variants import Transfer

METHODS = ("I", "II", "III", "IV", "V")
"""The methods of Section V: τ-states; the formula without information gain; the formula; with transferred values. The
fifth is ours: the closed loop of `tickwise.transfer.closed_loop`, in its form of learning."""

PROTOCOLS = {
    "paper": "some random negatives, a particle swarm, primitives one by one",
    "full": "all negatives, an exact search, primitives together",
}
"""How formulas are inferred, as the paper does it and with all there is, and what each is in a few words."""


@dataclass(frozen=True, slots=True)
class Collection:
    """The data collection phase (Section IV-A): the first episodes of Q-learning on τ-states.

    Attributes:
        episodes: Episodes of the phase.
        tau: The horizon τ of the τ-states.
        negatives: Trajectories with label -1 drawn at random from all those there are.
        positives: Per task, collection goes on in steps of a tenth of the phase until so many have label 1; about as
            many as the paper has.
        most_episodes: It ends here in any case.
        least_ticks: None gives label 1 to trajectories with a return above 0 (Case Study 1). A number gives it to those
            that last at least so many ticks, and their last state is left out, since the rule may have been broken
            there (Case Study 2).
        epsilon: Exploration during the phase; None for that of learning. 1 gives trajectories of random actions.
        noise: The share of trajectories whose label is turned round before inference, to see what wrong labels do.
    """

    episodes: int = 10_000
    tau: int = 5
    negatives: int = 200
    positives: dict[str, int] = field(default_factory=lambda: {"source": 40, "target": 20})
    most_episodes: int = 200_000
    least_ticks: int | None = None
    epsilon: float | None = None
    noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Goal:
    """When training has got there, by the measure that is nearest to the paper's.

    Attributes:
        block: Episodes whose mean return counts, one block after the other.
        above: What the mean return has to exceed; None where it has to be at least the optimal value V*.
    """

    block: int = 10
    above: float | None = None

    @property
    def short(self) -> str:
        """What it looks for, in a few words, to stand after "the first"."""
        if self.above is not None and self.block == 1:
            return f"episode with a return above {self.above:,.0f}"
        level = "at the optimum" if self.above is None else f"above {self.above:,.0f}"
        return f"block of {self.block} episodes {level}"

    @property
    def text(self) -> str:
        """The measure in words."""
        one = self.block == 1
        what = "training episode whose return" if one else f"block of {self.block} training episodes whose mean return"
        level = "is at least the optimal value V*" if self.above is None else f"exceeds {self.above:,.0f}"
        return f"the first {what} {level}"

    @property
    def heading(self) -> str:
        """The head of a column."""
        what = "return" if self.block == 1 else "block"
        return f"first {what} " + ("at V*" if self.above is None else f"above {self.above:,.0f}")


@dataclass(frozen=True, slots=True)
class Learning:
    """How the methods learn and how they are measured.

    Attributes:
        settings: Settings of Q-learning, the same for every method.
        source: Settings of Q-learning in the source task, for the Q-function that is transferred.
        source_episodes: Episodes of learning in the source task before its Q-function is transferred.
        most_episodes: Method to the most episodes it learns for.
        disjunct: The name of the strategy that chooses the disjunct at the start of an episode (see
            `tickwise.rl.states.DISJUNCT_CHOICES`).
        forms: Method to the form that it learns in, where it is not Q-learning with `settings`.
        transfer: How Method IV transfers values; by default as Algorithm 2 does.
        loop: How Method V goes about collecting, inferring and learning at once.
        loop_steps: Method V has an evaluation at each multiple of so many episodes.
        goal: The measure of convergence nearest to the paper's.
        window: Episodes of the paper's box plot: the mean return over them is compared.
        block: Episodes of the paper's averaging.
        evaluation_episodes: Episodes of each evaluation of the greedy policy, on fixed seeds.
        evaluation_steps: Pairs (until, every): up to episode ``until`` there is an evaluation at each multiple of
            ``every``; the last pair has no end.
    """

    settings: QSettings = field(default_factory=lambda: QSettings(initial=40.0))
    source: QSettings = field(default_factory=lambda: QSettings(initial=40.0))
    source_episodes: int = 1_000_000
    most_episodes: dict[str, int] = field(
        default_factory=lambda: {"I": 2_000_000, "II": 2_000_000, "III": 100_000, "IV": 100_000, "V": 2_000}
    )
    disjunct: str = "nearest_centroid"
    forms: dict[str, LearningForm] = field(default_factory=dict)
    transfer: Transfer = field(default_factory=Transfer)
    loop: LoopSettings = field(default_factory=LoopSettings)
    loop_steps: int = 20
    goal: Goal = field(default_factory=Goal)
    window: int = 40_000
    block: int = 10
    evaluation_episodes: int = 200
    evaluation_steps: tuple[tuple[int, int], ...] = ((10_000, 100), (50_000, 500), (0, 5_000))

    def form(self, method: str) -> LearningForm:
        """The form that a method learns in."""
        return self.forms.get(method, QLearning(self.settings))

    @property
    def shown(self) -> int:
        """Episodes of the training curves: a quarter more than the window."""
        return self.window * 5 // 4


@dataclass(frozen=True, slots=True)
class Published:
    """What the paper reports of a study, for comparison; nothing of a study that is not the paper's.

    Attributes:
        formulas: ``source``, ``target`` and ``target_without_information``, as text.
        positives: Trajectories with label 1 of the source and the target.
        episodes: Episodes until each method gets to the goal, None where it does not within two million.
        collection: Episodes of the data collection phase.
        regions: What the paper says of the true regions.
        figures: The paper's counterparts of the figures ``maps`` and ``curves``.
        settled: Episodes of each method "for convergence to the optimal policy", where the goal is another measure.
    """

    formulas: dict[str, str] = field(default_factory=dict)
    positives: dict[str, int] = field(default_factory=dict)
    episodes: dict[str, int | None] = field(default_factory=dict)
    collection: int | None = None
    regions: str = ""
    figures: dict[str, str] = field(default_factory=dict)
    settled: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StudySpec:
    """A study: a source and a target task, and all settings.

    Attributes:
        name: The name on the command line.
        title: The title of the report.
        source: The source environment with its hidden task.
        target: The target environment with its hidden task.
        collection: The data collection phase.
        inference: The constraints of Problem 1 and the settings of Algorithm 1.
        swarm: The settings of the particle swarm.
        learning: Learning and evaluation.
        true: ``source`` and ``target``: for each task a formula that says what it asks for. Its operators and regions
            are the true ones; its times are one choice of several.
        published: What the paper reports of it.
        similar: Whether the target task is known to be similar to the source task.
        remarks: What else the study's author chose: what it is about, what the paper says of it, and the choice.
        runs: Independent runs.
        collections: Collections that formulas are inferred from; None for as many as there are runs.
        protocol: One of `PROTOCOLS`: which formulas the methods learn with.
        exact: The search of the full protocol.
        full: Of these collections, those that the full protocol infers from too; None for all of them.
        seed: The root seed.
        short: Whether it was cut short to be looked at within minutes.
    """

    name: str
    title: str
    source: EnvironmentSpec
    target: EnvironmentSpec
    collection: Collection
    inference: InferenceSettings
    swarm: SwarmSettings
    learning: Learning
    true: dict[str, str]
    published: Published = field(default_factory=Published)
    similar: bool = True
    remarks: tuple[tuple[str, str, str], ...] = ()
    runs: int = 10
    collections: int | None = None
    protocol: str = "paper"
    exact: ExactSettings = field(default_factory=lambda: ExactSettings(joint=True))
    full: int | None = None
    seed: int = 0
    short: bool = False

    @property
    def inferences(self) -> range:
        """The numbers of the collections that formulas are inferred from."""
        return range(self.runs if self.collections is None else self.collections)

    def inferred(self, protocol: str) -> range:
        """The numbers of the collections that formulas are inferred from by one of `PROTOCOLS`."""
        every = self.inferences
        return every if protocol == "paper" or self.full is None else every[: self.full]

    def as_dict(self) -> dict[str, Any]:
        """The specification as plain data, as it goes into a run folder and a report."""
        return asdict(self)

    def quick(self) -> StudySpec:
        """The same study with fewer runs and episodes, to look at within minutes."""
        limits = {"I": 100_000, "II": 100_000, "III": 50_000, "IV": 50_000, "V": 1_500}
        most = {method: min(most, limits[method]) for method, most in self.learning.most_episodes.items()}
        return replace(self, runs=3, full=1, short=True, learning=replace(self.learning, most_episodes=most))


def check_protocol(protocol: str) -> None:
    """Refuse a name that is none of `PROTOCOLS`.

    Raises:
        ConfigurationError: If it is not.
    """
    if protocol not in PROTOCOLS:
        raise ConfigurationError(f"there is no protocol {protocol!r}; choose {' or '.join(PROTOCOLS)}")


def environment_of(spec: StudySpec, task: str) -> EnvironmentSpec:
    """The environment of ``source`` or ``target``."""
    return spec.source if task == "source" else spec.target


def full_settings(settings: InferenceSettings, positives: int, negatives: int, sampled: int) -> InferenceSettings:
    """The constants of Problem 1 for all trajectories, so that an error counts what it counts among a sample.

    Among P trajectories with label 1 and all N with label -1, instead of n of these, an error is a smaller share: with
    P = 40, n = 200 and N = 16,000, ζ = 0.95 allows 12 errors of 240, but 802 of 16,040, where a formula that is always
    false would do. With the share s = (P + n) / (P + N), the rate 1 - (1 - ζ) s allows as many errors as before, and
    the weight λ s leaves the price of an error, in information, as it was.

    Args:
        settings: Those for the sample.
        positives: P.
        negatives: N, all trajectories with label -1.
        sampled: n, as many of them as a sample has.

    Returns:
        The settings for one task; they differ from task to task, as P and N do. No label has a weight.
    """
    share = (positives + min(sampled, negatives)) / (positives + negatives)
    return replace(
        settings,
        rate=1 - (1 - settings.rate) * share,
        information_weight=settings.information_weight * share,
        class_weight=None,
    )
