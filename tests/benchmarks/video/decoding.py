"""PyAV against OpenCV: python tests/benchmarks/video/decoding.py [--seconds S].

Both read the same clip of 1280 x 720 at 30 Hz, scale each frame to 1152 x 648 and turn it into the 32-bit pixels that a
window paints: CPU time per frame, and how much of the time another Python thread cannot run. Then a camera in a process
of its own sends frames over TCP: the delay from sending a frame to having its pixels. Rounds of both are interleaved.
"""

import argparse
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av
import cv2
import numpy as np
from av.video.reformatter import VideoReformatter

from tests.video.clips import SIZE, number_in, write_clip

SHOWN = (1152, 648)
ROUNDS = 5
CAMERA = Path(__file__).resolve().parents[2] / "video" / "camera_process.py"


def by_pyav(source: str, **options: Any) -> Iterator[Any]:
    """Yield the pixels (height, width, 4) of every frame."""
    reformatter = VideoReformatter()
    with av.open(source, **options) as container:
        container.streams.video[0].thread_count = 1
        for frame in container.decode(video=0):
            scaled = reformatter.reformat(frame, *SHOWN, "bgra", interpolation="BILINEAR")
            plane = scaled.planes[0]
            yield np.frombuffer(plane, np.uint8).reshape(scaled.height, plane.line_size)[:, : 4 * scaled.width]


def by_opencv(source: str, **_: Any) -> Iterator[Any]:
    """Yield the pixels (height, width, 4) of every frame."""
    cv2.setNumThreads(1)
    capture = cv2.VideoCapture(source, cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])
    while True:
        read, frame = capture.read()
        if not read:
            capture.release()
            return
        yield cv2.cvtColor(cv2.resize(frame, SHOWN, interpolation=cv2.INTER_LINEAR), cv2.COLOR_BGR2BGRA)


LIVE = {"fflags": "nobuffer", "flags": "low_delay", "probesize": "65536", "analyzeduration": "0"}
LIBRARIES: dict[str, Callable[..., Iterator[Any]]] = {"PyAV": by_pyav, "OpenCV": by_opencv}


def decoding(library: str, clip: Path) -> tuple[float, float]:
    """Return the CPU time per frame [ms], and the longest pause of another Python thread [ms], 95th percentile."""
    pauses: list[float] = []
    ended = threading.Event()

    def watch() -> None:
        before = time.perf_counter()
        while not ended.is_set():
            time.sleep(0.001)
            now = time.perf_counter()
            pauses.append(1e3 * (now - before))
            before = now

    watcher = threading.Thread(target=watch)
    watcher.start()
    began, count = time.process_time(), 0
    for _ in LIBRARIES[library](str(clip)):
        count += 1
    spent = time.process_time() - began
    ended.set()
    watcher.join()
    return 1e3 * spent / count, float(np.percentile(pauses, 95))


def delays_ms(library: str, seconds: float) -> list[float]:
    """Return the delays from sending a frame to having its pixels [ms]."""
    command = [sys.executable, str(CAMERA), "--seconds", str(seconds), "--print"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as camera:
        assert camera.stdout is not None
        source = f"tcp://127.0.0.1:{int(camera.stdout.readline())}"
        got = {number_in(pixels): time.monotonic() for pixels in LIBRARIES[library](source, options=LIVE)}
        sent = dict(map(float, line.split()) for line in camera.stdout)
    common = sorted(got.keys() & sent.keys())[10:]
    return [1e3 * (got[number] - sent[number]) for number in common]


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=6.0)
    seconds = parser.parse_args().seconds
    with TemporaryDirectory() as folder:
        clip = Path(folder) / "clip.mp4"
        write_clip(clip, frames=round(30 * seconds))
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in LIBRARIES}
        for _ in range(ROUNDS):
            for name, rounds in found.items():
                rounds.append(decoding(name, clip))
    print(f"{SIZE[0]} x {SIZE[1]} H.264 to {SHOWN[0]} x {SHOWN[1]} pixels of 32 bits, medians of {ROUNDS} rounds")
    for name, rounds in found.items():
        cpu, pause = np.median(rounds, axis=0)
        print(f"{name:<8} {cpu:6.2f} ms of CPU per frame   other threads pause at most {pause:.2f} ms (p95)")
    ratios = [one[0] / other[0] for one, other in zip(found["PyAV"], found["OpenCV"], strict=True)]
    print(f"ratio    {np.median(ratios):6.2f} ({min(ratios):.2f} to {max(ratios):.2f})")
    os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = "|".join(f"{name};{value}" for name, value in LIVE.items())
    delays: dict[str, list[float]] = {name: [] for name in LIBRARIES}
    for _ in range(3):
        for name, of_library in delays.items():
            of_library.extend(delays_ms(name, seconds / 2))
    print("camera in a process of its own, over TCP: delay from sending to pixels")
    for name, of_library in delays.items():
        median, late = np.percentile(of_library, (50, 95))
        print(f"{name:<8} {median:6.1f} ms (median)  {late:.1f} ms (p95)  of {len(of_library)} frames")


if __name__ == "__main__":
    main()
