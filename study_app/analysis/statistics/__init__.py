"""Tests, effect sizes and intervals: arrays in, frozen results out; nothing is read, written or drawn here.

Reading order: outcome; effect_sizes, mean_tests, rank_tests, recognition, thresholds; equivalence, trend;
slope_tests; cumulative_models.
"""
