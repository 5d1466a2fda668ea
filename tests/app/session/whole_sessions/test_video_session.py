"""A session whose conditions show footage: what is recorded, and that it does not reveal a condition."""

import hashlib
import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.app.session.bridge import SessionBridge
from study_app.devices.rig import Rig
from study_app.errors import SessionError, VideoError
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import PausePage, TroublePage
from study_app.store import workstation
from study_app.store.blinded.blinding import read_key
from study_app.store.journals.journal_events import CAUSE_WITHHELD
from study_app.store.recordings import read_frames
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.workstation import MachineSettings
from study_app.video import sources
from tests.app.people import Person, events, receipt_of, rows, run_attended, window
from tests.compiled import needs_servo

pytest.importorskip("av", reason="the optional extra video is not installed")

from tests.video.clips import RATE_HZ, write_clip

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight")]

NAME = "zanzibar.mp4"


@pytest.fixture
def study(short_demo: str) -> Path:
    """Return a short demo in format 2 whose condition ``thick`` shows footage, and differs in nothing else."""
    path = Path(short_demo)
    text = path.read_text("utf-8")
    head = '[conditions.thick]\nliquid = "thick"\n'
    assert head in text
    path.write_text(
        text.replace(head, f'[conditions.thick]\nliquid = "thin"\nview = "{NAME}"\n'), encoding="utf-8", newline="\n"
    )
    return path


@pytest.fixture
def run(study: Path, results: Path) -> Callable[[], int]:
    return lambda: run_attended(study, results)[0]


def test_footage_is_shown_recorded_and_sealed(study: Path, run: Any, results: Path) -> None:
    write_clip(study.parent / NAME, frames=20, size=(320, 180))
    assert run() == 0
    ended = events(results)
    assert ended[-1]["status"] == "completed"
    digest = hashlib.sha256((study.parent / NAME).read_bytes()).hexdigest()
    assert receipt_of(results)["video"] == {"footage_sha256": [digest]}
    assert "video_frames" not in rows(results, "trials")[0]
    assert len({len(event["sealed"]) for event in ended if event["event"] == "trial_ended"}) == 1
    texts = [path for path in results.rglob("*") if path.is_file() and path.suffix not in {".parquet", ".sealed"}]
    assert not [path for path in texts if NAME.encode() in path.read_bytes()]
    key = read_key(results)
    assert not verify_study(results).errors
    unblind(results, by="AK", reason="a test")
    frames_of = {row["trial"]: row["video_frames"] for row in rows(results, "trials")}
    thick = {row["trial"] for row in rows(results, "trials") if key.condition(row["block"], row["code"]) == "thick"}
    assert {trial for trial, frames in frames_of.items() if frames != "n/a"} == thick
    for row in rows(results, "trials"):
        recorded = read_frames(results / "data" / "sub-P001" / "ses-01" / row["recording_frames"])
        if row["trial"] not in thick:
            assert set(recorded["video_frame"]) == {-1}
            continue
        assert row["video_age_mean_ms"] == "0.0"
        assert set(recorded["video_age_ns"][recorded["video_frame"] >= 0]) == {0}
        assert recorded["video_frame"].max() >= 3
        period_ns = 1e9 / RATE_HZ
        recorded = recorded[recorded["video_frame"] >= 0]
        times, numbers = recorded["video_ns"] - recorded["video_ns"].min(), recorded["video_frame"]
        assert abs(times - numbers * period_ns).max() < 2 * period_ns  # before the first frame it does not run


def test_footage_that_cannot_be_read_is_refused_and_nothing_is_created(study: Path, run: Any, results: Path) -> None:
    (study.parent / NAME).write_bytes(b"no video")
    with pytest.raises(SessionError, match=rf"video: .*{NAME} cannot be shown"):
        run()
    assert not results.exists()


def test_a_camera_that_is_not_there_is_refused(study: Path, run: Any, results: Path) -> None:
    study.write_text(
        study.read_text("utf-8").replace(f'view = "{NAME}"', 'view = "camera"'), encoding="utf-8", newline="\n"
    )
    workstation.save_settings(MachineSettings(camera="tcp://127.0.0.1:9"))
    with pytest.raises(SessionError, match=r"video: the camera tcp://127\.0\.0\.1:9 cannot be used: (?!Error number)"):
        run()
    assert not results.exists()


