"""What a setting of the method does, each an experiment of its own: the same collections under several values of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from tickwise.experiments.case_studies import find_study
from tickwise.experiments.effect_measures import Finished, Measure
from tickwise.experiments.runner import Unit
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec

RUNS = 3
"""Collections a value, unless another number is asked for."""


@dataclass(frozen=True, slots=True)
class Effect:
    """A setting, the values that it is given, and what is measured.

    Attributes:
        name: The name on the command line.
        title: The title of the report.
        symbol: The paper's symbol of the setting.
        axis: What the setting is.
        value: The value that a study has.
        vary: A study with another value.
        values: The values.
        few: Those of the quick form.
        study: The study that it is measured on unless another one is named.
        paper: What the paper says about it, in sentences.
        reading: How to understand what is measured, in sentences.
        measures: What is measured.
        headline: The measures, times among them, that the first sentences of a report are about.
        times: What is measured in seconds; it is kept apart, since it is another number each time.
        size: Of what problem size the times are a function; None for the setting itself.
        episodes: Method to the episodes that it learns for; 0 for the study's window.
        impossible: Study to the values that it cannot be carried out with.
    """

    name: str
    title: str
    symbol: str
    axis: str
    value: Callable[[StudySpec], float]
    vary: Callable[[StudySpec, float], StudySpec]
    values: tuple[float, ...]
    few: tuple[float, ...]
    study: str
    paper: str
    reading: str
    measures: tuple[Measure, ...]
    headline: tuple[Measure, ...]
    times: tuple[Measure, ...] = ()
    size: Measure | None = None
    episodes: Mapping[str, int] = field(default_factory=lambda: {"III": 0})
    impossible: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


def effect_units(
    effect: Effect,
    folder: Path,
    *,
    study: str | None = None,
    runs: int | None = None,
    seed: int = 0,
    quick: bool = False,
) -> list[Unit]:
    """What has to be carried out: each value with each collection, a study of one run in a folder of its own.

    The first collection has the root seed, the next ones those after it. So all values have the same collections as far
    as the setting leaves them alone, and each learns with its own formula.

    Args:
        effect: The effect.
        folder: Where the run folders go, as ``value/run-1`` and so on.
        study: The name of the study; None for the effect's own.
        runs: Collections a value; None for 3, or 1 in the quick form.
        seed: The root seed.
        quick: Whether to take few values.

    Returns:
        The units for `tickwise.experiments.runner.run_units`, value by value.

    Raises:
        ConfigurationError: If there is no such study, or a number is out of range.
    """
    count = (1 if quick else RUNS) if runs is None else runs
    base = find_study(study or effect.study, runs=count, seed=seed)
    values = [value for value in _values(effect, quick) if value not in effect.impossible.get(base.name, ())]
    return [
        Unit(
            f"{effect.symbol} = {value:g}" + (f", seed {seed + run}" if count > 1 else ""),
            replace(_short(effect, effect.vary(base, value)), runs=1, seed=seed + run, short=quick),
            folder / f"{value:g}" / f"run-{run + 1}",
        )
        for value in values
        for run in range(count)
    ]


def _short(effect: Effect, spec: StudySpec) -> StudySpec:
    """A study with no more inference and learning than is measured: effects are those of the paper's protocol."""
    window = spec.learning.window
    most = {method: episodes or window for method, episodes in effect.episodes.items()}
    steps = ((0, max(most.values(), default=window)),)
    return replace(spec, full=0, learning=replace(spec.learning, most_episodes=most, evaluation_steps=steps))


