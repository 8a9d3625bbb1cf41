"""A report in a browser, with made-up recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.browsers import Open, quiet_pages
from tests.experiments import recorded, synthetic
from tickwise.experiments.figures import FIGURES
from tickwise.experiments.report import render_report

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 5"><path d="M0 0"/></svg>'


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return recorded.results(synthetic.small())


@pytest.fixture(scope="module")
def report(results: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(render_report(results, synthetic.small(), dict.fromkeys(FIGURES, SVG)), encoding="utf-8")
    return path


@pytest.fixture
def opened(browser: Any, report: Path) -> Iterator[Open]:
    """Opens the report, or another page."""
    with quiet_pages(browser) as open_page:
        yield lambda path=report, **options: open_page(path, **options)
