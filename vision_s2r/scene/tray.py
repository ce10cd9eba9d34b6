"""The bin: an open box on a table, its floor's top at z = 0, its middle at the world's origin."""

from dataclasses import dataclass

INNER = 0.25  # m, inner edge length
WALL = 0.008
HEIGHT = 0.05
DEPTH_OF_FLOOR = 0.01


@dataclass(frozen=True)
class TrayPart:
    """A box: its name, edge lengths [3] and middle [3], metres."""

    name: str
    size: tuple[float, float, float]
    position: tuple[float, float, float]


_OUTER = INNER + 2 * WALL
_WALL_AT = (INNER + WALL) / 2
PARTS = (
    TrayPart("bin_floor", (_OUTER, _OUTER, DEPTH_OF_FLOOR), (0.0, 0.0, -DEPTH_OF_FLOOR / 2)),
    TrayPart("bin_left", (WALL, _OUTER, HEIGHT), (-_WALL_AT, 0.0, HEIGHT / 2)),
    TrayPart("bin_right", (WALL, _OUTER, HEIGHT), (_WALL_AT, 0.0, HEIGHT / 2)),
    TrayPart("bin_front", (INNER, WALL, HEIGHT), (0.0, -_WALL_AT, HEIGHT / 2)),
    TrayPart("bin_back", (INNER, WALL, HEIGHT), (0.0, _WALL_AT, HEIGHT / 2)),
)
