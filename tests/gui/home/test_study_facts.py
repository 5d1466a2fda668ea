"""What the home window says of protocols and sessions."""

import json
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from study_app.designer import version_rows
from study_app.errors import ProtocolError
from study_app.gui.home.study_facts import (
    BrokenFacts,
    StudyFacts,
    held,
    holds_liquids_alone,
    interrupted,
    read_studies,
    sources,
    study_facts,
)
from study_app.gui.sessions.session_facts import (
    incidents,
    matching,
    sessions,
    started_words,
    states_of,
    status_chip,
    validity_chip,
)
from study_app.gui.sessions.session_page import read_record
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import PageStep, build_schedule
from study_app.protocol.source.files import source_bytes
from study_app.session.resume import REHEARSED_SCREENS
from study_app.store.drafts import Draft, draft_files, keep
from study_app.store.exclusions import exclude
from study_app.store.journals import journal_events
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.study_settings import begin_settings
from tests.journal_lines import event_of
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = pytest.mark.slow


def begun(results, participant, source="demo", *, device="mouse", screens=None, simulated=False, pilot=False):
    """Begin a session of the demo, or of a copy of it."""
    protocol = load(source)
    how = SessionStart(
        participant, seed=1, operator="AK", language="en", device={"name": device}, screens=screens or {},
        simulated=simulated, pilot=pilot,
    )  # fmt: skip
    return protocol, begin(results / "demo", protocol, source_bytes(source), how)


def start(results, participant, status=None, **how):
    _, store = begun(results, participant, device="scripted", **how)
    if status is None:
        store.close()
    else:
        store.finish(status)


