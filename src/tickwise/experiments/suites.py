"""Suites: several studies that one command carries out, with one report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tickwise.errors import ConfigurationError, StoreError
from tickwise.experiments.case_studies import STUDIES, find_study
from tickwise.experiments.effect_catalog import EFFECTS, find_effect
from tickwise.experiments.effects import Effect, effect_units
from tickwise.experiments.random_pairs import random_pairs
from tickwise.experiments.runner import Unit
from tickwise.experiments.study import StudySpec, check_protocol

TITLES = {
    "random": "Random pairs of tasks",
    "all": "The case studies, random pairs of tasks, and the effects of settings",
    "effect": "The effect of a setting",
}
"""Name and title of each suite."""

TASKS = 50
"""Random pairs where no other number is asked for; the quick form has 4."""

PAIR_RUNS = 5
"""Learning runs of each pair where no other number is asked for; the quick form has 2."""


@dataclass(frozen=True, slots=True)
class Suite:
    """Several studies with one report; all of them follow from what was asked for.

    Attributes:
        name: One of `TITLES`.
        tasks: Random pairs of tasks.
        runs: Independent runs of each study; None for each one's own number.
        seed: The root seed.
        short: Whether it is cut short to be looked at within minutes.
        effect: The name of the effect, where the suite is a single one.
        study: The study that the effect is measured on; None for its own.
        protocol: Whose formulas the methods of studies and pairs learn with; effects are those of the paper's.
    """

    name: str
    tasks: int
    runs: int | None = None
    seed: int = 0
    short: bool = False
    effect: str | None = None
    study: str | None = None
    protocol: str = "paper"

    @property
    def title(self) -> str:
        """The title of the report."""
        return TITLES[self.name] if self.effect is None else EFFECTS[self.effect].title

    @property
    def command(self) -> str:
        """The command line that gives the suite's numbers, whatever the folder and the number of workers."""
        if self.effect is None:
            what = f"reproduce {self.name} --tasks {self.tasks}"
        else:
            what = f"effect {self.effect}" + ("" if self.study is None else f" --study {self.study}")
        options = [f"--protocol {self.protocol}"] * (self.protocol != "paper") + ["--quick"] * self.short
        options += [] if self.runs is None else [f"--runs {self.runs}"]
        return " ".join(["tickwise", what, *options, f"--seed {self.seed}"])

    @property
    def studies(self) -> tuple[StudySpec, ...]:
        """The studies that are reported one by one."""
        names = tuple(STUDIES) if self.name == "all" else ()
        return tuple(
            find_study(name, quick=self.short, runs=self.runs, seed=self.seed, protocol=self.protocol) for name in names
        )

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of settings that are shown."""
        if self.effect is not None:
            return (EFFECTS[self.effect],)
        return tuple(EFFECTS.values()) if self.name == "all" else ()

    def units(self, folder: Path) -> Units:
        """All that has to be carried out, in folders of the suite's.

        Args:
            folder: The run folder of the suite.
        """
        runs = (2 if self.short else PAIR_RUNS) if self.runs is None else self.runs
        return Units(
            studies=tuple(Unit(spec.name, spec, folder / spec.name) for spec in self.studies),
            pairs=tuple(
                Unit(spec.name, spec, folder / "pairs" / spec.name)
                for spec in random_pairs(self.tasks, self.seed, runs=runs, protocol=self.protocol)
            ),
            effects={
                effect.name: tuple(self._variations(effect, folder / "effects" / effect.name))
                for effect in self.effects
            },
        )

    def _variations(self, effect: Effect, folder: Path) -> list[Unit]:
        runs = None if self.effect is None else self.runs  # --runs means the learning runs of studies elsewhere
        return effect_units(effect, folder, study=self.study, runs=runs, seed=self.seed, quick=self.short)

    def as_dict(self) -> dict[str, Any]:
        """What was asked for, as plain data, as it goes into the run folder."""
        return {
            "suite": self.name, "effect": self.effect, "study": self.study, "tasks": self.tasks, "runs": self.runs,
            "seed": self.seed, "short": self.short, "protocol": self.protocol,
        }  # fmt: skip


@dataclass(frozen=True, slots=True)
class Units:
    """What a suite consists of.

    Attributes:
        studies: Studies that are reported one by one.
        pairs: Random pairs of tasks, which are reported together.
        effects: The variations of each effect by its name.
    """

    studies: tuple[Unit, ...]
    pairs: tuple[Unit, ...]
    effects: Mapping[str, tuple[Unit, ...]]

    @property
    def all(self) -> list[Unit]:
        """Every unit."""
        return [*self.studies, *self.pairs, *(unit for units in self.effects.values() for unit in units)]


def find_suite(
    name: str,
    *,
    tasks: int | None = None,
    runs: int | None = None,
    seed: int = 0,
    quick: bool = False,
    protocol: str = "paper",
) -> Suite:
    """The suite of a name.

    Args:
        name: ``random`` or ``all``.
        tasks: Random pairs of tasks; None for 50, or 4 in the quick form.
        runs: Independent runs of each study; None for each one's own number.
        seed: The root seed.
        quick: Whether to cut it short.
        protocol: One of `tickwise.experiments.study.PROTOCOLS`.

    Raises:
        ConfigurationError: If there is no such suite or protocol, or a number is out of range.
    """
    if name not in ("random", "all"):
        raise ConfigurationError(f"there is no suite {name!r}; choose random or all")
    count = (4 if quick else TASKS) if tasks is None else tasks
    if count < 1:
        raise ConfigurationError(f"a suite of {count} random tasks shows nothing; use --tasks 1 or more")
    _check_numbers(runs, seed)
    check_protocol(protocol)
    return Suite(name, count, runs, seed, quick, protocol=protocol)


def effect_suite(
    effect: str, *, study: str | None = None, runs: int | None = None, seed: int = 0, quick: bool = False
) -> Suite:
    """The suite of a single effect.

    Args:
        effect: The name of the effect.
        study: The study that it is measured on; None for its own.
        runs: Collections a value; None for the effect's own number.
        seed: The root seed.
        quick: Whether to take few values.

    Raises:
        ConfigurationError: If there is no such effect or study, or a number is out of range.
    """
    find_effect(effect)
    _check_numbers(runs, seed)
    if study is not None:
        find_study(study)
    return Suite("effect", 0, runs, seed, quick, effect, study)


def _check_numbers(runs: int | None, seed: int) -> None:
    if runs is not None and runs < 1:
        raise ConfigurationError(f"studies of {runs} runs show nothing; use --runs 1 or more")
    if seed < 0:
        raise ConfigurationError(f"the seed is {seed}; use 0 or more")


def suite_of(configuration: Mapping[str, Any], folder: Path) -> Suite:
    """The suite that a run folder belongs to.

    Args:
        configuration: What ``config.json`` holds.
        folder: The folder, for messages.

    Raises:
        StoreError: If it is no configuration of a suite.
    """
    try:
        shared = {"runs": configuration["runs"], "seed": configuration["seed"], "quick": configuration["short"]}
        if configuration["effect"] is not None:
            return effect_suite(configuration["effect"], study=configuration["study"], **shared)
        asked = {"tasks": configuration["tasks"], "protocol": configuration["protocol"]}
        return find_suite(configuration["suite"], **asked, **shared)
    except KeyError as error:
        raise StoreError(
            f"{folder / 'config.json'} holds no configuration of a suite (there is no {error}); name another folder"
        ) from None
