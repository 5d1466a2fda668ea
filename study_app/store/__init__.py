"""Keeping what happened: journal, receipt, derived tables, sealed conditions."""
