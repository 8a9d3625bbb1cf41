"""The paper's case studies as specifications: everything a study needs is data in one place."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

from tickwise.envs.catalog import CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET, EnvironmentSpec
from tickwise.errors import ConfigurationError
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.rl.qlearning import QSettings


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
    """

    episodes: int = 10_000
    tau: int = 5
    negatives: int = 200
    positives: dict[str, int] = field(default_factory=lambda: {"source": 40, "target": 20})
    most_episodes: int = 200_000


@dataclass(frozen=True, slots=True)
class Learning:
    """How the methods learn and how they are measured.

    Attributes:
        settings: Settings of Q-learning, the same for every method.
        source_episodes: Episodes of learning in the source task before its Q-function is transferred.
        most_episodes: Method to the most episodes it learns for.
        window: Episodes of the paper's box plot: the mean return over them is compared.
        block: Episodes of the paper's averaging.
        evaluation_episodes: Episodes of each evaluation of the greedy policy, on fixed seeds.
        evaluation_steps: Pairs (until, every): up to episode ``until`` there is an evaluation at each multiple of
            ``every``; the last pair has no end.
    """

    settings: QSettings = field(default_factory=lambda: QSettings(initial=40.0))
    source_episodes: int = 1_000_000
    most_episodes: dict[str, int] = field(
        default_factory=lambda: {"I": 2_000_000, "II": 2_000_000, "III": 100_000, "IV": 100_000}
    )
    window: int = 40_000
    block: int = 10
    evaluation_episodes: int = 200
    evaluation_steps: tuple[tuple[int, int], ...] = ((10_000, 100), (50_000, 500), (0, 5_000))


@dataclass(frozen=True, slots=True)
class Published:
    """What the paper reports of a study, for comparison.

    Attributes:
        formulas: ``source``, ``target`` and ``target_without_information``, as text.
        positives: Trajectories with label 1 of the source and the target.
        episodes: Episodes to convergence of each method, None where it does not converge within two million.
        collection: Episodes of the data collection phase.
    """

    formulas: dict[str, str]
    positives: dict[str, int]
    episodes: dict[str, int | None]
    collection: int


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
        published: The paper's figures.
        runs: Independent runs.
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
    published: Published
    runs: int = 10
    seed: int = 0
    short: bool = False

    def as_dict(self) -> dict[str, Any]:
        """The specification as plain data, as it goes into a run folder and a report."""
        return asdict(self)

    def quick(self) -> StudySpec:
        """The same study with fewer runs and episodes, to look at within minutes."""
        most = {"I": 100_000, "II": 100_000, "III": 50_000, "IV": 50_000}
        learning = replace(self.learning, most_episodes=most)
        return replace(self, runs=3, short=True, learning=learning)


CASE_STUDY_1 = StudySpec(
    name="case1",
    title="Case Study 1: stay in G, then reach Y",
    source=CASE_STUDY_1_SOURCE,
    target=CASE_STUDY_1_TARGET,
    collection=Collection(),
    inference=InferenceSettings(size=4, rate=0.95, information_weight=0.01, depth=2),
    swarm=SwarmSettings(),
    learning=Learning(),
    published=Published(
        formulas={
            "source": "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)",
            "target": "F[5,18] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[24,39] (4 <= x <= 7 & 1 <= y <= 2)",
            "target_without_information": (
                "F[1,18] G[0,4] (5 <= x <= 6 & 6 <= y <= 7) & F[24,40] (0 <= x <= 8 & 0 <= y <= 2)"
            ),
        },
        positives={"source": 46, "target": 19},
        episodes={"I": 834_590, "II": None, "III": 13_850, "IV": 2_220},
        collection=10_000,
    ),
)

STUDIES = {study.name: study for study in (CASE_STUDY_1,)}
"""All studies by name."""


def find_study(name: str, *, quick: bool = False, runs: int | None = None, seed: int = 0) -> StudySpec:
    """The specification of a study by name.

    Args:
        name: The name on the command line.
        quick: Whether to cut it short.
        runs: Independent runs; None for the study's own number.
        seed: The root seed.

    Raises:
        ConfigurationError: If there is no such study, or a number is out of range.
    """
    if name not in STUDIES:
        raise ConfigurationError(f"there is no study {name!r}; choose {', '.join(STUDIES)}")
    if runs is not None and runs < 1:
        raise ConfigurationError(f"a study of {runs} runs shows nothing; use --runs 1 or more")
    if seed < 0:
        raise ConfigurationError(f"the seed is {seed}; use 0 or more")
    spec = STUDIES[name].quick() if quick else STUDIES[name]
    return replace(spec, seed=seed, runs=spec.runs if runs is None else runs)
