"""Checks of a protocol: cross-references and consistency."""
