"""What learning a target task costs in all: every episode spent in it, collection included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tickwise.experiments.measures import episode_statistics

LEVEL = "95"
"""The share of V* to get to, in percent of the way from always failing."""


def target_episodes(method: str, results: Sequence[Mapping[str, Any]], collection: int) -> list[dict[str, int | None]]:
    """The episodes that each run spent in the target task until its greedy policy was as good as 95 % of V*.

    Args:
        method: The name of the method.
        results: What each of its runs gave.
        collection: The episodes of the collection that the target's formula was inferred from.

    Returns:
        For each run ``collection`` and ``learning``; the latter is None where it did not get there. Method I needs no
        formula, and so no collection. Method V collects until a formula is satisfying on fresh episodes, and what it
        needs beyond is learning; until then nobody knows that it is there, so that collection counts in full.
    """
    return [_of_run(method, run, collection) for run in results]


def _of_run(method: str, run: Mapping[str, Any], collection: int) -> dict[str, int | None]:
    there = run["reached"][LEVEL]
    if method == "I":
        return {"collection": 0, "learning": there}
    if method != "V":
        return {"collection": collection, "learning": there}
    collected = run["episodes"] if run["collected"] is None else run["collected"]
    return {"collection": collected, "learning": None if there is None else max(there - collected, 0)}


def totals(episodes: Sequence[Mapping[str, int | None]]) -> list[int | None]:
    """Collection and learning together; None where a run did not get there."""
    return [
        None if run["learning"] is None or run["collection"] is None else run["collection"] + run["learning"]
        for run in episodes
    ]


def budget_statistics(episodes: Sequence[Mapping[str, int | None]], seed: int) -> dict[str, Any]:
    """Statistics over the runs of the ``collection``, and of ``total``, collection and learning together."""
    return {
        "collection": episode_statistics([run["collection"] for run in episodes], seed),
        "total": episode_statistics(totals(episodes), seed),
    }
