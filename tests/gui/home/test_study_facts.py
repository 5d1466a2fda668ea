"""What the home window says of studies and sessions, compared with a reviewed text."""

import json
import os
import re
from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from pathlib import Path
from types import SimpleNamespace

import pytest

from study_app.designer import version_rows
from study_app.gui.home.study_facts import (
    BrokenFacts,
    StudyFacts,
    file_states,
    holds_liquids_alone,
    interrupted_session,
    is_shipped,
    known_sources,
    last_written_ns,
    read_studies,
    session_counts_text,
    study_facts,
    time_text,
)
from study_app.gui.sessions.session_facts import (
    Extent,
    incidents_text,
    occurring_states,
    session_filter,
    sessions,
    start_time_text,
    status_chip,
    validity_chip,
)
from study_app.gui.sessions.session_page import read_record
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import PageStep, build_schedule
from study_app.protocol.source.files import source_bytes
from study_app.session.resume import REHEARSED_SCREENS
from study_app.store.exclusions import exclude
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.journals import journal_events
from study_app.store.versions.drafts import Draft, draft_files, write_draft
from study_app.store.versions.study_settings import keep_original
from tests import studies
from tests.golden import check_kept
from tests.golden_values import value_lines
from tests.journal_lines import event_of
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = pytest.mark.slow


def begin_demo(results, participant, source="demo", *, device="mouse", **start_values):
    """Begin a session of the demo, or of a copy of it."""
    where = results / "demo", participant, source
    return load(source), studies.begun(*where, operator="AK", device={"name": device}, **start_values)


def start(results, participant, status=None, **how):
    _, store = begin_demo(results, participant, device="scripted", **how)
    if status is None:
        store.close()
    else:
        store.finish(status)


