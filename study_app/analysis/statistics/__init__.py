"""Tests, effect sizes and intervals: arrays in, frozen results out; nothing is read, written or drawn here."""
