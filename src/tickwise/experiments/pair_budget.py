"""What random pairs of tasks cost in all target episodes: the closed loop beside collecting once and transferring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tickwise.experiments.budget import totals
from tickwise.experiments.measures import difference_statistics, median_statistics, sure_ratio
from tickwise.experiments.study import StudySpec

CLOSED, RIVAL, PLAIN = "V", "IV", ("III", "I")
"""The closed loop, what it is compared with, and learning without transfer: with a formula where there is one."""

_NOTHING: dict[str, Any] = {
    "totals": {},
    "ratio": None,
    "plain": None,
    "slower": None,
    "ends": None,
    "negative": False,
    "transferable": None,
}


def pair_budget(spec: StudySpec, summary: Mapping[str, Any]) -> dict[str, Any]:
    """What one pair cost.

    Args:
        spec: The pair.
        summary: Its summary.

    Returns:
        ``totals``, by method all target episodes of each run; ``ratio``, how many times fewer the closed loop needs
        than Method IV, None where either was not carried out; ``plain``, the method that learns without transfer;
        ``slower``, whether the closed loop's median run needs more episodes than that one's, where a run that did not
        get there counts with all its episodes; ``ends``, how much better it is at its end, in shares of the way from
        always failing to V*, with an interval (see `difference_statistics`); ``negative``, whether it is worse by more
        than the noise between runs; and ``transferable``, in how many runs the closed loop found that it is.
    """
    methods = summary["methods"]
    if CLOSED not in methods:
        return dict(_NOTHING)
    spent = {name: totals(method["target_episodes"]) for name, method in methods.items()}
    limits = {name: _limit(method) for name, method in methods.items()}
    plain = next((name for name in PLAIN if name in methods), None)
    ratio = None
    if RIVAL in methods:
        ratio = sure_ratio(_filled(spent[RIVAL], limits[RIVAL]), _filled(spent[CLOSED], limits[CLOSED]), 0)
    slower = ends = None
    if plain is not None:
        ours, theirs = (float(np.median(_filled(spent[name], limits[name]))) for name in (CLOSED, plain))
        slower, way = ours > theirs, summary["v_star"] - summary["fail"]
        mine, others = ([end / way for end in methods[name]["final"]] for name in (CLOSED, plain))
        ends = difference_statistics(mine, others, spec.seed)
    loops = methods[CLOSED]["loops"]
    return {
        "totals": spent, "ratio": ratio, "plain": plain, "slower": slower,
        "ends": ends, "negative": ends is not None and ends["high"] is not None and ends["high"] < 0,
        "transferable": sum(loop["transferable"] for loop in loops), "of": len(loops), "name": spec.name,
    }  # fmt: skip


def suite_budget(rows: Sequence[Mapping[str, Any]], seed: int) -> dict[str, Any]:
    """What all pairs cost together.

    Args:
        rows: The rows of the pairs, each with its ``budget``.
        seed: The seed of the bootstrap.

    Returns:
        ``ratio``, the median over the pairs of how many times fewer target episodes the closed loop needs than Method
        IV; ``median``, by method the median over those pairs of the median run; ``reached``, on how many pairs most
        runs of the closed loop got there; ``slower``, the names of the pairs where it needs more than learning without
        transfer; ``negative``, by how much it ends worse than that on the pairs where it does by more than the noise
        between runs, by name; and ``of``, how many pairs it was carried out on. Statistics are those of
        `median_statistics`.
    """
    budgets = [row["budget"] for row in rows if row["budget"]["totals"]]
    both = [budget for budget in budgets if budget["ratio"] is not None]
    return {
        "of": len(budgets),
        "ratio": median_statistics([budget["ratio"] for budget in both], seed),
        "median": {
            name: median_statistics([_median(budget["totals"][name]) for budget in both], seed)
            for name in (RIVAL, CLOSED)
        },
        "reached": sum(_most_reached(budget["totals"][CLOSED]) for budget in budgets),
        "slower": [budget["name"] for budget in budgets if budget["slower"]],
        "negative": {budget["name"]: -budget["ends"]["value"] for budget in budgets if budget["negative"]},
    }


def _limit(method: Mapping[str, Any]) -> int:
    """All target episodes that a run had, whether or not it got there."""
    collection = max(run["collection"] for run in method["target_episodes"])
    most: int = max(method["episodes"])
    return most if "loops" in method else collection + most


def _filled(values: Sequence[int | None], limit: int) -> list[int]:
    return [limit if value is None else value for value in values]


def _median(values: Sequence[int | None]) -> float:
    """The median run, infinite where most runs did not get there."""
    return float(np.median([np.inf if value is None else value for value in values]))


def _most_reached(values: Sequence[int | None]) -> bool:
    return 2 * sum(value is not None for value in values) > len(values)
