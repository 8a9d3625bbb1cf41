"""The player of a report in a browser, as a reader uses it."""

from __future__ import annotations

import json
from typing import Any


def choose(page: Any, **choices: str) -> None:
    for name, label in choices.items():
        select = page.locator(f"[data-choose={name}]")
        texts = select.locator("option").all_text_contents()
        select.select_option(index=next(i for i, text in enumerate(texts) if text.startswith(label)))


def told(page: Any, name: str) -> Any:
    return json.loads(page.locator(".player").get_attribute(f"data-{name}"))
