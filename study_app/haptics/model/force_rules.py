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

    Added mass and history that exceed their limit are scaled to it up to ``kept_excess`` times the limit, beyond that
    to less, with the cube of the ratio, at least to ``cut_inertia_share`` of the drag limit: with more, released
    handles oscillated. With "kalman" they are first smoothed for up to ``longest_smoothing`` times as long, until that
    took ``smoothed_excess`` of the excess (of its logarithm): each alone distorts the force more. At 1 kHz the limit of
    "kalman" is ``most_inertia_nspm`` (0: that of the table), less with the cube of a drag limit below
    ``inertia_drag_nspm``: so no loop of the sweep oscillated whose delay was one tick longer than assumed. [choice]
    "ewma" has at least ``ewma_share`` of it, up to its limit at one tick of delay: with all of it, one loop of 27,000
    exceeded the permitted force above 40 Hz.
    ``smoothing_lead`` is 1 if the smoothing does not lag with "kalman" (`kernels.effects.added_mass`), else 0, and
    ``jerk_of_speed_ps3`` the growth of its model's jerk with speed.
    ``fade_out_s`` is how long the force takes to fade out without usable samples, ``fade_out_slew`` the fraction of the
    slew limit meanwhile: with a third, a handle of 50 g released in a gap gained 6.5 mJ. ``hand_mps2`` is the greatest
    acceleration by a hand, ``gap_ticks`` the time between two samples, in nominal periods, above which it is a gap
    (`sample_validation`), ``quiet_s`` how long a hand must be quiet for its energy debt to be forgiven (`passivity`).
    ``history_rs`` is the square root of the period of the oscillation whose inertia the history force may return as
    energy: with that of 1 Hz, a handle of 200 g let go in tar oscillated at 35 Hz on energy that 35 Hz do not store.
    ``known_force_ticks`` is the shortest delay at which "kalman" computes inertial forces with the known force instead
    of smoothing and limiting them (`kernels.known_force`), up to an inertia of ``most_known_inertia`` times the least
    mass of the device and a scale of ``most_known_scale``: beyond, the force was noisy. Without it, the passivity
    controller withheld 13 to 41 % of oils of 1 to 10 Pa s in reaches without delay. After a surprise, it is not used
    for ``unused_s``, and returns within ``regained_s``: with a second each, the controller withheld 17 to 79 % of
    repeated reaches at three and four ticks. ``swing_mps`` is the least speed at which reversals count as an
    oscillation of the handle, which lowers the gain (`passivity`).
    After a peak of more than 40 mm/s, faster than any tremor, a reversal may take ``shaken_reversal_s``: a released
    handle of 50 g oscillated at 10 Hz.
    ``trusts_gaps`` is 1 if the energy balance counts a step over a gap in full, 0 if only the energy that it cost: the
    position may have jumped.
    ``acting_share`` is the fraction of the time in which the passivity controller may change a force that a study
    delays, before the gain falls: with 0.3, a handle stirred at 9 Hz with 50 ms of delay oscillated above 40 Hz.
    ``late_swing_mps`` is ``swing_mps`` for a force that a study delays: a released handle of 50 g oscillated at 13 Hz
    with the 1 mJ that are tolerated. With 0.06, the controller withheld 23 % of thesis water delayed by 20 ms from a
    light hand.
    ``false_lead_gain`` times the false fraction of its lead over "ewma" is taken from the velocity of "kalman"
    (`kernels.estimators`): with 1, the velocity on real encoders was noisier than that of "ewma". A fraction of
    ``tolerated_false_lead`` counts as 0: in a stroke of 8 Hz the mean over eight samples alone makes it 0.024, and the
    controller withheld twice as much of such strokes in light oil.
    ``fast_radps`` and ``fast_damping`` are the corner frequency and the damping ratio of the high-pass filter of the
    known force: a handle of 0.2 kg has 7 Hz and 0.3 in a middle grip, 4 Hz and 0.2 in a light one, 11 Hz and 0.5 in a
    firm one. With 5.5 Hz and 0.5, up to half of the drag in honey and glycerin was lost at 3 Hz; with 8 Hz and 0.5,
    a light hand lost a third of the inertia of honey at three ticks.
    """

    version: int
    cut_inertia_share: float = 0.15
    kept_excess: float = 0.0
    smoothed_excess: float = 0.0
    longest_smoothing: float = 1.0
    inertia_drag_nspm: float = 0.0
    most_inertia_nspm: float = 0.0
    ewma_share: float = 0.0
    smoothing_lead: float = 0.0
    jerk_of_speed_ps3: float = 4000.0
    fade_out_s: float = 0.045
    fade_out_slew: float = 1.0 / 3.0
    hand_mps2: float = math.inf
    gap_ticks: float = math.inf
    quiet_s: float = math.inf
    history_rs: float = 1.0
    known_force_ticks: int = 99
    most_known_inertia: float = 7.0
    most_known_scale: float = 3.0
    unused_s: float = 1.0
    regained_s: float = 1.0
    swing_mps: float = math.inf
    shaken_reversal_s: float = 0.05
    trusts_gaps: float = 1.0
    acting_share: float = math.inf
    late_swing_mps: float = math.inf
    false_lead_gain: float = 0.0
    tolerated_false_lead: float = 0.0
    fast_radps: float = 2.0 * math.pi * 5.5
    fast_damping: float = 0.5


VERSIONS: Final = {
    rules.version: rules
    for rules in (
        ForceRules(version=1),
        ForceRules(version=2),
        ForceRules(
            version=3,
            kept_excess=1.75,
            smoothed_excess=0.5,
            longest_smoothing=1.6,
            inertia_drag_nspm=21.8,
            most_inertia_nspm=33.0,
            ewma_share=0.9,
            smoothing_lead=1.0,
            jerk_of_speed_ps3=2200.0,
            fade_out_s=0.01,
            fade_out_slew=1.0,
            hand_mps2=50.0,
            gap_ticks=4.5,
            quiet_s=0.3,
            history_rs=math.sqrt(0.02),
        ),
    )
}
VERSIONS[4] = VERSIONS[3]._replace(version=4, known_force_ticks=1)
VERSIONS[5] = VERSIONS[4]._replace(version=5, swing_mps=0.01)
VERSIONS[6] = VERSIONS[5]._replace(version=6, acting_share=0.25)
VERSIONS[7] = VERSIONS[6]._replace(version=7, shaken_reversal_s=0.06, trusts_gaps=0.0)
VERSIONS[8] = VERSIONS[7]._replace(version=8, known_force_ticks=0, unused_s=0.05, regained_s=0.1)
VERSIONS[9] = VERSIONS[8]._replace(version=9, late_swing_mps=0.1)
VERSIONS[10] = VERSIONS[9]._replace(version=10, false_lead_gain=1.5)
VERSIONS[11] = VERSIONS[10]._replace(version=11, fast_radps=2.0 * math.pi * 7.5, fast_damping=0.3)
VERSIONS[12] = VERSIONS[11]._replace(version=12, tolerated_false_lead=0.05)

FORCE_RULES: Final = 12
"""The version by which this program computes forces. Receipts state it: released numbers never change, new numbers are
a new version."""
CURRENT: Final = VERSIONS[FORCE_RULES]


def rules_from(described: Mapping[str, Any]) -> ForceRules:
    """Return the rules that a receipt records with its device; those of version 1 in receipts of earlier versions.

    Raises
    ------
    StoreError
        The version of the rules is unknown to this program.
    """
    version = described.get("force_rules", 1)
    if version not in VERSIONS:
        raise StoreError(
            f"the receipt uses force rules {version!r}, but this version of liquid-study supports only rules 1 to "
            f"{FORCE_RULES}: use a newer version"
        )
    return VERSIONS[version]
