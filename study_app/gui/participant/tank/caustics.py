"""Light on the floor of the tank: real caustics of a still, gently rippled surface, computed once.

Vertical rays are bent by the slope of the surface and gathered where they land. The ripple is fixed: the tank shows
no motion of its own, the same for every liquid.
"""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

COLUMNS, ROWS = 512, 320
RAYS = 2  # per cell and axis
BEND = 0.075  # largest shift of a ray, in widths of the floor
WAVES = 12
SEED = 7


@cache
def brightness() -> NDArray[np.float32]:
    """Return the light on the floor above its mean as a (320, 512) array in 0 … 1, back of the tank first."""
    random = np.random.Generator(np.random.PCG64(SEED))
    x = _starts(COLUMNS)[None, :]
    z = _starts(ROWS)[:, None]
    shift_x = np.zeros((z.size, x.size), np.float32)
    shift_z = np.zeros_like(shift_x)
    for _ in range(WAVES):
        number = math.tau * random.uniform(2.0, 8.0)
        angle = random.uniform(0, math.tau)
        along_x, along_z = math.cos(angle), math.sin(angle)
        slope = BEND / WAVES * np.cos(number * (along_x * x + along_z * z) + random.uniform(0, math.tau))
        shift_x += along_x * slope
        shift_z += along_z * slope
    landed = _gathered(x + shift_x, z + shift_z)
    soft = _blurred(_blurred(_blurred(landed)))
    above = np.clip(soft - 0.85, 0, None)
    light: NDArray[np.float32] = np.clip(above / 2.6, 0, 1).astype(np.float32)
    return light


def _starts(cells: int) -> NDArray[np.float32]:
    """Return where rays start along one axis [widths of the floor], a shift beyond either end of it."""
    beyond = math.ceil(BEND * COLUMNS) * RAYS
    starts: NDArray[np.float32] = np.arange(-beyond, cells * RAYS + beyond, dtype=np.float32)
    return (starts + np.float32(0.5)) / np.float32(COLUMNS * RAYS)


def _gathered(x: NDArray[np.float32], z: NDArray[np.float32]) -> NDArray[np.float64]:
    """Count rays per cell of the floor, 1 where it is as bright as without ripples."""
    column = np.floor(x * COLUMNS).astype(np.int32).ravel()
    row = np.floor(z * COLUMNS).astype(np.int32).ravel()
    inside = (column >= 0) & (column < COLUMNS) & (row >= 0) & (row < ROWS)
    counts = np.bincount(row[inside] * COLUMNS + column[inside], minlength=ROWS * COLUMNS)
    return counts.reshape(ROWS, COLUMNS) / RAYS**2


def _blurred(image: NDArray[np.float64], radius: int = 1) -> NDArray[np.float64]:
    """Return the image after a box filter of 2 radius + 1 cells in both directions, edges repeated."""
    width = 2 * radius + 1
    for axis in (0, 1):
        padded = np.pad(image, [(radius + 1, radius) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        summed = np.cumsum(padded, axis=axis)
        image = (
            np.take(summed, range(width, summed.shape[axis]), axis)
            - np.take(summed, range(summed.shape[axis] - width), axis)
        ) / width
    return image
