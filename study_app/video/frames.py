"""Video frames ready to be painted by the tank, and their sources."""

from dataclasses import dataclass, field
from typing import Any, Protocol

from study_app.errors import VideoError


def stopped(why: str) -> VideoError:
    """Return the error of a source that fails in a trial, without its name, which would reveal the condition."""
    return VideoError(f"a video of the study stopped ({why}): check camera and files")


@dataclass(frozen=True, slots=True)
class VideoFrame:
    """A decoded frame.

    Attributes
    ----------
    number : int
        Its number in the source, from 0; lost frames have numbers, too.
    width, height, stride : int
        Its size [px], and the bytes of a row.
    pixels : buffer
        Rows of 32-bit pixels: blue, green, red, unused.
    due_ns : int
        Its display time without a delay [ns, servo's clock]: when it was ready, or its time in the footage.
    age_ns : int or None
        Age of the picture then, by the source's time stamps; None if unknown, 0 for footage.
    period_ns : int
        Time from one frame of the source to the next.
    """

    number: int
    width: int
    height: int
    stride: int
    pixels: Any = field(repr=False, compare=False)
    due_ns: int
    age_ns: int | None
    period_ns: int


class VideoSource(Protocol):
    """A source of frames; every method returns at once."""

    def rewind(self) -> None:
        """Prepare for a trial."""

    def begin(self, at_ns: int) -> None:
        """Set the start of the trial [ns, servo's clock], from which footage runs."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the frame of a time [ns, servo's clock]; None if there is none yet.

        Raises
        ------
        VideoError
            The source failed.
        """

    def fit(self, width: int, height: int) -> None:
        """Scale later frames so that they fit into this many pixels."""
