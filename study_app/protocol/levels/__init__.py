"""Levels of stimuli as they are presented."""
