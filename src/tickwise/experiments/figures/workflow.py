"""The workflow with the study's own numbers: the counterpart of the paper's workflow diagram."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from tickwise.automata.build import timed_automata
from tickwise.experiments.figures.style import (
    GREEN,
    INK,
    LINE,
    MUTED,
    PAPER,
    VERMILION,
    WIDTH,
    arrow,
    blank,
    canvas,
    note,
    thousands,
)
from tickwise.experiments.regions import NamedFormula, math_primitive, math_symbol, read_formula
from tickwise.experiments.study import StudySpec

_LEFT, _MIDDLE, _RIGHT = 2.25, 4.5, 6.75
_HEIGHT = 8.6
_ROWS = {"collect": 7.6, "label": 6.4, "infer": 5.05, "decide": 3.75, "automaton": 2.35, "learn": 1.0}
_SOURCE_FACE, _TARGET_FACE = "#FDF3E1", "#E8F3FB"


def draw(results: Mapping[str, Any], spec: StudySpec) -> Figure:
    """From the collection to learning in the target task, with what the first run gave at each step."""
    figure = canvas(_HEIGHT)
    axes = blank(figure, WIDTH, _HEIGHT)
    summary = results["summary"]
    transferable = bool(summary["transferable"])
    for x, title, face in ((_LEFT, "Source task", _SOURCE_FACE), (_RIGHT, "Target task", _TARGET_FACE)):
        axes.add_patch(Rectangle((x - 2.1, 0.2), 4.2, _HEIGHT - 0.4, facecolor=face, edgecolor="none", zorder=0))
        axes.text(x, _HEIGHT - 0.38, title, ha="center", va="center", fontsize=12, weight="bold")
    collection = results["collections"][0] if results["collections"] else {}
    for x, task in ((_LEFT, "source"), (_RIGHT, "target")):
        _collection(axes, x, collection.get(task, {}), spec)
    source = read_formula(summary["formulas"]["source"], "S", spec.source)
    target = read_formula(summary["formulas"]["target"], "T", spec.target)
    _inference(axes, results, spec, source, target)
    _decision(axes, transferable=transferable)
    _learning(axes, results, spec, source, target, transferable=transferable)
    return figure


def _collection(axes: Axes, x: float, counts: Mapping[str, Any], spec: StudySpec) -> None:
    rows = _ROWS
    tau = spec.collection.tau
    episodes = thousands(counts.get("episodes"))
    note(
        axes,
        x,
        rows["collect"],
        f"Data collection\nQ-learning on τ-states, τ = {tau}\n{episodes} episodes",
    )
    positives = counts.get("positives", "–")
    negatives = thousands(counts.get("candidates" if spec.protocol == "full" else "negatives"))
    note(axes, x, rows["label"], f"Labelled trajectories\n{positives} with label 1, {negatives} with −1")
    arrow(axes, (x, rows["collect"] - 0.47), (x, rows["label"] + 0.36))
    arrow(axes, (x, rows["label"] - 0.36), (x, rows["infer"] + 0.6))


def _inference(
    axes: Axes,
    results: Mapping[str, Any],
    spec: StudySpec,
    source: NamedFormula | None,
    target: NamedFormula | None,
) -> None:
    y = _ROWS["infer"]
    facts = results["inferences"][0]["source"] if results["inferences"] else {}
    way = "Inference: decision tree" if spec.protocol == "paper" else "Inference: primitives together"
    note(axes, _LEFT, y, f"{way}\n{_lines(source, 'S')}\n{_quality(facts)}", linespacing=1.7)
    attempts = results["inferences"][0]["target"]["attempts"] if results["inferences"] else []
    quality = _quality(attempts[-1]) if attempts else "not attempted"
    note(axes, _RIGHT, y, f"Inference: same operators\n{_lines(target, 'T')}\n{quality}", linespacing=1.7)
    if source is not None:
        arrow(axes, (_LEFT + 1.62, y), (_RIGHT - 1.62, y), dashed=True)
        axes.text(_MIDDLE, y + 0.08, "structure", ha="center", va="bottom", fontsize=9.5, color=MUTED, zorder=5)


def _lines(formula: NamedFormula | None, task: str) -> str:
    """A formula, a line a primitive."""
    symbol = math_symbol(task)
    if formula is None:
        return f"${symbol}$: none found"
    lines = []
    for number, disjunct in enumerate(formula.sdnf.disjuncts):
        parts = [math_primitive(part, formula.names) for part in disjunct.primitives]
        first = rf"{symbol} =\," if number == 0 else r"∨\,"
        lines.append(f"${first}{parts[0]}$")
        lines += [f"$∧\\,{part}$" for part in parts[1:]]
    return "\n".join(lines)


def _quality(facts: Mapping[str, Any]) -> str:
    if facts.get("rate") is None:
        return "no leaf with label 1"
    if not facts.get("satisfying", True):
        return f"not satisfying: rate {facts['rate']:.3f}, size {facts['size']}"
    return f"rate {facts['rate']:.3f}, information gain {facts['gain']:.3f}"


def _decision(axes: Axes, *, transferable: bool) -> None:
    y = _ROWS["decide"]
    answer, colour = ("yes", GREEN) if transferable else ("no", VERMILION)
    note(
        axes, _MIDDLE, y, f"Logically transferable?\n{answer}", edge=colour, shape="round4,pad=0.65",
        weight="bold", color="#00694C" if transferable else "#A54700",
    )  # fmt: skip
    for x, side in ((_LEFT, -1), (_RIGHT, 1)):
        axes.plot([x, x], [_ROWS["infer"] - 0.6, y], color=INK, linewidth=1.3, zorder=1)
        arrow(axes, (x, y), (_MIDDLE + side * 1.13, y))


def _learning(
    axes: Axes,
    results: Mapping[str, Any],
    spec: StudySpec,
    source: NamedFormula | None,
    target: NamedFormula | None,
    *,
    transferable: bool,
) -> None:
    """Automata, learning on extended states and the transfer; greyed without transferability."""
    high, low = _ROWS["automaton"], _ROWS["learn"]
    muted: dict[str, Any] = {} if transferable else {"edge": LINE, "color": MUTED, "dashed": True}
    ink = INK if transferable else LINE
    colour = GREEN if transferable else LINE
    note(axes, _LEFT, high, _automata(source, "S"), **muted)
    note(axes, _RIGHT, high, _automata(target, "T"), **muted)
    episodes = thousands(spec.learning.source_episodes)
    note(axes, _LEFT, low, f"Q-learning on extended states\n{episodes} episodes", **muted)
    note(axes, _RIGHT, low, _outcome(results, spec, transferable=transferable), edge=INK, face=PAPER)
    for x in (_LEFT, _RIGHT):
        arrow(
            axes,
            (x, high - 0.37),
            (x, low + (0.37 if x == _LEFT else 0.68)),
            colour=ink,
            dashed=not transferable,
        )
    middle = _ROWS["decide"] - 0.46
    axes.plot([_MIDDLE, _MIDDLE], [middle, high + 0.62], color=colour, linewidth=1.3, zorder=1)
    axes.plot([_LEFT, _RIGHT], [high + 0.62] * 2, color=colour, linewidth=1.3, zorder=1)
    for x in (_LEFT, _RIGHT):
        arrow(axes, (x, high + 0.62), (x, high + 0.37), colour=colour, dashed=not transferable)
    if transferable:
        arrow(axes, (_LEFT + 1.3, high), (_RIGHT - 1.3, high), dashed=True, style="<|-|>")
        axes.text(_MIDDLE, high + 0.07, r"mapping $\xi$", ha="center", va="bottom", fontsize=9.5, color=MUTED)
        arrow(axes, (_LEFT + 1.36, low), (_RIGHT - 1.42, low), colour=VERMILION)
        axes.text(
            _MIDDLE,
            low + 0.07,
            r"transfer of $\bar{Q}$",
            ha="center",
            va="bottom",
            fontsize=9.5,
            color="#A54700",
        )


def _automata(formula: NamedFormula | None, task: str) -> str:
    title = f"Timed automaton of ${math_symbol(task)}$"
    if formula is None:
        return f"{title}\nnot built"
    automata = timed_automata(formula.sdnf)
    if len(automata) > 1:
        title = f"{len(automata)} timed automata of ${math_symbol(task)}$"
    locations = " + ".join(str(len(automaton.locations)) for automaton in automata)
    clocks = len(automata[0].clocks)
    return f"{title}\n{locations} locations, {clocks} clock{'s' if clocks > 1 else ''}"


def _outcome(results: Mapping[str, Any], spec: StudySpec, *, transferable: bool) -> str:
    """What learning in the target task gave, by the study's goal."""
    methods = results["summary"]["methods"]
    names = [name for name in (("III", "IV") if transferable else ("I",)) if name in methods]
    title = "Q-learning on extended states" if transferable else "Q-learning on τ-states"
    lines = [title, "episodes to the", f"{spec.learning.goal.heading}:"]
    what = {"I": "Method I", "III": "without transfer", "IV": "with transfer"}
    for name in names:
        runs = methods[name]
        found = runs["statistics"]["goal"]
        if found["mean"] is not None:
            lines.append(f"{what[name]} {thousands(found['mean'])}")
        else:
            lines.append(f"{what[name]}: {found['reached']} of {len(runs['episodes'])} runs got there")
    return "\n".join(lines if names else [title, "not carried out"])
