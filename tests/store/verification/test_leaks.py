"""What the conditions are is written nowhere but in the sealed key: no id, no parameter, no delay."""

import re
from pathlib import Path

import pytest

from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.files import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.verification.leaks import Telltales, certain_telltales, find_leaks, presented_numbers, telltales
from tests.journal_lines import event_of
from tests.protocol.trials.level_studies import study as levels_study
from tests.store.conftest import Attend, Make, Start, Tables


def leaks_in(folder: Path, protocol: Protocol) -> list[tuple[str, str]]:
    return [(leak.place, leak.word) for leak in find_leaks(folder, telltales(protocol))]


def test_a_leak_is_found_wherever_it_is(tmp_path: Path, protocol: Protocol, start: Start) -> None:
    store = start(device={"name": "scripted", "rate_hz": 1013.7})
    store.append(journal_events.Note(kind="note", text="this must be mildew, 137 ms"))
    store.append(
        journal_events.TrialStarted(
            trial=1, attempt=1, block="b", phase="main", part=1, index=1, of=1, code="see_tardy"
        )
    )
    store.write_tables()
    store.finish("completed")
    (store.folder.path / "quagmire.txt").write_text("first\nfeel_quagmire is it", encoding="utf-8", newline="\n")
    session = "data/sub-P007/ses-01"
    assert leaks_in(tmp_path / "study", protocol) == [
        (f"{session}/journal.jsonl, line 2, text", "mildew"),
        (f"{session}/journal.jsonl, line 2, text", "137"),
        (f"{session}/journal.jsonl, line 3, code", "see_tardy"),
        (f"the name {session}/quagmire.txt", "quagmire"),
        (f"{session}/quagmire.txt, line 2", "feel_quagmire"),
        (f"{session}/receipt.json, device, rate_hz", "1013.7"),
        (f"{session}/subject-P007_session-01_task-brackish_description-trials_data.csv, row 2, code", "see_tardy"),
    ]


def test_the_preregistration_names_the_conditions(tmp_path: Path, protocol: Protocol, start: Start) -> None:
    start().finish("completed")
    folder = StudyFolder(tmp_path / "study")
    folder.preregistration.write_text("agreement is higher in mildew than in quagmire", encoding="utf-8", newline="\n")
    assert leaks_in(folder.path, protocol) == []
    folder.preregistration.rename(folder.path / "draft.md")
    assert leaks_in(folder.path, protocol) == [("draft.md, line 1", "mildew"), ("draft.md, line 1", "quagmire")]


def test_statements_may_name_their_attribute(tmp_path: Path, tables_of_study: Tables, start: Start) -> None:
    """The name of a statement about mildew is permitted, but the word reveals a condition elsewhere."""
    tables = tables_of_study()
    item = {"id": "mildew", "text": "I think it is mildew.", "short": "mildew"}
    tables["questionnaires"]["form"]["items"] = [item]
    protocol = Protocol.model_validate(tables)
    store = start(protocol=protocol)
    fields = {"block": "liquids", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}
    store.append(journal_events.TrialStarted(trial=1, attempt=1, **fields))
    store.append(journal_events.ItemShown(trial=1, item="mildew"))
    store.append(journal_events.Choice(trial=1, item="mildew", value=4))
    answer = {"item": "mildew", "number": 1, "value": 4, "onset_s": 1.5, "first_s": 2.0, "last_s": 2.0, "changes": 0}
    store.append(event_of("responses", trial=1, attempt=1, items=[answer]))
    store.finish("completed")
    assert b"mildew" in store.folder.table("brackish", "responses").read_bytes()
    assert b"mildew" in store.folder.receipt.read_bytes()
    assert leaks_in(tmp_path / "study", protocol) == []


@pytest.mark.parametrize("simulated", [False, True], ids=["real", "rehearsed"])
def test_a_finished_session_reveals_no_condition(
    tmp_path: Path, protocol: Protocol, start: Start, attend: Attend, samples_of: Make, *, simulated: bool
) -> None:
    store = start(simulated=simulated, recordings=True)
    assert store.recorder is not None
    attend(store)
    store.recorder.start(1, 1, 1000.0)
    store.recorder.append(samples_of(100))
    store.append(journal_events.Note(kind="mark", text=""))
    store.finish("completed")
    assert len(list((tmp_path / "study").rglob("*.*"))) >= 11
    assert leaks_in(tmp_path / "study", protocol) == []
    assert not telltales(protocol).words & set(re.findall(r"[\w.]+", repr(store.key)))


def test_published_and_common_words_are_not_certain_leaks() -> None:
    """The thesis' study names liquids in statements and has short numbers; only other words are certain leaks."""
    protocol = load("rek2024")
    tables = protocol.model_dump(mode="json", include={"liquids", "conditions"})
    words = certain_telltales(tables, receipt.without_conditions(protocol)).words
    assert {"light_oil", "delay_50", "delay_200"} < words
    assert not {"honey", "practice", "1", "50", "0.068", "1000"} & words


