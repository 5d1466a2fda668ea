"""Where an interrupted session goes on, for every line its journal may end with, and what it then presents."""

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import pytest
from click.testing import CliRunner

from study_app.app.session import live_session
from study_app.cli import commands
from study_app.errors import SessionError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule
from study_app.protocol.randomization import stream
from study_app.protocol.source.files import protocol_hash, source_bytes
from study_app.session import preflight_measurements
from study_app.session.pages import PausePage
from study_app.session.preflight import Masking, Screen
from study_app.session.resume import REHEARSED_SCREENS, begun_schedule, find_protocol, is_rehearsal, resume_at
from study_app.session.start import MEASURED_S, NewSession, check_choices, measure_rig, open_store, resumed_choices
from study_app.session.transitions.events import Begin, ResumeRequested, ShowPage, StartTrial, Write
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance, initial_state
from study_app.store import receipt
from study_app.store.journals import journal
from study_app.store.journals.journal_events import start_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import event_from, event_of
from tests.outlets.collector import Collector
from tests.session import small

STARTED = {"event": "session_started", "t_s": 0.0}


def study(resume: str, *, breaks: bool = False) -> Protocol:
    tables = small.TABLES | {"study": small.TABLES["study"] | {"resume": resume}}
    if breaks:
        rest = {"kind": "break", "title": "Rest", "body": "Breathe."}
        feeling = tables["blocks"]["feeling"] | {"break_every": 1, "break_page": "rest"}
        tables |= {"pages": tables["pages"] | {"rest": rest}, "blocks": tables["blocks"] | {"feeling": feeling}}
    return Protocol.model_validate(tables)


def walk_to_end(protocol: Protocol, lines: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], list[str]]:
    """Resume after these lines and walk to the end; return the lines written and what was presented."""
    schedule, key = build_schedule(protocol, "P001", 1), small.opened().plan.key
    state = initial_state(protocol, schedule, key, "en", resume_at(protocol, schedule, map(event_from, lines)))
    lines_written, presented = [], []
    event: Any = Begin(100.0)
    while True:
        state, commands = advance(state, event)
        for command in commands:
            match command:
                case Write(line=line):
                    lines_written.append({"event": line.event, "t_s": event.at_s, **line.fields()})
                    presented += [line.fields()["page"]] if line.event == "page_shown" else []
                case StartTrial(trial=trial, attempt=attempt):
                    presented.append(f"{state.trial.block} {trial}/{attempt}")
                case ShowPage(page=PausePage(force_off=force_off)):
                    presented.append("waits without force" if force_off else "waits")
        if state.phase is Phase.COMPLETE:
            return lines_written, presented
        at_s = event.at_s + 1.0
        paused = state.phase is Phase.PAUSED
        event = ResumeRequested(at_s, "participant") if paused else small.next_event(state, at_s)


BLOCKS: dict[int | str, str] = {1: "practice", 2: "feeling", 3: "feeling", 4: "baseline", 5: "seeing", 6: "seeing"}
UNASKED = (1, 4)
"""Trials without questions."""


def presented_after(lines: list[dict[str, Any]], resume: str, *, breaks: bool) -> list[str]:
    """Return the steps after these lines: from the first unfinished step, or from the first step of its block."""
    steps: list[Any] = ["welcome", 1, 2, *["rest"] * breaks, *range(3, 7), "thanks"]
    attempt_counts, at = Counter(line["trial"] for line in lines if line["event"] == "trial_started"), 0
    for line in lines:
        name = line.get("page", line.get("trial"))
        if line["event"] in {"page_shown", "trial_started"}:
            at = steps.index(name)
        if line["event"] in {"page_left", "responses"} or (line["event"] == "trial_ended" and name in UNASKED):
            at = steps.index(name) + 1
    block = (BLOCKS | {"rest": "feeling"}).get(steps[at]) if at < len(steps) else None
    if block is not None and resume == "block":
        at = steps.index(next(trial for trial, its_block in BLOCKS.items() if its_block == block))
    left = [f"{BLOCKS[step]} {step}/{attempt_counts[step] + 1}" if step in BLOCKS else step for step in steps[at:]]
    return [*["waits"] * (steps[at : at + 1] != [] and steps[at] in BLOCKS), *left]


@pytest.mark.parametrize("resume", ["trial", "block"])
@pytest.mark.parametrize("breaks", [False, True])
def test_a_resumed_session_continues_with_the_unfinished_steps(resume: str, breaks: bool) -> None:
    lines = [STARTED, *walk_to_end(study("block", breaks=breaks), [STARTED])[0]]
    cut = next(n for n, line in enumerate(lines) if line["event"] == "choice" and line["trial"] == 3)
    again = [*lines[: cut + 1], {"event": "session_resumed", "t_s": 100.0}]
    for lines_told in (lines, [*again, *walk_to_end(study("block", breaks=breaks), again)[0]]):
        for count in range(1, len(lines_told) + 1):
            steps = walk_to_end(study(resume, breaks=breaks), lines_told[:count])[1]
            assert steps == presented_after(lines_told[:count], resume, breaks=breaks), lines_told[count - 1]


