"""What is chosen before a session, and what is refused before any window opens for it."""

from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app import app
from study_app.app.session import live_session
from study_app.errors import StoreError
from study_app.protocol.source.files import source_bytes
from study_app.session import start
from study_app.session.preflight import Measurements, Screen
from study_app.session.start import NewSession, Ready, draw_seed, resumed_choices
from study_app.store.sessions.open_session import SessionStore
from study_app.store.workstation import MachineSettings
from study_app.workspace import workspace
from tests import studies
from tests.session.small import CHOSEN


def test_measurements_of_a_ready_session_include_screen_and_outlets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(start, "Videos", lambda *arguments: arguments)
    rig: Any = SimpleNamespace(servo=SimpleNamespace(now_ns=7))
    outlets: Any = SimpleNamespace(statuses=lambda: ("lsl",))
    facts = Measurements(**dict.fromkeys(field.name for field in fields(Measurements)))  # type: ignore[arg-type]
    measured = Ready(rig, facts, outlets=outlets).facts_with(refresh_hz=59.9, scaling=1.25)
    assert measured == replace(facts, screen=Screen(refresh_hz=59.9, scaling=1.25), outlets=("lsl",))  # type: ignore[arg-type]
    chosen: Any = SimpleNamespace(source="demo", footage=Path("waves"))
    for shows in (True, False):
        study: Any = SimpleNamespace(conditions={"thin": SimpleNamespace(shows_video=shows)})
        assert start.unopened_videos(chosen, study, "front", rig) == (
            (study, Path("waves"), "front", 7) if shows else None
        )


@pytest.fixture
def begin_demo(tmp_path: Path) -> SessionStore:
    """Begin a session of the demo; return it open."""
    return studies.begun(tmp_path / "results", seed=5, operator="AK")


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> list[NewSession]:
    """Open no window; return the sessions for which they would have been."""
    requests: list[NewSession] = []
    monkeypatch.setattr(live_session, "run_session", lambda chosen, _progress: requests.append(chosen) or 0)
    return requests


def test_a_resumed_session_has_the_settings_of_its_start(begin_demo: SessionStore, windows: list[NewSession]) -> None:
    begin_demo.close()
    assert app.resume(begin_demo.folder.path, operator="BB") == 0
    (request,) = windows
    assert request == resumed_choices(begin_demo.folder.path, operator="BB")
    assert (request.participant, request.session, request.seed, request.device) == ("P001", 1, 5, "mouse")
    assert (request.source, request.results, request.resumes) == (
        "demo",
        begin_demo.place.study_folder.path,
        begin_demo.folder.path,
    )


def test_a_drawn_seed_is_from_1_to_the_largest_that_a_person_would_copy(monkeypatch: pytest.MonkeyPatch) -> None:
    for draw, seed in ((lambda _: 0, 1), (lambda below: below - 1, 999_999)):
        monkeypatch.setattr("secrets.randbelow", draw)
        assert draw_seed() == seed


def test_outlets_are_opened_for_markers_or_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    opened_outlets: list[tuple[object, ...]] = []
    servo: Any = object()
    monkeypatch.setattr(start, "Outlets", lambda *arguments: opened_outlets.append(arguments))
    for settings in (
        {},
        {"triggers": "udp:lab:9"},
        {"lsl_markers": True, "triggers": "usb:1"},
        {"lsl_samples": "always"},
    ):
        start.open_outlets(MachineSettings(**settings), servo, "single")
    addresses = (("udp:lab:9",), "off"), (("lsl", "usb:1"), "off"), ((), "always")
    assert opened_outlets == [(*arguments, servo, "single") for arguments in addresses]


def test_a_session_that_is_open_is_refused_before_any_window(
    begin_demo: SessionStore, windows: list[NewSession]
) -> None:
    with begin_demo, pytest.raises(StoreError, match="is open in another program"):
        app.resume(begin_demo.folder.path)
    assert windows == []


def test_a_finished_session_is_refused_before_any_window(begin_demo: SessionStore, windows: list[NewSession]) -> None:
    begin_demo.finish("completed")
    with pytest.raises(StoreError, match="is finished"):
        app.resume(begin_demo.folder.path, protocol="a file that is gone")
    assert windows == []


def test_a_changed_protocol_is_refused_before_any_window(
    begin_demo: SessionStore, windows: list[NewSession], tmp_path: Path
) -> None:
    begin_demo.close()
    before = begin_demo.folder.journal.read_bytes()
    changed = tmp_path / "changed.toml"
    changed.write_text(
        source_bytes("demo").decode().replace('"Reaching"', '"Reach now"'), encoding="utf-8", newline="\n"
    )
    with pytest.raises(StoreError, match="Reach now"):
        app.resume(begin_demo.folder.path, protocol=str(changed))
    assert windows == []
    assert begin_demo.folder.journal.read_bytes() == before


def test_a_session_is_named_by_its_participant_group_number_seed_and_whether_it_is_a_pilot() -> None:
    choices = replace(CHOSEN, participant="P007", session=3, seed=41)
    assert choices.who == "Participant P007  ·  session 3  ·  seed 41"
    assert replace(choices, group="young", pilot=True).who == (
        "Participant P007  ·  group young  ·  session 3  ·  seed 41  ·  pilot"
    )


def test_a_session_is_run_as_it_was_asked_for_and_else_with_the_defaults(
    windows: list[NewSession], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = tmp_path / "own"
    choices = {
        "participant": "P007",
        "session": 1,
        "operator": "AK",
        "recordings": False,
        "screen": 2,
        "device": "falcon",
    }
    firmware: dict[str, str | Path] = {"firmware": "/firmware.bin"}
    app.run("rek2024", seed=41, language="nl", device_options=firmware, results=results, **choices)  # type: ignore[arg-type]
    assert windows.pop() == NewSession(
        source="rek2024",
        seed=41,
        language="nl",
        windowed=False,
        results=results,
        device_options=firmware,
        **choices,  # type: ignore[arg-type]
    )
    monkeypatch.setattr("secrets.randbelow", lambda _: 76)
    folders = {("mouse", False): "", ("scripted", False): "-scripted", ("mouse", True): "-pilot"}
    for (device, pilot), suffix in folders.items():
        app.run("rek2024", participant="P008", device=device, pilot=pilot)
        folder = workspace().results / f"rek2024{suffix}"
        defaults = replace(CHOSEN, source="rek2024", participant="P008", seed=77, operator="", results=folder)
        assert windows.pop() == replace(defaults, device=device, windowed=pilot, pilot=pilot)


def test_a_pilot_is_resumed_with_its_language_its_recordings_and_its_device(tmp_path: Path) -> None:
    receipt_fields = {"seed": 41, "language": "nl", "device": {"name": "falcon"}, "pilot": True, "recordings": False}
    begun_store = studies.begun(tmp_path / "results", "P007", "rek2024", **receipt_fields)
    begun_store.close()
    chosen = resumed_choices(begun_store.folder.path, operator="BB", screen=2)
    begun_as = replace(CHOSEN, source="rek2024", participant="P007", seed=41, language="nl", device="falcon")
    again = replace(
        begun_as, pilot=True, recordings=False, results=tmp_path / "results", resumes=begun_store.folder.path
    )
    assert chosen == replace(again, operator="BB", screen=2, windowed=True)  # as all pilots are
    choices = resumed_choices(begun_store.folder.path, device="mouse", device_options={"firmware": "/firmware.bin"})
    assert (choices.device, choices.device_options) == ("mouse", {"firmware": "/firmware.bin"})
