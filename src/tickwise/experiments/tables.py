"""What a finished run folder shows in a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from rich.table import Table

from tickwise.experiments.store import read_json

TIMES = "times/inference.json"
"""In the run folder of a study: what each inference took, which differs each time."""


def suite_tables(summary: Mapping[str, Any], folder: Path) -> Iterator[str | Table]:
    """What a suite gave.

    Args:
        summary: The suite's summary.
        folder: Its run folder, which has the times that inference took.
    """
    for name, study in summary["studies"].items():
        yield f"== {name}"
        yield from study_tables(study, folder / name)
    if "random" in summary:
        yield from _pairs(summary["random"])
    for name, effect in summary["effects"].items():
        yield _effect(name, effect, read_json(folder / "times" / f"{name}.json"))


def _pairs(found: Mapping[str, Any]) -> Iterator[str]:
    yield "== random pairs of tasks"
    for kind, verb in (("similar", "identified"), ("dissimilar", "refused")):
        row = found["identification"][kind]
        yield f"{kind} pairs {verb}: {row['right']} of {row['of']}"
    budget = found["budget"]
    if budget["ratio"]["median"] is not None:
        ratio = budget["ratio"]
        yield (
            f"IV/V by all target episodes to 95 % of V*: median {ratio['median']:.1f} "
            f"[{ratio['low']:.1f}, {ratio['high']:.1f}] over {ratio['count']} pairs"
        )
        yield (
            f"V needs more than learning without transfer on {len(budget['slower'])} of {budget['of']} pairs, "
            f"and ends worse by more than noise on {len(budget['negative'])}"
        )
    for pair, measures in found["speed_ups"].items():
        goal = measures["goal"]
        if goal["median"] is not None:
            interval = f"[{goal['low']:.1f}, {goal['high']:.1f}]"
            yield f"{pair} by the goal: median {goal['median']:.1f} {interval} over {goal['count']} pairs"


def _effect(name: str, effect: Mapping[str, Any], times: Mapping[str, Any]) -> Table:
    """A column a value, since there are more measures than fit side by side."""
    table = Table(title=f"{name}, on {effect['study']}: medians, and shares of the collections", title_justify="left")
    table.add_column(f"at {effect['symbol']} =")
    for value in effect["values"]:
        table.add_column(f"{value:g}", justify="right")
    for measure in (*effect["measures"].values(), *times["measures"].values()):
        cells = ("none" if middle is None else format(middle, measure["form"]) for middle in measure["middle"])
        unit = ", seconds" if measure["unit"] == "seconds" else ""
        table.add_row(measure["title"] + unit, *cells)
    return table


def study_tables(summary: Mapping[str, Any], folder: Path) -> Iterator[str | Table]:
    """What a study gave: its formulas, a row a protocol, and a row a method.

    Args:
        summary: The study's summary.
        folder: Its run folder, which has the times that inference took.
    """
    for name, formula in summary["formulas"].items():
        yield f"{name.replace('_', ' ')}: {formula or 'none'}"
    yield f"logically transferable: {'yes' if summary['transferable'] else 'no'}"
    yield f"reason: {summary['reason']}"
    yield _protocols(summary["protocols"], read_json(folder / TIMES))
    runs = summary["runs"]
    table = Table(
        title=f"Episodes to converge, mean of {runs} run{'' if runs == 1 else 's'} (V* = {summary['v_star']:.2f})\n"
        f"goal: {summary['goal']}",
        title_justify="left",
    )
    columns = {"goal": "goal", "reached_80": "80 %", "reached_90": "90 %", "reached_95": "95 %", "settled": "settled"}
    table.add_column("method")
    for heading in (*columns.values(), "mean return", "in all"):
        table.add_column(heading, justify="right")
    for name, method in summary["methods"].items():
        statistics = method["statistics"]
        cells = [_episodes(statistics[key], runs) for key in columns]
        spent = _episodes(statistics["target_episodes"]["total"], runs)
        table.add_row(name, *cells, f"{statistics['window_mean']['iqm']:.1f}", spent)
    yield table
    for pair, measures in summary["ratios"].items():
        found = measures["goal"]
        if found["value"] is not None:
            least = "at least " if found["at_least"] else ""
            yield f"{pair} by the goal: {least}{found['value']:.1f} times fewer episodes"


def _protocols(protocols: Mapping[str, Any], seconds: Mapping[str, Sequence[float]]) -> Table:
    table = Table(title="Collections whose formulas have the true operators and regions exactly", title_justify="left")
    table.add_column("protocol")
    for heading in ("source", "target", "both", "transferable", "seconds each"):
        table.add_column(heading, justify="right")
    for name, found in protocols.items():
        counts = (*(found["exact"][key] for key in ("source", "target", "both")), found["transferable"])
        cells = [f"{count} of {found['of']}" for count in counts]
        table.add_row(name + ", learned with" * found["chosen"], *cells, f"{median(seconds[name]):.1f}")
    return table


def _episodes(statistics: Mapping[str, Any], runs: int) -> str:
    if statistics["mean"] is not None:
        return f"{statistics['mean']:,.0f}"
    return f"{statistics['reached']} of {runs} runs"
