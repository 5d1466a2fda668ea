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


def test_what_is_ready_is_measured_with_its_screen_and_its_outlets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(start, "Videos", lambda *given: given)
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
def begun(tmp_path: Path) -> SessionStore:
    """Begin a session of the demo; return it open."""
    return studies.begun(tmp_path / "results", seed=5, operator="AK")


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> list[NewSession]:
    """Open no window; return the sessions for which they would have been."""
    asked: list[NewSession] = []
    monkeypatch.setattr(live_session, "run_session", lambda chosen, _progress: asked.append(chosen) or 0)
    return asked


def test_a_session_that_can_go_on_is_chosen_as_it_was_begun(begun: SessionStore, windows: list[NewSession]) -> None:
    begun.close()
    assert app.resume(begun.folder.path, operator="BB") == 0
    (chosen,) = windows
    assert chosen == resumed_choices(begun.folder.path, operator="BB")
    assert (chosen.participant, chosen.session, chosen.seed, chosen.device) == ("P001", 1, 5, "mouse")
    assert (chosen.source, chosen.results, chosen.resumes) == ("demo", begun.place.study_folder.path, begun.folder.path)


def test_a_drawn_seed_is_from_1_to_the_largest_that_a_person_would_copy(monkeypatch: pytest.MonkeyPatch) -> None:
    for drawn, seed in ((lambda _: 0, 1), (lambda below: below - 1, 999_999)):
        monkeypatch.setattr("secrets.randbelow", drawn)
        assert draw_seed() == seed


def test_outlets_are_opened_for_markers_or_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[object, ...]] = []
    servo: Any = object()
    monkeypatch.setattr(start, "Outlets", lambda *told: opened.append(told))
    for settings in (
        {},
        {"triggers": "udp:lab:9"},
        {"lsl_markers": True, "triggers": "usb:1"},
        {"lsl_samples": "always"},
    ):
        start.open_outlets(MachineSettings(**settings), servo, "single")
    addresses = (("udp:lab:9",), "off"), (("lsl", "usb:1"), "off"), ((), "always")
    assert opened == [(*told, servo, "single") for told in addresses]


def test_a_session_that_is_open_is_refused_before_any_window(begun: SessionStore, windows: list[NewSession]) -> None:
    with begun, pytest.raises(StoreError, match="is open in another program"):
        app.resume(begun.folder.path)
    assert windows == []


def test_a_finished_session_is_refused_before_any_window(begun: SessionStore, windows: list[NewSession]) -> None:
    begun.finish("completed")
    with pytest.raises(StoreError, match="is finished"):
        app.resume(begun.folder.path, protocol="a file that is gone")
    assert windows == []


def test_a_changed_protocol_is_refused_before_any_window(
    begun: SessionStore, windows: list[NewSession], tmp_path: Path
) -> None:
    begun.close()
    before = begun.folder.journal.read_bytes()
    changed = tmp_path / "changed.toml"
    changed.write_text(
        source_bytes("demo").decode().replace('"Now reach"', '"Reach now"'), encoding="utf-8", newline="\n"
    )
    with pytest.raises(StoreError, match="Reach now"):
        app.resume(begun.folder.path, protocol=str(changed))
    assert windows == []
    assert begun.folder.journal.read_bytes() == before


def test_a_session_is_named_by_its_participant_group_number_seed_and_whether_it_is_a_pilot() -> None:
    chosen = replace(CHOSEN, participant="P007", session=3, seed=41)
    assert chosen.who == "Participant P007  ·  session 3  ·  seed 41"
    assert replace(chosen, group="young", pilot=True).who == (
        "Participant P007  ·  group young  ·  session 3  ·  seed 41  ·  pilot"
    )


def test_a_session_is_run_as_it_was_asked_for_and_else_with_the_defaults(
    windows: list[NewSession], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = tmp_path / "own"
    asked = {
        "participant": "P007",
        "session": 1,
        "operator": "AK",
        "recordings": False,
        "screen": 2,
        "device": "falcon",
    }
    firmware: dict[str, str | Path] = {"firmware": "/firmware.bin"}
    app.run("rek2024", seed=41, language="nl", device_options=firmware, results=results, **asked)  # type: ignore[arg-type]
    assert windows.pop() == NewSession(
        source="rek2024",
        seed=41,
        language="nl",
        windowed=False,
        results=results,
        device_options=firmware,
        **asked,  # type: ignore[arg-type]
    )
    monkeypatch.setattr("secrets.randbelow", lambda _: 76)
    folders = {("mouse", False): "", ("scripted", False): "-scripted", ("mouse", True): "-pilot"}
    for (device, pilot), suffix in folders.items():
        app.run("rek2024", participant="P008", device=device, pilot=pilot)
        folder = workspace().results / f"rek2024{suffix}"
        defaults = replace(CHOSEN, source="rek2024", participant="P008", seed=77, operator="", results=folder)
        assert windows.pop() == replace(defaults, device=device, windowed=pilot, pilot=pilot)


def test_a_pilot_is_resumed_with_its_language_its_recordings_and_its_device(tmp_path: Path) -> None:
    given = {"seed": 41, "language": "nl", "device": {"name": "falcon"}, "pilot": True, "recordings": False}
    begun = studies.begun(tmp_path / "results", "P007", "rek2024", **given)
    begun.close()
    chosen = resumed_choices(begun.folder.path, operator="BB", screen=2)
    begun_as = replace(CHOSEN, source="rek2024", participant="P007", seed=41, language="nl", device="falcon")
    again = replace(begun_as, pilot=True, recordings=False, results=tmp_path / "results", resumes=begun.folder.path)
    assert chosen == replace(again, operator="BB", screen=2, windowed=True)  # as all pilots are
    asked = resumed_choices(begun.folder.path, device="mouse", device_options={"firmware": "/firmware.bin"})
    assert (asked.device, asked.device_options) == ("mouse", {"firmware": "/firmware.bin"})
