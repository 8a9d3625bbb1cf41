from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tickwise.experiments import progress
from tickwise.experiments.progress import Board, Display, Item, board

ITEMS = [Item(f"Method {name}, run 1", "episodes", weight) for name, weight in (("I", 3.0), ("II", 1.0))]


class Clock:
    """Seconds that pass when told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(progress.time, "monotonic", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


def plain() -> tuple[Console, io.StringIO]:
    stream = io.StringIO()
    return Console(file=stream, soft_wrap=True), stream


def drawn(console: Console, renderable: object) -> str:
    with console.capture() as capture:
        console.print(renderable)
    return capture.get()


def test_a_board_is_shared():
    with board(2) as shared:
        same = Board(shared.path, shared.jobs).rows()
        assert not same.any()
        shared.reporter(1)(30, 200)
        np.testing.assert_array_equal(same, [[0, 0], [30, 200]])
        folder = shared.path.parent
        assert folder.exists()
    assert not folder.exists()


def test_elsewhere_than_on_a_terminal_there_are_a_few_plain_lines(clock: Clock):
    console, stream = plain()
    with board(20) as shared:
        items = [Item(f"job {number}", "episodes", 1.0) for number in range(20)]
        with Display(console).phase("Learn", items, shared, before=4) as finish:
            for number in range(20):
                clock.now += 6
                finish(number)
    lines = stream.getvalue().splitlines()
    assert lines[0] == "Learn: 20 jobs (4 finished before)"
    assert lines[1] == "Learn: 10 %, 1 min 48 s left"
    assert lines[-2] == "Learn: 90 %, 12 s left"
    assert lines[-1] == "Learn: done in 2 min 00 s"
    assert len(lines) == 11
    assert "\x1b" not in stream.getvalue()


def test_one_job_alone_is_two_lines(clock: Clock):
    console, stream = plain()
    with board(1) as shared, Display(console).phase("Infer", ITEMS[:1], shared) as finish:
        clock.now += 1.4
        finish(0)
    assert stream.getvalue() == "Infer: 1 job\nInfer: done in 1 s\n"


def test_a_finished_phase_is_said_to_be():
    console, stream = plain()
    Display(console).skip("Collect", 6)
    assert stream.getvalue() == "Collect: 6 jobs finished before\n"


def test_the_share_counts_running_jobs_by_weight(clock: Clock):
    with board(2) as shared:
        phase = progress._Phase("Learn", ITEMS, shared)
        assert phase.share() == 0
        assert phase.remaining() == ""
        shared.reporter(0)(50, 100)
        assert phase.share() == pytest.approx(3 / 8)
        phase.finish(1)
        assert phase.share() == pytest.approx(3 / 8 + 1 / 4)
        clock.now += 50
        assert phase.remaining() == ", 30 s left"  # 50 s for 5/8
        shared.reporter(0)(120, 100)
        assert phase.share() == 1


def test_a_live_table_shows_what_runs(clock: Clock):
    console = Console(file=io.StringIO(), width=100)
    with board(2) as shared:
        phase = progress._Phase("Learn", ITEMS, shared)
        assert "Method" not in drawn(console, phase.render())
        shared.reporter(0)(12_000, 40_000)
        clock.now += 90
        text = drawn(console, phase.render())
        assert "Learn" in text
        assert "0 of 2 jobs, 1 min 30 s, 5 min 10 s left" in text
        assert re.search(r"Method I, run 1 +\S.* 12,000 of 40,000 episodes", text)
        assert "Method II" not in text  # it has not begun
        phase.finish(0)
        assert "Method I," not in drawn(console, phase.render())


def live_output(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("TERM", "xterm-256color")
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=True, force_interactive=True, width=100, highlight=False)
    with board(2) as shared, Display(console).phase("Learn", ITEMS, shared) as finish:
        shared.reporter(0)(1, 2)
        finish(1)
    return stream.getvalue()


def test_a_terminal_gets_a_live_table_and_keeps_one_line(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    text = live_output(monkeypatch)
    assert "Method I, run 1" in text
    assert re.search(r"\x1b\[[0-9;]*38;|\x1b\[[0-9;]*3[0-7]m", text)
    assert text.endswith("Learn: done in 0 s\n")


def test_no_color_is_respected(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NO_COLOR", "1")
    text = live_output(monkeypatch)
    assert "Method I, run 1" in text
    assert not re.search(r"\x1b\[[0-9;]*[34]8;|\x1b\[[0-9;]*[349][0-7]m", text)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (3_599, "59 min 59 s"), (3_661, "1 h 01 min")],
)
def test_durations(seconds: float, text: str):
    assert progress._duration(seconds) == text


def test_a_board_is_removed_after_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(progress.tempfile, "tempdir", str(tmp_path))
    with pytest.raises(KeyboardInterrupt), board(3):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
