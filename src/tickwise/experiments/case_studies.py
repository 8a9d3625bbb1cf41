"""The studies that can be named on the command line: the paper's two case studies, each a specification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tickwise.envs.catalog import (
    CASE_STUDY_1_SOURCE,
    CASE_STUDY_1_TARGET,
    CASE_STUDY_2_SOURCE,
    CASE_STUDY_2_TARGET,
)
from tickwise.errors import ConfigurationError, StoreError
from tickwise.experiments.random_pairs import find_pair
from tickwise.experiments.study import Collection, Goal, Learning, Published, StudySpec, check_protocol
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.tree import InferenceSettings
from tickwise.rl.qlearning import QSettings

_SOURCE_1 = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"
_TARGET_1 = "F[1,16] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[22,39] (4 <= x <= 7 & 0 <= y <= 2)"
_SOURCE_2 = "G[0,25] F[0,8] (2 <= x <= 3 & 2 <= y <= 3)"
_TARGET_2 = "G[0,40] F[0,10] (2 <= x <= 3 & 3 <= y <= 4) | G[0,40] F[0,10] (4 <= x <= 5 & 3 <= y <= 4)"

CASE_STUDY_1 = StudySpec(
    name="case1",
    title="Case Study 1: stay in G, then reach Y",
    source=CASE_STUDY_1_SOURCE,
    target=CASE_STUDY_1_TARGET,
    collection=Collection(),
    inference=InferenceSettings(size=4, rate=0.95, information_weight=0.01, depth=2),
    swarm=SwarmSettings(),
    learning=Learning(),
    true={"source": _SOURCE_1, "target": _TARGET_1},
    published=Published(
        formulas={
            "source": _SOURCE_1,
            "target": "F[5,18] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[24,39] (4 <= x <= 7 & 1 <= y <= 2)",
            "target_without_information": (
                "F[1,18] G[0,4] (5 <= x <= 6 & 6 <= y <= 7) & F[24,40] (0 <= x <= 8 & 0 <= y <= 2)"
            ),
        },
        positives={"source": 46, "target": 19},
        episodes={"I": 834_590, "II": None, "III": 13_850, "IV": 2_220},
        collection=10_000,
        regions=(
            "Shown in a figure only. The text says that all inferred regions are exact but Ȳᵀ, which is different from "
            "Yᵀ and close to it."
        ),
        figures={"maps": "Fig. 6 (and of Figs. 1 and 2)", "curves": "Fig. 7"},
    ),
)

CASE_STUDY_2 = StudySpec(
    name="case2",
    title="Case Study 2: come back to B time and again",
    source=CASE_STUDY_2_SOURCE,
    target=CASE_STUDY_2_TARGET,
    collection=Collection(episodes=1_000, positives={"source": 20, "target": 20}, most_episodes=20_000, least_ticks=20),
    inference=InferenceSettings(size=4, rate=0.99, information_weight=0.01, depth=2),
    swarm=SwarmSettings(),
    learning=Learning(
        settings=QSettings(epsilon=0.005, initial=50.0),
        source=QSettings(epsilon=0.1, initial=50.0),
        most_episodes={**Learning().most_episodes, "V": 1_000},
        goal=Goal(block=1, above=1_000.0),
        window=7_000,
    ),
    true={"source": _SOURCE_2, "target": _TARGET_2},
    published=Published(
        formulas={
            "source": _SOURCE_2,
            "target": _TARGET_2,
            "target_without_information": (
                "G[0,40] F[0,10] (2 <= x <= 5 & 3 <= y <= 4) | G[0,40] F[0,9] (6 <= x <= 7 & 6 <= y <= 7)"
            ),
        },
        positives={"source": 22, "target": 34},
        episodes={"I": None, "II": None, "III": 1_540, "IV": 610},
        collection=1_000,
        regions=(
            "Shown in a figure only. The text says that the inferred blue regions are the true ones; where the green "
            "ones lie it does not say."
        ),
        figures={"maps": "Fig. 9 (and of Fig. 8)", "curves": "Fig. 10"},
        settled={"III": 6_000, "IV": 6_000},
    ),
    remarks=(
        (
            "Least classification rate ζ",
            "0.95 in both case studies.",
            "0.99 here. The labels are free of noise: a positive trajectory obeys the rule to its end, and a negative "
            "one breaks it. At 0.95 a single formula is satisfying in most collections, □◇ of the block of cells that "
            "covers both blue regions and the cell between them (rate 0.94 to 0.98), and no disjunction is needed.",
        ),
        (
            "Windows beyond the episode",
            "□[0,25] ◇[0,8] for an episode of 25 ticks.",
            "Effects end with the episode: □[0,17] ◇[0,8] says the same of trajectories of 25 ticks, and is decided "
            "with them.",
        ),
    ),
)

STUDIES = {study.name: study for study in (CASE_STUDY_1, CASE_STUDY_2)}
"""All studies by name."""


def find_study(
    name: str, *, quick: bool = False, runs: int | None = None, seed: int = 0, protocol: str = "paper"
) -> StudySpec:
    """The specification of a study by name.

    Args:
        name: The name on the command line.
        quick: Whether to cut it short.
        runs: Independent runs; None for the study's own number.
        seed: The root seed.
        protocol: One of `tickwise.experiments.study.PROTOCOLS`: whose formulas the methods learn with.

    Raises:
        ConfigurationError: If there is no such study or protocol, or a number is out of range.
    """
    check_protocol(protocol)
    pair = find_pair(name, seed, runs, protocol)
    if pair is not None:
        return pair
    if name not in STUDIES:
        raise ConfigurationError(
            f"there is no study {name!r}; choose {', '.join(STUDIES)}, or a random pair such as pair-07"
        )
    if runs is not None and runs < 1:
        raise ConfigurationError(f"a study of {runs} runs shows nothing; use --runs 1 or more")
    if seed < 0:
        raise ConfigurationError(f"the seed is {seed}; use 0 or more")
    spec = STUDIES[name].quick() if quick else STUDIES[name]
    return replace(spec, seed=seed, protocol=protocol, runs=spec.runs if runs is None else runs)


def study_of(config: Mapping[str, Any], folder: Path) -> StudySpec:
    """The specification of the study that a run folder's configuration belongs to.

    Args:
        config: What `config.json` holds.
        folder: The run folder.

    Raises:
        StoreError: If it is no study's configuration.
        ConfigurationError: If there is no such study any more.
    """
    try:
        asked = {"quick": config["short"], **{key: config[key] for key in ("runs", "seed", "protocol")}}
        return find_study(config["name"], **asked)
    except KeyError as error:
        raise StoreError(
            f"{folder / 'config.json'} holds no configuration of a run (there is no {error}); name another folder"
        ) from None