def stop_at(results, participant, steps, *, screens=None, source="demo", then=()):
    """Leave a session unfinished after so many steps of its schedule, or in the middle of the next one."""
    protocol, store = begun(results, participant, source, screens=screens or {"participant": {}})
    for step in build_schedule(protocol, participant, 1).steps[:steps]:
        if isinstance(step, PageStep):
            store.append(journal_events.PageShown(page=step.page_id))
            store.append(journal_events.PageLeft(page=step.page_id))
            continue
        told = {name: getattr(step, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append(journal_events.TrialStarted(trial=step.number, attempt=1, **told))
        store.append(event_of("trial_ended", trial=step.number, attempt=1, outcome="complete"))
        answer = {"value": 4, "onset_s": 1, "first_s": 1, "last_s": 1, "changes": 0}
        rows = [{"item": item, "number": number, **answer} for number, item in enumerate(step.items, 1)]
        store.append(event_of("responses", trial=step.number, attempt=1, items=rows))
    for event, said in then:
        store.append(event_of(event, **said))
    store.close()


@pytest.mark.parametrize(
    ("steps", "where", "answers"),
    [
        (0, "before “A first look”", 0),
        (1, "in part 1, liquid setting 1 of 2", 0),
        (2, "in part 1, liquid setting 2 of 2", 2),
        (4, "in part 2, delay setting 1 of 2", 4),
        (7, "after the last page", 8),
    ],
)
def test_an_interrupted_session_is_told_by_where_it_stopped_and_what_is_on_disk(tmp_path, steps, where, answers):
    stop_at(tmp_path, "P006", steps)
    now = datetime.now().astimezone()
    told = interrupted(sessions(tmp_path, {"demo": 8}), [study_facts("rek2024"), study_facts("demo")], now)
    assert told.heading == f"P006, session 1 of demo stopped {where}"
    assert f"{answers} of 8 answers are on disk" in told.line
    assert told.source == "demo"
    assert told.folder == tmp_path / "demo" / "data" / "sub-P006" / "ses-01"


def test_only_what_can_go_on_here_is_offered(tmp_path):
    now = datetime.now().astimezone()
    studies = [study_facts("demo")]
    start(tmp_path, "P001", "completed")
    stop_at(tmp_path, "P002", 2, screens=dict(REHEARSED_SCREENS))
    assert interrupted(sessions(tmp_path, {}), studies, now) is None
    stop_at(tmp_path, "P003", 2)
    assert interrupted(sessions(tmp_path, {}), [], now) is None
    assert interrupted(sessions(tmp_path, {}), studies, now).participant == "P003"
    opening = open_alone(tmp_path / "demo" / "data" / "sub-P003" / "ses-01")
    assert interrupted(sessions(tmp_path, {}), studies, now) is None
    opening.release()


def test_a_session_of_a_study_whose_liquid_file_is_lost_is_offered(tmp_path):
    source, liquid = tmp_path / "mine.toml", tmp_path / "thick.toml"
    table = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]\n'
    text = source_bytes("demo").decode()
    assert table in text
    source.write_text(text.replace(table, '[liquids.thick]\nfile = "thick.toml"\n'), encoding="utf-8")
    liquid.write_text(f"format = 1\n{table}", encoding="utf-8")
    results, now = tmp_path / "results", datetime.now().astimezone()
    stop_at(results, "P001", 2, source=source)
    whole = interrupted(sessions(results, {}), [study_facts("demo"), study_facts(str(source))], now)
    liquid.unlink()
    broken = study_facts(str(source))
    assert isinstance(broken, BrokenFacts)
    assert whole.source == str(source)
    assert interrupted(sessions(results, {}), [broken, study_facts("demo")], now) == whole


def test_the_card_of_a_protocol_states_extent_languages_and_needs(tmp_path):
    assert sources()[-1] == "demo"
    facts = study_facts("rek2024")
    assert isinstance(facts, StudyFacts)
    assert (facts.extent, facts.languages) == ("2 parts, 10 settings, 62 answers", "Dutch, English")
    assert "8 N" in facts.needs
    levels = study_facts("viscosityjnd")
    assert isinstance(levels, StudyFacts)
    assert levels.extent.startswith("1 part, 220 trials, ")
    assert levels.duration.startswith("about ")
    (tmp_path / "grouped.toml").write_text(STUDY + GROUPS)
    grouped = study_facts(str(tmp_path / "grouped.toml"))
    assert isinstance(grouped, StudyFacts)
    assert (grouped.extent, grouped.duration) == ("2 parts, 6 settings, 6 to 7 answers", "about 1 to 2 min")


def test_a_broken_protocol_names_its_first_problem(tmp_path):
    broken = tmp_path / "own.toml"
    broken.write_text("format = 1\nsequence = [")
    facts = study_facts(str(broken))
    assert isinstance(facts, BrokenFacts)
    assert "line 2" in facts.problem
    broken.write_text("format = 1\n")
    facts = study_facts(str(broken))
    with pytest.raises(ProtocolError) as refused:
        load(facts.source)
    count = len(refused.value.problems)
    assert count > 1
    assert facts.problem.endswith(f". Open it in the designer to see all {count} problems.")


def test_sessions_that_need_care_stand_first_then_the_newest(tmp_path):
    start(tmp_path, "P001", "completed")
    start(tmp_path, "P002")
    start(tmp_path, "P003", "withdrawn")
    found = sessions(tmp_path, {"demo": 8})
    wanted = [("P002", "unfinished"), ("P003", "withdrawn"), ("P001", "completed")]
    assert [(row.participant, row.status) for row in found] == wanted
    assert (found[0].answers, found[0].answers_of) == (0, 8)
    assert held(found, "demo") == "3 sessions, 1 complete"
    assert held(found, "rek2024") == "no participant yet"


def test_a_session_open_in_a_program_is_running_until_that_ends(tmp_path):
    start(tmp_path, "P001")
    opening = open_alone(sessions(tmp_path, {})[0].folder)
    (running,) = sessions(tmp_path, {})
    assert (running.status, status_chip(running)[2], running.needs_care) == ("running", "Running", False)
    assert ("running", "Running") in states_of([running])
    assert validity_chip(replace(running, validity="valid"))[2] == "Open"
    assert status_chip(replace(running, status="moved")) == ("neutral", "ring", "Moved")
    opening.release()
    (stopped,) = sessions(tmp_path, {})
    assert (stopped.status, status_chip(stopped)[2]) == ("unfinished", "Interrupted")


def test_lost_recordings_and_a_reconnected_device_show_in_the_row(tmp_path):
    lost = {"trial": 1, "attempt": 1, "reason": "the disk is full"}
    device = {"device": "mouse", "described": {}}
    stop_at(tmp_path, "P001", 3, then=[("recording_lost", lost), ("device_reconnected", device)])
    outlet = {"outlet": "Serial port", "reason": "it was unplugged"}
    stop_at(tmp_path, "P003", 3, then=[("outlet_lost", outlet)])
    stop_at(tmp_path, "P002", 3, then=[("note", {"kind": "note", "text": '"event":"recording_lost",'})])
    rows = {row.participant: row for row in sessions(tmp_path, {})}
    assert validity_chip(rows["P001"])[2] == "Recording lost"
    assert incidents(rows["P001"]) == "1 recording lost, device reconnected"
    assert incidents(rows["P003"]) == "1 outlet failed"
    assert ("lost", "Recording lost") in states_of(rows.values())
    assert [row for row in rows.values() if matching("", "lost")(row)] == [rows["P001"]]
    assert incidents(rows["P002"]) == ""
    assert incidents(read_record(rows["P001"].folder).facts) in read_record(rows["P001"].folder).about


@pytest.mark.parametrize("simulated", [False, True])
def test_a_pilot_counts_as_one_also_where_its_first_steps_were_simulated(tmp_path, simulated):
    start(tmp_path, "P001", "completed", simulated=simulated, pilot=True)
    (found,) = sessions(tmp_path, {})
    assert found.kind == "pilot"
    assert held([found], "demo") == "no participant yet, 1 pilot"


def test_a_session_that_is_left_out_says_why(tmp_path):
    for participant in ("P001", "P002"):
        start(tmp_path, participant, "completed")
    exclude(tmp_path / "demo", "P001", 1, by="AB", reason="fell asleep")
    found = sessions(tmp_path, {})
    assert {row.participant: row.excluded for row in found} == {"P001": "fell asleep", "P002": None}
    assert held(found, "demo") == "2 sessions, 2 complete, 1 excluded"
    (tmp_path / "demo" / "exclusions.csv").write_text("nonsense")
    assert [row.excluded for row in sessions(tmp_path, {})] == [None, None]


def test_a_folder_that_holds_something_else_is_passed_over(tmp_path):
    start(tmp_path, "P001", "completed")
    (tmp_path / "holiday" / "data" / "sub-x" / "ses-01").mkdir(parents=True)
    (tmp_path / "holiday" / "data" / "sub-x" / "ses-01" / "journal.jsonl").write_text("[]\nno journal\n")
    assert [row.participant for row in sessions(tmp_path, {}) if row.study == "demo"] == ["P001"]


def test_times_are_said_as_people_say_them():
    now = datetime(2024, 11, 20, 15, 0).astimezone()
    assert started_words(now, now) == "Today 15:00"
    assert started_words(now - timedelta(hours=20), now) == "Yesterday 19:00"
    assert started_words(datetime(2024, 11, 18, 9, 5).astimezone(), now) == "18 Nov 09:05"
    assert started_words(datetime(2023, 3, 1, 9, 5).astimezone(), now) == "1 Mar 2023 09:05"


def test_a_session_whose_journal_tells_nothing_is_still_listed(tmp_path):
    start(tmp_path, "P001", "completed")
    start(tmp_path, "P002", "completed")
    journal = tmp_path / "demo" / "data" / "sub-P001" / "ses-01" / "journal.jsonl"
    first = journal.read_text().splitlines()[0]
    journal.write_text(first.replace('"at":', '"once":').replace('"event":"session_started"', '"event":"tired"') + "\n")
    found = sessions(tmp_path, {})
    assert [(one.participant, one.status) for one in found] == [("P001", "damaged"), ("P002", "completed")]
    assert found[0].answers == 0


def test_drafts_come_first_the_newest_of_all_and_a_copy_names_its_original(tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    protocols = tmp_path / "protocols"
    protocols.mkdir()
    text = source_bytes("demo").decode()
    for number, name in enumerate(("saved", "older", "newer", "broken")):
        file, own = protocols / f"{name}.toml", text.replace('name = "demo"', f'name = "{name}"')
        file.write_text(own if name != "broken" else own.replace("format = ", "form = "), encoding="utf-8")
        keep(file, Draft(own.replace("force_limit_n = 6", "force_limit_n = 5") if number else own, ""))
    keep(protocols / "fresh.toml", Draft('[study]\ntitle = "Fresh"\n', ""))
    for name, at in (("older", "2026-11-20T08:00:00+01:00"), ("newer", "2026-11-20T08:30:00+00:00")):
        (kept,) = (file for file in draft_files() if f"{name}.toml" in file.read_text(encoding="utf-8"))
        kept.write_text(json.dumps(json.loads(kept.read_bytes()) | {"kept_at": at}), encoding="utf-8")
    begin_settings(protocols / "older.toml", "demo")
    found = read_studies((), lambda: version_rows)
    assert [(Path(it.source).stem, it.origin) for it in found[2:5]] == [
        ("newer", "Own study"),
        ("older", "Copy of demo"),
        ("saved", "Own study"),
    ]
    assert {Path(it.source).stem for it in found[:2]} == {"fresh", "broken"}
    assert found[3].draft.words.endswith(", not saved: Device")
    assert [it.draft for it in found[4:]] == [None] * len(found[4:])
    assert {it.origin for it in found[5:]} == {"Shipped study"}


def test_a_file_of_liquids_that_becomes_a_study_is_noticed(tmp_path: Path) -> None:
    file = tmp_path / "liquids.toml"
    file.write_text("format = 1\n[liquids.water]\ndensity_kg_m3 = 1000\n")
    assert holds_liquids_alone(str(file))
    file.write_text(f"{file.read_text()}[study]\nname = 'mine'\n")
    assert not holds_liquids_alone(str(file))
    file.unlink()
    assert not holds_liquids_alone(str(file))
