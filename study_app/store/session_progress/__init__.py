"""How far a session is: delivered values, missing trials, and progress computed from the journal."""

from study_app.store.session_progress.delivered import (
    JUDGED,
    LONGEST_S,
    TOLERATED_TICKS,
    Broken,
    Delivered,
    beyond_limits,
    broken_interval_limits,
    broken_limits,
    broken_trial_limits,
    delay_error_ms,
    delivered_error,
    delivered_values,
    judged_fields,
    late_device_text,
    late_device_ticks,
)
from study_app.store.session_progress.missing_trials import MISSING_PERCENT, REASONS, MissingTrials, limit_reason
from study_app.store.session_progress.progress import Progress, TrialAnswer, attempt_name, progress_of, trial_results

__all__ = [
    "JUDGED",
    "LONGEST_S",
    "MISSING_PERCENT",
    "REASONS",
    "TOLERATED_TICKS",
    "Broken",
    "Delivered",
    "MissingTrials",
    "Progress",
    "TrialAnswer",
    "attempt_name",
    "beyond_limits",
    "broken_interval_limits",
    "broken_limits",
    "broken_trial_limits",
    "delay_error_ms",
    "delivered_error",
    "delivered_values",
    "judged_fields",
    "late_device_text",
    "late_device_ticks",
    "limit_reason",
    "progress_of",
    "trial_results",
]
