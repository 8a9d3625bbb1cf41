"""Pictures and text maps of a gridworld episode, drawn with NumPy alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.gridworld import STEPS
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import Landmark, inside

Colour = tuple[int, int, int]

# Okabe and Ito's palette, which colour-blind readers can tell apart
PALETTE: dict[str, Colour] = {
    "green": (0, 158, 115),
    "yellow": (240, 228, 66),
    "blue": (86, 180, 233),
}
"""Colours of the landmarks, as red, green, blue."""

FLOOR: Colour = (255, 255, 255)
GRID: Colour = (187, 187, 187)
INK: Colour = (0, 0, 0)
ELAPSED: Colour = (0, 114, 178)
SUCCEEDED: Colour = (0, 158, 115)
FAILED: Colour = (213, 94, 0)

ARROWS = "▶▲◀▼"
"""The robot in a text map, by heading."""

_LEAST_PIXELS = 360
_LEAST_CELL_PIXELS = 64
_BAR_PIXELS = 12
_SAMPLES = 4  # per pixel and axis, for smooth edges of the robot

# An arrowhead with a notch, towards east in a cell of side 1 about 0, y upwards.
# It consists of two counterclockwise triangles.
_ARROWHEAD = (
    ((0.30, 0.0), (-0.24, 0.23), (-0.10, 0.0)),
    ((0.30, 0.0), (-0.10, 0.0), (-0.24, -0.23)),
)

_GLYPHS = {
    "A": "010 101 111 101 101",
    "B": "110 101 110 101 110",
    "C": "111 100 100 100 111",
    "D": "110 101 101 101 110",
    "E": "111 100 110 100 111",
    "F": "111 100 110 100 100",
    "G": "111 100 101 101 111",
    "H": "101 101 111 101 101",
    "I": "111 010 010 010 111",
    "J": "001 001 001 101 111",
    "K": "101 101 110 101 101",
    "L": "100 100 100 100 111",
    "M": "101 111 111 101 101",
    "N": "110 101 101 101 101",
    "O": "111 101 101 101 111",
    "P": "111 101 111 100 100",
    "Q": "111 101 101 111 001",
    "R": "111 101 110 101 101",
    "S": "111 100 010 001 111",
    "T": "111 010 010 010 010",
    "U": "101 101 101 101 111",
    "V": "101 101 101 101 010",
    "W": "101 101 111 111 101",
    "X": "101 101 010 101 101",
    "Y": "101 101 010 010 010",
    "Z": "111 001 010 100 111",
    "0": "111 101 101 101 111",
    "1": "010 110 010 010 111",
    "2": "111 001 111 100 111",
    "3": "111 001 111 001 111",
    "4": "101 101 111 001 001",
    "5": "111 100 111 001 111",
    "6": "111 100 111 101 111",
    "7": "111 001 001 010 010",
    "8": "111 101 111 101 111",
    "9": "111 101 111 001 111",
}


@dataclass(frozen=True, slots=True)
class Map:
    """What of a picture does not change during an episode.

    Attributes:
        size: Cells along a side.
        labels: The landmark's label in each cell; empty where there is none.
        colours: The colour of each cell.
    """

    size: int
    labels: tuple[str, ...]
    colours: tuple[Colour, ...]

    @classmethod
    def of(cls, size: int, mdp: TabularMDP, landmarks: Sequence[Landmark]) -> Map:
        """The map of a world with landmarks; where they overlap, a later one hides an earlier one."""
        labels, colours = [""] * mdp.n_cells, [FLOOR] * mdp.n_cells
        for landmark in landmarks:
            for cell in np.unique(mdp.cell[inside(landmark.box, mdp)]):
                labels[cell], colours[cell] = landmark.label, PALETTE[landmark.colour]
        return cls(size, tuple(labels), tuple(colours))


@dataclass(frozen=True, slots=True)
class Scene:
    """One tick of an episode.

    Attributes:
        place: Cell (i, j) and heading of the robot.
        tick: The tick.
        deadline: The last tick.
        stage: How far the task is, in words.
        success: How the episode ended; ``None`` while it goes on.
    """

    place: tuple[int, int, int]
    tick: int
    deadline: int
    stage: str
    success: bool | None


def text_map(world: Map, scene: Scene) -> str:
    """The scene as text: a line of state, then the map with north up.

    A cell shows its landmark's label or a dot, and behind it the robot as an arrow where it is.
    """
    outcome = {None: "", True: ", success", False: ", failure"}[scene.success]
    lines = [f"tick {scene.tick}/{scene.deadline}{outcome}: {scene.stage}"]
    i, j, heading = scene.place
    width = max(1, *map(len, world.labels))
    for row in reversed(range(world.size)):
        cells = (
            (world.labels[column * world.size + row] or "·").ljust(width)
            + (ARROWS[heading] if (column, row) == (i, j) else " ")
            for column in range(world.size)
        )
        lines.append(" ".join(cells).rstrip())
    return "\n".join(lines)


def picture(world: Map, scene: Scene) -> NDArray[np.uint8]:
    """The scene as a picture with north up and a bar of the time that has passed below.

    The bar is blue while the episode goes on, and at its end green for success or vermilion for failure.

    Returns:
        Red, green and blue, shape ``(height, width, 3)``, at least 360 pixels each way.
    """
    cell = max(_LEAST_CELL_PIXELS, -(-_LEAST_PIXELS // world.size))
    side = world.size * cell + 1  # the last grid line
    image = np.full((side + _BAR_PIXELS, side, 3), FLOOR, dtype=np.uint8)
    for number, (label, colour) in enumerate(zip(world.labels, world.colours, strict=True)):
        column, row = divmod(number, world.size)
        left, top = column * cell, (world.size - 1 - row) * cell
        image[top : top + cell, left : left + cell] = colour
        _write(image, label, left + cell // 16 + 1, top + cell // 16 + 1, pixel=cell // 24)
    image[0:side:cell, :] = GRID
    image[:side, 0:side:cell] = GRID
    _draw_robot(image, scene.place, world.size, cell)
    bar = {None: ELAPSED, True: SUCCEEDED, False: FAILED}[scene.success]
    image[side + 2 :, : round(side * scene.tick / scene.deadline)] = bar
    return image


def _write(image: NDArray[np.uint8], text: str, left: int, top: int, pixel: int) -> None:
    """Write a label with square dots of some pixels, its upper left corner given."""
    for character in text:
        dots = np.array([list(map(int, line)) for line in _GLYPHS[character].split()], dtype=np.bool_)
        glyph = np.kron(dots, np.ones((pixel, pixel), dtype=np.bool_))
        height, width = glyph.shape
        image[top : top + height, left : left + width][glyph] = INK
        left += width + pixel


def _draw_robot(image: NDArray[np.uint8], place: tuple[int, int, int], size: int, cell: int) -> None:
    i, j, heading = place
    left, top = i * cell + 1, (size - 1 - j) * cell + 1
    inner = cell - 1  # without the grid lines
    tile = image[top : top + inner, left : left + inner].astype(np.float64)
    for scale, colour in ((1.3, FLOOR), (1.0, INK)):  # a white rim keeps it clear on every colour
        cover = _arrowhead_cover(inner, heading, scale)[..., None]
        tile = tile * (1 - cover) + np.array(colour) * cover
    image[top : top + inner, left : left + inner] = np.rint(tile).astype(np.uint8)


def _arrowhead_cover(pixels: int, heading: int, scale: float) -> NDArray[np.float64]:
    """Which part of each pixel of a cell the arrowhead covers, shape ``(pixels, pixels)``."""
    fine = pixels * _SAMPLES
    along = (np.arange(fine) + 0.5) / fine - 0.5
    x, y = along[None, :], -along[:, None]  # rows go down, y goes up
    (cosine, sine) = STEPS[heading]
    covered = np.zeros((fine, fine), dtype=np.bool_)
    for triangle in _ARROWHEAD:
        # scaled about the middle of the arrowhead's axis, and turned
        points = [
            ((a * cosine - b * sine), (a * sine + b * cosine))
            for a, b in ((0.03 + (px - 0.03) * scale, py * scale) for px, py in triangle)
        ]
        sides = [
            (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1], strict=True)
        ]
        covered |= np.all(np.array(sides) >= 0, axis=0)
    cover: NDArray[np.float64] = covered.reshape(pixels, _SAMPLES, pixels, _SAMPLES).mean(axis=(1, 3))
    return cover
