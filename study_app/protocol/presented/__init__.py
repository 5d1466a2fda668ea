"""The content of a study's trials: tracks, levels, and intervals."""

from study_app.protocol.presented.presentation import (
    Presentation,
    is_criterion_met,
    link_descriptions,
    link_seed,
    longest_delay_s,
    next_level,
    recorded_presentation,
    trial_result,
)
from study_app.protocol.presented.presented_levels import extreme_levels, highest_damping, level_limits

__all__ = [
    "Presentation",
    "extreme_levels",
    "highest_damping",
    "is_criterion_met",
    "level_limits",
    "link_descriptions",
    "link_seed",
    "longest_delay_s",
    "next_level",
    "recorded_presentation",
    "trial_result",
]
