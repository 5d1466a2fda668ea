"""Numbers of the force computation that differ between versions of the program, so that old recordings replay.

A receipt states the version of the rules. Compiled code reads the rules of its
scene from ``parameters.rules`` (`layout.RULES`), so that one code computes the force of every version.
"""

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from study_app.errors import StoreError


class ForceRules(NamedTuple):
    """The rules of one version.

    With "kalman", added mass and history that exceed their limit are smoothed for up to ``longest_smoothing`` times as
    long; with every estimator they are then scaled to it, or to ``cut_inertia_share`` of the drag limit if that is
    less. At 1 kHz the limit of "kalman" is ``inertia_of_drag`` times that of drag, at most ``most_inertia_nspm`` (0:
    that of the table). ``smoothing_lead`` is the share of the lag of smoothing that is compensated
    (`kernels.effects.added_mass`). The others are those of the filter (`kernels.estimators.kalman`).
    """

    version: int
    cut_inertia_share: float = 0.15
    longest_smoothing: float = 1.0
    inertia_of_drag: float = 0.0
    most_inertia_nspm: float = 0.0
    smoothing_lead: float = 0.0
    jerk_m2ps5: float = 0.5
    jerk_of_speed_ps3: float = 4000.0
    jerk_of_acceleration_ps: float = 10.0
    jerk_of_force_ps: float = 0.0
    snap_of_acceleration_ps3: float = 0.0
    snap_of_jerk_ps: float = 0.0
    first_jerk_mps3: float = 0.0


VERSIONS: Final = {
    rules.version: rules
    for rules in (
        ForceRules(version=1),
        ForceRules(version=2),
        ForceRules(
            version=3,
            cut_inertia_share=math.inf,
            longest_smoothing=1.3,
            inertia_of_drag=1.6,
            most_inertia_nspm=36.0,
            smoothing_lead=0.8,
            jerk_m2ps5=0.3,
            jerk_of_speed_ps3=400.0,
            jerk_of_acceleration_ps=1.0,
            jerk_of_force_ps=16.0,
            snap_of_acceleration_ps3=100.0,
            snap_of_jerk_ps=3.0,
            first_jerk_mps3=100.0,
        ),
    )
}

FORCE_RULES: Final = 3
"""The version by which this program computes forces. Receipts state it: released numbers never change, new numbers are
a new version."""
CURRENT: Final = VERSIONS[FORCE_RULES]


def rules_from(described: Mapping[str, Any]) -> ForceRules:
    """Return the rules that a receipt records with its device; those of version 1 in receipts of earlier versions.

    Raises
    ------
    StoreError
        They are of a version that this program does not know.
    """
    version = described.get("force_rules", 1)
    if version not in VERSIONS:
        raise StoreError(
            f"the receipt states force rules {version!r}, this version knows 1 to {FORCE_RULES}: use a newer version "
            "of liquid-study"
        )
    return VERSIONS[version]
