"""Common parts of the two streams of the Lab Streaming Layer; the library is the extra ``lsl``."""

import platform
import time
from collections.abc import Sequence
from typing import Any, Final

import study_app
from study_app.errors import OutletError

MARKERS: Final = "liquid-study markers"
SAMPLES: Final = "liquid-study samples"
DELIVERY_S: Final = 0.2
"""Time for which a stream with receivers stays open after its last sample, to deliver it."""


def library() -> Any:
    """Return the module ``pylsl``.

    Raises
    ------
    OutletError
        It, or the library that it loads, is not installed.
    """
    try:
        import pylsl  # noqa: PLC0415 - an extra
    except (ImportError, RuntimeError) as error:
        raise OutletError("the Lab Streaming Layer needs pylsl: pip install 'liquid-study[lsl]'") from error
    return pylsl


def stream_info(lsl: Any, name: str, kind: str, labels: Sequence[str], rate_hz: float, form: str) -> Any:
    """Return the description of a stream: its name, its channels and the sender; no data of a session.

    ``labels`` are those of the channels, followed by a blank and the unit if there is one.
    """
    source = f"{name} of {platform.node()}"
    info = lsl.StreamInfo(name, kind, len(labels), rate_hz, form, source)
    about = info.desc()
    about.append_child_value("manufacturer", "liquid-study")
    about.append_child_value("version", study_app.__version__)
    channels = about.append_child("channels")
    for label in labels:
        words, _, unit = label.partition(" ")
        channel = channels.append_child("channel")
        channel.append_child_value("label", words)
        if unit:
            channel.append_child_value("unit", unit)
    return info


def close_outlet(outlet: Any) -> None:
    """Wait for delivery of the last samples if a program receives them; the outlet ends with its last reference."""
    if outlet is not None and outlet.have_consumers():
        time.sleep(DELIVERY_S)
