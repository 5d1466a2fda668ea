"""What the tank is given of a video: frames ready to be painted, and where they come from."""

from dataclasses import dataclass, field
from typing import Any, Protocol

from study_app.errors import VideoError


def stopped(why: str) -> VideoError:
    """Return the error of a source that fails in a trial: it names no source, which would tell the condition."""
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
        When it would be shown without a delay [ns, servo's clock]: when it was ready, or its time in the footage.
    age_ns : int or None
        How old the picture was then, by the source's time stamps; None where these do not say it, 0 for footage.
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
    """Where frames come from; every method returns at once."""

    def rewind(self) -> None:
        """Make ready for a trial."""

    def begin(self, at_ns: int) -> None:
        """Hear that the trial began at this moment [ns, servo's clock]: footage runs from then on."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the frame of a moment [ns, servo's clock]; None where there is none yet.

        Raises
        ------
        VideoError
            The source failed.
        """

    def fit(self, width: int, height: int) -> None:
        """Scale later frames so that they fit into this many pixels."""
