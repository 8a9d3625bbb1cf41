"""Recorded episodes as plain data for a page that plays them: worlds, formulas with their automata, and ticks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.build import timed_automata
from tickwise.automata.interchange import fill, layout
from tickwise.automata.model import UNBOUNDED, Edge, TimedAutomaton
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.gridworld import ACTIONS, HEADINGS
from tickwise.envs.tasks import TaskTable
from tickwise.experiments.recording import PREFIX
from tickwise.experiments.regions import Name, NamedFormula, clip, overlap, plain_primitive, ranges_text, read_formula
from tickwise.experiments.study import StudySpec, environment_of
from tickwise.logic.render import to_english
from tickwise.logic.sdnf import Operator
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Box

_FORMULAS = {"I": "target", "II": "target_without_information", "III": "target", "IV": "target", "source": "source"}
_OWN = PREFIX + "formulas"  # of Method V, which goes from one formula to the next
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_SIGNS = {"<": "<", "<=": "≤", ">": ">", ">=": "≥"}


def playback(results: Mapping[str, Any], spec: StudySpec, methods: Mapping[str, str]) -> dict[str, Any] | None:
    """All that a page needs to play the recorded episodes of a study.

    Args:
        results: The results of the study.
        spec: The study.
        methods: What each method is, in words, in the order in which they are offered.

    Returns:
        Plain data: ``tasks``, ``formulas`` and ``methods``, and the names of ``actions`` and ``headings``; None where
        nothing was recorded, as in run folders of versions that did not record. A method has one of the formulas, or
        each of its points of learning has its own.
    """
    learned = {name: results["methods"].get(name) or [] for name in methods}
    learned["source"] = results["source_learning"]
    titles = {name: f"{name}: {meaning}" for name, meaning in methods.items()} | {"source": "source task: φˢ"}
    recorded = [name for name, runs in learned.items() if any(f"{PREFIX}states" in run for run in runs)]
    if not recorded:
        return None
    tables = {task: environment_of(spec, task).task_table() for task in ("source", "target")}
    formulas = {
        name: _formula(results["summary"]["formulas"][name], spec, name) for name in dict.fromkeys(_FORMULAS.values())
    }
    own = dict.fromkeys(text for name in recorded for run in learned[name] for text in run.get(_OWN, ()))
    formulas |= {text: _formula(text, spec) for text in own}
    played = []
    for name in recorded:
        task = "source" if name == "source" else "target"
        runs = [run for run in learned[name] if f"{PREFIX}states" in run]
        key = _FORMULAS.get(name)
        entry: dict[str, Any] = {"key": name, "title": titles[name], "task": task}
        entry["formula"] = key if key and formulas[key] else None
        entry["follows"] = name != "I"
        entry["runs"] = [{"run": run["run"] + 1, "points": _points(run, tables[task])} for run in runs]
        played.append(entry)
    return {
        "tasks": {name: _task(environment_of(spec, name), table, name) for name, table in tables.items()},
        "formulas": formulas, "methods": played, "actions": ACTIONS, "headings": HEADINGS,
    }  # fmt: skip


def _task(environment: EnvironmentSpec, table: TaskTable, task: str) -> dict[str, Any]:
    """A world and its hidden task."""
    size = environment.world.size
    return {
        "size": size,
        "slip": environment.world.slip,
        "turnFailure": environment.world.turn_failure,
        "deadline": environment.task.deadline,
        "stages": table.stages,
        "landmarks": [
            {
                "name": Name(landmark.label, task[0].upper(), inferred=False).plain,
                "colour": landmark.colour,
                "rectangle": clip(landmark.box, size),
            }
            for landmark in environment.task.landmarks
        ],
    }


def _points(run: Mapping[str, Any], table: TaskTable) -> list[dict[str, Any]]:
    """The episodes of one run at each point of learning."""
    recorded = {name.removeprefix(PREFIX): value for name, value in run.items() if name.startswith(PREFIX)}
    points = []
    for index, learned in enumerate(recorded["at"]):
        evaluation = int(np.searchsorted(run["evaluation_episodes"], learned))
        rows = zip(*(recorded[name][index] for name in ("states", "actions", "disjunct", "returns")), strict=True)
        point: dict[str, Any] = {
            "learned": int(learned),
            "mean": round(float(run["evaluation_returns"][evaluation]), 1),
            "episodes": [_episode(table, *row) for row in rows],
        }
        if _OWN in run:
            point["formula"] = run[_OWN][index]
            point["tested"] = run["collected"] is not None and int(learned) >= run["collected"]
        points.append(point)
    return points


def _episode(
    table: TaskTable, states: NDArray[np.int32], actions: NDArray[np.int8], disjunct: int, total: float
) -> dict[str, Any]:
    """One episode with what the hidden task says at each tick."""
    path = [int(state) for state in states[states >= 0]]
    stages, rewards = [int(table.delta[0, table.letter[path[0]]])], [0.0]
    for t, state in enumerate(path[1:], start=1):
        stages.append(int(table.delta[stages[-1], table.letter[state]]))
        final = float(table.final_reward[stages[-1]]) if t == table.horizon else 0.0
        rewards.append(float(table.reward[stages[-1], state]) + final)
    return {
        "states": path, "actions": [int(action) for action in actions[: len(path) - 1]], "stages": stages,
        "rewards": [round(reward, 3) for reward in rewards], "disjunct": int(disjunct),
        "return": round(float(total), 3), "success": bool(table.success[stages[-1]]),
    }  # fmt: skip


def _formula(text: str | None, spec: StudySpec, key: str = "target") -> dict[str, Any] | None:
    """A formula with its regions and automata."""
    task = "source" if key == "source" else "target"
    environment = environment_of(spec, task)
    formula = read_formula(text, task[0].upper(), environment, primed=key == "target_without_information")
    if formula is None:
        return None
    boxes = list(formula.names)
    return {
        "symbol": formula.symbol,
        "english": to_english(formula.sdnf, {box: name.plain for box, name in formula.names.items()}),
        "regions": [_region(box, formula, environment) for box in boxes],
        "automata": [_automaton(automaton, formula, boxes) for automaton in timed_automata(formula.sdnf)],
    }


def _region(box: Box, formula: NamedFormula, environment: EnvironmentSpec) -> dict[str, Any]:
    """A region, with a 1 for each cell that lies in it, in the order of the cells' numbers."""
    mdp, size = environment.mdp(), environment.world.size
    within = holds(box, mdp.cell_coordinates, mdp.variables)
    shares = [(overlap(box, landmark.box, size), landmark.colour) for landmark in environment.task.landmarks]
    share, colour = max(shares, key=lambda pair: pair[0], default=(0.0, "other"))
    return {
        "name": formula.names[box].plain, "ranges": ranges_text(box), "rectangle": clip(box, size),
        "colour": colour if share > 0 else "other", "cells": "".join("1" if inside else "0" for inside in within),
    }  # fmt: skip


