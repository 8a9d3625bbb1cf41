"""Steps per second of the compiled learning loop, beside the same loop in C.

    python benchmarks/learning.py [--episodes 15000] [--repetitions 41]

The world is the target of Case Study 1, the agent's states are the extended states of its formula, and ε is
0.02. `learning.c` is the same algorithm over the same tables and draws from the same generator (NumPy's
PCG64, inlined), so that both take the very same steps: their Q-tables are compared bit for bit. The two run
in turn, each time from a fresh Q-table, in processor time. Without a C compiler (``CC``, ``cc`` or ``gcc``)
there is nothing to compare with; the script says so and ends.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.build import timed_automata
from tickwise.envs.catalog import CASE_STUDY_1_TARGET
from tickwise.logic.parse import parse
from tickwise.rl.kernels import greedy_returns
from tickwise.rl.qlearning import Problem, QSettings, learn
from tickwise.rl.states import automaton_memory
from tickwise.rl.stream import take_stream

FORMULA = "F[0,22] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[31,40] (4 <= x <= 7 & 0 <= y <= 2)"
SETTINGS = QSettings(epsilon=0.02)
# Fused multiply-adds would round differently from ours; without them the results can be compared bit for bit.
FLAGS = ("-O3", "-march=native", "-ffp-contract=off")


class Run(NamedTuple):
    """One repetition: processor seconds of learning and of greedy play, and the Q-table."""

    learning: float
    playing: float
    q: NDArray[np.float32]


def build_problem() -> Problem:
    mdp = CASE_STUDY_1_TARGET.mdp()
    tables = [automaton.compile() for automaton in timed_automata(parse(FORMULA))]
    return Problem(mdp, CASE_STUDY_1_TARGET.task_table(), automaton_memory(mdp, tables))


def compile_c(folder: Path) -> Path | None:
    """The C program, or None where there is no compiler."""
    compiler = next(filter(None, map(shutil.which, (os.environ.get("CC", "cc"), "gcc"))), None)
    if compiler is None:
        return None
    program = folder / "learning"
    subprocess.run([compiler, *FLAGS, "-o", str(program), str(Path(__file__).with_suffix(".c"))], check=True)
    return program


def generators() -> tuple[np.random.Generator, np.random.Generator]:
    """Fresh generators for learning and for playing."""
    return np.random.default_rng(0), np.random.default_rng(1)


def dump(problem: Problem, path: Path) -> None:
    """Write what the C program reads, in its order."""
    mdp, task, memory = problem.mdp, problem.task, problem.memory
    sizes = (
        *mdp.successor.shape, task.delta.shape[1], memory.delta.shape[1], memory.n_states, task.n_states,
        task.horizon,
    )  # fmt: skip
    states = [rng.bit_generator.state["state"] for rng in generators()]
    words = [half for state in states for name in ("state", "inc") for half in divmod(state[name], 2**64)]
    arrays = (
        np.array(sizes, dtype=np.int32),
        np.array([SETTINGS.alpha, SETTINGS.gamma, SETTINGS.epsilon, SETTINGS.initial]),
        np.array(words, dtype=np.uint64),
        *(array for array in problem.arrays if isinstance(array, np.ndarray)),
    )
    path.write_bytes(b"".join(array.tobytes() for array in arrays))


def run_ours(problem: Problem, episodes: int) -> Run:
    learner, player = generators()
    q, returns = problem.initial_q(SETTINGS), np.empty(episodes, dtype=np.float32)
    begin = time.process_time()
    learn(problem, q, SETTINGS, learner, episodes)
    learned = time.process_time()
    greedy_returns(*problem.arrays, take_stream(player), q, returns)
    return Run(learned - begin, time.process_time() - learned, q)


def run_c(program: Path, tables: Path, problem: Problem, episodes: int) -> Run:
    out = tables.with_name("q.bin")
    done = subprocess.run([program, tables, str(episodes), out], check=True, capture_output=True, text=True)
    learning, playing, _ = map(float, done.stdout.split())
    return Run(learning, playing, np.fromfile(out, dtype=np.float32).reshape(problem.initial_q(SETTINGS).shape))


def report(problem: Problem, steps: int, ours: list[Run], c: list[Run]) -> None:
    memory_states, states, actions = problem.initial_q(SETTINGS).shape
    print(f"{memory_states} memory states, {states} states, {actions} actions")
    print(f"{steps:,} steps a repetition, {len(ours)} repetitions in turn, medians; the Q-tables are equal")
    print(f"{'million steps per second':26}{'tickwise':>10}{'C':>10}{'ratio':>8}")
    for field, label in (("learning", "Q-learning"), ("playing", "greedy evaluation")):
        seconds = [statistics.median(getattr(run, field) for run in runs) for runs in (ours, c)]
        rates = [steps / each / 1e6 for each in seconds]
        print(f"{label:26}{rates[0]:10.1f}{rates[1]:10.1f}{rates[0] / rates[1]:8.2f}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=15_000, help="episodes of 40 steps in a repetition")
    parser.add_argument("--repetitions", type=int, default=41)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        program, tables = compile_c(Path(name)), Path(name) / "tables.bin"
        if program is None:
            print("skipped: there is no C compiler; install one, or name it in CC")
            return 0
        problem = build_problem()
        dump(problem, tables)
        run_ours(problem, 1)  # compiles
        ours, c = [], []
        for _ in range(options.repetitions):
            ours.append(run_ours(problem, options.episodes))
            c.append(run_c(program, tables, problem, options.episodes))
            if not np.array_equal(ours[-1].q, c[-1].q):
                print("the two Q-tables differ: they do not do the same work", file=sys.stderr)
                return 1
    report(problem, options.episodes * problem.task.horizon, ours, c)
    return 0


if __name__ == "__main__":
    sys.exit(main())
