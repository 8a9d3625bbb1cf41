"""TChecker itself on what is written for it, where it is there (the package tcheckerpy needs glibc 2.38 or later)."""

from __future__ import annotations

import ctypes
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.strategies import VARIABLES, random_trajectories, sdnfs
from tickwise.automata.build import timed_automata
from tickwise.automata.formats import export_all
from tickwise.automata.model import TimedAutomaton
from tickwise.automata.network import network
from tickwise.logic.parse import parse
from tickwise.logic.semantics import holds


def loads() -> bool:
    spec = find_spec("tcheckerpy")
    if spec is None:
        return False
    try:
        ctypes.CDLL(str(Path(next(iter(spec.submodule_search_locations))) / "libtchecker.so"))
    except OSError:
        return False
    return True


pytestmark = pytest.mark.skipif(not loads(), reason="tcheckerpy is not installed or needs a later glibc")


def reachable(text: str, *labels: str) -> bool:
    from tcheckerpy.tools import tck_reach

    # given a list, it would look for labels that begin with a space
    return tck_reach.reach(text, tck_reach.Algorithm.COVREACH, labels=[",".join(labels)])[0]


def playing(text: str, letters: list[tuple[bool, ...]]) -> str:
    """The system with an environment that plays one word and then stops."""
    lines = text.splitlines()
    start, end = lines.index("process:Environment"), lines.index("process:Automaton")
    environment = ["process:Environment", "clock:1:t"]
    for tick in range(len(letters)):
        initial = "initial: : " if tick == 0 else ""
        environment += [
            f"location:Environment:choose{tick}{{{initial}committed:}}",
            f"location:Environment:read{tick}{{committed:}}",
            f"location:Environment:wait{tick}{{invariant: t<=1}}",
        ]
    for tick, letter in enumerate(letters):
        values = "; ".join(f"p{number}={int(value)}" for number, value in enumerate(letter, start=1))
        environment += [
            f"edge:Environment:choose{tick}:read{tick}:choose{{do: {values}}}",
            f"edge:Environment:read{tick}:wait{tick}:tick{{do: t=0}}",
        ]
        if tick + 1 < len(letters):
            environment.append(f"edge:Environment:wait{tick}:choose{tick + 1}:elapse{{provided: t==1}}")
    return "\n".join([*lines[:start], *environment, *lines[end:]]) + "\n"


def verdict(automaton: TimedAutomaton, X: np.ndarray) -> int:
    columns = [holds(region, X, VARIABLES).tolist() for region in network((automaton,)).regions]
    text = playing(automaton.to("tchecker"), list(zip(*columns, strict=True)))
    return int(reachable(text, "accepting")) - int(reachable(text, "rejecting"))


@settings(max_examples=12, deadline=None)
@given(sdnfs(longest=3, disjuncts=1), st.integers(0, 2**32 - 1))
def test_the_verdict_on_a_trajectory(phi, seed):
    (automaton,) = timed_automata(phi)
    ticks = 1 + seed % (phi.formula.end_effect + 2)
    X = random_trajectories(seed, 1, ticks, len(VARIABLES))[0]
    assert verdict(automaton, X) == automaton.verdict(X, variables=VARIABLES)


@settings(max_examples=8, deadline=None)
@given(sdnfs(longest=3, disjuncts=3))
def test_the_syntax_and_that_no_run_is_stuck(phi):
    from tcheckerpy.tools import tck_syntax

    automata = timed_automata(phi)
    text = export_all(automata, "tchecker")
    tck_syntax.check(text)
    for number in [""] if len(automata) == 1 else range(1, len(automata) + 1):
        assert reachable(text, f"accepting{number}")
        assert reachable(text, f"rejecting{number}")


def test_disjuncts_are_run_on_the_same_states():
    text = export_all(timed_automata(parse("F[0,1] (x >= 3) | G[0,1] (x <= 2) | G[0,1] (x > 2)")), "tchecker")
    assert reachable(text, "accepting1", "rejecting3")  # for instance 2, then 3
    assert not reachable(text, "accepting1", "accepting2")
    assert not reachable(text, "accepting2", "accepting3")
    assert reachable(text, "rejecting1", "accepting3")  # 2.5 at both ticks