def _automaton(automaton: TimedAutomaton, formula: NamedFormula, boxes: Sequence[Box]) -> dict[str, Any]:
    """A timed automaton, where to draw it, and the parts of its conjunction."""
    names = {box: name.plain for box, name in formula.names.items()}
    literals = [
        {holding: ("" if holding != part.complemented else "¬") + names[part.box] for holding in (True, False)}
        for part in automaton.conjunction.primitives
    ]
    meanings = _meanings(automaton, [literal[True] for literal in literals])
    kinds = [
        "accepting" if q in automaton.accepting else "rejecting" if q in automaton.rejecting else "working"
        for q in range(len(automaton.locations))
    ]
    return {
        "clocks": [clock.translate(_SUBSCRIPTS) for clock in automaton.clocks],
        "initial": automaton.initial,
        "locations": [
            {
                "name": name.translate(_SUBSCRIPTS) if kinds[q] == "working" else name, "kind": kinds[q],
                "stage": automaton.stages[q], "place": place, "fill": fill(automaton, q),
                "active": sorted(automaton.active[q]), "meaning": meanings[q],
            }
            for q, (name, place) in enumerate(zip(automaton.locations, layout(automaton), strict=True))
        ],
        "edges": [edge for each in automaton.edges if (edge := _edge(automaton, each, literals)) is not None],
        "parts": [
            {
                "text": plain_primitive(part, formula.names), "english": to_english(part, names),
                "operator": part.operator.value, "window": [part.window.start, part.window.end],
                "duration": part.duration, "region": boxes.index(part.box), "complemented": part.complemented,
            }
            for part in automaton.conjunction.primitives
        ],
    }  # fmt: skip


def _edge(automaton: TimedAutomaton, edge: Edge, literals: Sequence[Mapping[bool, str]]) -> dict[str, Any] | None:
    """An edge, with its guard as the least and the greatest value of each clock; None if no value satisfies it."""
    ranges = edge.ranges(len(automaton.clocks))
    if any(low > high for low, high in ranges):
        return None
    clocks = [name.translate(_SUBSCRIPTS) for name in automaton.clocks]
    label = [literals[predicate][holding] for predicate, holding in edge.literals]
    for clock in dict.fromkeys(atom.clock for atom in edge.guard):
        atoms = [atom for atom in edge.guard if atom.clock == clock]
        low, high = ranges[clock]
        if len(atoms) == 1:
            label.append(f"{clocks[clock]} {_SIGNS[atoms[0].comparison]} {atoms[0].value}")
        else:
            label.append(f"{low} ≤ {clocks[clock]} ≤ {high}" if low < high else f"{clocks[clock]} = {low}")
    lines = [", ".join(label) or "⊤", *(f"{clocks[clock]} ≔ 0" for clock in sorted(edge.resets))]
    mask, wanted = edge.cube
    return {
        "source": edge.source, "target": edge.target, "mask": mask, "wanted": wanted,
        "ranges": [[low, None if high == UNBOUNDED else high] for low, high in ranges],
        "resets": sorted(edge.resets), "label": lines,
    }  # fmt: skip


_WORKING = {
    Operator.EVENTUALLY: ("waiting for {}",),
    Operator.ALWAYS: ("{} is to hold throughout the window",),
    Operator.EVENTUALLY_ALWAYS: ("waiting for a stay in {}", "within a stay in {}"),
    Operator.ALWAYS_EVENTUALLY: ("no visit to {} is overdue", "away from {}: the time for the next visit is running"),
}
"""What the working locations of each operator mean: the waiting one, and where there is one the second."""


def _meanings(automaton: TimedAutomaton, predicates: Sequence[str]) -> list[str]:
    """What it means to be in each location."""
    meanings = []
    seen: list[int] = []
    for location, stage in enumerate(automaton.stages):
        part = automaton.conjunction.primitives[stage]
        if location in automaton.accepting:
            meanings.append("satisfied")
        elif location in automaton.rejecting:
            meanings.append(f"violated, by {part.operator.symbol} {predicates[stage]}")
        else:
            meanings.append(_WORKING[part.operator][seen.count(stage)].format(predicates[stage]))
            seen.append(stage)
    return meanings
