"""A 3Dconnexion SpaceMouse: the deflection of its cap sets the speed of the pointer of a simulated handle.

The participant feels no force and sees what the mouse device shows: a spring connects the handle to the pointer, and
the liquid's force acts on the handle. A thread reads the device and sets the pointer, as a window does for the mouse.
"""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from study_app.devices.simulated import PointedDevice
from study_app.devices.spacemouse.hid import (
    DEAD_DEFLECTION,
    FULL_DEFLECTION,
    FULL_SPEED_MPS,
    LED,
    Buttons,
    Displacement,
    Model,
    choose_interface,
    find_space_mice,
    load_hid,
    open_interface,
    parse_report,
    program_buttons,
    velocity_mps,
)

_REPORT_BYTES = 64
_WAIT_MS = 10
_SILENT_S = 0.5  # a displacement is repeated every 8 or 16 ms, so after this silence the cap was released
_LONGEST_STEP_S = 0.05


class SpaceMouseDevice(PointedDevice):
    """The connected SpaceMouse; it can be unplugged and opened again.

    Parameters
    ----------
    hid : the HID module; None: hidapi's, loaded when the device is opened
    """

    name = "spacemouse"

    def __init__(
        self,
        workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05),
        force_limit_n: float = 8.0,
        *,
        hid: Any = None,
        now_s: Callable[[], float] = time.perf_counter,
    ) -> None:
        super().__init__(workspace_m, force_limit_n)
        self._hid = hid
        self._now_s = now_s
        self._model: Model | None = None
        self._open_hid: Any = None
        self.thread: threading.Thread | None = None
        self._ending = threading.Event()

    def open(self) -> None:
        """Find the SpaceMouse, open it, and start reading.

        Raises
        ------
        DeviceNotFound
            No SpaceMouse is connected.
        DeviceError
            The SpaceMouse cannot be opened or reports no motion.
        """
        if self.thread is not None and self.thread.is_alive():
            return
        self.close()
        hid = self._hid if self._hid is not None else load_hid()
        self._model, path = choose_interface(find_space_mice(hid))
        self._open_hid = open_interface(hid, self._model, path)
        self._set_light(on=True)
        self.point_to(*self.aim_m)
        self.release()
        super().open()
        self._ending.clear()
        self.thread = threading.Thread(target=self._read_loop, name="SpaceMouse", daemon=True)
        self.thread.start()

    def close(self) -> None:
        """Remove the force from the handle and close the device; a second call does nothing."""
        super().close()
        thread, self.thread = self.thread, None
        if thread is not None:
            self._ending.set()
            thread.join()
        if self._open_hid is not None:
            self._set_light(on=False)
            self._open_hid.close()
            self._open_hid = None

    def describe(self) -> dict[str, Any]:
        model_facts = {
            "model": None if self._model is None else self._model.name,
            "full_speed_mps": FULL_SPEED_MPS,
            "dead_share": DEAD_DEFLECTION / FULL_DEFLECTION,
        }
        return super().describe() | model_facts

    def _read_loop(self) -> None:
        """Read until the mouse is closed or lost; the servo detects a loss at its next tick."""
        assert self._model is not None  # noqa: S101 - it is open
        displacement = Displacement(right=0, toward=0, down=0)
        pointer_m = self.aim_m
        now_s = heard_s = self._now_s()
        while not self._ending.is_set():
            try:
                report = parse_report(bytes(self._open_hid.read(_REPORT_BYTES, _WAIT_MS)))
            except (OSError, ValueError):
                self.unplug()
                return
            before_s, now_s = now_s, self._now_s()
            if report is not None:
                heard_s = now_s
            elif now_s - heard_s > _SILENT_S:
                displacement = Displacement(right=0, toward=0, down=0)
            step_s = min(now_s - before_s, _LONGEST_STEP_S)
            velocity = velocity_mps(displacement)
            if any(velocity):
                pointer_m = self._within_workspace(
                    *(at + step_s * speed for at, speed in zip(pointer_m, velocity, strict=True))
                )
                self.point_to(*pointer_m)
            if isinstance(report, Displacement):
                displacement = report
            elif isinstance(report, Buttons):
                self.press(program_buttons(report.held, self._model))

    def _set_light(self, *, on: bool) -> None:
        if self._model is not None and self._model.light:
            with suppress(OSError, ValueError):  # it has no light, or was unplugged
                self._open_hid.write(bytes([LED, int(on)]))
