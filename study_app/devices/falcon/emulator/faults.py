"""Faults of an emulated Falcon: by chance, a number of times, or while switched on."""

from random import Random
from typing import Any, Final

import numpy as np

from study_app.errors import DeviceError
from study_app.haptics.kernels.compiled import kernel

CHANCES: Final = ("drop", "truncate", "corrupt", "duplicate", "delay", "stall", "echo", "glued", "echo_prefix")
"""A reply lost, cut to 14 bytes, with a wrong byte, sent twice or late; a device that receives nothing for some time; a
byte of firmware echoed wrongly; more bytes behind the answer to a ping, in the same USB packet; 13 41 as the echo of
'A'."""
DROP, TRUNCATE, CORRUPT, DUPLICATE, DELAY, STALL, ECHO, GLUED, ECHO_PREFIX = range(len(CHANCES))

SWITCHES: Final = (
    "unplugged",  # the bridge is gone
    "access_denied",  # cannot be opened: no permission
    "not_supported",  # cannot be opened: another driver has it
    "busy",  # cannot be claimed: another program has it
    "kernel_driver",  # cannot be claimed until the kernel's driver is detached
    "kernel_driver_stays",  # which it does not permit
    "frozen",  # encoders stand still, homing too
    "never_homes",  # no arm finds its index
    "forgets",  # the origin of the encoders is lost when the homing flag drops
    "leading_zero",  # a 00 before the answer to a ping
    "status_noise",  # modem status bytes of all kinds
)

POWER_OFF: Final = "power-off"
"""On a command line: its mains adapter is disconnected, which the emulator handles."""

FAULTS = np.dtype(
    [
        ("chance", np.float64, (len(CHANCES),)),  # probability at each opportunity
        ("due", np.int64, (len(CHANCES),)),  # number of occurrences before chance decides
        ("happened", np.int64, (len(CHANCES),)),
        ("delay_ns", np.int64),
        ("stall_ns", np.int64),
        ("ignored_pings", np.int64),
        ("state", np.uint64),  # of the generator
        ("was_unplugged", np.int64),  # 1 until the bridge has begun anew
        *((name, np.int64) for name in SWITCHES),
    ],
    align=True,
)


@kernel
def draw(faults: Any) -> float:
    """Return a number in [0, 1): xorshift64*, Vigna 2016."""
    state = faults.state
    state ^= state >> np.uint64(12)
    state ^= state << np.uint64(25)
    state ^= state >> np.uint64(27)
    faults.state = state
    return float((state * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)) * 2.0**-53


@kernel
def strikes(faults: Any, kind: int) -> bool:
    """Return whether this fault happens now."""
    if faults.due[kind] > 0:
        faults.due[kind] -= 1
    elif not (faults.chance[kind] > 0.0 and draw(faults) < faults.chance[kind]):
        return False
    faults.happened[kind] += 1
    return True


class Faults:
    """The faults of one emulated Falcon; may be changed while it runs.

    Attributes
    ----------
    CHANCES, SWITCHES : the names there are
    """

    def __init__(self, state: Any, random: Random) -> None:
        self._state = state
        state.state = 1 + int(random.random() * 2**52)
        state.delay_ns, state.stall_ns = 3_000_000, 20_000_000

    def chance(self, name: str, chance: float) -> None:
        """Let it happen with this probability at each opportunity; 0: never."""
        if not 0.0 <= chance <= 1.0:
            raise DeviceError(f"the chance of fault '{name}' must be 0 to 1, not {chance}")
        self._state.chance[_place(name)] = chance

    def once(self, name: str, times: int = 1) -> None:
        """Let it happen at the next ``times`` opportunities."""
        self._state.due[_place(name)] = times

    def happened(self, name: str) -> int:
        """Return the number of occurrences so far."""
        return int(self._state.happened[_place(name)])

    def on(self, name: str, on: bool = True) -> None:
        """Switch it on, or off."""
        setattr(self._state, _switch(name), int(on))
        if name == "unplugged" and on:
            self._state.was_unplugged = 1
        if name == "kernel_driver_stays" and on:
            self._state.kernel_driver = 1  # which has to be there, to stay

    def off(self, name: str) -> None:
        """Switch it off."""
        self.on(name, False)

    def is_on(self, name: str) -> bool:
        """Return whether it is switched on."""
        return bool(self._state[_switch(name)])

    def last(self, *, delay_s: float | None = None, stall_s: float | None = None) -> None:
        """Set the delay of a late reply and the duration of a stall [s]; a stall of 0 s is one packet."""
        if delay_s is not None:
            self._state.delay_ns = round(delay_s * 1e9)
        if stall_s is not None:
            self._state.stall_ns = round(stall_s * 1e9)

    def ignore_pings(self, count: int) -> None:
        """Leave the next ``pings`` of the boot loader without an answer."""
        self._state.ignored_pings = count

    def take(self, word: str) -> None:
        """Take a fault as a command line gives it: ``drop=0.01`` or ``frozen``."""
        name, equals, value = word.partition("=")
        name = name.strip().replace("-", "_")
        if name in SWITCHES and not equals:
            self.on(name)
            return
        try:
            chance = float(value)
        except ValueError:
            known = ", ".join((*(f"{spelt(known)}=CHANCE" for known in CHANCES), *map(spelt, SWITCHES), POWER_OFF))
            raise DeviceError(f"fault '{word}' is not known; choose of: {known}") from None
        self.chance(name, chance)


def spelt(name: str) -> str:
    """Return a fault's name as a command line gives it and messages say it."""
    return name.replace("_", "-")


def _place(name: str) -> int:
    if name not in CHANCES:
        raise DeviceError(f"fault '{name}' does not come by chance; choose one of: {', '.join(map(spelt, CHANCES))}")
    return CHANCES.index(name)


def _switch(name: str) -> str:
    if name not in SWITCHES:
        raise DeviceError(f"fault '{name}' cannot be switched on; choose one of: {', '.join(map(spelt, SWITCHES))}")
    return name
