"""Versions in the designer: the card that asks before saving, and the tab Changes."""
