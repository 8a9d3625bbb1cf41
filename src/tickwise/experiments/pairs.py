"""What random pairs of tasks show together: how often transferability is identified rightly, and the speed-up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tickwise.experiments.measures import median_statistics, sure_ratio
from tickwise.experiments.pair_budget import pair_budget, suite_budget
from tickwise.experiments.store import Store
from tickwise.experiments.study import StudySpec
from tickwise.experiments.summary import PAIRS, gather

MEASURES = ("goal", "reached_80", "reached_90")
"""By which the methods are compared."""

KINDS = ("similar", "dissimilar")


def gather_pairs(specs: Sequence[StudySpec], stores: Sequence[Store], version: str) -> dict[str, Any]:
    """Read the finished run folders of random pairs; all that is given depends on the artefacts alone.

    Args:
        specs: The pairs.
        stores: Their artefacts.
        version: The version of Tickwise that made them.

    Returns:
        A mapping with ``pairs`` (a row a pair), ``budget`` (all target episodes; see `suite_budget`),
        ``identification`` (for each of `KINDS` the number ``right``, ``of``
        how many, the ``share`` and its 95 % Wilson interval ``low`` to ``high``) and ``speed_ups`` (for each pair of
        methods and measure the ``median`` over the pairs of tasks with its interval; see `median_statistics`).

    Raises:
        MissingFileError: If an artefact is missing.
        StoreError: If one cannot be read.
    """
    rows = [_row(spec, gather(spec, store, version)) for spec, store in zip(specs, stores, strict=True)]
    seed = specs[0].seed if specs else 0
    return {
        "pairs": rows,
        "budget": suite_budget(rows, seed),
        "identification": {
            kind: _share([row for row in rows if row["similar"] == (kind == "similar")]) for kind in KINDS
        },
        "speed_ups": {
            f"{slow}/{fast}": {
                measure: median_statistics(
                    [row["speed_ups"][f"{slow}/{fast}"][measure] for row in rows if row["speed_ups"]], seed
                )
                for measure in MEASURES
            }
            for slow, fast in PAIRS
        },
    }


def _row(spec: StudySpec, results: Mapping[str, Any]) -> dict[str, Any]:
    """What one pair gave."""
    summary, inference = results["summary"], results["inferences"][0]
    identified = bool(summary["transferable"])
    attempts = inference["target"]["attempts"]
    return {
        "name": spec.name, "similar": spec.similar, "identified": identified, "right": identified == spec.similar,
        "reason": summary["reason"],
        "worlds": {"source": spec.source.world.size, "target": spec.target.world.size},
        "true": {"source": spec.source.task.formula, "target": spec.target.task.formula},  # type: ignore[attr-defined]
        "inferred": {
            "source": inference["source"]["formula"],
            "target": attempts[-1]["formula"] if attempts else None,
        },
        "rates": {"source": inference["source"]["rate"], "target": attempts[-1]["rate"] if attempts else None},
        "satisfying": inference["source"]["satisfying"],
        "v_star": summary["v_star"],
        "episodes": {
            method: {measure: found["statistics"][measure] for measure in MEASURES}
            for method, found in summary["methods"].items()
        },
        "speed_ups": _speed_ups(spec, summary["methods"]),
        "budget": pair_budget(spec, summary),
    }  # fmt: skip


def _speed_ups(spec: StudySpec, methods: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """How many times fewer episodes the faster method of each pair needs; empty where a method was not carried out."""
    if any(method not in methods for pair in PAIRS for method in pair):
        return {}
    limit = max(spec.learning.most_episodes.values())
    return {
        f"{slow}/{fast}": {
            measure: sure_ratio(methods[slow][measure], methods[fast][measure], limit) for measure in MEASURES
        }
        for slow, fast in PAIRS
    }


def _share(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How many pairs were judged rightly, with the 95 % Wilson interval of the share."""
    right, count = sum(row["right"] for row in rows), len(rows)
    if not count:
        return {"right": 0, "of": 0, "share": None, "low": None, "high": None}
    interval = binomtest(right, count).proportion_ci(method="wilson")
    return {
        "right": right, "of": count, "share": right / count, "low": float(np.clip(interval.low, 0, 1)),
        "high": float(np.clip(interval.high, 0, 1)),
    }  # fmt: skip
