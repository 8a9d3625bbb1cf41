"""How long an import takes: a fresh interpreter that imports and ends, by the clock."""

from __future__ import annotations

import functools
import subprocess
import sys
import time
from importlib.util import find_spec

from benchmarks.contest import Contender, Turn, UnavailableError, contest
from benchmarks.result import OURS, Result

STATEMENTS = {
    OURS: "import tickwise",
    "no import": "pass",
    "numpy": "import numpy",
    "rtamt": "import rtamt",
    "metric-temporal-logic": "import mtl",
    "stlpy": "import stlpy.STL",
    "tickwise, all of it": "from tickwise import *",
}


def started(statement: str) -> Turn:
    module = statement.split()[1] if statement.startswith("import") else "sys"
    if find_spec(module.partition(".")[0]) is None:
        raise UnavailableError(f"No module named '{module}'")
    return lambda: subprocess.run([sys.executable, "-W", "ignore", "-c", statement], check=True)


def measure(quick: bool) -> list[Result]:
    contenders = [
        Contender(name, functools.partial(started, statement), 1, 3 if quick else 11)
        for name, statement in STATEMENTS.items()
    ]
    return contest("start", "start", contenders, clock=time.perf_counter)
