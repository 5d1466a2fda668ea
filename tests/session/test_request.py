"""What is chosen before a session, and what is refused before any window opens for it."""

from pathlib import Path
from typing import Any

import pytest

from study_app import app
from study_app.app.session import live_session
from study_app.errors import StoreError
from study_app.protocol.source.files import source_bytes
from study_app.session import start
from study_app.session.start import NewSession, draw_seed, resumed_choices
from study_app.store.sessions.open_session import SessionStore
from study_app.store.workstation import MachineSettings
from tests import studies


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
