"""Where a point of the hand frame falls on the screen, and how large a ball is there.

A pinhole camera in front of the tank, a little above it and looking down: the floor shows, so that shadows on it tell
depth. Everything is in the hand frame (x right, y up, z toward the participant, metres) until `Camera.point`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

Point: TypeAlias = tuple[float, float, float]
Pixel: TypeAlias = tuple[float, float]

PITCH = math.radians(14.4)
DISTANCE = 3.3  # from the eye to the middle of the glass, in heights of the water beyond half the depth
LEAST_WIDTH = 2.05  # of the water, in its heights: a tank looks like a tank
LEAST_DEPTH = 1.2
GLASS_ABOVE = 0.13  # of the water's height
MARGIN_M = 0.0025  # between ball and glass


@dataclass(frozen=True, slots=True)
class Box:
    """The inside of the tank: half width, floor, water level, glass edge, half depth [m]."""

    x: float
    floor: float
    water: float
    top: float
    z: float

    @classmethod
    def around(cls, workspace_m: Point, ball_m: float) -> Box:
        """Return the tank in which a ball of radius ``ball_m`` can be at every place of the workspace (full sizes)."""
        spare = 2 * (ball_m + MARGIN_M)
        width, height, depth = (size + spare for size in workspace_m)
        return cls(
            x=max(width, LEAST_WIDTH * height) / 2,
            floor=-height / 2,
            water=height / 2,
            top=height * (0.5 + GLASS_ABOVE),
            z=max(depth, LEAST_DEPTH * height) / 2,
        )

    def corners(self) -> tuple[Point, ...]:
        """Return the eight corners of the glass."""
        return tuple((x, y, z) for x in (-self.x, self.x) for y in (self.floor, self.top) for z in (-self.z, self.z))


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole at (0, ``eye_y``, ``eye_z``) [m] that looks down by ``pitch`` [rad]; ``focal`` and ``centre`` in px."""

    eye_y: float
    eye_z: float
    focal: float
    centre_x: float
    centre_y: float
    pitch: float = PITCH

    @classmethod
    def fitted(cls, box: Box, left: float, top: float, width: float, height: float, *, pitch: float = PITCH) -> Camera:
        """Return the camera that shows the whole box as large as the rectangle allows, in its middle [px]."""
        middle = (box.top + box.floor) / 2
        distance = DISTANCE * (box.water - box.floor) + box.z
        eye_y = middle + math.sin(pitch) * distance
        eye_z = math.cos(pitch) * distance
        bare = cls(eye_y, eye_z, 1.0, 0.0, 0.0, pitch)
        pixels = [bare.point(corner) for corner in box.corners()]
        xs, ys = [x for x, _ in pixels], [y for _, y in pixels]
        focal = min(width / (max(xs) - min(xs)), height / (max(ys) - min(ys)))
        return cls(
            eye_y,
            eye_z,
            focal,
            left + width / 2 - focal * (max(xs) + min(xs)) / 2,
            top + height / 2 - focal * (max(ys) + min(ys)) / 2,
            pitch,
        )

    def distance(self, point: Point) -> float:
        """Return how far a point is from the eye along the line of sight [m]."""
        _, y, z = point
        return (self.eye_y - y) * math.sin(self.pitch) + (self.eye_z - z) * math.cos(self.pitch)

    def scale(self, point: Point) -> float:
        """Return px per metre at a point's distance."""
        return self.focal / self.distance(point)

    def point(self, point: Point) -> Pixel:
        """Return where a point falls on the screen [px]."""
        x, y, z = point
        up = (y - self.eye_y) * math.cos(self.pitch) - (z - self.eye_z) * math.sin(self.pitch)
        scale = self.scale(point)
        return self.centre_x + scale * x, self.centre_y - scale * up
