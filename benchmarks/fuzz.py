"""Fuzz the readers: formulas, CSV, NPZ, Parquet and JSON that are nearly right, from a seed, in this process.

Whatever is read, a reader gives a result or raises a `TickwiseError` of one line (a parse error adds a line and its
caret). Anything else is an escape; so is an input that takes longer than ``--slow`` seconds. What escaped is kept in
``--out`` with its traceback, as a reproducer.

Run it as ``python benchmarks/fuzz.py --seconds 600``; ``--seed``, ``--only``, ``--out`` and ``--slow`` are options.
"""

from __future__ import annotations

import argparse
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks import mutation
from tickwise.automata.build import timed_automata
from tickwise.automata.interchange import from_json, to_json
from tickwise.errors import ParseError, TickwiseError
from tickwise.inference.reading import read_trajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf

LONGEST_MESSAGE = 1_000
"""The most characters of a message, without the path: a person has to read it."""

Content = str | bytes


class SlowError(BaseException):
    """An input took too long; no handler of the code under test catches it."""


class BrokenPromiseError(Exception):
    """What was read does not do what it should, or a message is not one that a person can read."""


@dataclass(frozen=True, slots=True)
class Target:
    """Something that reads.

    Attributes:
        make: An input, from a source of randomness.
        read: Reads an input; the folder is for files.
    """

    make: Callable[[random.Random], Content]
    read: Callable[[Content, Path], None]


@dataclass(slots=True)
class Tally:
    """What came of a target's inputs.

    Attributes:
        outcomes: How often each outcome came: ``accepted``, or the error's class.
        seconds: The time that reading took.
        escapes: The reproducers of what escaped, one for each kind.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    escapes: dict[str, Path] = field(default_factory=dict)

    @property
    def inputs(self) -> int:
        """How many inputs there were."""
        return self.outcomes.total()


def _read_formula(text: Content, _: Path) -> None:
    phi = parse(text)  # type: ignore[arg-type]
    if parse(str(phi)) != phi:
        raise BrokenPromiseError(f"{phi} parses to another formula")
    to_sdnf(phi)


def _read_json(text: Content, _: Path) -> None:
    automaton = from_json(text)  # type: ignore[arg-type]
    if from_json(to_json(automaton)) != automaton:
        raise BrokenPromiseError("an automaton that was read is written as another one")
    automaton.compile()


def _reader(name: str) -> Callable[[Content, Path], None]:
    def read(content: Content, folder: Path) -> None:
        file = folder / name
        file.write_bytes(content)  # type: ignore[arg-type]
        read_trajectories(file, labelled=file.stat().st_size % 2 == 0)

    return read


def _valid_json() -> list[str]:
    formulas = ("F[0,2] (x >= 3)", "G[1,4] F[0,3] (0 <= x <= 2 & y < 1)", "F[1,5] G[0,4] (x > 3) & F[10,20] !(y <= 2)")
    return [to_json(each) for text in formulas for each in timed_automata(parse(text))]


def targets() -> dict[str, Target]:
    """What is fuzzed; Parquet where it can be read."""
    valid = _valid_json()
    found = {
        "formula": Target(mutation.formula_text, _read_formula),
        "csv": Target(mutation.csv_text, _reader("input.csv")),
        "npz": Target(mutation.npz_archive, _reader("input.npz")),
        "json": Target(lambda rng: mutation.json_text(rng, valid), _read_json),
    }
    if find_spec("pyarrow"):
        found["parquet"] = Target(mutation.parquet_file, _reader("input.parquet"))
    return found


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    """Raise `SlowError` in what takes longer; not on systems without timers."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def ring(*_: Any) -> None:
        raise SlowError(f"longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def attempt(target: Target, content: Content, folder: Path, slow: float) -> tuple[str, BaseException | None]:
    """Read one input.

    Returns:
        The outcome, and what escaped.
    """
    try:
        with _limit(slow):
            target.read(content, folder)
    except TickwiseError as error:
        message = str(error).replace(str(folder), "")
        lines = message.split("\n")
        caret = isinstance(error, ParseError) and len(lines) == 3 and lines[2].strip() == "^"
        if not caret and len(message.splitlines()) != 1:
            return type(error).__name__, BrokenPromiseError(f"a message of several lines: {message!r:.300}")
        if len(message) > LONGEST_MESSAGE:
            return type(error).__name__, BrokenPromiseError(f"a long message: {message[:300]}")
        return type(error).__name__, None
    except (Exception, SlowError) as error:
        return type(error).__name__, error
    return "accepted", None


def fuzz(
    seconds: float, seed: int = 0, only: Sequence[str] = (), out: Path | None = None, slow: float = 20.0
) -> dict[str, Tally]:
    """Fuzz each target for the same time.

    Args:
        seconds: How long in all.
        seed: What the inputs come from; the same seed gives the same inputs in the same order.
        only: The targets; all if empty.
        out: Where reproducers are kept; nothing is kept without it.
        slow: The longest that one input may take, in seconds.

    Returns:
        What came of each target's inputs.
    """
    chosen = {name: target for name, target in targets().items() if not only or name in only}
    tallies = {name: Tally() for name in chosen}
    with tempfile.TemporaryDirectory(prefix="tickwise-fuzz-") as temporary, warnings.catch_warnings():
        warnings.simplefilter("error")  # a warning is noise on a person's screen
        for name, target in chosen.items():
            rng = random.Random(f"{seed} {name}")
            end = time.monotonic() + seconds / len(chosen)
            while time.monotonic() < end:
                content = target.make(rng)
                began = time.monotonic()
                outcome, escaped = attempt(target, content, Path(temporary), slow)
                tallies[name].seconds += time.monotonic() - began
                tallies[name].outcomes[outcome] += 1
                if escaped is not None:
                    _keep(tallies[name], name, content, escaped, out)
    return tallies


def _keep(tally: Tally, name: str, content: Content, escaped: BaseException, out: Path | None) -> None:
    """Keep the first input of each kind of escape: of one class, from one place."""
    frames = traceback.extract_tb(escaped.__traceback__)
    place = f"at {Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else str(escaped).partition(":")[0]
    kind = f"{type(escaped).__name__} {place}"
    if kind in tally.escapes:
        return
    raw = content.encode(errors="surrogatepass") if isinstance(content, str) else content
    path = (out or Path()) / f"{name}-{sha256(raw).hexdigest()[:12]}"
    tally.escapes[kind] = path
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".input").write_bytes(raw)
        trace = "".join(traceback.format_exception(escaped))
        path.with_suffix(".txt").write_text(trace, encoding="utf-8", errors="backslashreplace")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="how long in all (60)")
    parser.add_argument("--seed", type=int, default=0, help="the seed of the inputs (0)")
    parser.add_argument("--only", action="append", default=[], choices=sorted(targets()), help="a target (all)")
    parser.add_argument("--out", type=Path, default=Path("runs/fuzz"), help="where reproducers are kept (runs/fuzz)")
    parser.add_argument("--slow", type=float, default=20.0, help="the longest that one input may take (20 s)")
    options = parser.parse_args()
    tallies = fuzz(options.seconds, options.seed, options.only, options.out, options.slow)
    for name, tally in tallies.items():
        outcomes = ", ".join(f"{outcome} {count:,}" for outcome, count in tally.outcomes.most_common())
        print(f"{name}: {tally.inputs:,} inputs, {tally.inputs / max(tally.seconds, 1e-9):,.0f} a second: {outcomes}")
        for kind, path in tally.escapes.items():
            print(f"  escaped: {kind}; {path.with_suffix('.input')}")
    return int(any(tally.escapes for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
