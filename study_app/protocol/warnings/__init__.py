"""Warnings about a valid protocol, such as withheld forces, imprecise thresholds and untranslated texts.

Reading order: delayed_force, expected_precision, group_names, question_warnings, untranslated; study_warnings.
"""

from study_app.protocol.warnings.delayed_force import WITHHELD_PERCENT, Entry, longest_delay_ms, stored_table
from study_app.protocol.warnings.expected_precision import (
    PRECISION,
    EstimationPlan,
    MeanPlan,
    RatingPlan,
    SensitivityPlan,
    ThresholdPlan,
    expected_of,
    imprecise,
    precision_plan,
    precision_rows,
    threshold_plan,
)
from study_app.protocol.warnings.study_warnings import warnings
from study_app.protocol.warnings.untranslated import (
    UntranslatedText,
    check_translated,
    describe_untranslated,
    listed_places,
    untranslated_at,
    untranslated_on_pages,
    untranslated_texts,
)

__all__ = [
    "PRECISION",
    "WITHHELD_PERCENT",
    "Entry",
    "EstimationPlan",
    "MeanPlan",
    "RatingPlan",
    "SensitivityPlan",
    "ThresholdPlan",
    "UntranslatedText",
    "check_translated",
    "describe_untranslated",
    "expected_of",
    "imprecise",
    "listed_places",
    "longest_delay_ms",
    "precision_plan",
    "precision_rows",
    "stored_table",
    "threshold_plan",
    "untranslated_at",
    "untranslated_on_pages",
    "untranslated_texts",
    "warnings",
]
