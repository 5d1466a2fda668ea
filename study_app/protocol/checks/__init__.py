"""Checks of a protocol: cross-references and consistency."""

from study_app.protocol.checks.cross_references import CHOICES, ITEM_REFERENCES, SEQUENCE_KEYS, TEXTS
from study_app.protocol.checks.designs import fitting_rules
from study_app.protocol.checks.force_limits import blocks_by_stimulus, check_paced, slope_limit_fault

__all__ = [
    "CHOICES",
    "ITEM_REFERENCES",
    "SEQUENCE_KEYS",
    "TEXTS",
    "blocks_by_stimulus",
    "check_paced",
    "fitting_rules",
    "slope_limit_fault",
]
