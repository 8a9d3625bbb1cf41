from __future__ import annotations

import pytest

from tests.test_cli import Tickwise


@pytest.fixture
def tickwise(capsys: pytest.CaptureFixture[str]) -> Tickwise:
    return Tickwise(capsys)
