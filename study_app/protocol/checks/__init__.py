"""Checks of a protocol: cross-references and consistency."""

from study_app.protocol.checks.cross_references import CHOICES, ITEM_REFERENCES, OWN, TEXTS
from study_app.protocol.checks.designs import missing_for_rule
from study_app.protocol.checks.force_limits import blocks_by_stimulus, check_paced, slope_limit_fault

__all__ = [
    "CHOICES",
    "ITEM_REFERENCES",
    "OWN",
    "TEXTS",
    "blocks_by_stimulus",
    "check_paced",
    "missing_for_rule",
    "slope_limit_fault",
]
