"""The examples that each command's help ends with."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypedDict

EXAMPLES = {
    "reproduce": (
        "tickwise reproduce all --workers 4",
        "tickwise reproduce case2 --protocol full --runs 3",
        "tickwise reproduce random --tasks 20 --seed 2",
    ),
    "infer": ("tickwise infer logs.npz --size 2 --rate 0.99", "tickwise infer logs.csv --json > formula.json"),
    "check": (
        "tickwise check 'F[1,15] G[0,4] (3 <= x <= 4)' logs.csv --json",
        "tickwise check 'F[0,9] (x > 3)' logs.csv | grep false",
    ),
    "automaton": (
        "tickwise automaton 'F[0,9] (x > 3)' | dot -Tpdf > automaton.pdf",
        "tickwise automaton 'F[0,9] (x > 3)' --format svg > automaton.svg",
    ),
    "compare": (
        "tickwise compare 'F[0,9] (x > 1)' 'G[3,5] (y < 2)' --json",
        "tickwise compare 'F[0,9] (x > 1)' 'F[3,5] (x > 2)' --picture both.svg",
    ),
    "report": ("tickwise report runs/all",),
    "effect": ("tickwise effect tau --study case1 --runs 5", "tickwise effect list"),
    "library": (
        "tickwise library add tasks case1 --run runs/case1",
        "tickwise library list tasks",
        "tickwise library rank tasks logs.npz --study case1",
        "tickwise library transfer tasks logs.npz start.npz --study case1",
    ),
    "library add": ("tickwise library add tasks mine --formula PHI --q q.npy --world world.npz",),
    "library list": ("tickwise library list tasks --json > tasks.json",),
    "library rank": (
        "tickwise library rank tasks logs.npz --world world.npz --by distance",
        "tickwise library rank tasks logs.csv --json > ranking.json",
    ),
    "library transfer": ("tickwise library transfer tasks logs.npz new.npz --study case1 --entry mine",),
    "doctor": ("tickwise doctor --json > doctor.json",),
}
"""Examples beside the one in a command's docstring, by the command's name."""

_MARK = "For example:"


class Description(TypedDict):
    """What typer has to know of a command: its help, and what stands below its options."""

    help: str
    epilog: str


def epilog_of(name: str, first: str = "") -> str:
    """What stands below the options of a command: its examples.

    Args:
        name: The command's name.
        first: The example that comes before those of `EXAMPLES`.
    """
    lines = [f"  {each}" for each in (*filter(None, [first]), *EXAMPLES.get(name, ()))]
    # the mark keeps the lines that follow it as they are
    return "\b\n" + "\n".join(("Examples:", *lines)) if lines else ""


def described(function: Callable[..., Any], name: str | None = None) -> Description:
    """A command's help, with its examples below the options.

    Args:
        function: The command; its docstring may have an example after ``For example:``, to its end.
        name: What stands after ``tickwise``; the function's name if left out.

    Returns:
        Arguments of typer's ``command``.
    """
    words, _, example = (inspect.getdoc(function) or "").partition(_MARK)
    return {"help": words.strip(), "epilog": epilog_of(name or function.__name__, " ".join(example.split()))}
