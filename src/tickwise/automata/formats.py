"""The formats in which timed automata can be written for other programs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Final

from tickwise.automata.interchange import to_dot, to_json, to_mermaid
from tickwise.automata.model import TimedAutomaton
from tickwise.automata.tchecker import to_tchecker
from tickwise.automata.uppaal import to_uppaal
from tickwise.errors import ConfigurationError

ALONE: Final[dict[str, Callable[[TimedAutomaton], str]]] = {"dot": to_dot, "json": to_json, "mermaid": to_mermaid}
"""Formats in which an automaton stands alone."""

TOGETHER: Final[dict[str, Callable[[Sequence[TimedAutomaton]], str]]] = {"tchecker": to_tchecker, "uppaal": to_uppaal}
"""Formats in which a formula's automata run side by side, on the same letters."""

FORMATS: Final = tuple(sorted((*ALONE, *TOGETHER)))


def export(automaton: TimedAutomaton, format: str) -> str:
    """One automaton as text.

    Args:
        automaton: The timed automaton.
        format: ``dot`` (Graphviz), ``json``, ``mermaid``, ``tchecker`` or ``uppaal``.

    Returns:
        The text, which ends with a newline.

    Raises:
        ConfigurationError: If there is no such format.
        AutomatonError: If the letters are too many for a system; see `tickwise.automata.network.network`.
    """
    _require(format)
    return TOGETHER[format]((automaton,)) if format in TOGETHER else ALONE[format](automaton)


def export_all(automata: Sequence[TimedAutomaton], format: str) -> str:
    """The automata of a formula's disjuncts as one text.

    Args:
        automata: The automata.
        format: As for `export`.

    Returns:
        One system in TChecker and UPPAAL, a list in JSON, one diagram after the other in Graphviz and Mermaid.

    Raises:
        ConfigurationError: If there is no such format.
        AutomatonError: If the letters are too many for a system, or there is no automaton for one.
    """
    _require(format)
    if format in TOGETHER:
        return TOGETHER[format](automata)
    texts = [ALONE[format](automaton) for automaton in automata]
    if format == "json":
        return json.dumps([json.loads(text) for text in texts], indent=1, ensure_ascii=False) + "\n"
    return "\n".join(texts)


def _require(format: str) -> None:
    if format not in FORMATS:
        raise ConfigurationError(f"format {format!r} is unknown; use one of {', '.join(FORMATS)}")
