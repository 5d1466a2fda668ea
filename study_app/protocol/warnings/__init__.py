"""Warnings about a valid protocol: withheld forces, imprecise thresholds, names of groups, untranslated texts."""
