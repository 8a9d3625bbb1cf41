"""Random pairs of tasks, some similar and some not, as studies: the evidence that nothing is tuned to two examples."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from tickwise._seeding import generator
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.random_tasks import RandomTaskSettings, Structure, random_task
from tickwise.errors import ConfigurationError
from tickwise.experiments.study import Collection, Learning, StudySpec
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.sdnf import Operator
from tickwise.rl.qlearning import QSettings

SETTINGS = RandomTaskSettings(
    deadlines=(26, 36),
    windows=(7, 14),
    durations=(3, 5),
    disjoint=True,
    endings=("deadline", "violated"),
    complemented_region=0.75,
    chances=(0.02, 0.1),
    worlds=50,
)
"""Windows and durations are long enough to tell the operators apart, and random actions give both labels. No episode
ends with success: in the weak view it would satisfy every formula that looks beyond its end."""

SIZE = 4
"""The size constraint ϱ_th, as in the paper's case studies."""

SAYS: dict[Operator, frozenset[Operator]] = {
    Operator.EVENTUALLY: frozenset({Operator.EVENTUALLY}),
    Operator.ALWAYS: frozenset({Operator.ALWAYS, Operator.EVENTUALLY_ALWAYS, Operator.EVENTUALLY}),
    Operator.EVENTUALLY_ALWAYS: frozenset({Operator.EVENTUALLY_ALWAYS, Operator.ALWAYS, Operator.EVENTUALLY}),
    Operator.ALWAYS_EVENTUALLY: frozenset({Operator.ALWAYS_EVENTUALLY, Operator.EVENTUALLY, Operator.ALWAYS}),
}
"""What each operator can say, or nearly: ◇□ with the shortest window is □, and with the shortest stay nearly ◇; □◇
with the shortest gap is nearly □, and with the shortest window nearly ◇; copies of □ joined by ∨ nearly ◇□ and ◇."""

_NAME = re.compile(r"pair-(\d+)")


def random_pairs(count: int, seed: int = 0, *, runs: int = 5, protocol: str = "paper") -> tuple[StudySpec, ...]:
    """Random pairs of tasks; every other one is similar, the first is.

    Args:
        count: How many.
        seed: The root seed.
        runs: Independent learning runs of each.
        protocol: Whose formulas the methods learn with; see `random_pair`.
    """
    return tuple(random_pair(number, seed, runs=runs, protocol=protocol) for number in range(count))


def find_pair(name: str, seed: int, runs: int | None, protocol: str = "paper") -> StudySpec | None:
    """The pair of a name such as ``pair-07``; None if it is no such name."""
    found = _NAME.fullmatch(name)
    if found is None:
        return None
    return random_pair(int(found[1]), seed, protocol=protocol, **({} if runs is None else {"runs": runs}))


def random_pair(number: int, seed: int = 0, *, runs: int = 5, protocol: str = "paper") -> StudySpec:
    """One pair: a random source task, and a target task that is similar to it or not.

    A similar target has the source's structure, or two copies of it joined by ∨ (Definition 7), in another world with
    other regions and times. The structure of one that is not similar has a primitive that no primitive of the source
    can say, even nearly (`SAYS`): transferability has to be refused.

    Args:
        number: The pair's number; even ones are similar.
        seed: The root seed.
        runs: Independent learning runs.
        protocol: Whose formulas the methods learn with. The full protocol infers from a pair only where this asks for
            it: it takes minutes for some of them, and there are fifty.
    """
    rng = generator(seed, "random pair", number)
    similar = number % 2 == 0
    name = f"pair-{number:02d}"
    environments = _environments(rng, name, similar)
    while environments is None:
        environments = _environments(rng, name, similar)
    kind = "similar" if similar else "not similar"
    return StudySpec(
        name=name,
        title=f"Random pair {number}, {kind}",
        source=environments[0],
        target=environments[1],
        collection=Collection(
            episodes=5_000,
            positives={"source": 150, "target": 150},
            negatives=600,
            most_episodes=100_000,
            epsilon=1.0,
        ),
        inference=InferenceSettings(size=SIZE, rate=0.995, information_weight=0.01, depth=2),
        swarm=SwarmSettings(restarts=1),
        learning=Learning(
            settings=QSettings(initial=40.0),
            source=QSettings(initial=40.0),
            source_episodes=200_000,
            most_episodes={**dict.fromkeys(("I", "III", "IV"), 200_000), "V": 1_000},
            window=20_000,
            evaluation_steps=((10_000, 250), (50_000, 2_500), (0, 10_000)),
        ),
        true={task: each.task.formula for task, each in zip(("source", "target"), environments, strict=True)},  # type: ignore[attr-defined]
        similar=similar,
        runs=runs,
        collections=1,
        protocol=protocol,
        full=1 if protocol == "full" else 0,
        seed=seed,
    )


def can_say(source: Structure, target: Structure) -> bool:
    """Whether disjuncts of the source's structure can say each disjunct of the target's, or nearly.

    A disjunct can say another if the primitives of the other can be given to primitives of its own, in order, whose
    operators can say theirs (`SAYS`); primitives that are left over can be made to hold always.
    """
    return all(any(_covers(mine, other) for mine in source) for other in target)


def _covers(source: tuple[tuple[Operator, bool], ...], target: tuple[tuple[Operator, bool], ...]) -> bool:
    left = iter(source)
    return all(any(wanted in SAYS[operator] for operator, _ in left) for wanted, _ in target)


def _conjunction(rng: np.random.Generator) -> tuple[tuple[Operator, bool], ...]:
    """One primitive or two, each with any operator; every fourth is negated, but never ◇: chance finds an outside."""
    operators = [tuple(Operator)[int(rng.integers(4))] for _ in range(int(rng.integers(1, 3)))]
    return tuple(
        (operator, operator is not Operator.EVENTUALLY and bool(rng.random() < 0.25)) for operator in operators
    )


def _environments(rng: np.random.Generator, name: str, similar: bool) -> tuple[EnvironmentSpec, ...] | None:
    """The source and the target of a pair; None where the structures drawn will not do."""
    source: Structure = (_conjunction(rng),)
    copies = 2 if 2 * len(source[0]) <= SIZE and rng.random() < 0.3 else 1
    target = source * copies if similar else (_conjunction(rng),)
    if not similar and can_say(source, target):
        return None
    try:
        return tuple(
            replace(random_task(rng, structure, settings=SETTINGS), name=f"{name}-{task}")
            for task, structure in (("S", source), ("T", target))
        )
    except ConfigurationError:  # rare structures are hardly ever neither trivial nor hopeless
        return None
