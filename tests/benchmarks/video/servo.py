"""What a video costs the servo, and how late it is: python tests/benchmarks/video/servo.py [--rounds N] [--seconds S].

The servo runs at 1 kHz with the mouse device under a tank of 1920 x 1080 that is painted 60 times a second, in turn
without a video and with footage of 1280 x 720 at 30 Hz (H.264), at requested delays of 0 and 100 ms. Printed are the
lateness of the servo's ticks, ratios of neighbouring segments with their 95 % intervals (bootstrap), and by how much
frames of the video were later than requested, in periods of the video.
"""

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtWidgets import QApplication

from study_app.devices.simulated import MouseDevice
from study_app.gui.participant.tank_widget import TankWidget
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load_scene
from study_app.protocol.wording.languages import words
from study_app.session.trial import SETTLED_S
from study_app.video.frames import VideoStatistics
from study_app.video.sources import Footage

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.gui.small import follow, task_page, view
from tests.video.clips import RATE_HZ, SIZE, write_clip

FRAME_MS = 16
DELAYS_S = (0.0, 0.1)
LEFT_OUT_S = 0.5


class Segment:
    """One segment: paints the tank, with a video or without, while the servo is listened to."""

    def __init__(self, servo: Servo, widget: TankWidget, footage: Footage | None, delay_s: float) -> None:
        self.servo, self.widget, self.footage, self.delay_s = servo, widget, footage, delay_s
        self.seen = VideoStatistics()
        self.errors_ns: list[int] = []
        self.choices_ns: list[int] = []
        self.gaps_ns: list[int] = []
        self._painted_ns = 0
        self._shown = -1
        self._begun = False
        self.painting_s = 0.0
        self.frames = 0
        widget.show_interval(replace(widget.page, video=footage is not None))
        if footage is not None:
            footage.fit(*widget.video.size(1.0))
            footage.rewind()

    def paint(self) -> None:
        """Paint a frame like a session, and record the video frame."""
        began = time.perf_counter()
        drawn_ns = self.servo.now_ns() - round((self.delay_s + SETTLED_S) * 1e9)
        position_m, shown_ns = self.servo.telemetry.position_at(drawn_ns)
        video = None if self.footage is None else self.footage.frame_at(drawn_ns)
        self.widget.show_view(replace(view(tuple(position_m), sample_ns=shown_ns, target_m=(0, 0, 0)), video=video))
        painted_ns = self.servo.now_ns()
        if self.footage is not None and not self._begun:
            self.footage.begin(painted_ns)
        elif video is not None and video.number > 0:
            self.choices_ns.append(drawn_ns - video.due_ns)
            if video.number != self._shown:
                self._shown = video.number
                self.errors_ns.append(painted_ns - video.due_ns - round(self.delay_s * 1e9))
                self.seen.frame(painted_ns, video, self.delay_s)
        if self._begun:
            self.gaps_ns.append(painted_ns - self._painted_ns)
        self._begun, self._painted_ns = True, painted_ns
        self.painting_s += time.perf_counter() - began
        self.frames += 1

    def run(self, seconds: float) -> Any:
        """Return the lateness of every tick [ns]."""
        loop, timer = QEventLoop(), QTimer()
        timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(self.paint)
        timer.start(FRAME_MS)
        reader = self.servo.telemetry.reader()
        kept: list[Any] = []
        polls = QTimer()
        polls.timeout.connect(lambda: kept.append(reader.read().lateness_ns.copy()))
        polls.start(200)
        QTimer.singleShot(round(1e3 * seconds), loop.quit)
        loop.exec()
        timer.stop()
        polls.stop()
        return np.concatenate([*kept, reader.read().lateness_ns])[round(1000 * LEFT_OUT_S) :]


def interval(ratios: list[float]) -> str:
    """Return the geometric mean of ratios with its 95 % interval by bootstrap."""
    logs = np.log(ratios)
    draws = np.random.default_rng(1).choice(logs, (10_000, len(logs))).mean(axis=1)
    low, high = np.exp(np.percentile(draws, (2.5, 97.5)))
    return f"{np.exp(logs.mean()):.2f} ({low:.2f} to {high:.2f})"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=6.0)
    options = parser.parse_args()
    QApplication.instance() or QApplication([])
    widget = TankWidget(task_page(follow()), words("en"))
    widget.resize(1920, 1080)
    widget.show()
    times_ns: dict[str, list[Any]] = {"without": [], "with": []}
    errors_ns: dict[float, list[int]] = {delay_s: [] for delay_s in DELAYS_S}
    choices_ns: list[int] = []
    gaps_ns: list[int] = []
    late = lost = frames = 0
    painting_ms: dict[str, list[float]] = {"without": [], "with": []}
    with TemporaryDirectory() as folder, Servo(MouseDevice()) as servo:
        servo.load(load_scene("rek2024", "water"))
        clip = Path(folder) / "clip.mp4"
        write_clip(clip, frames=5 * RATE_HZ)
        footage = Footage(clip)
        for number in range(options.rounds):
            names = ("without", "with") if number % 2 == 0 else ("with", "without")
            for name in names:
                delay_s = DELAYS_S[number // 2 % len(DELAYS_S)]
                segment = Segment(servo, widget, footage if name == "with" else None, delay_s)
                times_ns[name].append(segment.run(options.seconds))
                painting_ms[name].append(1e3 * segment.painting_s / segment.frames)
                if name == "with":
                    errors_ns[delay_s] += segment.errors_ns
                    choices_ns += segment.choices_ns
                    gaps_ns += segment.gaps_ns
                    columns = segment.seen.columns()
                    late, lost = late + columns["video_frames_late"], lost + columns["video_frames_lost"]
                    frames += columns["video_frames"]
        footage.close()
        priority = servo.describe()["priority"]
    print(
        f"footage {SIZE[0]} x {SIZE[1]} at {RATE_HZ} Hz, {options.rounds} rounds of {options.seconds:g} s; {priority}"
    )
    print(f"{'lateness of ticks':<20}{'p50 us':>9}{'p99 us':>9}{'paint ms':>10}")
    for name, segments in times_ns.items():
        middle, high = (np.median([np.percentile(segment, q) for segment in segments]) / 1e3 for q in (50, 99))
        print(f"{name + ' a video':<20}{middle:>9.1f}{high:>9.1f}{np.median(painting_ms[name]):>10.2f}")
    for q in (50, 99):
        values = [
            np.percentile(times_with, q) / np.percentile(times_without, q)
            for times_with, times_without in zip(times_ns["with"], times_ns["without"], strict=True)
        ]
        print(f"ratio of p{q}, with to without: {interval(values)}")
    period_ns = 1e9 / RATE_HZ
    for delay_s, errors in errors_ns.items():
        if errors:
            mean, high, most = np.mean(errors), np.percentile(errors, 99), max(errors)
            print(
                f"video asked for {1e3 * delay_s:.0f} ms late: error in its periods: mean {mean / period_ns:.2f}, "
                f"p99 {high / period_ns:.2f}, largest {most / period_ns:.2f}, of {len(errors)} frames"
            )
    right = np.mean(np.asarray(choices_ns) < period_ns)
    print(
        f"of {len(choices_ns)} paintings {100 * right:.2f} % showed the video's frame of their moment, the oldest was "
        f"{max(choices_ns) / period_ns:.2f} periods old"
    )
    print(f"time between paintings: p99 {np.percentile(gaps_ns, 99) / 1e6:.0f} ms, longest {max(gaps_ns) / 1e6:.0f} ms")
    print(f"frames {frames}, late by more than a period {late}, lost {lost}")


if __name__ == "__main__":
    main()
