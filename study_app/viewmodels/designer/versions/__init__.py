"""Versions of a study as the designer shows them. No Qt here."""
