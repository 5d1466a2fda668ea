"""A live camera: a process of its own that sends frames over TCP, with time stamps of known age or none."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from study_app.errors import VideoError

pytest.importorskip("av", reason="the optional extra video is not installed")

from study_app.video import sources
from study_app.video.sources import Camera, _FrameNumbers
from tests.strangers import ends_with_each
from tests.video.clips import number_in
from tests.video.test_footage import pixels_of

pytestmark = pytest.mark.slow

SENDER = Path(__file__).with_name("camera_process.py")
SIZE = ("--size", "320x180")
PERIOD_S = 1 / 30


@contextmanager
def sending(*options: str) -> Iterator[tuple[Camera, subprocess.Popen[str]]]:
    command = [sys.executable, str(SENDER), *SIZE, *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        live_camera = Camera(f"tcp://127.0.0.1:{int(process.stdout.readline())}", time.perf_counter_ns, 0.5)
        try:
            yield live_camera, process
        finally:
            live_camera.close()
            process.kill()


@contextmanager
def camera(*options: str) -> Iterator[Camera]:
    with sending(*options) as (live_camera, _):
        yield live_camera


@pytest.mark.nightly
def test_a_camera_shows_the_frame_that_was_ready_at_a_moment_and_its_age() -> None:
    with camera("--seconds", "4", "--age-ms", "80") as live_camera:
        time.sleep(1.0)
        now_ns = time.perf_counter_ns()
        newest, earlier = live_camera.frame_at(now_ns), live_camera.frame_at(now_ns - 200_000_000)
        assert newest is not None
        assert earlier is not None
        assert 0 <= now_ns - newest.due_ns < 3e9 * PERIOD_S
        assert 0 <= now_ns - 200_000_000 - earlier.due_ns < 3e9 * PERIOD_S
        assert number_in(pixels_of(newest)) - number_in(pixels_of(earlier)) == newest.number - earlier.number > 0
        assert newest.age_ns is not None
        assert 80e6 <= newest.age_ns < 80e6 + 2e9 * PERIOD_S  # what encoding and sending took is part of it


def test_the_age_of_frames_is_unknown_where_time_stamps_are_on_no_clock() -> None:
    with camera("--seconds", "3", "--relative") as live_camera:
        assert live_camera.newest.age_ns is None


@pytest.mark.nightly
@pytest.mark.flaky(reruns=4)  # on a busy machine the sender itself may be late by a frame, and stamps say so
def test_frames_that_were_lost_on_the_way_have_numbers() -> None:
    with camera("--seconds", "4", "--lose", "5") as live_camera:
        time.sleep(1.5)
        with live_camera._changed:
            held = list(live_camera._frames)
    steps = {later.number - earlier.number for earlier, later in pairwise(held)}
    assert steps == {1, 2}
    numbers = [number_in(pixels_of(frame)) for frame in held]
    assert [b - a for a, b in pairwise(numbers)] == [later.number - earlier.number for earlier, later in pairwise(held)]


@pytest.mark.nightly
def test_a_stopped_camera_is_reported_in_one_line_without_its_name() -> None:
    with camera("--seconds", "2") as live_camera:
        live_camera.thread.join(10)
        with pytest.raises(VideoError, match=r"stopped \(it ended\): check the camera and the files") as refused:
            live_camera.frame_at(time.perf_counter_ns())
        assert live_camera.source not in str(refused.value)  # the operator and the journal's readers are blind


@pytest.mark.nightly
@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="this system cannot stop a process")
def test_a_silent_camera_is_reported() -> None:
    with sending("--seconds", "20") as (live_camera, process):
        os.kill(process.pid, signal.SIGSTOP)
        live_camera.thread.join(10)
        assert not live_camera.thread.is_alive()
        with pytest.raises(VideoError, match=r"stopped \(no data arrived in time\)"):
            live_camera.frame_at(time.perf_counter_ns())


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("", "^no camera is selected: specify one under This machine"),
        ("tcp://127.0.0.1:9", "the camera tcp://127.0.0.1:9 cannot be used: Connection refused"),
        ("v4l2:/dev/video77", "the camera v4l2:/dev/video77 cannot be used: No such file or directory"),
    ],
)
def test_no_camera_is_refused_in_one_line(source: str, why: str) -> None:
    with pytest.raises(VideoError, match=why):
        Camera(source, time.perf_counter_ns, 0.0)


@pytest.mark.parametrize("protocol", ["tcp", "http"])
def test_another_program_in_place_of_a_camera_is_one_line_in_time(
    protocol: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "OPENS_S", 1.0)

    def client(port: int) -> str:
        with pytest.raises(VideoError) as refused:
            Camera(f"{protocol}://127.0.0.1:{port}/", time.perf_counter_ns, 0.0)
        return str(refused.value)

    said = ends_with_each(client)
    line = rf"the camera {protocol}://127.0.0.1:\d+/? cannot be used: [^\n]{{1,100}}$"
    assert [reply for reply in said.items() if not re.match(line, reply[1])] == []


def test_numbers_follow_time_stamps() -> None:
    numbers = _FrameNumbers(33_333_333)
    assert [numbers.next_number(stamp) for stamp in (0.0, 0.033, 0.1, 0.133, None, 0.3)] == [0, 1, 3, 4, 5, 6]
