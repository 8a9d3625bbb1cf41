"""Timed automata in TChecker's file format."""

from __future__ import annotations

from collections.abc import Sequence

from tickwise.automata.model import Edge, TimedAutomaton
from tickwise.automata.network import Component, Network, network


def to_tchecker(automata: Sequence[TimedAutomaton]) -> str:
    """Automata and their environment as a system for TChecker.

    Accepting locations carry the label ``accepting`` and rejecting ones ``rejecting``, with the automaton's number
    after it where there are several; ``tck-reach -a reach -l accepting FILE`` looks for a satisfying run. A unit
    of time is a tick.

    Args:
        automata: One automaton or more, which read the same letters.

    Returns:
        The declarations, one a line.

    Raises:
        AutomatonError: If the letters are too many; see `tickwise.automata.network.network`.
    """
    system = network(automata)
    lines = [*(f"# {note}" for note in system.notes), "system:tickwise", "event:choose", "event:tick", "event:elapse"]
    lines += [f"int:1:0:1:0:p{number}" for number in range(1, len(system.regions) + 1)]
    lines += _environment(system)
    for component in system.components:
        lines += _process(component)
    everyone = ":".join(f"Automaton{component.number}@tick" for component in system.components)
    lines.append(f"sync:Environment@tick:{everyone}")
    return "\n".join(lines) + "\n"


def _environment(system: Network) -> list[str]:
    """Choose a letter, let it be read, wait for a tick; the first letter is read at time 0."""
    lines = [
        "process:Environment",
        "clock:1:t",
        "location:Environment:choose{initial: : committed:}",
        "location:Environment:read{committed:}",
        "location:Environment:wait{invariant: t<=1}",
    ]
    for letter in system.letters:
        values = "; ".join(f"p{number}={int(holds)}" for number, holds in enumerate(letter, start=1))
        lines.append(f"edge:Environment:choose:read:choose{{do: {values}}}")
    return [
        *lines,
        "edge:Environment:read:wait:tick{do: t=0}",
        "edge:Environment:wait:choose:elapse{provided: t==1}",
    ]


def _process(component: Component) -> list[str]:
    automaton, name = component.automaton, f"Automaton{component.number}"
    lines = [f"process:{name}", *(f"clock:1:{_clock(component, c)}" for c in range(len(automaton.clocks)))]
    for q, location in enumerate(component.locations):
        attributes = ["initial:"] if q == automaton.initial else []
        attributes += [f"labels: accepting{component.number}"] if q in automaton.accepting else []
        attributes += [f"labels: rejecting{component.number}"] if q in automaton.rejecting else []
        lines.append(f"location:{name}:{location}{{{' : '.join(attributes)}}}")
    return lines + [f"edge:{name}:{_edge(component, edge)}" for edge in automaton.edges]


def _edge(component: Component, edge: Edge) -> str:
    guard = [f"p{region + 1}=={int(holds)}" for region, holds in component.reads(edge)]
    guard += [f"{_clock(component, atom.clock)}{atom.comparison}{atom.value}" for atom in edge.guard]
    resets = [f"{_clock(component, clock)}=0" for clock in sorted(edge.resets)]
    attributes = [f"provided: {' && '.join(guard)}"] if guard else []
    attributes += [f"do: {'; '.join(resets)}"] if resets else []
    source, target = component.locations[edge.source], component.locations[edge.target]
    return f"{source}:{target}:tick{{{' : '.join(attributes)}}}"


def _clock(component: Component, clock: int) -> str:
    # all names are global
    return component.clocks[clock] + (f"_{component.number}" if component.number else "")
