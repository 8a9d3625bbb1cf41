"""Run the benchmarks: ``python -m benchmarks [NAME ...] [--quick] [--out FOLDER]``."""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from pathlib import Path

from benchmarks.report import table, write
from benchmarks.result import Result

BENCHMARKS = ("learning", "forms", "planning", "counting", "monitoring", "exact_search", "parts", "runs", "start")
"""Modules with ``measure(quick: bool) -> list[Result]``, in the order of the table."""


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description="Compare Tickwise with C and with others."
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which ones (all: {', '.join(BENCHMARKS)})")
    parser.add_argument("--quick", action="store_true", help="small sizes and few repetitions: whether all works")
    parser.add_argument("--out", type=Path, default=Path("runs/bench"), help="where the results go (runs/bench)")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]!r}; there are {', '.join(BENCHMARKS)}")
    results: list[Result] = []
    for name in options.names or BENCHMARKS:
        begin = time.monotonic()
        print(f"{name} ...", end=" ", file=sys.stderr, flush=True)
        results += importlib.import_module(f"benchmarks.{name}").measure(options.quick)
        print(f"{time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)
    print(table(results))
    write(results, options.out, options.quick)
    print(f"written to {options.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
