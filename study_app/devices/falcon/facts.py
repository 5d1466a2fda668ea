"""What was observed of a Falcon, and what is said of one way in which it fails.

`Facts` are what a transport, the boot, homing or a test run saw; errors carry theirs. `failure_modes` lists the modes.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

OPEN: Final = "open"
ALL_HOMED: Final = 0b111

OTHER: Final = ""
"""Key of the cure on every platform that has none of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """What was observed; None is "not checked".

    Attributes
    ----------
    platform : as ``sys.platform`` says it
    usb : the kind of ``failures.UsbFailure``, or ``OPEN``: the bridge could be opened and claimed
    listed : the list of USB devices shows it
    ftdi_sees : FTDI's driver (D2XX) shows it
    program : "running", "loaded", "needed" (no file was given), "refused" (the file is none)
    boot_step : where loading it ended: "ping", "autobaud", "echo", "start"
    replies : it answers packets
    homed : bits of the arms that are
    moved : its encoders changed while the grip was to be moved
    pulled_out : the grip was pulled out after homing
    round_trip_s : median time from a packet to its reply [s]
    broken_share : share of packets without a whole reply
    rate_hz : ticks of the servo a second
    step_n : largest step of the force between two ticks [N]
    """

    platform: str = field(default_factory=lambda: sys.platform)
    usb: str | None = None
    listed: bool | None = None
    ftdi_sees: bool | None = None
    program: str | None = None
    boot_step: str | None = None
    replies: bool | None = None
    homed: int | None = None
    moved: bool | None = None
    pulled_out: bool | None = None
    round_trip_s: float | None = None
    broken_share: float | None = None
    rate_hz: float | None = None
    step_n: float | None = None


Shows = Callable[[Facts], bool | None]
"""True: the facts show this mode; False: they rule it out; None: they do not tell."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One way to fail.

    ``tested`` is what holds where it is not there, ``symptom`` what a user sees where it is, ``cause`` a clause that
    fits after "because", ``cures`` what to do by platform ("" for all others), ``detected`` by what it is known,
    ``paste`` what a terminal on Linux takes.
    """

    id: str
    tested: str
    symptom: str
    cause: str
    cures: Mapping[str, str]
    detected: str
    shown_by: Shows
    paste: str = ""

    def cure(self, platform: str) -> str:
        """Return what to do on this system."""
        return self.cures.get(platform, self.cures.get(OTHER, ""))
