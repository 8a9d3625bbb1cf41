from __future__ import annotations

import re
import string

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from tickwise.envs.catalog import CATALOG, register_all
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.rendering import _GLYPHS, Map, Scene, picture

register_all()
GREEN, YELLOW, SKY, WHITE = (0, 158, 115), (240, 228, 66), (86, 180, 233), (255, 255, 255)
CELL = 64


def tile(image: np.ndarray, size: int, i: int, j: int) -> np.ndarray:
    """A cell of a picture without the grid lines."""
    side = (image.shape[1] - 1) // size
    return image[(size - 1 - j) * side + 1 : (size - j) * side, i * side + 1 : (i + 1) * side]


def drawn(name: str, state: int, actions: tuple[int, ...] = ()) -> np.ndarray:
    env = gymnasium.make(f"{name}-v0", render_mode="rgb_array", turn_failure=0.0, slip=0.0)
    env.reset(options={"state": state})
    for action in actions:
        env.step(action)
    return env.render()


@pytest.mark.parametrize("name", list(CATALOG))
def test_the_picture_is_large_enough_and_coloured_by_region(name: str):
    spec = CATALOG[name]
    size = spec.world.size
    image = drawn(name, 0)
    assert image.dtype == np.uint8
    side = {5: 72, 7: 64, 9: 64}[size]  # pixels a cell
    assert image.shape == (size * side + 1 + 12, size * side + 1, 3)
    assert min(image.shape[:2]) >= 360
    middles = {(i, j): tuple(tile(image, size, i, j)[40, 40]) for i in range(size) for j in range(size)}
    colours = {"green": GREEN, "yellow": YELLOW, "blue": SKY}
    expected = dict.fromkeys(middles, WHITE)
    for mark in spec.task.landmarks:
        (x, y) = mark.box.bounds
        for i in range(int(x.lower), int(x.upper)):
            for j in range(int(y.lower), int(y.upper)):
                expected[i, j] = colours[mark.colour]
    del expected[0, 0], middles[0, 0]  # the robot is there
    assert middles == expected


def test_grid_lines_are_one_pixel_wide():
    image = drawn("CaseStudy1Source", 0)[: 9 * CELL + 1]
    line = (image == 187).all(axis=-1)
    assert line[::CELL].all()
    assert line[:, ::CELL].all()
    assert line.sum() == 2 * 10 * (9 * CELL + 1) - 100


def test_the_robot_turns_with_its_heading():
    tiles = [tile(drawn("CaseStudy1Source", heading), 9, 0, 0).astype(int) for heading in range(4)]
    for heading in range(3):  # pictures' rows go down, so a turn to the left is rot90
        assert abs(np.rot90(tiles[heading]) - tiles[heading + 1]).max() <= 1
    ink = (tiles[0] < 128).all(axis=-1)
    widths = ink.sum(axis=0)
    assert ink.any()
    assert np.flatnonzero(widths)[-1] > CELL * 0.75  # the tip, to the east
    assert widths[np.flatnonzero(widths)[-1]] <= 3


def test_the_robot_has_a_white_rim_on_every_colour():
    image = drawn("CaseStudy1Source", CATALOG["CaseStudy1Source"].world.state(7, 6, 1))
    cell = tile(image, 9, 7, 6)
    for colour in (YELLOW, WHITE, (0, 0, 0)):
        assert (cell == colour).all(axis=-1).sum() > 40


def test_the_bar_shows_the_time_that_has_passed():
    width = 9 * CELL + 1
    assert tuple(drawn("CaseStudy1Source", 0)[-1, 0]) == WHITE
    quarter = drawn("CaseStudy1Source", 0, (1,) * 10)[-1]
    assert (quarter == (0, 114, 178)).all(axis=-1).sum() == round(width / 4)
    failed = drawn("CaseStudy1Source", 0, (1,) * 40)[-1]
    assert (failed == (213, 94, 0)).all()
    on_blue = CATALOG["CaseStudy2Source"].world.state(2, 2, 0)
    kept = drawn("CaseStudy2Source", on_blue, (1,) * 25)[-1]
    assert (kept == GREEN).all()


