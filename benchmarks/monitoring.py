"""The verdict and the robustness of a formula on many trajectories, beside C and the libraries that monitor it.

The formula is that of Case Study 1's source; where trajectories grow longer, its windows grow with them. `monitoring.c`
is written by hand for this formula; it stops reading a trajectory when it knows the answer. Each library is given the
trajectories in the form that it wants, which is not timed, and answers for one after the other, since none takes a
batch. Their answers have to be ours. metric-temporal-logic and mstlo give verdicts, the former for every tick; rtamt
and stlpy give the robustness alone, which is positive where the verdict is true.

At the size of the case study there are the kernels alone as well: from arrays, with the search for NaN and the
comparisons with the boxes, and coded, where these comparisons were made before, a bit each.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.contest import Contender, Turn, contest
from benchmarks.native import library, pointer
from benchmarks.result import OURS, Result
from tickwise.logic import bits
from tickwise.logic.parse import parse
from tickwise.logic.program import program

COUNTS = (100, 1_000, 10_000, 100_000, 1_000_000)
TICKS = (40, 120, 400, 1_200, 4_000)
MOST_FOR_PEERS = 100
CASE_STUDY = 246
"""Trajectories of 41 ticks."""
G, Y = ((3, 4), (3, 5)), ((7, 8), (5, 8))
"""The regions, a range of x and one of y."""


@dataclass(frozen=True, slots=True)
class Windows:
    """The numbers of the formula: ◇[1,first] □[0,stay] G ∧ ◇[second,last] Y."""

    first: int
    stay: int
    second: int
    last: int

    @classmethod
    def fitting(cls, ticks: int) -> Windows:
        """Those of the case study for 41 ticks, and others in proportion."""
        return cls(15 * ticks // 41, max(1, 4 * ticks // 41), 21 * ticks // 41, ticks - 2)

    def __str__(self) -> str:
        g, y = (f"({a} <= x <= {b} & {c} <= y <= {d})" for (a, b), (c, d) in (G, Y))
        return f"F[1,{self.first}] G[0,{self.stay}] {g} & F[{self.second},{self.last}] {y}"


def walks(count: int, ticks: int) -> NDArray[np.float64]:
    """Random walks in a 9×9 world, drawn to G and then to Y often enough that some satisfy the formula."""
    rng = np.random.default_rng(0)
    half = ticks // 2
    states = np.empty((count, ticks, 2))
    cells = rng.integers(0, 9, size=(count, 2))
    goals = np.array([(3, 3), (7, 6)])
    for tick in range(ticks):
        states[:, tick] = cells + 0.5
        drawn = rng.random((count, 1)) < 0.6
        towards = np.sign(goals[int(tick > half)] - cells)
        cells = np.clip(cells + np.where(drawn, towards, rng.integers(-1, 2, size=(count, 2))), 0, 8)
    return states


Check = Callable[[Any], bool | float]
Maker = Callable[[Windows, NDArray[np.float64]], tuple[Check, Iterable[Any]]]


def one_by_one(make: Maker, windows: Windows, states: NDArray[np.float64]) -> Turn:
    """The answers by a check of one trajectory in the library's own form."""
    with warnings.catch_warnings(action="ignore"):  # old libraries in a young Python
        check, trajectories = make(windows, states)
    kept = list(trajectories)
    return lambda: np.array([check(one) for one in kept])


def verdicts(windows: Windows, states: NDArray[np.float64]) -> Turn:
    phi = parse(str(windows))
    return lambda: phi.verdict(states, variables=("x", "y")) == 1


def robustness(windows: Windows, states: NDArray[np.float64]) -> Turn:
    phi = parse(str(windows))
    return lambda: phi.robustness(states, variables=("x", "y"))


def kernel(windows: Windows, states: NDArray[np.float64]) -> Turn:
    """The kernel from arrays, without the public call around it."""
    compiled = program(parse(str(windows)), states.shape[1])
    rows, lengths = states.reshape(len(states), -1), np.full(len(states), states.shape[1])
    answers = np.empty(len(states), dtype=np.int8)

    def turn() -> NDArray[np.bool_]:
        bits.verdicts(rows, lengths, answers, *compiled.for_verdicts)
        return answers == 1

    return turn


