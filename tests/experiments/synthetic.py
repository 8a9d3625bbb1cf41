"""Made-up results of a study, in the form that figures and the report read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.tasks import ReachStayReach
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.experiments.study import StudySpec
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.syntax import Box

SOURCE = "F[0,17] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[22,40] (7 <= x <= 8 & 5 <= y <= 8)"
TARGET = "F[3,20] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[27,40] (4 <= x <= 7 & 0 <= y <= 2)"
PLAIN = "F[0,21] G[0,4] (5 <= x <= 6 & 6 <= y <= 7) & F[26,40] (0 <= x <= 9 & 0 <= y <= 3)"
METHODS = ("I", "II", "III", "IV", "V")
MIDDLES = {"I": 900_000.0, "II": 9_000_000.0, "III": 12_000.0, "IV": 1_500.0, "V": 250.0}
V_STAR = 96.4


def small(runs: int = 3) -> StudySpec:
    """The first case study with short learning, so that drawing takes little time."""
    most = {"I": 60_000, "II": 60_000, "III": 50_000, "IV": 50_000, "V": 1_500}
    learning = replace(CASE_STUDY_1.learning, most_episodes=most, source_episodes=60_000)
    return replace(CASE_STUDY_1, runs=runs, learning=learning)


def results(
    spec: StudySpec,
    *,
    methods: tuple[str, ...] = METHODS,
    formulas: tuple[str | None, ...] = (SOURCE, TARGET, PLAIN),
) -> dict[str, Any]:
    """Results of a study as `tickwise.experiments.summary` gives them.

    Args:
        spec: The study.
        methods: The methods that there are.
        formulas: Those of the source, the target, and the target without the information gain.
    """
    rng = np.random.default_rng(5)
    source, target, plain = formulas
    learned = {method: [_run(spec, method, run, rng) for run in range(spec.runs)] for method in methods}
    reason = (
        "A formula structurally equivalent with the source's classifies 99.5% of the target's trajectories rightly."
        if target
        else "Logical transferability is not identified: with up to 2 copies the best classification rate is 93.1%."
    )
    collections = [
        {
            "run": run,
            "source": {
                "positives": 26 + run,
                "negatives": 200,
                "candidates": 9_974 - run,
                "episodes": 10_000,
            },
            "target": {"positives": 20, "negatives": 200, "candidates": 17_980, "episodes": 18_000},
        }
        for run in range(spec.runs)
    ]
    command = f"tickwise reproduce {spec.name} --runs {spec.runs} --out runs/{spec.name}"
    return {
        "summary": {
            "study": spec.name, "quick": False, "seed": spec.seed, "runs": spec.runs, "version": "0.1.0",
            "command": command,
            "formulas": {"source": source, "target": target, "target_without_information": plain},
            "transferable": target is not None, "reason": reason,
            "structures": {
                "found": spec.runs, "of": spec.runs, "transferable": spec.runs if target else 0,
                "exact": {"source": 1, "target": 2},
            },
            "goal": spec.learning.goal.text,
            "v_star": V_STAR, "fail": -10.0, "source_v_star": 97.1,
            "methods": {method: _summary(method, runs) for method, runs in learned.items()},
            "ratios": _ratios(learned), "collections": collections,
            "protocols": _protocols(spec, formulas), "seconds": 1234.5,
            "peak_memory_mib": 812.0,
        },
        "collections": collections,
        "inferences": [_inference(run, formulas, reason) for run in range(spec.runs)],
        "data": {"source": _data(spec.source, rng), "target": _data(spec.target, rng)},
        "methods": learned,
        "seconds": {protocol: [1.5 + run for run in range(spec.runs)] for protocol in ("paper", "full")},
        "source_learning": [
            {key: learned_there[key] for key in ("run", "evaluation_episodes", "evaluation_returns")}
            for learned_there in (_run(spec, "source", run, rng) for run in range(spec.runs))
        ],
        "environment": {
            "command": command, "version": "0.1.0", "python": "3.11.7", "numpy": "2.4.6", "numba": "0.68.1",
            "platform": "Linux-6.1-x86_64", "cores": 2, "seconds": 1234.5,
        },
    }  # fmt: skip


def _protocols(spec: StudySpec, formulas: tuple[str | None, ...]) -> dict[str, Any]:
    """Both protocols: the full one is exactly right, the paper's in the target alone."""
    found = {}
    for protocol, of in (("paper", 220), ("full", 16_020)):
        right = {"source": protocol == "full", "target": formulas[1] is not None}
        tasks = {
            task: {
                "formula": formula, "rate": 1 - 3 / of, "errors": 3, "of": of, "exact_regions": right[task],
                "exact": right[task],
            }
            for task, formula in zip(("source", "target"), formulas, strict=False)
        }  # fmt: skip
        runs = [{"run": run, **tasks, "satisfying": True, "transferable": right["target"]} for run in range(spec.runs)]
        exact = {task: spec.runs * right[task] for task in right} | {"both": spec.runs * all(right.values())}
        found[protocol] = {
            "chosen": protocol == spec.protocol, "of": spec.runs, "transferable": spec.runs * right["target"],
            "exact": exact, "runs": runs,
        }  # fmt: skip
    return found


