"""The videos of a study: closed for good, and described without what would let a stranger in."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import VideoError
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.session.transitions.events import Broke, broken
from study_app.video import sources
from study_app.video.camera import without_login
from study_app.video.frames import VideoFrame, stopped
from study_app.video.sources import Videos


class FakeCamera:
    """A camera that opens once the test lets it."""

    opens: threading.Event
    made: list[FakeCamera]

    def __init__(self, source: str, *_: Any) -> None:
        self.made.append(self)
        assert self.opens.wait(10)
        self.source, self.size, self.closed = source, (640, 480), False
        self.newest = VideoFrame(0, 2, 2, 8, bytes(16), 0, None, 33_333_333)
        self.thread = threading.current_thread()

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> type[FakeCamera]:
    monkeypatch.setattr(FakeCamera, "opens", threading.Event(), raising=False)
    monkeypatch.setattr(FakeCamera, "made", [], raising=False)
    monkeypatch.setattr(sources, "Camera", FakeCamera)
    return FakeCamera


@pytest.fixture
def study() -> Protocol:
    text = source_bytes("demo").decode().replace("format = 1", "format = 2", 1)
    head = "[conditions.thick]\n"
    assert head in text
    return parse(text.replace(head, f'{head}view = "camera"\n').encode(), "demo.toml")


def videos(study: Protocol, camera: str = "v4l2:/dev/video0") -> Videos:
    return Videos(study, Path("/nowhere"), camera, lambda: 0)


def test_a_camera_that_opens_after_all_were_closed_is_closed_too(study: Protocol, camera: type[FakeCamera]) -> None:
    every = videos(study)
    opening = threading.Thread(target=every.open)
    opening.start()
    every.close()  # does not wait for the camera
    camera.opens.set()
    opening.join(10)
    (made,) = camera.made
    assert made.closed


def test_the_receipt_has_neither_name_nor_password_of_a_camera(study: Protocol, camera: type[FakeCamera]) -> None:
    camera.opens.set()
    every = videos(study, "rtsp://operator:secret@192.168.0.7/live")
    assert every.open().fault == ""
    assert every.describe()["camera"]["source"] == "rtsp://192.168.0.7/live"
    assert without_login("dshow:video=NAME") == "dshow:video=NAME"


def test_a_video_that_stops_is_no_haptic_device_to_be_reconnected() -> None:
    error = stopped("it ended")
    assert isinstance(error, VideoError)
    assert broken(1.0, error) == Broke(1.0, str(error), "program")