def test_common_words_as_condition_names_are_not_reported_as_leaks(
    tmp_path: Path, protocol: Protocol, start: Start, attend: Attend
) -> None:
    """Labs name their conditions "a", "none" or "force"; "n/a" and the descriptions of columns do not reveal them."""
    store = start(device={"name": "scripted", "priority": "none"})
    attend(store)
    store.finish("completed")
    names = ["a", "n", "none", "true", "force", "delay", "haptic", "baseline", "slow", "undertow"]
    tables = {"liquids": {name: {} for name in names}, "conditions": {}}
    words = certain_telltales(tables, receipt.without_conditions(protocol))
    assert find_leaks(tmp_path / "study", words) == []
    (tmp_path / "study" / "notes.txt").write_text("felt undertow", encoding="utf-8", newline="\n")
    assert [leak.word for leak in find_leaks(tmp_path / "study", words)] == ["undertow"]


def test_levels_standards_and_comparisons_are_looked_for_in_every_unit(tmp_path: Path) -> None:
    edits = (("standards = [1, 2]", "standards = [1.0713]"), ("[0.2, 0.4, 0.8]", "[0.2371]"))
    protocol = levels_study(*edits)
    comparison = 1.0713 + 1.0713 * 0.2371
    assert presented_numbers(protocol) == {1.0713, 0.2371, comparison}
    (tmp_path / "notes.txt").write_text(
        f"level 0.2371\nnothing\nfelt {comparison!r} Pa s, or {comparison * 1000!r}", encoding="utf-8", newline="\n"
    )
    assert {place for place, _ in leaks_in(tmp_path, protocol)} == {"notes.txt, line 1", "notes.txt, line 3"}
    published = receipt.without_conditions(protocol)
    certain = certain_telltales({"liquids": {}, "conditions": {}}, published, presented_numbers(protocol))
    assert certain.in_text(f"{comparison!r} and 0.2371") == [repr(comparison)], "short numbers stand anywhere"


def test_numbers_of_fewer_than_five_digits_are_not_certain_whatever_their_sign() -> None:
    pond = {"region": {"centre_m": [-1.0, 0.25, -1.23456]}, "density_kg_m3": 1013.7, "viscosity_pa_s": 1.234}
    words = certain_telltales({"liquids": {"pond": pond}, "conditions": {}}, {}).words
    assert {"pond", "1013.7", "1013700", "-1.23456", "-0.00123456"} < words
    assert not {"-1", "-1.0", "-1000", "-0.001", "0.25", "250", "1.234", "1234"} & words


SEARCHED = {
    "list.json": ('["calm", ["tardy", [["mildew"]]]]', [("", "tardy"), ("", "mildew")]),
    "tables.json": ('{"liquids": {"mildew": {"tardy": 2}}}', [(", liquids", "mildew"), (", liquids, mildew", "tardy")]),
    "rows.json": (
        '{"rows": [{"note": "tardy", "item": "mildew"}, {"code": ["mildew"]}]}',
        [(", rows, note", "tardy"), (", rows, code", "mildew")],
    ),
    "numbers.json": (
        '[{"delay": 137, "rate": 0.137, "of": 1370}, [137.0], "137 ms"]',
        [(", delay", "137"), ("", "137")],
    ),
    "absent.json": (
        '{"a": null, "b": [true, null, false], "mildew": "None, True and False"}',
        [("", "mildew"), (", mildew", "None"), (", mildew", "True"), (", mildew", "False")],
    ),
    "ignored.json": (
        '{"t_s": 137, "items": [{"id": "mildew"}], "trials": [{"onset_s": 137, "late_s": 137}]}',
        [(", trials, late_s", "137")],
    ),
    "lines.jsonl": (
        '{"value": ["tardy"]}\nhalf {"mildew\n{"item": "mildew"}\n[137]\n',
        [(", line 1, value", "tardy"), (", line 2", "mildew"), (", line 4", "137")],
    ),
    "cells.csv": (
        "code,item,mildew\ntardy\n,mildew,137,tardy\n",
        [(", row 1, mildew", "mildew"), (", row 2, code", "tardy"), (", row 3, mildew", "137"), (", row 3, ", "tardy")],
    ),
}
"""Files with revealing words, and the places at which they are leaks."""


@pytest.mark.parametrize("name", SEARCHED)
def test_names_and_values_at_any_depth_are_searched_except_statements_and_times(tmp_path: Path, name: str) -> None:
    content, places = SEARCHED[name]
    (tmp_path / name).write_text(content, encoding="utf-8", newline="\n")
    words = Telltales(["mildew", "tardy", "137", "None", "True", "False"])
    expected = [(name + place, word) for place, word in places]
    assert [(leak.place, leak.word) for leak in find_leaks(tmp_path, words)] == expected


def test_the_words_to_look_for_are_the_conditions(protocol: Protocol) -> None:
    words = telltales(protocol).words
    assert {"quagmire", "mildew", "see_tardy", "learn", "1013.7", "1391.3", "1717", "137", "0.137"} < words
    assert {"137.0", "137000000", "137000", "0.99917"} < words
    assert not {"drag", "wake", "0", "liquid", "delay_ms"} & words
