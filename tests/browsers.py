"""A headless browser for tests of pages, and what can be measured of a page in it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""The names under which systems have the browser, the likeliest first."""

Open = Callable[..., Any]


@contextmanager
def headless() -> Iterator[Any]:
    """The browser; skips the test where there is none, or nothing to drive it."""
    playwright = pytest.importorskip("playwright.sync_api", reason="tests of pages in a browser need playwright")
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(f"tests of pages in a browser need one of {', '.join(NAMES)}")
    quiet = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=path, args=quiet)
        yield browser
        browser.close()


@contextmanager
def quiet_pages(browser: Any) -> Iterator[Open]:
    """Opens pages that must say nothing on their console and ask for nothing but themselves."""
    contexts, complaints = [], []

    def open_page(path: Path, **options: Any) -> Any:
        contexts.append(browser.new_context(**{"viewport": {"width": 1200, "height": 900}, **options}))
        page = contexts[-1].new_page()
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: complaints.append(request.url) if request.url != path.as_uri() else None)
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


def hard_to_read(page: Any, least: float = 4.5, within: str = "body") -> dict[str, float]:
    """Texts whose contrast with what is behind them, as WCAG defines it, is below the least, each with its contrast.

    Disabled controls and what no one sees do not count, nor figures that Matplotlib drew, which stand on white.
    """
    found: dict[str, float] = page.locator(within).first.evaluate(
        """(root, least) => {
          const parse = (text) => { const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number); return [r, g, b, a]; };
          const light = (colour) => colour.slice(0, 3).map((c) => c / 255)
            .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
            .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
          const over = ([r, g, b, a], below) => [r, g, b].map((c, i) => a * c + (1 - a) * below[i]);
          const behind = (element) => {
            const disc = element.closest(".location")?.querySelector(".place");
            if (disc) return parse(getComputedStyle(disc).fill);
            let at = element;
            while (at && parse(getComputedStyle(at).backgroundColor)[3] === 0) at = at.parentElement;
            return at ? parse(getComputedStyle(at).backgroundColor) : [255, 255, 255];
          };
          const found = {};
          for (const element of root.querySelectorAll("*")) {
            const words = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.textContent);
            const text = words.join("").trim();
            if (!text || ["SCRIPT", "STYLE", "title", "OPTION"].includes(element.tagName)) continue;
            const passed = element.disabled || element.closest(".picture svg[aria-labelledby]");
            if (passed || !element.checkVisibility()) continue;
            const style = getComputedStyle(element);
            let opacity = 1;
            for (let at = element; at; at = at.parentElement) opacity *= Number(getComputedStyle(at).opacity);
            const [r, g, b, a] = parse(element instanceof SVGElement ? style.fill : style.color);
            const below = behind(element);
            const [low, high] = [over([r, g, b, a * opacity], below), below].map(light).sort((x, y) => x - y);
            const contrast = (high + 0.05) / (low + 0.05);
            if (contrast < least) found[text.slice(0, 60)] = contrast;
          }
          return found;
        }""",
        least,
    )
    return found


def contrast(one: str, other: str) -> float:
    """WCAG's contrast of two opaque colours, each as a browser computes it: ``rgb(1, 2, 3)``."""

    def luminance(colour: str) -> float:
        shares = [int(number) / 255 for number in re.findall(r"\d+", colour)]
        linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def too_wide(page: Any) -> list[str]:
    """What makes a page scroll sideways: nothing, unless the page is wider than the window."""
    found: list[str] = page.evaluate(
        """() => document.documentElement.scrollWidth <= innerWidth ? [] : [...document.body.querySelectorAll("*")]
          .filter((element) => element.getBoundingClientRect().right > innerWidth + 1)
          .map((element) => `${element.tagName} ${element.getAttribute("class")}`)"""
    )
    return found
