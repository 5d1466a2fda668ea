"""The videos of a study: opened before its session, described in its receipt, closed after it."""

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study_app.errors import VideoError
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.source.files import file_hash
from study_app.protocol.trials.stimuli import DELAY, MOST_DELAY_MS
from study_app.video.camera import USUAL, Camera, without_login
from study_app.video.decoding import EXTRA, installed
from study_app.video.footage import Footage

CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class VideosFound:
    """The result of opening a study's videos: a description, and why they cannot be used ("" if they can)."""

    about: str
    fault: str = ""


class Videos:
    """The videos that the conditions of a study show.

    Parameters
    ----------
    folder : Path
        The folder of its file; paths of footage are relative to it.
    camera : str
        The camera of this machine, as in `camera.Camera`; "" for the system's default.
    """

    def __init__(self, protocol: Protocol, folder: Path, camera: str, now_ns: Callable[[], int]) -> None:
        shown = [one for one in protocol.conditions.values() if one.shows_video]
        self.views = tuple(sorted({one.view for one in shown}))
        self._hashes = {one.view: one.footage_sha256 for one in shown if one.footage_sha256}
        self._folder, self._camera, self._now_ns = folder, camera or USUAL, now_ns
        varied = any(stimulus.vary == DELAY for stimulus in protocol.stimuli.values())
        self._holds_s = MOST_DELAY_MS / 1000 if varied else max((one.delay_ms for one in shown), default=0.0) / 1000
        self._open: dict[str, Camera | Footage] = {}
        self._opening = threading.Lock()
        self._changing = threading.Lock()
        self._closed = False

    def open(self) -> VideosFound:
        """Open videos that are not open or failed; return the result."""
        with self._opening:
            for view in self.views:
                before = self._open.get(view)
                if before is not None and before.works:
                    continue
                try:
                    if before is not None:
                        before.close()
                    self._keep(view, self._opened(view))
                except VideoError as error:
                    return VideosFound("every video of the study must open", str(error))
        return VideosFound("; ".join(self._words()))

    def reopen(self) -> None:
        """Open videos that failed in a session.

        Raises
        ------
        VideoError
            It cannot be opened; without the name of the source, which would reveal the condition.
        """
        if self.open().fault:
            raise VideoError("a video of the study cannot be opened: check camera and files")

    def source(self, view: str) -> Camera | Footage:
        """Return the open source of a condition's view."""
        return self._open[view]

    def fit(self, width: int, height: int) -> None:
        """Scale later frames of all videos so that they fit into this many pixels."""
        for one in self._open.values():
            one.fit(width, height)

    def describe(self) -> dict[str, Any]:
        """Return the record for the receipt, which does not reveal the video of a condition."""
        found: dict[str, Any] = {"footage_sha256": sorted(set(self._hashes.values()))} if self._hashes else {}
        if isinstance(camera := self._open.get(CAMERA), Camera):
            age_ns = camera.newest.age_ns
            found["camera"] = {
                "source": without_login(camera.source),
                "size": list(camera.size),
                "rate_hz": round(1e9 / camera.newest.period_ns, 3),
                "age": "unknown" if age_ns is None else "by the source's time stamps",
            }
        return found

    def close(self) -> None:
        """Close all, including those that another thread is still opening."""
        with self._changing:
            self._closed = True
            every = tuple(self._open.values())
        for one in every:
            one.close()

    def _keep(self, view: str, source: Camera | Footage) -> None:
        """Store an open source; close it if all were closed meanwhile."""
        with self._changing:
            closed = self._closed
            if not closed:
                self._open = {**self._open, view: source}
        if closed:
            source.close()
            raise VideoError("the videos were closed meanwhile")

    def _opened(self, view: str) -> Camera | Footage:
        if view == CAMERA:
            return Camera(self._camera, self._now_ns, self._holds_s)
        path = self._folder / view
        if file_hash(path) not in (None, self._hashes.get(view)):
            raise VideoError(f"{path} is not the file that the study began with: restore it")
        return Footage(path)

    def _words(self) -> Iterable[str]:
        for view, one in self._open.items():
            if isinstance(one, Camera) and view == CAMERA:
                age_ns = one.newest.age_ns
                age = "age unknown" if age_ns is None else f"{age_ns / 1e6:.0f} ms old"
                yield f"camera, {one.size[0]} × {one.size[1]}, {1e9 / one.newest.period_ns:.3g} Hz, {age}"
        if count := sum(isinstance(one, Footage) for one in self._open.values()):
            yield f"footage, {counted(count, 'file')}"


def missing_here(protocol: Protocol, folder: Path, camera: str, now_ns: Callable[[], int]) -> str:
    """Return why this machine cannot show the study's videos, "" if it can.

    Raises
    ------
    VideoError
        Why footage cannot be shown on any machine, in one line.
    """
    views = {one.view for one in protocol.conditions.values() if one.shows_video}
    if views and not installed():
        return f"a video {EXTRA}"
    for view in sorted(views - {CAMERA}):
        Footage(folder / view).close()
    try:
        if CAMERA in views:
            Camera(camera or USUAL, now_ns, holds_s=0.0).close()
    except VideoError as error:
        return str(error)
    return ""
