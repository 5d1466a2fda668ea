"""Scenes, liquids, bodies and limits as plain values; no compiler.

Reading order: device_dynamics, effect, force_rules, motion, ranges; estimators, laws; effects; layout, scene; gate,
overrides; slope_limits.
"""
