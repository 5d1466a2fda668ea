"""Vectors of three: array fields of records, shape (3,), changed in place, and tuples, which stay in registers."""

from __future__ import annotations

import math
from typing import Any, Final, TypeAlias

from study_app.haptics.kernels.compiled import part

Vector: TypeAlias = tuple[float, float, float]
ZERO: Final[Vector] = (0.0, 0.0, 0.0)


@part
def components(vector: Any) -> Vector:
    """Return its components as a tuple."""
    return vector[0], vector[1], vector[2]


@part
def vector_sum(a: Any, b: Any) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def difference(a: Any, b: Any) -> Vector:
    """Return a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def multiple(vector: Any, factor: float) -> Vector:
    """Return it times a factor."""
    return factor * vector[0], factor * vector[1], factor * vector[2]


@part
def clear(vector: Any) -> None:
    """Set it to zero."""
    vector[0] = 0.0
    vector[1] = 0.0
    vector[2] = 0.0


@part
def copy(source: Any, to: Any) -> None:
    """Set ``to`` to ``source``."""
    x, y, z = source[0], source[1], source[2]  # all loads before the stores, so that they are vectorised
    to[0], to[1], to[2] = x, y, z


@part
def subtract(a: Any, b: Any, to: Any) -> None:
    """Set ``to`` to a − b."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    to[0], to[1], to[2] = x, y, z


@part
def norm(vector: Any) -> float:
    """Return its length."""
    return math.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@part
def square(vector: Any) -> float:
    """Return its length squared, which compares lengths without a root."""
    return float(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


@part
def dot(a: Any, b: Any) -> float:
    """Return a · b."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@part
def distance(a: Any, b: Any) -> float:
    """Return the length of a − b."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


@part
def square_distance(a: Any, b: Any) -> float:
    """Return the length of a − b, squared."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return float(x * x + y * y + z * z)


@part
def is_finite(vector: Any) -> bool:
    """Return whether all three are finite."""
    return bool(abs(vector[0]) + abs(vector[1]) + abs(vector[2]) < math.inf)
