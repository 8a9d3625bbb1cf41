"""A suite so small that all of it runs in seconds; as a program, the command line with it in the place of ``all``.

``python -m tests.experiments.tiny_suite reproduce all --out DIR`` carries it out in a process of its own.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

from tests.experiments.tiny import TINY
from tickwise.cli import main
from tickwise.envs.temporal import FormulaTask
from tickwise.experiments import case_studies, suites
from tickwise.experiments.effect_catalog import EFFECTS
from tickwise.experiments.effects import Effect
from tickwise.experiments.study import StudySpec

STUDY = replace(
    TINY,
    runs=1,
    learning=replace(TINY.learning, source_episodes=2_000, most_episodes=dict.fromkeys(("I", "III", "IV"), 2_000)),
)
"""The tiny study with a single run and little learning."""


def pairs(count: int, seed: int = 0, *, runs: int = 1, protocol: str = "paper") -> tuple[StudySpec, ...]:
    """Pairs that are similar and pairs that are not, in turn, in the worlds of the tiny study."""
    return tuple(_pair(number, seed, runs, protocol) for number in range(count))


def _pair(number: int, seed: int, runs: int, protocol: str) -> StudySpec:
    similar = number % 2 == 0
    source, target = "F[2,9] (0 <= x <= 1 & 0 <= y <= 1)", "F[3,11] (3 <= x <= 4 & 2 <= y <= 4)"
    if not similar:
        target = "G[2,10] F[0,3] (1 <= x <= 3 & 1 <= y <= 3)"
    environments = {
        name: replace(environment, task=FormulaTask(formula, 14))
        for name, environment, formula in (("source", TINY.source, source), ("target", TINY.target, target))
    }
    return replace(
        STUDY,
        name=f"pair-{number:02d}",
        **environments,
        collection=replace(STUDY.collection, epsilon=1.0, negatives=100),
        inference=replace(STUDY.inference, size=1, rate=0.99),
        true={"source": source, "target": target},
        similar=similar,
        runs=runs,
        collections=1,
        protocol=protocol,
        full=1 if protocol == "full" else 0,
        seed=seed,
    )


@contextmanager
def in_place() -> Iterator[None]:
    """The tiny study, pairs and one effect in the place of what the suite ``all`` consists of."""
    effects: Mapping[str, Effect] = {"depth": replace(EFFECTS["depth"], values=(1, 2), few=(1, 2), study="tiny")}
    changes: dict[str, Any] = {"STUDIES": {"tiny": STUDY}, "EFFECTS": effects, "random_pairs": pairs}
    with patch.multiple(suites, **changes), patch.dict(case_studies.STUDIES, {"tiny": STUDY}):
        yield


if __name__ == "__main__":
    with in_place():
        sys.exit(main())
