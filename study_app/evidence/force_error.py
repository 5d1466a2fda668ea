"""The error of a force against a reference solution."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from study_app.evidence.reference_solutions import Truth
from study_app.haptics.model.motion import Floats

RELATIVE: Final = 0.05
FELT_N: Final = 0.05
"""The accuracy target: max(5 % of the force, 0.05 N), below the smallest difference of force that people feel, 7 %."""
ROUNDING: Final = 1e-9
"""Errors below this share of the force are rounding errors, and count as equal."""


class Error(NamedTuple):
    """The errors of a force: root mean square and greatest [N], relative to those of the reference, and direction.

    ``direction_deg`` is the root mean square angle where the reference is perceptible, or else not near zero.
    """

    rms_n: float
    most_n: float
    rms: float
    most: float
    direction_deg: float
    target: float  # max(5 %, 0.05 N) as a share of the true force


def error_of(forces_n: Sequence[Floats], truth: Truth) -> Error:
    """Return the errors of forces, one (n, 3) array for each case of the reference."""
    true_n = np.concatenate([case.force_n[case.counted] for case in truth.cases])
    felt_n = np.concatenate([force[case.counted] for force, case in zip(forces_n, truth.cases, strict=True)])
    sizes_n = np.linalg.norm(true_n, axis=1)
    wrong_n = np.linalg.norm(felt_n - true_n, axis=1)
    true_rms_n, true_most_n = _rms(sizes_n), float(sizes_n.max())
    rms_n, most_n = _rms(wrong_n), float(wrong_n.max())
    counts = (sizes_n >= min(FELT_N, RELATIVE * true_most_n)) & (np.linalg.norm(felt_n, axis=1) > 0)
    cross = np.linalg.norm(np.cross(felt_n[counts], true_n[counts]), axis=1)
    angles = np.degrees(np.arctan2(cross, (felt_n[counts] * true_n[counts]).sum(axis=1)))
    target = max(RELATIVE, FELT_N / true_rms_n)
    direction_deg = _rms(angles) if len(angles) else math.nan
    return Error(rms_n, most_n, rms_n / true_rms_n, most_n / true_most_n, direction_deg, target)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
