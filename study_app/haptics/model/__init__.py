"""Scenes, liquids, bodies and limits as plain values; no compiler."""
