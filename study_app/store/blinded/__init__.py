"""Blinding: the sealed key, sealed columns, unblinding."""
