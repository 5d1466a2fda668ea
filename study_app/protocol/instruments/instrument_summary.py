"""A study's standard questionnaires in words, for who checks it: their sources, and what is from memory."""

from __future__ import annotations

from collections.abc import Iterator

from study_app.protocol.model import Protocol
from study_app.protocol.questionnaires import Questionnaire, instrument


def sources(questionnaire: Questionnaire) -> Iterator[str]:
    """Yield where a questionnaire's items and scores come from, and what these were compared with."""
    if questionnaire.instrument is not None:
        found = instrument(questionnaire.instrument)
        yield f"Source: {found['source']}"
        yield f"Compared: {found['compared']}"


def warnings(protocol: Protocol) -> Iterator[str]:
    """Yield what is reproduced from memory in a questionnaire that the study uses."""
    for name, questionnaire in protocol.questionnaires.items():
        of = questionnaire.instrument
        if of is not None and (recalled := instrument(of).get("from_memory")) is not None:
            yield f"questionnaires.{name}: from memory, compared with no source: {recalled}: compare it with your copy"