class Operator(Person):
    """An operator who reconnects failed devices as soon as possible, and resumes.

    ``forces`` says whether one was on meanwhile, ``troubles`` what was shown to have failed.
    """

    def __init__(self) -> None:
        super().__init__()
        self.bridge: SessionBridge | None = None
        self.forces: list[bool] = []
        self.troubles: set[str] = set()

    def look(self) -> None:
        participant, operator = window(ParticipantWindow), window(OperatorWindow)
        page = None if participant is None else participant.page
        if not isinstance(page, TroublePage | PausePage):
            super().look()
            return
        self.forces.append(self.bridge.parts.servo.force_is_on)
        if isinstance(page, TroublePage):
            self.troubles.add(self.bridge.view().trouble)
        if isinstance(page, PausePage):
            operator.ask("resume")
        elif operator.banner.reconnect.isVisible() and operator.banner.reconnect.isEnabled():
            QTest.mouseClick(operator.banner.reconnect, Qt.MouseButton.LeftButton)


@pytest.mark.nightly
def test_footage_that_stops_is_opened_again_by_the_operator(
    study: Path, results: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The working haptic device is left as it is; the trial is presented again with the video."""
    write_clip(study.parent / NAME, frames=20, size=(320, 180))
    reconnected: list[Rig] = []
    monkeypatch.setattr(Rig, "reconnect", reconnected.append)
    scaler: Any = vars(sources)["Scaler"]
    scale, scaled, fail = scaler.pixels, itertools.count(), SessionBridge.fail

    def pixels(scaler: Any, frame: Any) -> Any:
        if next(scaled) == 20:  # 15 wait decoded before the first trial
            raise OSError("the file is gone")
        return scale(scaler, frame)

    monkeypatch.setattr(scaler, "pixels", pixels)
    operator = Operator()

    def failed(bridge: SessionBridge, error: BaseException) -> None:
        operator.bridge = bridge
        fail(bridge, error)

    monkeypatch.setattr(SessionBridge, "fail", failed)
    assert run_attended(study, results, operator)[0] == 0
    lines = events(results)
    (broke,) = [line for line in lines if line["event"] == "broke"]
    (again,) = [line for line in lines if line["event"] == "device_reconnected"]
    assert broke["what"] == CAUSE_WITHHELD
    assert operator.troubles == {"one of the study's videos stopped (the file is gone): check the camera and the files"}
    assert again["device"] == "scripted"
    assert reconnected == []
    assert lines[-1]["status"] == "completed"
    assert operator.forces
    assert not any(operator.forces)
    first, second = [row for row in rows(results, "trials") if row["notes"] != "n/a"]
    assert (first["outcome"], second["outcome"]) == ("interrupted", "complete")
    assert first["notes"] == "the session was stopped and continued"
    assert second["notes"] == "presented again: the session was stopped and continued"
    assert "the file is gone" in caplog.text
    caplog.clear()


def test_a_source_that_fails_in_a_trial_ends_in_zero_force(
    study: Path, run: Any, results: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    write_clip(study.parent / NAME, frames=20, size=(320, 180))
    forces: list[bool] = []
    offers: list[bool] = []
    fail = SessionBridge.fail

    def failed(bridge: SessionBridge, error: BaseException) -> None:
        fail(bridge, error)
        forces.append(bridge.parts.servo.force_is_on)
        offers.append(bridge.view().may_reconnect)
        bridge.leave_without_asking()

    monkeypatch.setattr(SessionBridge, "fail", failed)
    monkeypatch.setattr("study_app.video.sources.Footage.frame_at", _lost)
    with pytest.raises(Exception, match="the session was stopped: the file is gone"):
        run()
    assert forces[0] is False
    assert offers[0] is True
    assert "broke" in {event["event"] for event in events(results)}
    assert (
        json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text("utf-8"))["status"]
        == "unfinished"
    )
    assert "the file is gone" in caplog.text
    caplog.clear()


def _lost(*_: Any) -> Any:
    raise VideoError("the file is gone")