def test_a_journal_of_another_order_is_refused() -> None:
    plan = small.opened().plan
    lines = [event_from(STARTED), event_of("trial_started", t_s=1.0, trial=3, attempt=1)]
    with pytest.raises(SessionError, match="does not follow the order"):
        resume_at(study("trial"), plan.schedule, lines)


def start_event(study: str, protocol_hash: str = "0") -> Any:
    return event_of("session_started", study=study, protocol_hash=protocol_hash)


def test_the_protocol_is_found_by_its_hash_then_by_its_study(tmp_path: Path) -> None:
    changed = tmp_path / "mine.toml"
    changed.write_bytes(source_bytes("demo") + b"\n# changed\n")
    exact = start_event("demo", protocol_hash(changed.read_bytes()))
    assert find_protocol(exact, ["demo", str(changed)]) == str(changed)
    assert find_protocol(start_event("demo"), ["rek2024", "demo"]) == "demo"
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol(start_event("gone"), ["demo"])


@pytest.mark.slow
def test_a_protocol_at_hand_that_cannot_be_read_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "protocols"
    (own / "a_folder.toml").mkdir(parents=True)
    (own / "latin.toml").write_bytes(b"\xff\xfe")
    (own / "broken.toml").write_bytes(b"[study")
    (own / "mine.toml").write_bytes(source_bytes("demo") + b"\n# changed\n")
    monkeypatch.chdir(tmp_path)
    assert find_protocol(start_event("demo", protocol_hash((own / "mine.toml").read_bytes()))) == "mine"
    assert find_protocol(start_event("demo")) in ("mine", "demo")
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol(start_event("gone"))


def test_a_receipt_without_screens_is_not_from_a_rehearsal() -> None:
    assert is_rehearsal({"screens": dict(REHEARSED_SCREENS)})
    assert not is_rehearsal({"screens": {}})
    assert not is_rehearsal({})


SEED = 5
RIG: Any = SimpleNamespace(described={"name": "mouse"}, servo=SimpleNamespace(now_ns=lambda: 0))


@pytest.fixture
def square(tmp_path: Path) -> Path:
    """Return the demo with its blocks in the orders of Latin squares."""
    path = tmp_path / "square.toml"
    text = source_bytes("demo").decode()
    assert text.count('\norder = "shuffled"') == 2
    path.write_text(text.replace('\norder = "shuffled"', '\norder = "latin"'), encoding="utf-8", newline="\n")
    return path


def chosen_for(path: Path, participant: str, row_of: str | None) -> NewSession:
    results = path.parent / "results"
    choices = replace(small.CHOSEN, source=str(path), participant=participant, seed=SEED, results=results)
    return replace(choices, recordings=False, row_of=row_of)


def codes(schedule: Schedule) -> list[str]:
    return [trial.code for trial in schedule.trials]


def present(store: SessionStore, schedule: Schedule) -> None:
    """Present every trial of a schedule and end the session."""
    for trial in schedule.trials:
        fields = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append(event_of("trial_started", trial=trial.number, attempt=1, **fields))
        store.append(event_of("trial_ended", trial=trial.number, attempt=1, outcome="complete"))
    store.finish("completed")


def run_one(path: Path, participant: str, row_of: str | None) -> tuple[Protocol, SessionStore]:
    source = path.read_bytes()
    protocol = parse(source, str(path))
    choices = chosen_for(path, participant, row_of)
    check_choices(choices, protocol)
    return protocol, open_store(choices, protocol, source, RIG, {})


def test_row_of_another_participant_gives_that_participants_order(square: Path) -> None:
    protocol = parse(square.read_bytes(), "square.toml")
    rows = {who: codes(build_schedule(protocol, who, SEED)) for who in ("P001", "P002")}
    assert rows["P001"] != rows["P002"]
    for place, row in enumerate(rows.values(), start=1):
        assert codes(build_schedule(protocol, "P025", SEED, place)) == row


@pytest.mark.parametrize(("row_of", "place"), [("P001", 1), ("P002", 2)])
def test_receipt_keeps_the_row_and_reproduce_uses_it(square: Path, row_of: str, place: int) -> None:
    protocol, store = run_one(square, "P025", row_of)
    present(store, build_schedule(protocol, "P025", SEED, place))
    path = store.folder.receipt
    content = json.loads(path.read_text("utf-8"))
    assert content["row_of"] == row_of
    assert reproduce_session(store.folder.path).differences == []
    assert verify_study(square.parent / "results").errors == ()
    path.write_text(
        json.dumps(content | {"row_of": "P002" if row_of == "P001" else "P001"}), encoding="utf-8", newline="\n"
    )
    assert any("code" in line for line in reproduce_session(store.folder.path).differences)
    assert any(
        "differs from the journal in row_of" in str(error) for error in verify_study(square.parent / "results").errors
    )


