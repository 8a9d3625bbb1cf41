"""Verdicts and robustness of a formula on many trajectories, beside C and rtamt.

    python benchmarks/satisfaction.py [--quick]

The formula is that of Case Study 1, the trajectories are walks over its world, float64, 41 ticks, x and y. One core;
each time is the best of several repetitions, contenders in turn. What is timed:

- *kernel, encoded*: the compiled program on trajectories that were compared with the boxes before, a bit each;
- *kernel, arrays*: from the array of states, the search for NaN and the comparisons included;
- *verdict*, *robustness*: the public calls on the same array;
- *C loop*: `satisfaction.c`, written by hand for this formula; it stops reading a trajectory when it knows the answer;
- *C bits*: the same steps as the kernel's, by hand for this formula;
- *rtamt*: parsed once, then one evaluation for each trajectory, as its interface asks; it gives robustness.

The answers are compared; where they differ the script ends with an error. Without a C compiler (``CC``, ``cc`` or
``gcc``) or rtamt there are fewer contenders.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise.logic import bits
from tickwise.logic.parse import parse
from tickwise.logic.program import program
from tickwise.logic.syntax import Formula

FORMULA = "F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)"
RTAMT = (
    "(eventually[1:15] (always[0:4] ((x >= 3) and (x <= 4) and (y >= 3) and (y <= 5)))) and "
    "(eventually[21:39] ((x >= 7) and (x <= 8) and (y >= 5) and (y <= 8)))"
)
CASE_STUDY = 246
TICKS = 41

Array = NDArray[Any]
Contender = Callable[[], Array]


class Row(NamedTuple):
    """One time.

    Attributes:
        benchmark: What was done.
        size: The number of trajectories, or of ticks where these grow.
        contender: Who did it.
        seconds: The best time.
    """

    benchmark: str
    size: int
    contender: str
    seconds: float


def measure(quick: bool = False) -> list[Row]:
    """All times; fewer trajectories and repetitions where it has to be quick."""
    phi = parse(FORMULA)
    with tempfile.TemporaryDirectory() as folder:
        c = compile_c(Path(folder))
        rows = case_study(phi, c, 100 if quick else 2000)
        rows += more_trajectories(phi, c, range(2, 5 if quick else 7))
    return rows + more_ticks((40, 400) if quick else (40, 100, 400, 1000, 4000))


def case_study(phi: Formula, c: dict[str, Any], repetitions: int) -> list[Row]:
    """The trajectories of the case study."""
    states = walks(CASE_STUDY, TICKS)
    contenders = {"kernel, encoded": encoded_kernel(phi, states), "kernel, arrays": array_kernel(phi, states)}
    contenders |= public(phi, states) | by_hand(c, states)
    times = best(contenders, repetitions)
    if find_spec("rtamt") is not None:
        times |= best({"rtamt": rtamt_robustness(states, phi)}, 3)
    return [Row("Case Study 1", CASE_STUDY, *one) for one in times.items()]


def more_trajectories(phi: Formula, c: dict[str, Any], powers: range) -> list[Row]:
    """Ever more trajectories of the same length."""
    rows = []
    for power in powers:
        states = walks(10**power, TICKS)
        contenders = {"kernel, arrays": array_kernel(phi, states)} | public(phi, states) | by_hand(c, states)
        times = best(contenders, max(5, 10 ** (5 - power)))
        rows += [Row("trajectories of 41 ticks", len(states), *one) for one in times.items()]
    return rows


def more_ticks(sizes: tuple[int, ...]) -> list[Row]:
    """A thousand ever longer trajectories, with windows that grow with them."""
    rows = []
    for ticks in sizes:
        early, stay, late = ticks // 3, ticks // 10, ticks // 2
        phi = parse(
            FORMULA.replace("1,15", f"1,{early}").replace("0,4", f"0,{stay}").replace("21,39", f"{late},{ticks - 1}")
        )
        times = best(public(phi, walks(1000, ticks)), 10)
        rows += [Row("ticks of 1,000 trajectories", ticks, *one) for one in times.items()]
    return rows


def walks(count: int, ticks: int) -> NDArray[np.float64]:
    """Walks over the cells of a 9 by 9 world: stay, or go to a neighbour; shape (count, ticks, 2)."""
    rng = np.random.default_rng(0)
    moves = np.array([(0, 0), (0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)], dtype=np.int8)
    states = np.empty((count, ticks, 2))
    cells = rng.integers(0, 9, size=(count, 2), dtype=np.int8)
    for tick in range(ticks):
        states[:, tick] = cells + 0.5
        cells = np.clip(cells + moves[rng.integers(0, len(moves), size=count)], 0, 8)
    return states


def encoded_kernel(phi: Formula, states: NDArray[np.float64]) -> Contender:
    """The program on codes that were made before."""
    compiled = program(phi, states.shape[1])
    count, rows = len(states), states.reshape(len(states), -1)
    codes = np.empty((len(compiled.boxes), bits.words_of(compiled.lower.shape[1]), count), dtype=np.uint64)
    signals = np.empty((compiled.depth, len(compiled.pattern), count), dtype=np.uint64)
    ends = np.full(count, rows.shape[1])
    bits.encode(rows, 0, count, compiled.stride, compiled.spans, compiled.lower, compiled.upper, codes)
    arguments = (
        compiled.code,
        compiled.stride,
        compiled.pattern,
        compiled.spans,
        codes,
        ends,
        bits.NONE,
        True,
        signals,
    )

    def run() -> Array:
        bits.evaluate(*arguments, count)
        return signals[0, 0]  # compared outside the time: bit 0

    return run


def array_kernel(phi: Formula, states: NDArray[np.float64]) -> Contender:
    """The whole kernel, without the public call around it."""
    compiled = program(phi, states.shape[1])
    rows, lengths = states.reshape(len(states), -1), np.full(len(states), states.shape[1])
    answers = np.empty(len(states), dtype=np.int8)

    def run() -> Array:
        bits.verdicts(rows, lengths, answers, *compiled.for_verdicts)
        return answers

    return run


def public(phi: Formula, states: NDArray[np.float64]) -> dict[str, Contender]:
    """The public calls."""
    return {
        "verdict": lambda: np.asarray(phi.verdict(states)),
        "robustness": lambda: np.asarray(phi.robustness(states)),
    }


def compile_c(folder: Path) -> dict[str, Any]:
    """The functions of the C library by their names here; none where there is no compiler."""
    compiler = next(filter(None, map(shutil.which, (os.environ.get("CC", "cc"), "gcc"))), None)
    if compiler is None:
        return {}
    library, source = folder / "satisfaction.so", Path(__file__).with_suffix(".c")
    subprocess.run([compiler, "-O3", "-march=native", "-shared", "-fPIC", "-o", library, source], check=True)
    functions = ctypes.CDLL(str(library))
    for name in ("loop", "bits"):
        getattr(functions, name).argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p]
    functions.loop.restype, functions.bits.restype = None, ctypes.c_int64
    return {"C loop": functions.loop, "C bits": functions.bits}


def by_hand(c: dict[str, Any], states: NDArray[np.float64]) -> dict[str, Contender]:
    """The C functions on an array."""
    return {name: one_by_hand(function, states) for name, function in c.items()}


def one_by_hand(function: Any, states: NDArray[np.float64]) -> Contender:
    answers = np.empty(len(states), dtype=np.int8)
    arguments = (states.ctypes.data, *states.shape[:2], answers.ctypes.data)

    def run() -> Array:
        function(*arguments)
        return answers

    return run


def rtamt_robustness(states: NDArray[np.float64], phi: Formula) -> Contender:
    """Rtamt on one trajectory after the other; its numbers have to be ours."""
    import rtamt

    specification = rtamt.StlDiscreteTimeSpecification()
    specification.declare_var("x", "float")
    specification.declare_var("y", "float")
    specification.spec = RTAMT
    specification.parse()
    time_axis = list(range(states.shape[1]))
    data = [{"time": time_axis, "x": one[:, 0].tolist(), "y": one[:, 1].tolist()} for one in states]

    def run() -> Array:
        return np.array([specification.evaluate(one)[0][1] for one in data])

    if not np.array_equal(run(), np.asarray(phi.robustness(states))):
        raise SystemExit("rtamt gives another robustness; the comparison is of different work")
    return run


def best(contenders: dict[str, Contender], repetitions: int) -> dict[str, float]:
    """The best time of each, taken in turn; their answers have to be the same."""
    said = {name: satisfied(name, run()) for name, run in contenders.items()}
    expected = next(iter(said.values()))
    for name, answers in said.items():
        if name not in ("robustness", "rtamt") and not np.array_equal(answers, expected):
            raise SystemExit(f"{name} gives other answers than {next(iter(said))}; they do not do the same work")
    times = dict.fromkeys(contenders, float("inf"))
    for _ in range(repetitions):
        for name, run in contenders.items():
            begin = time.perf_counter()
            run()
            times[name] = min(times[name], time.perf_counter() - begin)
    return times


def satisfied(name: str, answers: Array) -> NDArray[np.bool_]:
    """Which trajectories satisfy the formula: bit 0 of a word, or a positive number."""
    return (answers & np.uint64(1)) == 1 if name == "kernel, encoded" else answers > 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer trajectories and repetitions")
    rows = measure(parser.parse_args().quick)
    print(f"{'benchmark':29}{'size':>10}  {'contender':17}{'seconds':>12}{'ns a tick':>11}")
    for row in rows:
        ticks = 1000 * row.size if row.benchmark.startswith("ticks") else TICKS * row.size
        print(
            f"{row.benchmark:29}{row.size:>10,}  {row.contender:17}{row.seconds:12.3g}{row.seconds / ticks * 1e9:11.3f}"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
