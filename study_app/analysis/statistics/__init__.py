"""Tests, effect sizes and intervals: arrays in, frozen results out; nothing is read, written or drawn here.

Reading order: outcome; effect_sizes, mean_tests, rank_tests, recognition_tests, thresholds; equivalence, trend_tests;
slope_tests; cumulative_models.
"""

from study_app.analysis.statistics.equivalence import STEPS, p_equivalent, tost
from study_app.analysis.statistics.mean_tests import means_of, p_differs
from study_app.analysis.statistics.outcome import Array, holm, student_interval
from study_app.analysis.statistics.recognition_tests import recognition
from study_app.analysis.statistics.thresholds import Threshold, detection_threshold
from study_app.analysis.statistics.trend_tests import trend

__all__ = [
    "STEPS",
    "Array",
    "Threshold",
    "detection_threshold",
    "holm",
    "means_of",
    "p_differs",
    "p_equivalent",
    "recognition",
    "student_interval",
    "tost",
    "trend",
]
