"""How messages show what was given: on one line and cut short, whatever it was."""

from __future__ import annotations

from collections.abc import Iterable


def brief(value: object, most: int = 60) -> str:
    """A value, quoted as Python does, in at most so many characters."""
    try:
        text = repr(value)
    except ValueError:  # an int of thousands of digits
        text = f"a value of type {type(value).__name__}"
    text = " ".join(text.splitlines())
    return text if len(text) <= most else f"{text[: most - 1]}…"


def listed(names: Iterable[str], most: int = 12) -> str:
    """Names, separated by commas: the first of many, those that are long or hard to print quoted."""
    given = [str(name) for name in names]
    shown = [name if name.isprintable() and 0 < len(name) <= 40 else brief(name, 40) for name in given[:most]]
    more = [f"and {len(given) - most} more"] if len(given) > most else []
    return ", ".join(shown + more)


def reason(error: BaseException, most: int = 200) -> str:
    """The first line of what another library says, or the error's kind where it says nothing."""
    text = next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)
    text = "".join(sign if sign.isprintable() else "�" for sign in text)
    return text if len(text) <= most else f"{text[: most - 1]}…"