def test_a_session_is_measured_and_begun_with_the_chosen_settings(
    square: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measure = mock.Mock(return_value=small.WELL)
    monkeypatch.setattr(preflight_measurements, "measure_servo_and_disk", measure)
    videos: Any = SimpleNamespace(open=lambda: "opened", describe=lambda: {"camera": "left"})
    rig: Any = SimpleNamespace(device=SimpleNamespace(name="mouse"), **vars(RIG))
    settings = chosen_for(square, "P025", "P002")
    played = replace(settings, row_of=None, played=True, recordings=True)
    for choices, participant, lasts_s in ((settings, "P002", MEASURED_S), (played, "P025", 0.5)):
        facts = measure_rig(rig, choices, videos, sleep=str)
        receipt_fields = {"device": "mouse", "screen": Screen(0.0, 1.0), "participant": participant, "sleep": str}
        measure.assert_called_with(
            rig.servo, settings.results, recordings=choices.recordings, lasts_s=lasts_s, **receipt_fields
        )
        assert (facts.video, facts.ran_otherwise, facts.untranslated, facts.late_device) == ("opened", "", (), "")
    outlets: Any = Collector()
    outlets.described = {"markers": ["usb:1"]}
    source = square.read_bytes()
    more = Masking("noise", 61), outlets, videos
    with open_store(settings, parse(source, str(square)), source, RIG, {"one": {"width": 9}}, *more) as store:
        start_receipt, first = receipt.read(store.folder.receipt), start_of(store.lines)
    receipt_fields = {
        "participant": "P025",
        "session": 1,
        "seed": SEED,
        "operator": "AK",
        "language": "en",
        "device": "mouse",
    }
    receipt_fields |= {"simulated": False, "pilot": False, "recordings": False, "row_of": "P002"}
    assert {name: getattr(first, name) for name in receipt_fields} == receipt_fields
    receipt_fields = {"device": {"name": "mouse"}, "screens": {"one": {"width": 9}}, "outlets": {"markers": ["usb:1"]}}
    receipt_fields |= {"motors_masked": {"means": "noise", "noise_db": 61}, "video": {"camera": "left"}}
    assert {name: start_receipt[name] for name in receipt_fields} == receipt_fields


def test_resumed_session_keeps_the_row(square: Path) -> None:
    protocol, store = run_one(square, "P025", "P002")
    store.close()
    choices = resumed_choices(store.folder.path, protocol=str(square))
    assert (choices.participant, choices.row_of) == ("P025", "P002")
    planned = build_schedule(protocol, "P025", SEED, 2)
    assert begun_schedule(protocol, start_of(journal.read(store.folder.journal)), store.key) == planned
    assert planned != build_schedule(protocol, "P025", SEED)
    outlets: Any = Collector()
    with open_store(choices, protocol, square.read_bytes(), RIG, {}, outlets=outlets) as resumed:
        assert resumed.lines[-1].event == "session_resumed"
    assert outlets.events == ["session_resumed"]


def test_the_receipt_lacks_row_of_without_a_row_of_another_participant(square: Path) -> None:
    _, store = run_one(square, "P025", None)
    store.close()
    assert "row_of" not in json.loads(store.folder.receipt.read_text("utf-8"))
    assert resumed_choices(store.folder.path, protocol=str(square)).row_of is None


@pytest.mark.parametrize(
    ("source", "row_of", "message"),
    [
        ("demo", "P002", "no block in demo has a Williams or Latin order"),
        ("square", "anna", "rows are assigned by the number in the ID"),
        ("square", "P 2", "rows are assigned by the number in the ID"),
    ],
)
def test_a_row_without_effect_is_refused(square: Path, source: str, row_of: str, message: str) -> None:
    text = source_bytes("demo") if source == "demo" else square.read_bytes()
    with pytest.raises(SessionError, match=message):
        check_choices(chosen_for(square, "P025", row_of), parse(text, "file.toml"))


def test_a_language_that_the_study_lacks_is_refused_with_those_it_has(square: Path) -> None:
    choices, protocol = chosen_for(square, "P025", None), parse(square.read_bytes(), "file.toml")
    check_choices(choices, protocol)
    with pytest.raises(SessionError, match=r"^language 'xx': demo is available only in en; choose one of these lang"):
        check_choices(replace(choices, language="xx"), protocol)
    draws = [replace(choices, seed=seed, participant=who).tremor().random() for seed, who in ((5, "P1"), (6, "P1"))]
    draws += [replace(choices, seed=5, participant="P2").tremor().random(), choices.tremor().random()]
    assert len(set(draws)) == 4
    assert choices.tremor().random() == stream(SEED, "run/P025/tremor").random() == draws[3]


def test_run_takes_the_row_of_a_participant(square: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    requests: list[NewSession] = []
    monkeypatch.setattr(live_session, "run_session", lambda chosen, _progress: requests.append(chosen) or 0)
    words = ["run", str(square), "--participant", "P025", "--row-of", "P002", "--results", str(square.parent / "r")]
    assert CliRunner().invoke(commands, words).exit_code == 0
    assert [request.row_of for request in requests] == ["P002"]