def stop_at(results, participant, steps, *, screens=None, source="demo", then=()):
    """Leave a session unfinished after this number of steps, or in the middle of the next one."""
    protocol, store = begin_demo(results, participant, source, screens=screens or {"participant": {}})
    for step in build_schedule(protocol, participant, 1).steps[:steps]:
        if isinstance(step, PageStep):
            store.append(journal_events.PageShown(page=step.page_id))
            store.append(journal_events.PageLeft(page=step.page_id))
            continue
        trial_fields = {name: getattr(step, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append(journal_events.TrialStarted(trial=step.number, attempt=1, **trial_fields))
        store.append(event_of("trial_ended", trial=step.number, attempt=1, outcome="complete"))
        answer = {"value": 4, "onset_s": 1, "first_s": 1, "last_s": 1, "changes": 0}
        rows = [{"item": item, "number": number, **answer} for number, item in enumerate(step.items, 1)]
        store.append(event_of("responses", trial=step.number, attempt=1, items=rows))
    for event, said in then:
        store.append(event_of(event, **said))
    store.close()


def session_lines(folder: Path) -> Iterator[str]:
    """Yield the texts about each session in a folder of results, their counts, and the sessions of each filter."""
    rows, now = sessions(folder, {"demo": 8}), datetime.now().astimezone()
    for row in rows:
        chips = f"{status_chip(row)[2]}, {validity_chip(row)[2]}; {incidents_text(row)}"
        yield f"{row.participant} {row.kind} {row.status}: {chips}; {row.answers} of {row.answers_of}; {row.excluded}"
    for study in ("demo", "rek2024"):
        yield f"{study}: {session_counts_text(rows, study)}"
    yield from (f"{words}: {[row.participant for row in rows if session_filter('', state)(row)]}" for state, words in
                occurring_states(rows))  # fmt: skip
    offered = interrupted_session(rows, [study_facts("rek2024"), study_facts("demo")], now)
    if offered is not None:
        yield f"go on with {offered.source}: {offered.heading}; {offered.line}"
        assert offered.folder == folder / "demo" / "data" / f"sub-{offered.participant}" / "ses-01"
    assert interrupted_session(rows, [], now) is None


def test_the_extent_of_a_study_counts_its_parts_trials_and_answers(monkeypatch):
    extent = Extent(parts=(2, 3), settings=(17,), setting="trial", answers=(23, 5), expected_s=(61.0,))
    monkeypatch.setattr("study_app.gui.home.study_facts.extent_of", lambda _protocol: extent)
    assert study_facts("demo").extent == "2 to 3 parts, 17 trials, 5 to 23 answers"


def test_sessions_are_described_as_they_were_held(tmp_path):
    lines = []
    for steps in (0, 1, 2, 4, 7):
        stop_at(tmp_path / str(steps), "P006", steps)
        lines += [f"== stopped after {steps} steps", *session_lines(tmp_path / str(steps))]
    for number, status in enumerate(("completed", None, "withdrawn", "completed", "completed"), 1):
        start(tmp_path, f"P{number:03}", status)
    start(tmp_path, "P010", "completed", pilot=True)
    start(tmp_path / "rehearsed", "P011", "completed", pilot=True, simulated=True)
    start(tmp_path / "rehearsed", "P012", "completed", simulated=True)
    lines += ["== simulated", *session_lines(tmp_path / "rehearsed")]
    stop_at(tmp_path, "P013", 2, screens=dict(REHEARSED_SCREENS))
    lines += ["== a rehearsal that stopped", *session_lines(tmp_path)]
    lost = {"trial": 1, "attempt": 1, "reason": "the disk is full"}
    for participant, then in (
        ("P020", [("recording_lost", lost), ("device_reconnected", {"device": "mouse", "described": {}})]),
        ("P021", [("outlet_lost", {"outlet": "Serial port", "reason": "it was unplugged"})]),
        ("P022", [("note", {"kind": "note", "text": '"event":"recording_lost",'})]),
    ):
        stop_at(tmp_path, participant, 3, then=then)
    exclude(tmp_path / "demo", "P004", 1, by="AB", reason="fell asleep")
    journal = tmp_path / "demo" / "data" / "sub-P005" / "ses-01" / "journal.jsonl"
    first = journal.read_text("utf-8").splitlines()[0]
    journal.write_text(
        first.replace('"at":', '"once":').replace('"event":"session_started"', '"event":"tired"') + "\n",
        encoding="utf-8",
        newline="\n",
    )
    holiday = tmp_path / "holiday" / "data" / "sub-x" / "ses-01"
    holiday.mkdir(parents=True)
    (holiday / "journal.jsonl").write_text("[]\nno journal\n", encoding="utf-8", newline="\n")
    lines += ["== all", *session_lines(tmp_path)]
    lines += [read_record(tmp_path / "demo" / "data" / "sub-P020" / "ses-01").about]
    opening = lock_folder(tmp_path / "demo" / "data" / "sub-P022" / "ses-01")
    lines += ["== P022 is open in a program", *session_lines(tmp_path)]
    opening.release()
    (tmp_path / "demo" / "exclusions.csv").write_text("nonsense", encoding="utf-8", newline="\n")
    lines += ["== exclusions that cannot be read", *session_lines(tmp_path)]
    reviewed_lines = (
        re.sub(r"Today \d\d:\d\d", "Today HH:MM", line.replace(str(tmp_path), "FOLDER")) for line in lines
    )
    check_kept(Path(__file__).with_name("sessions.txt"), reviewed_lines)


def test_studies_state_extent_languages_needs_and_the_first_problem(tmp_path):
    lines = []
    for name, text in {"grouped": STUDY + GROUPS, "cut": "format = 2\nsequence = [", "bare": "format = 2\n"}.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8", newline="\n")
    assert known_sources()[-1] == "demo"
    for source in ("rek2024", "viscosityjnd", *(str(tmp_path / f"{name}.toml") for name in ("grouped", "cut", "bare"))):
        facts = study_facts(source)
        names = ("problem",) if isinstance(facts, BrokenFacts) else ("extent", "duration", "languages", "needs")
        lines += [f"== {Path(source).stem}", *value_lines({name: getattr(facts, name) for name in names})]
    reviewed_lines = (line.replace(str(tmp_path), "FOLDER") for line in lines)
    check_kept(Path(__file__).with_name("studies.txt"), reviewed_lines)


def test_a_session_of_a_study_whose_liquid_file_is_lost_is_offered(tmp_path):
    source, liquid = tmp_path / "mine.toml", tmp_path / "thick.toml"
    table = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]\n'
    text = source_bytes("demo").decode()
    assert table in text
    source.write_text(text.replace(table, '[liquids.thick]\nfile = "thick.toml"\n'), encoding="utf-8", newline="\n")
    liquid.write_text(f"format = 2\n{table}", encoding="utf-8", newline="\n")
    results, now = tmp_path / "results", datetime.now().astimezone()
    stop_at(results, "P001", 2, source=source)
    whole = interrupted_session(sessions(results, {}), [study_facts("demo"), study_facts(str(source))], now)
    liquid.unlink()
    broken = study_facts(str(source))
    assert isinstance(broken, BrokenFacts)
    assert whole.source == str(source)
    assert interrupted_session(sessions(results, {}), [broken, study_facts("demo")], now) == whole


def test_times_are_written_as_people_say_them():
    now = datetime(2024, 11, 20, 15, 0).astimezone()
    assert start_time_text(now, now) == "Today 15:00"
    assert start_time_text(now - timedelta(hours=20), now) == "Yesterday 19:00"
    assert start_time_text(datetime(2024, 11, 18, 9, 5).astimezone(), now) == "18 Nov 09:05"
    assert start_time_text(datetime(2023, 3, 1, 9, 5).astimezone(), now) == "1 Mar 2023 09:05"
    here, tokyo = (timezone(timedelta(hours=hours)) for hours in (-5, 9))
    recorded = datetime(2024, 11, 21, 1, 30, tzinfo=tokyo)
    assert start_time_text(recorded, datetime(2024, 11, 20, 15, 0, tzinfo=here)) == "Today 11:30"


def test_the_study_that_was_run_last_comes_after_the_opened_ones_and_the_demo_before_any_session(tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    opened_file, results = tmp_path / "opened.toml", tmp_path / "results"
    opened_file.write_text(source_bytes("demo").decode().replace('"demo"', '"mine"', 1), encoding="utf-8", newline="\n")
    results.mkdir()
    names = {None: "rek2024", results: "demo"}
    assert {folder: read_studies((), results=folder)[0].name for folder in names} == names
    for written_s, folder, study in ((30, "sample-demo", "demo"), (20, "slime", "slime"), (10, "rek2024", "rek2024")):
        studies.begun(results / folder, "P001", study).close()
        session = results / folder / "data" / "sub-P001" / "ses-01"
        os.utime(session / "journal.jsonl", (written_s, written_s))
        assert last_written_ns(session) == written_s * 10**9
    assert last_written_ns(results) == 0
    facts = read_studies((str(opened_file),), results=results)
    assert [study.source for study in facts[:3]] == [str(opened_file), "slime", "rek2024"]
    assert [study.name for study in facts[:2]] == ["mine", "slime"]
    assert [study.source for study in facts].count(str(opened_file)) == 1


def test_a_card_states_the_requirements_and_origin_of_a_study(tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    (tmp_path / "protocols").mkdir()
    own = tmp_path / "protocols" / "own.toml"
    text = source_bytes("rek2024").decode()
    own.write_text(text.replace('"rek2024"', '"own"', 1), encoding="utf-8", newline="\n")
    keep_original(own, "rek2024")
    shipped, copy = study_facts("rek2024"), study_facts(str(own))
    assert isinstance(shipped, StudyFacts)
    assert (shipped.name, shipped.file_name, shipped.title) == ("rek2024", "rek2024", "Feeling simulated liquids")
    assert (shipped.languages, shipped.needs) == ("Dutch, English", "Haptic device or mouse; at most 8 N")
    assert (shipped.extent, shipped.duration) == ("2 parts, 10 settings, 62 answers", "about 18 min")
    assert shipped.description.startswith("The user study of Ł. Rek, Solving liquids")
    assert (shipped.origin, copy.origin, copy.file_name) == ("Shipped study", "Copy of rek2024", "own")
    assert [is_shipped(source) for source in ("demo", "own", str(own), "nowhere")] == [True, False, False, False]


def test_a_changed_file_changes_the_states_of_the_files(tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    protocols, opened_file = tmp_path / "protocols", tmp_path / "opened.toml"
    protocols.mkdir()
    states = [file_states([str(opened_file)])]
    for act in (
        lambda: opened_file.write_bytes(b"x"),
        lambda: os.utime(opened_file, ns=(5, 7)),
        lambda: (opened_file.write_bytes(b"xy"), os.utime(opened_file, ns=(5, 7))),
        lambda: (protocols / "own.toml").write_bytes(b"abc"),
        lambda: write_draft(protocols / "fresh.toml", Draft(text="a", base="")),
    ):
        act()
        states.append(file_states([str(opened_file)]))
    assert len(set(states)) == len(states) == 6
    assert [len(states) for states in states] == [0, 1, 1, 1, 2, 3]
    assert (opened_file, 7, 2) in states[-1]


def test_the_time_of_a_draft_includes_its_day_unless_it_is_today(monkeypatch) -> None:
    now = datetime(2024, 11, 20, 18, 0).astimezone()
    monkeypatch.setattr("study_app.gui.home.study_facts.time", SimpleNamespace(time=now.timestamp))
    moments = (now.replace(hour=9, minute=5), now.replace(day=19, hour=23), now.replace(year=2023))
    said = ["today 09:05", "2024-11-19 23:00", "2023-11-20 18:00", "an unknown time"]
    assert [time_text(moment) for moment in (*(it.isoformat() for it in moments), "yesterday")] == said


def test_drafts_come_first_the_newest_of_all_and_a_copy_names_its_original(tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    protocols = tmp_path / "protocols"
    protocols.mkdir()
    text = source_bytes("demo").decode()
    for number, name in enumerate(("saved", "older", "newer", "broken")):
        file, own = protocols / f"{name}.toml", text.replace('name = "demo"', f'name = "{name}"')
        file.write_text(
            own if name != "broken" else own.replace("format = ", "form = "), encoding="utf-8", newline="\n"
        )
        write_draft(file, Draft(text=own.replace("force_limit_n = 6", "force_limit_n = 5") if number else own, base=""))
    write_draft(protocols / "fresh.toml", Draft(text='[study]\ntitle = "Fresh"\n', base=""))
    for name, at in (("older", "2026-11-20T08:00:00+01:00"), ("newer", "2026-11-20T08:30:00+00:00")):
        (kept,) = (file for file in draft_files() if f"{name}.toml" in file.read_text(encoding="utf-8"))
        kept.write_text(json.dumps(json.loads(kept.read_bytes()) | {"kept_at": at}), encoding="utf-8", newline="\n")
    keep_original(protocols / "older.toml", "demo")
    studies_found = read_studies((), lambda: version_rows)
    assert [(Path(it.source).stem, it.origin) for it in studies_found[2:5]] == [
        ("newer", "Own study"),
        ("older", "Copy of demo"),
        ("saved", "Own study"),
    ]
    assert {Path(it.source).stem for it in studies_found[:2]} == {"fresh", "broken"}
    assert studies_found[3].draft.words.endswith(", not saved: Device")
    (fresh,) = (it for it in studies_found if Path(it.source).stem == "fresh")
    assert (fresh.title, fresh.origin, fresh.draft.words[-13:]) == ("Fresh", "Own study", ", never saved")
    assert [it.draft for it in studies_found[4:]] == [None] * len(studies_found[4:])
    assert {it.origin for it in studies_found[5:]} == {"Shipped study"}


def test_a_file_of_liquids_that_becomes_a_study_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "liquids.toml"
    file.write_text("format = 2\n[liquids.water]\ndensity_kg_m3 = 1000\n", encoding="utf-8", newline="\n")
    assert holds_liquids_alone(str(file))
    file.write_text(f"{file.read_text('utf-8')}[study]\nname = 'mine'\n", encoding="utf-8", newline="\n")
    assert not holds_liquids_alone(str(file))
    file.write_text("format = [", encoding="utf-8", newline="\n")
    assert not holds_liquids_alone(str(file)), "it cannot be read"
    file.unlink()
    assert not holds_liquids_alone(str(file))
