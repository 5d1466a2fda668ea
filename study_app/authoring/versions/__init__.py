"""Versions of a study: contents that were saved, contents that sessions were run with, and how they differ."""