def coded_kernel(windows: Windows, states: NDArray[np.float64]) -> Turn:
    """The kernel on trajectories that were compared with the boxes before."""
    compiled = program(parse(str(windows)), states.shape[1])
    count, rows = len(states), states.reshape(len(states), -1)
    codes = np.empty((len(compiled.boxes), bits.words_of(compiled.lower.shape[1]), count), dtype=np.uint64)
    signals = np.empty((compiled.depth, len(compiled.pattern), count), dtype=np.uint64)
    bits.encode(rows, 0, count, compiled.stride, compiled.spans, compiled.lower, compiled.upper, codes)
    ends = np.full(count, rows.shape[1])
    arguments = compiled.code, compiled.stride, compiled.pattern, compiled.spans, codes, ends

    def turn() -> NDArray[np.bool_]:
        bits.evaluate(*arguments, bits.NONE, True, signals, count)
        return signals[0, 0] & np.uint64(1) == 1

    return turn


def in_c(windows: Windows, states: NDArray[np.float64]) -> Turn:
    function = library("monitoring").verdicts
    function.restype = None
    answers = np.empty(len(states), dtype=np.int8)
    numbers = (*states.shape[:2], windows.first, windows.stay, windows.second, windows.last)
    arguments = (pointer(states), *map(ctypes.c_long, numbers), pointer(answers))

    def turn() -> NDArray[np.bool_]:
        function(*arguments)
        return answers == 1

    return turn


def rtamt(windows: Windows, states: NDArray[np.float64]) -> tuple[Check, Iterable[Any]]:
    specification = importlib.import_module("rtamt").StlDiscreteTimeSpecification()
    for name in ("x", "y"):
        specification.declare_var(name, "float")
    g, y = (f"((x >= {a}) and (x <= {b}) and (y >= {c}) and (y <= {d}))" for (a, b), (c, d) in (G, Y))
    specification.spec = (
        f"(eventually[1:{windows.first}] (always[0:{windows.stay}] {g})) and "
        f"(eventually[{windows.second}:{windows.last}] {y})"
    )
    specification.parse()
    times = list(range(states.shape[1]))
    data = ({"time": times, "x": one[:, 0].tolist(), "y": one[:, 1].tolist()} for one in states)
    return lambda one: specification.evaluate(one)[0][1], data


def metric_temporal_logic(windows: Windows, states: NDArray[np.float64]) -> tuple[Check, Iterable[Any]]:
    """It takes truths rather than numbers, and an interval without its end."""
    parse_theirs = importlib.import_module("mtl").parse
    phi = parse_theirs(
        f"((F[1,{windows.first + 1}] (G[0,{windows.stay + 1}] g)) & (F[{windows.second},{windows.last + 1}] y))"
    )
    signals = {name: truths(states, region) for name, region in (("g", G), ("y", Y))}
    data = (
        {name: list(enumerate(truth[index].tolist())) for name, truth in signals.items()}
        for index in range(len(states))
    )
    return lambda one: bool(phi(one, quantitative=False)), data


def stlpy(windows: Windows, states: NDArray[np.float64]) -> tuple[Check, Iterable[Any]]:
    predicate = importlib.import_module("stlpy.STL").LinearPredicate

    def box(region: tuple[tuple[int, int], ...]) -> Any:
        sides = []
        for axis, (low, high) in enumerate(region):
            unit = np.eye(2)[axis : axis + 1]
            sides += [predicate(unit, np.array([low])), predicate(-unit, np.array([-high]))]
        return sides[0] & sides[1] & sides[2] & sides[3]

    phi = box(G).always(0, windows.stay).eventually(1, windows.first) & box(Y).eventually(windows.second, windows.last)
    return lambda one: float(phi.robustness(one, 0)[0]), (np.ascontiguousarray(one.T) for one in states)


