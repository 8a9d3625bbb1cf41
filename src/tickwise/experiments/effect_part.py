"""The effect of a setting as a part of a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from tickwise.experiments.case_studies import find_study
from tickwise.experiments.choices import signed
from tickwise.experiments.effects import Effect
from tickwise.experiments.page import Part, inline_svg, template

_POINTS = "A point is a collection; the line goes through the medians, and the range is shaded."

_CLEARLY = 0.1
"""The share of its range by which a measure must go beyond its ends for a sentence to say so."""


def effect_part(effect: Effect, results: Mapping[str, Any], figures: Mapping[str, str], *, nested: bool = True) -> Part:
    """What a setting does.

    Args:
        effect: The effect.
        results: What `tickwise.experiments.effects.effect_results` gave.
        figures: The SVG text of each figure by name.
        nested: Whether other parts stand beside it, so that its title is a heading of its own.

    Returns:
        The part; all text from data is escaped.
    """
    summary, times = results["summary"], results["times"]
    key = f"effect-{effect.name}"
    body = template("effect").render(
        h=3 if nested else 2,
        key=key,
        effect=effect,
        study=find_study(summary["study"]).title,
        runs=summary["runs"],
        own=_value(summary["own"]),
        command=summary["command"],
        figures=[_figure(effect, results, name, svg) for name, svg in figures.items()],
        values=[_value(value) for value in summary["values"]],
        rows=[_row(measure) for group in (summary, times) for measure in group["measures"].values()],
    )
    found = effect_verdict(effect, results)
    links = [(f"{key}-measured", "What was measured"), (f"{key}-numbers", "Numbers")]
    return Part(key, effect.title, found, [] if nested else links, Markup(body), found[0])


def effect_verdict(effect: Effect, results: Mapping[str, Any]) -> list[str]:
    """What the effect's headline measures did, a sentence each."""
    summary, times = results["summary"], results["times"]
    ends = f"With {effect.symbol} from {_value(summary['values'][0])} to {_value(summary['values'][-1])}, "
    sentences: list[str] = []
    for measure in effect.headline:
        measured = summary["measures"].get(measure.key) or times["measures"][measure.key]
        opening = "the " if not sentences else "The "
        name = measured["title"][:1].lower() + measured["title"][1:]
        trend = f"{opening}{name} {_trend(effect.symbol, summary['values'], measured)}"
        growth = measured.get("growth")
        line = (
            ""
            if growth is None
            else (
                f"; from {effect.symbol} = {_value(summary['own'])} on that is {signed(growth['fixed'], '.2g')} s and "
                f"{signed(growth['per_thousand'], '.2g')} s per 1,000 trajectories"
            )
        )
        sentences.append(f"{'' if sentences else ends}{trend}{line}.")
    return sentences


def _trend(symbol: str, values: Sequence[float], measured: Mapping[str, Any]) -> str:
    """What the middle of a measure does from the first value to the last, as a verb and its object."""
    known = [(value, middle) for value, middle in zip(values, measured["middle"], strict=True) if middle is not None]
    if not known:
        return "could not be measured"
    texts = [_number(measured, middle) for _, middle in known]
    unit = " s" if measured["unit"] == "seconds" else ""
    missing = [_value(value) for value, middle in zip(values, measured["middle"], strict=True) if middle is None]
    none = f" (none at {symbol} = {', '.join(missing)})" if missing else ""
    if len(set(texts)) == 1:
        return f"stays at {texts[0]}{unit}{none}"
    middles = [middle for _, middle in known]
    first, last = middles[0], middles[-1]
    beyond = [max(middle - max(first, last), min(first, last) - middle) for middle in middles]
    place = beyond.index(max(beyond))
    if beyond[place] > _CLEARLY * (max(middles) - min(middles)):
        at = f"{texts[place]}{unit} at {symbol} = {_value(known[place][0])}"
        return f"goes from {texts[0]}{unit} over {at} to {texts[-1]}{unit}{none}"
    there = next(place for place, middle in enumerate(middles) if abs(middle - first) >= 0.9 * abs(last - first))
    early = f", nearly all of it by {symbol} = {_value(known[there][0])}" if there < len(known) - 1 else ""
    return f"{'rises' if last > first else 'falls'} from {texts[0]}{unit} to {texts[-1]}{unit}{early}{none}"


def _figure(effect: Effect, results: Mapping[str, Any], name: str, svg: str) -> dict[str, Any]:
    timed = name.endswith("-time")
    return {
        "name": f"effect-{name}-figure",
        "title": "Time of inference" if timed else "Effect",
        "counterpart": "",
        "caption": _time_caption(results) if timed else _caption(effect, results),
        "svg": inline_svg(f"effect-{name}-figure", svg),
    }


def _caption(effect: Effect, results: Mapping[str, Any]) -> str:
    shares = any(measure["share"] for measure in results["summary"]["measures"].values())
    bars = " A bar is the share of the collections." if shares else ""
    return f"Over the {effect.axis}. {_POINTS}{bars} Values stand at equal distances."


def _time_caption(results: Mapping[str, Any]) -> str:
    line = " Axes are logarithmic; the dashed curve is linear growth, fitted from the study’s own value on."
    size = "size" in results["times"]
    return f"Processor time of one process, without compilation. {_POINTS}{line if size else ''}"


def _row(measure: Mapping[str, Any]) -> dict[str, Any]:
    cells = []
    for middle, row in zip(measure["middle"], measure["runs"], strict=True):
        note = "" if measure["share"] else _spread(measure, row)
        cells.append({"text": _number(measure, middle), "note": note})
    return {"title": measure["title"], "unit": measure["unit"], "cells": cells}


def _spread(measure: Mapping[str, Any], row: Sequence[float | None]) -> str:
    """The range of a row, and how many numbers are missing; empty where all are the same."""
    known = [value for value in row if value is not None]
    low, high = (_number(measure, end(known)) if known else "" for end in (min, max))
    parts = [f"{low} to {high}"] if low != high else []
    missing = len(row) - len(known)
    return "; ".join(parts + ([f"{missing} none"] if missing and known else []))


def _number(measure: Mapping[str, Any], value: float | None) -> str:
    return "none" if value is None else signed(value, measure["form"])


def _value(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:g}"
