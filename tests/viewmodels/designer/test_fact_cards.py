"""Facts of a study in words: those of the program's own functions, unknown while the study has faults."""

from __future__ import annotations

from study_app.authoring.facts import facts
from study_app.authoring.study import read
from study_app.authoring.writer.edits import Set, Unset
from study_app.haptics.model.steady_state import HAND_MPS, steady
from study_app.protocol.durations import expected_duration_s
from study_app.protocol.load import load
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.fact_cards import UNKNOWN, fact_cards
from study_app.viewmodels.number_words import minutes

STUDY = read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


def test_facts_are_those_of_the_study() -> None:
    protocol = load("rek2024")
    found = fact_cards(facts(STUDY), STUDY.document)
    numbers = {word: number for number, word in found.figures}
    assert numbers["expected"] == minutes(expected_duration_s(protocol))
    assert numbers["answers"] == "62"
    assert [line.force for line in found.forces] == [
        f"{steady(protocol.scene_of(name), HAND_MPS).force_n:.2f} N" for name in protocol.liquids
    ]
    assert not any(line.clipped for line in found.forces)
    assert found.texts[0] == "ok"


def test_numbers_of_a_study_with_faults_are_unknown_and_missing_texts_are_counted() -> None:
    broken, _ = STUDY.edited(Unset(("blocks", "liquids", "title", "nl")))
    found = fact_cards(facts(broken), broken.document)
    assert {number for number, _ in found.figures} == {UNKNOWN}
    assert found.forces == ()
    assert found.texts == ("bad", "warning", "Missing texts: 1 in nl")


def test_a_force_that_the_limit_clips_is_said() -> None:
    weak, _ = STUDY.edited(Set(("device", "force_limit_n"), 0.5))
    found = fact_cards(facts(weak), weak.document)
    assert all(line.clipped and line.share == 1.0 for line in found.forces)
