"""What the trials of a study present: their tracks, levels, and intervals."""

from study_app.protocol.presented.presentation import (
    Presentation,
    arrangement_of,
    arrangement_text,
    delay_s_of,
    has_imperfect_link,
    is_criterion_met,
    link_descriptions,
    link_seed,
    longest_delay_s,
    next_level,
    presented_condition,
    recorded_presentation,
    scene_of,
    trial_result,
)
from study_app.protocol.presented.presented_levels import extreme_levels, highest_damping, level_limits, levels

__all__ = [
    "Presentation",
    "arrangement_of",
    "arrangement_text",
    "delay_s_of",
    "extreme_levels",
    "has_imperfect_link",
    "highest_damping",
    "is_criterion_met",
    "level_limits",
    "levels",
    "link_descriptions",
    "link_seed",
    "longest_delay_s",
    "next_level",
    "presented_condition",
    "recorded_presentation",
    "scene_of",
    "trial_result",
]
