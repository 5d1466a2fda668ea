"""Tests whether thresholds of simulated observers are recovered, by methods and analysis and by the whole program."""

from study_app.evidence.thresholds.known_values import NAMES, known_value, known_values_evidence, validate_known_values
from study_app.evidence.thresholds.noticed_delays import compare_delays, noticed_delays_evidence

__all__ = [
    "NAMES",
    "compare_delays",
    "known_value",
    "known_values_evidence",
    "noticed_delays_evidence",
    "validate_known_values",
]
