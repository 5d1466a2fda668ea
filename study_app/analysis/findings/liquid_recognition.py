"""Which liquids participants recognized."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.analysis.findings.item_test import Verdict
from study_app.analysis.statistics.recognition import Recognition


@dataclass(frozen=True, slots=True)
class RecognitionResult:
    """The recognition of liquids: the items that name one, and which of them is right for each setting (code)."""

    labels: tuple[str, ...]
    settings: tuple[str, ...]
    right: tuple[str | None, ...]
    found: Recognition
    verdict: Verdict
