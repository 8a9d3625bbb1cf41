"""A simulator of networks of timed automata over whole units of time, and readers of UPPAAL's and TChecker's text.

It knows the languages only, nothing of how the systems are made: processes, guards, committed locations, invariants,
handshakes. Expressions are Python's, after a few replacements.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import product
from types import CodeType
from xml.etree import ElementTree


@dataclass
class Step:
    """An edge of a process; an event of "" is the process's own affair."""

    source: str
    target: str
    event: str
    guard: str
    updates: list[str]


@dataclass
class Process:
    name: str
    initial: str
    steps: list[Step]
    clocks: list[str]
    committed: set[str] = field(default_factory=set)
    invariants: dict[str, str] = field(default_factory=dict)
    labels: dict[str, set[str]] = field(default_factory=dict)


@dataclass
class System:
    processes: list[Process]
    handshakes: list[tuple[tuple[str, str], ...]]
    """Tuples of (process, event) that happen together."""
    values: dict[str, object]


Joint = tuple[tuple[Process, Step], ...]
Letter = dict[str, bool]


class Simulation:
    """A run on letters; at every moment exactly one thing can happen, but for the choice of the letter."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.places = {process.name: process.initial for process in system.processes}
        self.clocks = {clock: 0 for process in system.processes for clock in process.clocks}
        self.values = dict(system.values)

    def run(self, word: list[Letter]) -> None:
        """Play the letters until time has to pass after the last one."""
        remaining = list(word)
        while True:
            choices = [joint for joint in self.joints() if self.enabled(joint)]
            if not choices:
                if not remaining:
                    return
                self.clocks = {clock: value + 1 for clock, value in self.clocks.items()}
                assert all(self.holds(p, self.places[p.name]) for p in self.system.processes), "time cannot pass"
                continue
            played = [joint for joint in choices if self.letter(joint) is not None]
            if played:
                assert len(played) == len(choices)
                wanted = remaining.pop(0)
                choices = [joint for joint in played if self.letter(joint) == wanted]
            (joint,) = choices
            self.take(joint)

    def holds(self, process: Process, place: str) -> bool:
        return self.evaluate(process.invariants.get(place, "True"))

    def evaluate(self, expression: str) -> bool:
        return bool(eval(compiled(expression), {"__builtins__": {}}, {**self.values, **self.clocks}))

    def letter(self, joint: Joint) -> Letter | None:
        updates = [update for _, step in joint for update in step.updates if re.match(r"p\d", update)]
        if not updates:
            return None
        pairs = (update.split("=") for update in updates)
        return {name.strip(): self.evaluate(value) for name, value in pairs}

    def joints(self) -> Iterator[Joint]:
        busy = [(name, event) for handshake in self.system.handshakes for name, event in handshake]
        for process in self.system.processes:
            for step in self.leaving(process):
                if (process.name, step.event) not in busy:
                    yield ((process, step),)
        by_name = {process.name: process for process in self.system.processes}
        for handshake in self.system.handshakes:
            options = [
                [(by_name[name], step) for step in self.leaving(by_name[name]) if step.event == event]
                for name, event in handshake
            ]
            yield from product(*options)

    def leaving(self, process: Process) -> list[Step]:
        return [step for step in process.steps if step.source == self.places[process.name]]

    def enabled(self, joint: Joint) -> bool:
        committed = {p.name for p in self.system.processes if self.places[p.name] in p.committed}
        if committed and not committed & {process.name for process, _ in joint}:
            return False
        return all(self.evaluate(step.guard) for _, step in joint)

    def take(self, joint: Joint) -> None:
        for process, step in joint:
            for update in step.updates:
                name, value = (part.strip() for part in update.split("="))
                target = self.clocks if name in self.clocks else self.values
                assert name in target
                target[name] = int(self.evaluate(value)) if target is self.clocks else self.evaluate(value)
            self.places[process.name] = step.target
        assert all(self.holds(p, self.places[p.name]) for p in self.system.processes)


@cache
def compiled(expression: str) -> CodeType:
    return compile(expression.strip(), "<system>", "eval")


def python(expression: str) -> str:
    return re.sub(r"!(?!=)", " not ", expression.replace("&&", " and ")).strip() or "True"


def read_uppaal(text: str) -> System:
    root = ElementTree.fromstring(text)
    values, channels = uppaal_globals(root.findtext("declaration"))
    names = re.fullmatch(r"system (.*);", root.findtext("system")).group(1).split(", ")
    processes = [uppaal_process(template, values) for template in root.iter("template")]
    assert [process.name for process in processes] == names
    handshakes = [
        ((sender.name, f"{channel}!"), (receiver.name, f"{channel}?"))
        for channel in channels
        for sender in processes
        for receiver in processes
        if any(step.event == f"{channel}!" for step in sender.steps)
        and any(step.event == f"{channel}?" for step in receiver.steps)
    ]
    assert len(handshakes) == len(channels)
    return System(processes, handshakes, values)


def uppaal_globals(text: str) -> tuple[dict[str, object], list[str]]:
    statements = re.sub(r"//[^\n]*", "", text).split(";")
    values: dict[str, object] = {}
    channels: list[str] = []
    for statement in filter(None, (" ".join(part.split()) for part in statements)):
        if found := re.fullmatch(r"bool ([\w, ]+)", statement):
            values |= dict.fromkeys(found[1].split(", "), False)
        elif found := re.fullmatch(r"chan ([\w, ]+)", statement):
            channels += found[1].split(", ")
        elif found := re.fullmatch(r"const int (\w+) = (\d+)", statement):
            values[found[1]] = int(found[2])
        elif found := re.fullmatch(r"const bool (\w+)\[(\w+)\]\[(\d+)\] = (.*)", statement):
            table = eval(found[4].replace("{", "[").replace("}", "]").replace("true", "1").replace("false", "0"), {})
            assert len(table) == values[found[2]]
            assert {len(row) for row in table} == {int(found[3])}
            values[found[1]] = table
        else:
            raise AssertionError(statement)
    return values, channels


def uppaal_process(template: ElementTree.Element, values: dict[str, object]) -> Process:
    """A template's clocks are its own, also where another template's have the same names."""
    name = template.findtext("name")
    clocks = re.fullmatch(r"clock ([\w, ]+);", template.findtext("declaration")).group(1).split(", ")

    def own(text: str) -> str:
        return re.sub(rf"\b({'|'.join(clocks)})\b", rf"{name}_\1", text)

    names = {place.get("id"): place.findtext("name") for place in template.iter("location")}
    steps = []
    for edge in template.iter("transition"):
        labels = {label.get("kind"): label.text for label in edge.findall("label")}
        updates = list(filter(None, own(labels.get("assignment", "")).split(", ")))
        source, target = (names[edge.find(end).get("ref")] for end in ("source", "target"))
        event, guard = labels.get("synchronisation", ""), python(own(labels.get("guard", "")))
        choices = uppaal_choices(labels.get("select"), values)
        steps += [Step(source, target, event, guard, list(map(choice, updates))) for choice in choices]
    return Process(
        name,
        names[template.find("init").get("ref")],
        steps,
        [own(clock) for clock in clocks],
        {names[place.get("id")] for place in template.iter("location") if place.find("committed") is not None},
        {
            names[place.get("id")]: python(own(label.text))
            for place in template.iter("location")
            for label in place.findall("label")
            if label.get("kind") == "invariant"
        },
    )


def uppaal_choices(select: str | None, values: dict[str, object]) -> list[Callable[[str], str]]:
    if select is None:
        return [str]
    variable, count = re.fullmatch(r"(\w+) : int\[0, (\w+) - 1\]", select).groups()
    return [partial(re.sub, rf"\b{variable}\b", str(number)) for number in range(values[count])]


def read_tchecker(text: str) -> System:
    """All names are global there; a clock is given to the process declared last, which changes nothing."""
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    assert lines[0].startswith("system:")
    system = System([], [], {})
    events = set()
    for line in lines[1:]:
        kind, _, rest = line.partition(":")
        head, _, inner = rest.partition("{")
        parts = head.split(":")
        pairs = re.findall(r"(\w+):((?:(?! : ).)*)(?: : |$)", inner.removesuffix("}"))
        attributes = {key.strip(): value.strip() for key, value in pairs}
        process = system.processes[-1] if system.processes else None
        match kind:
            case "event":
                events.add(parts[0])
            case "int":
                size, low, high, initial, name = parts
                assert (size, low, high) == ("1", "0", "1")
                system.values[name] = bool(int(initial))
            case "process":
                system.processes.append(Process(parts[0], "", [], []))
            case "clock":
                assert parts[0] == "1"
                process.clocks.append(parts[1])
            case "location":
                assert parts[0] == process.name
                process.labels[parts[1]] = set(filter(None, attributes.get("labels", "").split(",")))
                if "initial" in attributes:
                    process.initial = parts[1]
                if "committed" in attributes:
                    process.committed.add(parts[1])
                if "invariant" in attributes:
                    process.invariants[parts[1]] = python(attributes["invariant"])
            case "edge":
                assert parts[0] == process.name
                assert {parts[1], parts[2]} <= set(process.labels)
                assert parts[3] in events
                updates = [part.strip() for part in attributes.get("do", "").split(";") if part.strip()]
                process.steps.append(
                    Step(parts[1], parts[2], parts[3], python(attributes.get("provided", "")), updates)
                )
            case "sync":
                system.handshakes.append(tuple(tuple(part.split("@")) for part in parts))
            case _:
                raise AssertionError(line)
    clocks = [clock for process in system.processes for clock in process.clocks]
    assert len(set(clocks)) == len(clocks)
    return system