def _grid(spec: StudySpec, episodes: int) -> np.ndarray:
    points = [0]
    while points[-1] < episodes:
        now = points[-1]
        every = next(step for until, step in spec.learning.evaluation_steps if now < until or not until)
        points.append(min(now + every, episodes))
    return np.array(points, dtype=np.int64)


def _run(spec: StudySpec, method: str, run: int, rng: np.random.Generator) -> dict[str, Any]:
    episodes = spec.learning.source_episodes if method == "source" else spec.learning.most_episodes[method]
    middle = MIDDLES.get(method, 20_000.0) * float(np.exp(rng.normal(0, 0.35)))
    ceiling = 0.72 if method == "II" else 0.968

    def success(at: np.ndarray) -> np.ndarray:
        start = 0.35 if method == "IV" else 0.004
        return start + (ceiling - start) / (1 + (middle / np.maximum(at, 1)) ** 1.6)

    block = spec.learning.block
    count = episodes // block
    wins = rng.binomial(block, success((np.arange(count) + 0.5) * block))
    blocks = (-10 + 110 * wins / block).astype(np.float32)
    grid = _grid(spec, episodes)
    # a greedy policy is a little better than the one that still learns
    evaluation = -10 + 110 * np.clip(success(grid * 1.6) + rng.normal(0, 0.02, len(grid)), 0, 0.97)
    there = np.flatnonzero(blocks >= V_STAR)
    levels = {str(level): -10 + level / 100 * (V_STAR + 10) for level in (80, 90, 95)}
    firsts = {level: np.flatnonzero(evaluation >= least) for level, least in levels.items()}
    lasts = {level: np.flatnonzero(evaluation < least) for level, least in levels.items()}
    return {
        "run": run,
        "episodes": episodes,
        "goal": int(there[0] + 1) * block if len(there) else None,
        "settled": int(middle) // block * block,
        "reached": {level: int(grid[found[0]]) if len(found) else None for level, found in firsts.items()},
        "stays": {
            level: int(grid[found[-1] + 1]) if len(found) and found[-1] + 1 < len(grid) else None
            for level, found in lasts.items()
        },
        "window_mean": float(blocks[: spec.learning.window // block].mean()),
        "end_mean": float(blocks[-len(blocks) // 5 :].mean()),
        "final": float(evaluation[-1]),
        "blocks": blocks,
        "evaluation_episodes": grid,
        "evaluation_returns": evaluation,
    }


def _summary(method: str, runs: list[dict[str, Any]]) -> dict[str, Any]:
    columns: dict[str, Any] = {name: [run[name] for run in runs] for name in ("goal", "settled")}
    for measure in ("reached", "stays"):
        for level in ("80", "90", "95"):
            columns[f"{measure}_{level}"] = [run[measure][level] for run in runs]
    statistics: dict[str, Any] = {name: _statistics(values) for name, values in columns.items()}
    means = {name: [run[name] for run in runs] for name in ("window_mean", "end_mean")}
    statistics |= {
        name: {"iqm": float(np.mean(values)), "low": min(values), "high": max(values)} for name, values in means.items()
    }
    columns["final"] = [run["final"] for run in runs]
    spent = [_spent(method, run) for run in runs]
    everything = [None if run["learning"] is None else run["collection"] + run["learning"] for run in spent]
    statistics["target_episodes"] = {
        "collection": _statistics([run["collection"] for run in spent]), "total": _statistics(everything)
    }  # fmt: skip
    loops = {"loops": [_loop(run) for run in runs]} if method == "V" else {}
    episodes = [run["episodes"] for run in runs]
    return {**columns, **means, **loops, "episodes": episodes, "target_episodes": spent, "statistics": statistics}


def _spent(method: str, run: dict[str, Any]) -> dict[str, int | None]:
    collection = {"I": 0, "V": 300}.get(method, 18_000)
    there = run["reached"]["95"]
    return {"collection": collection, "learning": max(there - 300, 0) if method == "V" and there else there}


def _loop(run: dict[str, Any]) -> dict[str, Any]:
    attempt = {"formula": TARGET, "begun": 260, "episodes": 30, "wrong": 0, "good": 28}
    return {
        "run": run["run"], "collected": 300, "first_good": 240, "formula": TARGET, "transferable": True, "reason": "",
        "attempts": [attempt],
    }  # fmt: skip


def _statistics(values: list[int | None]) -> dict[str, Any]:
    there = [value for value in values if value is not None]
    if len(there) < len(values):
        return {"mean": None, "low": None, "high": None, "median": None, "reached": len(there)}
    mean = float(np.mean(there))
    return {
        "mean": mean, "low": 0.8 * mean, "high": 1.3 * mean, "median": float(np.median(there)),
        "reached": len(there),
    }  # fmt: skip


def _ratios(learned: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    ratios: dict[str, Any] = {}
    for slow, fast in (("I", "III"), ("III", "IV")):
        if slow in learned and fast in learned:
            values = [run["goal"] for run in learned[slow]]
            others = [run["goal"] for run in learned[fast]]
            censored = None in values
            value = None
            if None not in others:
                limit = learned[slow][0]["episodes"]
                value = float(np.mean([item or limit for item in values]) / np.mean(others))
            ratios[f"{slow}/{fast}"] = {
                measure: {"value": value, "at_least": censored} for measure in ("goal", "reached_90")
            }
    return ratios


def _inference(run: int, formulas: tuple[str | None, ...], reason: str) -> dict[str, Any]:
    source, target, plain = formulas
    fit = {"rate": 0.995, "gain": 0.21, "size": 2, "satisfying": True}
    nothing = {"rate": None, "gain": None, "size": None, "satisfying": False}
    return {
        "run": run,
        "source": {"formula": source, **(fit if source else nothing), "tree": tree(source)},
        "target": {
            "formula": target, "transferable": target is not None, "reason": reason,
            "attempts": [{"formula": target or TARGET, **fit, "satisfying": bool(target)}] if source else [],
        },
        "target_without_information": {"formula": plain, **fit} if plain else None,
        "seconds": 3.25,
    }  # fmt: skip


def tree(source: str | None) -> dict[str, Any]:
    """A decision tree of depth 2 whose leaves give the source's formula, or a single leaf of label -1."""
    if source is None:
        return leaf(-1, "true", 3, 200, "I")
    first, second = source.split(" & F[")[0], "F[" + source.split(" & F[")[1]
    outside = "G[0,17] F[0,4] !(3 <= x <= 4 & 3 <= y <= 5)"
    below = inner(
        second, first, 26, 5, leaf(1, f"{first} & {second}", 26, 0, "I"),
        leaf(-1, f"{first} & G[22,40] !(7 <= x <= 8 & 5 <= y <= 8)", 0, 5, "I"),
    )  # fmt: skip
    return inner(first, "true", 26, 200, below, leaf(-1, outside, 0, 195, "I"))


def inner(
    formula: str, path: str, positives: int, negatives: int, left: dict[str, Any], right: dict[str, Any]
) -> dict[str, Any]:
    """A node that splits."""
    return {
        "label": None, "formula": formula, "path": path, "positives": positives, "negatives": negatives,
        "objective": 0.981, "rate": 0.978, "gain": 0.29, "left": left, "right": right, "stop": None,
    }  # fmt: skip


def leaf(label: int, path: str, positives: int, negatives: int, stop: str) -> dict[str, Any]:
    """A node that does not."""
    return {
        "label": label, "formula": None, "path": path, "positives": positives, "negatives": negatives,
        "objective": None, "rate": None, "gain": None, "left": None, "right": None, "stop": stop,
    }  # fmt: skip


def _data(environment: EnvironmentSpec, rng: np.random.Generator) -> LabelledTrajectories:
    """Walks from cell to cell; those with label 1 stay in the first region and end in the second."""
    task, size = environment.task, environment.world.size
    assert isinstance(task, ReachStayReach)
    rows = [_walk(task, size, rng) for _ in range(20)] + [_stroll(task.deadline, size, rng) for _ in range(40)]
    return LabelledTrajectories.from_arrays(rows, [1] * 20 + [-1] * 40, variables=("x", "y"))


def _walk(task: ReachStayReach, size: int, rng: np.random.Generator) -> np.ndarray:
    cells = [rng.integers(size, size=2)]
    _go(cells, _cell(task.first, rng), rng)
    cells += [cells[-1]] * (task.stay + 1)
    _go(cells, _cell(task.second, rng), rng)
    while len(cells) <= task.deadline:
        cells.append(cells[-1])
    return np.array(cells[: task.deadline + 1]) + 0.5


def _stroll(deadline: int, size: int, rng: np.random.Generator) -> np.ndarray:
    steps = rng.integers(-1, 2, size=(deadline, 2))
    cells = [rng.integers(size, size=2)]
    for step in steps:
        cells.append(np.clip(cells[-1] + step, 0, size - 1))
    return np.array(cells) + 0.5


def _cell(box: Box, rng: np.random.Generator) -> np.ndarray:
    return np.array([rng.integers(int(bound.lower), int(bound.upper)) for bound in box.bounds])


def _go(cells: list[np.ndarray], goal: np.ndarray, rng: np.random.Generator) -> None:
    while (cells[-1] != goal).any():
        axis = int(rng.choice(np.flatnonzero(cells[-1] != goal)))
        step = np.zeros(2, dtype=int)
        step[axis] = np.sign(goal[axis] - cells[-1][axis])
        cells.append(cells[-1] + step)
