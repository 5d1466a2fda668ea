"""The comparison of two conditions."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.analysis.findings.item_test import Tested


@dataclass(frozen=True, slots=True)
class Pair:
    """Two settings (codes) compared in one statement; the family is all pairs that are compared in the block."""

    first: str
    second: str
    tested: Tested