def mstlo(windows: Windows, states: NDArray[np.float64]) -> tuple[Check, Iterable[Any]]:
    library = importlib.import_module("mstlo_python")
    g, y = (f"((x >= {a} and x <= {b}) and (y >= {c} and y <= {d}))" for (a, b), (c, d) in (G, Y))
    phi = library.parse_formula(
        f"(F[1,{windows.first}](G[0,{windows.stay}]{g})) and (F[{windows.second},{windows.last}]{y})"
    )

    def check(one: Any) -> bool:
        verdicts = library.Monitor(phi, semantics="DelayedQualitative").update_batch(one).verdicts()
        return bool(verdicts[0][1])

    data = (
        {name: [(value, float(tick)) for tick, value in enumerate(one[:, column].tolist())]
         for column, name in enumerate(("x", "y"))}
        for one in states
    )  # fmt: skip
    return check, data


def truths(states: NDArray[np.float64], region: tuple[tuple[int, int], ...]) -> NDArray[np.bool_]:
    """Where each trajectory is in a region, shape (n, ticks)."""
    low, high = np.array(region, dtype=float).T
    return ((states >= low) & (states <= high)).all(axis=2)


class Peer(NamedTuple):
    """A library: how it is asked, how often it is timed, and for trajectories of how many ticks at most."""

    make: Maker
    repetitions: int
    most_ticks: int


VERDICTS = {"metric-temporal-logic": Peer(metric_temporal_logic, 1, 41), "mstlo": Peer(mstlo, 3, 4_000)}
ROBUSTNESS = {"rtamt": Peer(rtamt, 3, 400), "stlpy": Peer(stlpy, 3, 120)}


def peers(those: dict[str, Peer], windows: Windows, states: NDArray[np.float64]) -> list[Contender]:
    """The libraries, for no more than a hundred trajectories and not too long ones."""
    count, ticks = states.shape[:2]
    return [
        Contender(name, functools.partial(one_by_one, peer.make, windows, states), 1, peer.repetitions)
        for name, peer in those.items()
        if count <= MOST_FOR_PEERS and ticks <= peer.most_ticks
    ]


def compare(count: int, ticks: int, axis: str, unit: str) -> list[Result]:
    """All contenders on so many trajectories."""
    windows, states = Windows.fitting(ticks), walks(count, ticks)
    size = count if axis == "trajectories" else ticks
    rounds = max(1, 1_000_000 // (count * ticks))
    ours, robust, c = (
        Contender(name, functools.partial(turn, windows, states), 1, 5, rounds=rounds)
        for name, turn in ((OURS, verdicts), (OURS, robustness), ("C", in_c))
    )
    those = [ours, c, *peers(VERDICTS, windows, states)]
    results = contest("verdicts", unit, those, axis=axis, size=size, agree=np.array_equal)
    those = [robust, *peers(ROBUSTNESS, windows, states)]
    return results + contest("robustness", unit, those, axis=axis, size=size, agree=np.allclose)


def case_study() -> list[Result]:
    """One formula on the trajectories of the case study."""
    windows, states = Windows.fitting(41), walks(CASE_STUDY, 41)
    turns = {OURS: verdicts, "kernel, arrays": kernel, "kernel, coded": coded_kernel, "C": in_c}
    those = [
        Contender(name, functools.partial(turn, windows, states), 1, 5, rounds=2_000) for name, turn in turns.items()
    ]

    def positive(windows: Windows, states: NDArray[np.float64]) -> tuple[Check, Iterable[Any]]:
        check, trajectories = rtamt(windows, states)
        return lambda one: check(one) > 0, trajectories

    those.append(Contender("rtamt", functools.partial(one_by_one, positive, windows, states), 1, 3))
    return contest("one formula", f"{CASE_STUDY} trajectories", those, agree=np.array_equal)


def measure(quick: bool) -> list[Result]:
    results = case_study()
    for count in (10, 200) if quick else COUNTS:
        results += compare(count, 41, "trajectories", "batch")
    count = 10 if quick else MOST_FOR_PEERS
    for ticks in TICKS[:2] if quick else TICKS:
        results += compare(count, ticks, "ticks", f"{count} trajectories")
    return results
