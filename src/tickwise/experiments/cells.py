"""What a table of a report says of episodes over the runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tickwise.experiments.verdict import count


def episodes_cell(statistics: Mapping[str, Any], runs: int, limit: int) -> dict[str, str]:
    """Episodes over the runs, as text and as a note.

    Args:
        statistics: What `tickwise.experiments.measures.episode_statistics` gave.
        runs: How many runs there are.
        limit: The most episodes that a run had.
    """
    reached = statistics["reached"]
    there = f"{reached} of {runs} runs"
    if statistics["mean"] is not None and reached == runs:
        return {
            "text": count(statistics["mean"]),
            "note": f"{count(statistics['low'])} to {count(statistics['high'])}; {there}",
        }
    if statistics["median"] is not None:
        return {"text": f"median {count(statistics['median'])}", "note": f"{there} within {count(limit)}"}
    return {"text": "–" if reached else "none", "note": f"{there} within {count(limit)}"}