def test_text_of_case_study_1_by_hand():
    env = GridWorldEnv("CaseStudy1Source", render_mode="ansi", turn_failure=0.0, slip=0.0)
    env.reset(options={"state": env.specification.world.state(2, 4, 0)})
    env.step(0)
    env.step(1)
    assert env.render() == "\n".join(
        [
            "tick 2/40: stay in G: 2 of 5 ticks",
            "·  ·  ·  ·  ·  ·  ·  ·  ·",
            "·  ·  ·  ·  ·  ·  ·  Y  ·",
            "·  ·  ·  ·  ·  ·  ·  Y  ·",
            "·  ·  ·  ·  ·  ·  ·  Y  ·",
            "·  ·  ·  G▲ ·  ·  ·  ·  ·",
            "·  ·  ·  G  ·  ·  ·  ·  ·",
            "·  ·  ·  ·  ·  ·  ·  ·  ·",
            "·  ·  ·  ·  ·  ·  ·  ·  ·",
            "·  ·  ·  ·  ·  ·  ·  ·  ·",
        ]
    )


def test_text_of_case_study_2_by_hand():
    env = GridWorldEnv("CaseStudy2Target", render_mode="ansi", turn_failure=0.0, slip=0.0)
    env.reset(options={"state": env.specification.world.state(4, 3, 2)})
    assert env.render() == "\n".join(
        [
            "tick 0/40: B1 1 of 10 ticks away, B2 0 of 10 ticks away",
            "·   ·   ·   ·   ·   ·   ·",
            "·   ·   G   ·   G   ·   ·",
            "·   ·   ·   ·   ·   ·   ·",
            "·   ·   B1  ·   B2◀ ·   ·",
            "·   ·   ·   ·   ·   ·   ·",
            "·   ·   G   ·   G   ·   ·",
            "·   ·   ·   ·   ·   ·   ·",
        ]
    )
    for _ in range(10):
        env.step(1)
    assert env.render().splitlines()[0] == "tick 10/40: B1 is lost, B2 0 of 10 ticks away"


@pytest.mark.parametrize(("heading", "arrow"), list(enumerate("▶▲◀▼")))
def test_arrows(heading: int, arrow: str):
    env = GridWorldEnv("CaseStudy2Source", render_mode="ansi")
    env.reset(options={"state": heading})
    assert env.render().splitlines()[-1] == f"·{arrow} ·  ·  ·  ·"


def test_text_tells_the_outcome():
    env = GridWorldEnv("CaseStudy2Source", render_mode="ansi")
    env.reset(options={"state": 0})
    for _ in range(8):
        env.step(1)
    assert env.render().splitlines()[0] == "tick 8/25, failure: the rule is broken"


def test_no_mode_draws_nothing_and_nothing_is_drawn_before_the_start():
    env = GridWorldEnv("CaseStudy1Source")
    env.reset()
    assert env.render() is None
    with pytest.raises(ResetNeeded, match="call reset"):
        GridWorldEnv("CaseStudy1Source", render_mode="ansi").render()


def test_every_letter_and_digit_can_be_written_and_told_apart():
    glyphs = [_GLYPHS[character] for character in string.ascii_uppercase + string.digits]
    assert all(re.fullmatch(r"(?:[01]{3} ){4}[01]{3}", glyph) for glyph in glyphs)
    # O and 0, I and 1 or S and 5 may look alike, but no two letters do
    assert len(set(glyphs[:26])) == 26
    image = picture(Map(2, ("A", "Z9", "M", ""), (WHITE,) * 4), Scene((1, 1, 0), 0, 5, "", None))
    assert (tile(image, 2, 0, 1) == 0).any()