def effect_results(effect: Effect, units: Sequence[Unit], stores: Sequence[Store]) -> dict[str, Any]:
    """What finished units show, as plain data.

    Args:
        effect: The effect.
        units: What `effect_units` gave.
        stores: The artefacts of each unit.

    Returns:
        A mapping with ``summary``, which depends on the artefacts alone, and ``times``, which depends on the machine.
        Both have the ``values`` of the setting and the ``measures``: for each its numbers, a list a value with a number
        a collection (None where there is nothing to measure), the ``middle`` of each value (the median, or the mean
        where it is a share), and the least and greatest number, ``low`` and ``high``.

    Raises:
        MissingFileError: If an artefact is missing.
        StoreError: If one cannot be read.
    """
    groups: dict[float, list[Finished]] = {}
    for unit, store in zip(units, stores, strict=True):
        groups.setdefault(effect.value(unit.spec), []).append(Finished(unit.spec, store))
    first = units[0].spec
    summary: dict[str, Any] = {
        "effect": effect.name, "study": first.name, "quick": first.short, "seed": first.seed,
        "runs": len(units) // len(groups), "version": version("tickwise"), "command": command(effect, units),
        "symbol": effect.symbol, "axis": effect.axis, "values": list(groups),
        "own": effect.value(find_study(first.name)),
        "measures": {measure.key: _measured(measure, groups) for measure in effect.measures},
    }  # fmt: skip
    times: dict[str, Any] = {
        "effect": effect.name,
        "values": list(groups),
        "measures": {measure.key: _measured(measure, groups) for measure in effect.times},
    }
    if effect.size is not None:
        size = times["size"] = _measured(effect.size, groups)
        for measured in times["measures"].values():
            measured["growth"] = _growth(summary["values"], summary["own"], size["runs"], measured["runs"])
    return {"summary": summary, "times": times}


def command(effect: Effect, units: Sequence[Unit]) -> str:
    """The command line that gives the numbers, whatever the folder and the number of workers."""
    first = units[0].spec
    runs = len({unit.spec.seed for unit in units})
    quick = " --quick" if first.short else ""
    return f"tickwise effect {effect.name} --study {first.name}{quick} --runs {runs} --seed {first.seed}"


def _values(effect: Effect, quick: bool) -> tuple[float, ...]:
    return effect.few if quick else effect.values


def _measured(measure: Measure, groups: Mapping[float, Sequence[Finished]]) -> dict[str, Any]:
    rows = [[measure.number(finished) for finished in group] for group in groups.values()]
    specs = [group[0].spec for group in groups.values()]
    middle = (lambda values: sum(values) / len(values)) if measure.share else median
    return {
        "title": measure.title,
        "unit": measure.unit.format(window=f"{specs[0].learning.window:,}"),
        "form": measure.form,
        "share": measure.share,
        "mark": _mark(measure, specs),
        "runs": rows,
        "middle": [_over(middle, row) for row in rows],
        "low": [_over(min, row) for row in rows],
        "high": [_over(max, row) for row in rows],
    }


def _over(function: Any, row: Sequence[float | None]) -> float | None:
    known = [value for value in row if value is not None]
    return function(known) if known else None


def _mark(measure: Measure, specs: Sequence[StudySpec]) -> dict[str, Any] | None:
    """What to compare with, where it is the same for all values."""
    if measure.mark is None:
        return None
    (name, first), (_, last) = map(measure.mark, (specs[0], specs[-1]))
    return {"name": name, "value": first} if first == last else None


def _growth(
    values: Sequence[float], own: float, sizes: Sequence[Sequence[float]], seconds: Sequence[Sequence[float | None]]
) -> dict[str, float] | None:
    """How time grows with the problem's size: the straight line that fits from the study's own value on.

    Below that, a formula is often of another structure, and so another search.
    """
    pairs = [
        (size, time)
        for value, row, times in zip(values, sizes, seconds, strict=True)
        for size, time in zip(row, times, strict=True)
        if value >= own and time is not None
    ]
    if len({size for size, _ in pairs}) < 2:
        return None
    x, y = np.array(pairs, dtype=np.float64).T
    slope, fixed = np.polyfit(x, y, 1)
    return {"fixed": float(fixed), "per_thousand": 1000 * float(slope), "from": float(x.min())}
