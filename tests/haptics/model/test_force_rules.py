"""The versions of the force rules: released numbers stay, new numbers are a new version."""

import math

from study_app.haptics.model.force_rules import CURRENT, FORCE_RULES, VERSIONS

RELEASED = {
    "cut_inertia_share": 0.15,
    "kept_excess": 0.0,
    "smoothed_excess": 0.0,
    "longest_smoothing": 1.0,
    "inertia_drag_nspm": 0.0,
    "most_inertia_nspm": 0.0,
    "ewma_share": 0.0,
    "smoothing_lead": 0.0,
    "jerk_of_speed_ps3": 4000.0,
    "fade_out_s": 0.045,
    "fade_out_slew": 1.0 / 3.0,
    "hand_mps2": math.inf,
    "gap_ticks": math.inf,
    "quiet_s": math.inf,
    "history_rs": 1.0,
    "known_force_ticks": 99,
    "most_known_inertia": 7.0,
    "most_known_scale": 3.0,
    "unused_s": 1.0,
    "regained_s": 1.0,
    "swing_mps": math.inf,
    "shaken_reversal_s": 0.05,
    "trusts_gaps": 1.0,
    "acting_share": math.inf,
    "late_swing_mps": math.inf,
    "false_lead_gain": 0.0,
    "tolerated_false_lead": 0.0,
    "fast_radps": 34.55751918948772,  # 5.5 Hz
    "fast_damping": 0.5,
}


def test_released_versions_keep_their_numbers():
    for version in (1, 2):
        assert VERSIONS[version]._asdict() == {"version": version, **RELEASED}
    assert VERSIONS[5]._asdict() == {**VERSIONS[4]._asdict(), "version": 5, "swing_mps": 0.01}
    assert VERSIONS[6]._asdict() == {**VERSIONS[5]._asdict(), "version": 6, "acting_share": 0.25}
    assert VERSIONS[7]._asdict() == {
        **VERSIONS[6]._asdict(),
        "version": 7,
        "shaken_reversal_s": 0.06,
        "trusts_gaps": 0.0,
    }
    assert VERSIONS[8]._asdict() == {
        **VERSIONS[7]._asdict(),
        "version": 8,
        "known_force_ticks": 0,
        "unused_s": 0.05,
        "regained_s": 0.1,
    }
    assert VERSIONS[9]._asdict() == {**VERSIONS[8]._asdict(), "version": 9, "late_swing_mps": 0.1}
    assert VERSIONS[10]._asdict() == {**VERSIONS[9]._asdict(), "version": 10, "false_lead_gain": 1.5}
    assert VERSIONS[11]._asdict() == {
        **VERSIONS[10]._asdict(),
        "version": 11,
        "fast_radps": 47.12388980384689,  # 7.5 Hz
        "fast_damping": 0.3,
    }
    assert VERSIONS[12]._asdict() == {**VERSIONS[11]._asdict(), "version": 12, "tolerated_false_lead": 0.05}


def test_the_present_version_is_the_newest_and_has_its_own_numbers():
    assert max(VERSIONS) == FORCE_RULES
    assert [rules.version for rules in VERSIONS.values()] == list(VERSIONS)
    assert all(CURRENT[1:] != rules[1:] for rules in VERSIONS.values() if rules is not CURRENT)
