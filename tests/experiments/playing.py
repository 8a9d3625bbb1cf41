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


def watch(page: Any) -> list[dict[str, Any]]:
    """Step with the keys' events through the chosen episode, and read at each tick what is to be seen."""
    ticks = page.evaluate(
        """() => {
          const player = document.querySelector(".player");
          const press = (key) => player.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
          const all = (selector, read) => [...player.querySelectorAll(selector)].map(read);
          press("Home");
          const last = Number(player.querySelector("[data-choose=tick]").max);
          return Array.from({ length: last + 1 }, (_, tick) => {
            if (tick) press("ArrowRight");
            return {
              tick: Number(player.dataset.tick),
              locations: JSON.parse(player.dataset.locations),
              clocks: JSON.parse(player.dataset.clocks),
              verdicts: all(".lane-text[data-verdict]", (x) => Number(x.dataset.verdict)),
              literals: all(".literal", (x) => ["is-false", "is-open", "is-true"].indexOf(x.classList[1]) - 1),
              shown: all(".clock", (x) => x.textContent),
              current: all(".location.current .name", (x) => x.textContent),
              taken: all(".edge.taken", (x) => x.getAttribute("d")).length,
              lit: all(".region", (x) => x.classList.contains("lit")),
              world: player.querySelector(".map > title").textContent,
              robot: player.querySelector(".robot").style.transform,
            };
          });
        }"""
    )
    assert [seen["tick"] for seen in ticks] == list(range(len(ticks)))
    return list(ticks)
