"""The controller of the liquid lab, which connects its page, a device with its servo, the edits and their cost.

The device exerts force only while the page is shown. Leaving it, closing the window and an exception in a slot or in
painting all send zero force first, then stop the servo and close the device.
"""

from __future__ import annotations

import gc
import logging
import math
import random
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from PySide6.QtCore import QCoreApplication, QObject, Qt, QTimer, Signal

from study_app.app.failures import Patience, UncaughtExceptions, guarded
from study_app.devices import DEFAULT_DEVICE
from study_app.devices.registry import descriptor_of, title_of
from study_app.errors import StudyError
from study_app.evidence.appraisal import AppraisalClient, Costs, Errors, Question, start_appraisal_worker
from study_app.gui.kit import device_choices
from study_app.gui.lab import CostRow, DeviceShown, ErrorRow, LabPlace, LabView, Now
from study_app.gui.startup_window import LONG_AFTER_S
from study_app.gui.widgets import Background, delayed_call
from study_app.haptics.model.effects import NAMED
from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting, Side, Workbench
from study_app.lab.presets import Choice, available_liquids, displayed_name, liquids_of, preset_text, save_preset
from study_app.lab.programmed_paths import TITLES

if TYPE_CHECKING:
    from study_app.lab.live import Live

_SMALLEST_N = 0.001


def _cost_rows(costs: Costs) -> tuple[CostRow, ...]:
    """Return the costs of a tick's parts, the most expensive first, then the absent parts with the reasons."""
    rows = [CostRow(NAMED[cost.effect].label, cost.ns) for cost in costs.effects if cost.ns is not None]
    rows.append(CostRow("Servo alone", costs.rest_ns))
    absent = (CostRow(NAMED[cost.effect].label, None, cost.why) for cost in costs.effects if cost.ns is None)
    return (*sorted(rows, key=lambda row: -(row.ns or 0.0)), *absent)


def _error_rows(errors: Errors) -> tuple[ErrorRow, ...]:
    """Return the differences between a setting's force and its definition."""
    without = ", ".join(NAMED[effect].label.lower() for effect in errors.left_out)
    share = f"{errors.wake:.0e}".replace("e-0", "e−").replace("e-", "e−") if errors.wake else "0"
    wake, force = "no wake" if errors.wake is None else share, "no drag"
    if errors.force_n is not None:
        force = f"< {_SMALLEST_N:g} N" if errors.force_n < _SMALLEST_N else f"{errors.force_n:.3f} N"
    note = f"for drag and wake only; no reference exists for {without}" if without else "along programmed paths"
    return (
        ErrorRow(measure="Largest relative wake error", value=wake, note=note),
        ErrorRow(measure="Largest force error", value=force, note=note),
        ErrorRow(measure="Velocity filter lag", value=f"{1e3 * errors.lag_s:z.1f} ms", note="at constant acceleration"),
    )


log = logging.getLogger(__name__)


class _Measurements:
    """The cost and error of the felt setting, measured by a separate process."""

    def __init__(self, make_appraiser: Callable[[], AppraisalClient]) -> None:
        self._make = make_appraiser
        self._appraiser: AppraisalClient | None = None
        self._order_number = 0
        self.costs: Costs | None = None
        self.errors: Errors | None = None
        self.waits = False

    def discard_answers(self) -> None:
        """Discard the answers, because the setting has changed."""
        self._order_number, self.costs, self.errors, self.waits = -1, None, None, False

    def request(self, scene: Scene) -> None:
        """Request the cost and error of a setting, which `read_answers` receives."""
        self.discard_answers()
        if self._appraiser is not None and not self._appraiser.works:
            self.close()
        if self._appraiser is None:
            try:
                self._appraiser = self._make()
            except OSError as error:  # the lab works without costs if the process cannot be started
                log.info("the appraisal failed: %s", error)
                return
        self._order_number, self.waits = self._appraiser.order(Question(scene)), True

    def read_answers(self) -> None:
        for number, answer in () if self._appraiser is None else self._appraiser.answers():
            if number != self._order_number:
                continue
            if isinstance(answer, Costs):
                self.costs = answer
            elif isinstance(answer, Errors):
                self.errors, self.waits = answer, False
            else:
                self.waits = False

    def close(self) -> None:
        appraiser, self._appraiser, self.waits = self._appraiser, None, False
        if appraiser is not None:
            appraiser.close()


PATIENCE_S = 20.0
STARTS_AFTER_MS = 150  # opening a device holds the interpreter lock for long, so the lab is painted first


class LabOpening(QObject):
    """Opens the requested device in the background, and closes it if it is no longer requested.

    ``opened`` carries a `Live` whose servo runs at rest, ``failed`` an exception, and ``said`` an instruction of the
    device while it is being opened.

    Parameters
    ----------
    open_live : opens a device by its name, like ``lab.live.open_live``
    options : values of devices' options, by name
    """

    opened = Signal(object)
    failed = Signal(object)
    said = Signal(str)

    def __init__(self, open_live: Callable[..., Live] | None = None, options: Mapping[str, Path] | None = None) -> None:
        super().__init__()
        self._open_live = open_live
        self._options = options
        self._requested: str | None = None
        self._cancelled = threading.Event()
        self._began_s = 0.0
        self._start = delayed_call(self, STARTS_AFTER_MS, self._start_opening)
        self._background = Background(self)
        self._background.done.connect(self._deliver_outcome)

    @property
    def busy_with(self) -> str | None:
        """The name of the device that is being opened, or None."""
        return self._requested

    @property
    def elapsed_s(self) -> float:
        """The time since the device began to open [s]; 0 if none is being opened."""
        return time.perf_counter() - self._began_s if self._background.busy and self._requested is not None else 0.0

    def request_device(self, name: str) -> None:
        """Open a device; cancel one that is still being opened."""
        self.cancel()
        self._requested = name
        if not self._background.busy:
            self._start.start()

    def cancel(self) -> None:
        """Cancel the request; a device that is being opened is closed once it is open."""
        self._requested = None
        self._start.stop()
        self._cancelled.set()

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        """Wait until the device is open or has failed, because it must be closed in the GUI thread."""
        self._background.wait(patience_s)
        QCoreApplication.sendPostedEvents()

    def _start_opening(self) -> None:
        assert self._requested is not None  # noqa: S101 - called only with a request
        self._cancelled, self._began_s = threading.Event(), time.perf_counter()
        self._background.run(partial(self._open_device, self._requested, self._cancelled))

    def _open_device(self, name: str, cancelled: threading.Event) -> tuple[object, threading.Event]:
        """Compile, open and start the device; return the outcome for `_deliver_outcome`. Called in a thread."""
        try:
            is_first = self._open_live is None
            if self._open_live is None:
                from study_app.lab.live import open_live  # noqa: PLC0415 - imports the compiler, so only on demand

                self._open_live = partial(open_live, options=self._options)
            outcome: object = self._open_live(name, progress=self.said.emit, cancelled=cancelled.is_set)
            if is_first:
                gc.freeze()  # so that collections in the GUI thread skip the loaded objects
        except Exception as error:  # noqa: BLE001 - passed on: a thread has no caller to raise it to
            outcome = error
        return outcome, cancelled

    def _deliver_outcome(self, done: tuple[object, threading.Event]) -> None:
        """Emit the opened device, or close it if it is no longer requested."""
        outcome, cancelled = done
        if not cancelled.is_set():
            self._requested = None
            (self.failed if isinstance(outcome, Exception) else self.opened).emit(outcome)
            return
        if not isinstance(outcome, Exception):
            try:
                outcome.close()  # type: ignore[attr-defined]
            except Exception as error:  # noqa: BLE001 - reported, since the device may exert force
                self.failed.emit(error)
        if self._requested is not None:
            self._start_opening()


class _LabSaving(QObject):
    """The available liquids; writes presets one at a time, and updates the liquids afterwards.

    ``said`` names what was saved or opened last; ``failed`` carries an exception.
    """

    failed = Signal(object)
    _done = Signal(object)

    def __init__(self, liquids: tuple[Choice, ...]) -> None:
        super().__init__()
        self.liquids = liquids
        self.said = ""
        self._last_thread: threading.Thread | None = None
        self._done.connect(self._report_outcome, Qt.ConnectionType.QueuedConnection)

    def save_preset(self, path: Path, setting: Setting) -> None:
        sources = (*(choice.source for choice in self.liquids), str(path))
        # Not a pool, since Python waits for its threads at exit, and a drive may never respond.
        self._last_thread = threading.Thread(
            target=self._write_preset, args=(self._last_thread, path, setting, sources), name="preset", daemon=True
        )
        self._last_thread.start()

    def open_liquids(self, path: Path) -> Choice:
        """Add the liquids of a file to the available ones; return the first.

        Raises
        ------
        ProtocolError
            The file has problems, all of which are listed.
        """
        choices = liquids_of(str(path))
        self.liquids = (*(choice for choice in self.liquids if choice not in choices), *choices)
        self.said = f"Opened {path.name}: {', '.join(displayed_name(choice.liquid) for choice in choices)}"
        return choices[0]

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        """Wait until all presets are written and their outcomes reported."""
        if self._last_thread is not None:
            self._last_thread.join(patience_s)
            QCoreApplication.sendPostedEvents(self)

    def _write_preset(
        self, previous: threading.Thread | None, path: Path, setting: Setting, sources: tuple[str, ...]
    ) -> None:
        if previous is not None:
            previous.join()
        try:
            save_preset(path, preset_text(setting))
            outcome: object = f"Saved as {path.name} in {path.parent}", available_liquids(saved=sources)
        except Exception as error:  # noqa: BLE001 - passed on: a thread has no caller to raise it to
            outcome = error
        self._done.emit(outcome)

    def _report_outcome(self, outcome: Exception | tuple[str, tuple[Choice, ...]]) -> None:
        if isinstance(outcome, Exception):
            self.failed.emit(outcome)
            return
        self.said, liquids = outcome
        self.liquids = tuple(dict.fromkeys((*self.liquids, *liquids)))


_INITIAL_A: Final = Choice(source="rek2024", liquid="water", title="Water")
_INITIAL_B: Final = Choice(source="rek2024", liquid="light_oil", title="Light oil")
_FRAME_MS: Final = 33
_APPRAISE_AFTER_MS: Final = 300
_COMPILING: Final = "Compiling the force model (about a minute; only needed after an installation or update)"


class LabController(QObject):
    """Controls the lab while its page is shown.

    Parameters
    ----------
    place : the page, which is the controller's parent
    device, options : the initial device, and the values of devices' options, by name
    open_live, make_appraiser : functions that open a device by its name, and start the process that measures costs
    chance : random generator for blind comparisons
    bench, liquids : the initial workbench, and the liquids that can be chosen
    """

    def __init__(
        self,
        place: LabPlace,
        *,
        device: str = DEFAULT_DEVICE,
        options: Mapping[str, Path] | None = None,
        open_live: Callable[..., Live] | None = None,
        make_appraiser: Callable[[], AppraisalClient] = start_appraisal_worker,
        chance: random.Random | None = None,
        bench: Workbench | None = None,
        liquids: tuple[Choice, ...] | None = None,
    ) -> None:
        super().__init__(place)
        self.place = place
        self.live: Live | None = None
        self.device = device
        self.bench = Workbench(_INITIAL_A.setting(), _INITIAL_B.setting()) if bench is None else bench
        self.trouble = self.study = ""
        self._refused: tuple[str, str] | None = None
        self._entered = False
        self._measurements = _Measurements(make_appraiser)
        self._opening = LabOpening(open_live, options)
        self._saving = _LabSaving(available_liquids() if liquids is None else liquids)
        self.chance = chance if chance is not None else random.SystemRandom()
        self._said = ""
        self.uncaught = UncaughtExceptions(self._handle_uncaught)
        self.frames = self._make_timer(_FRAME_MS, self._draw_frame)
        self._due = self._make_timer(0, self._draw_frame, once=True)
        self._cost_due = self._make_timer(_APPRAISE_AFTER_MS, self._request_measurements, once=True)
        self._connect()

    def _make_timer(self, interval_ms: int, slot: Callable[[], None], *, once: bool = False) -> QTimer:
        timer = QTimer(self, interval=interval_ms, singleShot=once, timerType=Qt.TimerType.PreciseTimer)
        timer.timeout.connect(slot)
        return timer

    def _connect(self) -> None:
        for signal, slot in (
            (self.place.asked, self._handle_request),
            (self._opening.opened, self._start_feeling),
            (self._opening.failed, self.fail),
            (self._opening.said, partial(setattr, self, "_said")),
            (self._saving.failed, self._show_saving_error),
        ):
            signal.connect(slot)

    @guarded
    def _handle_request(self, request: str, details: tuple[Any, ...]) -> None:
        """Carry out a request of the lab's page."""
        bench, live = self.bench, self.live
        match request, *details:
            case "enter", *_:
                self._enter()
            case "leave", *_:
                self.leave()
            case "change", name, value, held:
                self._try_edit(lambda: bench.change(name, value, held=held), name)
            case "liquid", side, chosen:
                self._choose_liquid(side, chosen)
            case "copy", *_:
                self._try_edit(bench.copy_to_other, "")
            case "switch", *_:  # show the view at once, to release a held knob of the other side
                self.feel_workbench(bench.switch())
                self._show_view()
            case "blind", True:
                self.feel_workbench(bench.blinded(self.chance), anew=True)
            case "blind", *_:
                self.feel_workbench(bench.revealed())
            case "undo" | "redo", *_:
                self.feel_workbench(bench.undo() if request == "undo" else bench.redo())
            case "device", name:
                self._open_device(name)
            case "cancel", *_:
                self._cancel_opening()
            case "stop", *_ if live is not None:
                live.stop_force()
            case "stop", *_ if self._opening.busy_with is not None:  # the device that is being opened would exert force
                self._cancel_opening()
            case "diagnose", *_:  # the main window opens the diagnosis, which needs the device
                self.trouble = self.view().trouble
                self._close_device()
            case "fade in", *_:
                if self.live is None or self.live.servo.fault is not None:
                    self._open_device(self.device)
                else:
                    self.live.fade_in()
            case "path", name if live is not None:
                live.play(name)
            case "point", x_m, y_m, z_m if live is not None:
                live.point_to(x_m, y_m, z_m)
            case "press", buttons if live is not None:
                live.press(buttons)
            case "save", path, setting:
                self._save_preset(path, setting)
            case "preset", path:
                self._open_preset(path)

    @property
    def liquids(self) -> tuple[Choice, ...]:
        return self._saving.liquids

    def leave(self) -> None:
        """Send zero force, stop the servo, close the device, then everything else."""
        if not self._entered:
            return
        self._entered = False
        for timer in (self.frames, self._due, self._cost_due):
            timer.stop()
        self._opening.cancel()
        try:
            self._close_device()
        except StudyError as error:
            log.warning("the servo did not stop properly: %s", error)
            self.place.message.emit("The device was not released properly", f"{error}.")
        finally:
            self._measurements.close()
            self.uncaught.remove()

    def end(self, patience: Patience) -> None:
        """Leave the lab, then wait for presets that are being written and devices that are being opened."""
        self.leave()
        self._saving.wait(patience.left_s)
        self._opening.wait(patience.left_s)

    def fail(self, error: BaseException) -> None:
        """Send zero force and close the device, then show the failure; the device can be opened again.

        The traceback is cleared, since a painter that it keeps alive would block all painting.
        """
        self._opening.cancel()
        try:
            self._close_device()
        except StudyError as second:
            log.warning("the servo did not stop properly: %s", second)
        traceback.clear_frames(error.__traceback__)
        known = isinstance(error, StudyError)
        sentence = f"{error}" if known else f"{type(error).__name__}: {error}; the force is off"
        previous, self.trouble = self.trouble, sentence
        if not known and self.trouble != previous:  # every frame may raise it again
            log.error("the lab failed: %s", error, exc_info=error)

    def view(self) -> LabView:
        bench, live, opening, costs = self.bench, self.live, self._opening.busy_with, self._measurements.costs
        reading = None if live is None else live.reading()
        fault = "" if reading is None else reading.fault
        if fault or (self.trouble and live is None):  # a rejected edit or file does not stop the device
            state = "stopped"
        else:
            state = "opening" if opening is not None else "ready" if live is not None else "closed"
        scene = bench.in_hand.scene
        progress = self._said or (_COMPILING if self._opening.elapsed_s > LONG_AFTER_S else "")
        live_values: dict[str, Any] = {}
        if live is not None and reading is not None:
            half_x, half_y, half_z = live.device.workspace_m
            live_values = {
                "workspace_m": (2 * half_x, 2 * half_y, 2 * half_z),
                "path": live.path,
                "trace": live.trace(),
                "tail_a": live.tail("A"),
                "tail_b": live.tail("B"),
                "now": Now(position_m=reading.position_m, force_n=reading.force_n, wake_mps=reading.wake_mps),
                "limiters": live.limiters(),
            }
        if not bench.blind:  # the ball's size would reveal the side
            live_values["body_radius_m"] = scene.body.diameter_m / 2 / scene.scale
        descriptor = descriptor_of(self.device)
        return LabView(
            workbench=bench,
            liquids=self.liquids,
            device=DeviceShown(
                choices=device_choices(),
                chosen=self.device,
                state=state,
                ready=live is not None and not fault,
                pointer=descriptor.pointer,
                diagnosable=descriptor.doctor is not None,
            ),
            paths=tuple(TITLES.items()),
            cost=() if costs is None else _cost_rows(costs),
            tick_ns=None if costs is None else costs.tick_ns,
            errors=() if self._measurements.errors is None else _error_rows(self._measurements.errors),
            measuring=self._measurements.waits or self._cost_due.isActive(),
            force_on=reading is not None and reading.force_on,
            busy="" if opening is None else progress or f"Opening {title_of(opening)}",
            trouble=self.trouble or fault,
            refused=self._refused,
            said=self._saving.said,
            study=self.study,
            **live_values,
        )

    def feel_study_liquids(self, a: Setting, b: Setting, study: str) -> None:
        """Present liquids of the study in the designer; changes can be put back into ``study``, unless it is ""."""
        self.study = study
        self.feel_workbench(Workbench(a, b), anew=True)

    def _enter(self) -> None:
        if self._entered:
            return
        self._entered = True
        self.uncaught.install()
        self.frames.start()
        self._open_device(self.device)

    @guarded
    def _draw_frame(self) -> None:
        if self.live is not None:
            self.live.poll()
        self._measurements.read_answers()
        self._show_view()

    def _show_view(self) -> None:
        self.place.show_view(self.view())

    def _open_device(self, name: str) -> None:
        self._close_device()
        self.device, self.trouble, self._said = name, "", ""
        self._opening.request_device(name)

    @guarded
    def _start_feeling(self, live: Live) -> None:
        if not self._entered:
            live.close()
            return
        self.live = live
        live.feel(self.bench)
        self._cost_due.start()

    def _cancel_opening(self) -> None:
        self._opening.cancel()
        self.trouble = "No device is open"

    def _choose_liquid(self, side: Side, choice: Choice) -> None:
        self._try_edit(lambda: self.bench.choose(side, displayed_name(choice.liquid), choice.scene), "")

    def _try_edit(self, edit: Callable[[], Workbench], name: str) -> None:
        """Make an edit; if it is rejected, show the reason, next to the parameter ``name`` if there is one."""
        try:
            bench = edit()
        except StudyError as error:
            if name:
                self._refused = (name, str(error))
            else:
                self.trouble = str(error)
            return
        self.feel_workbench(bench)

    def feel_workbench(self, bench: Workbench, *, anew: bool = False) -> None:
        """Present a workbench at once, and measure its cost after a pause without edits."""
        previous, self.bench, self._refused = self.bench, bench, None
        self._clear_trouble()
        if bench.in_hand.scene != previous.in_hand.scene:
            self._measurements.discard_answers()
            self._cost_due.start()
        if self.live is not None:
            self.live.feel(bench, anew=anew)
            waits_s = self.live.due_in_s
            if waits_s is not None and not self._due.isActive():
                self._due.start(math.ceil(1e3 * waits_s))

    @guarded
    def _request_measurements(self) -> None:
        self._measurements.request(self.bench.in_hand.scene)

    def _save_preset(self, path: Path, setting: Setting) -> None:
        if self.bench.blind:
            self.trouble = "presets cannot be saved during a blind comparison: end the comparison first"
            return
        self._clear_trouble()
        self._saving.save_preset(path, setting)

    def _open_preset(self, path: Path) -> None:
        """Present the first liquid of a file, and make its other liquids available."""
        try:
            first = self._saving.open_liquids(path)
        except StudyError as error:
            self.trouble = str(error)
            return
        self._choose_liquid(self.bench.presented, first)

    @guarded
    def _show_saving_error(self, error: Exception) -> None:
        """Show why a preset could not be written; the force continues. Raise exceptions that are bugs."""
        if not isinstance(error, StudyError):
            raise error
        self.trouble = str(error)

    def _clear_trouble(self) -> None:
        """Clear the last problem, unless it is the reason why no device is open."""
        if self.live is not None:
            self.trouble = ""

    def _close_device(self) -> None:
        live, self.live = self.live, None
        if live is not None:
            live.close()

    def _handle_uncaught(self, error: BaseException) -> bool:
        self.fail(error)
        return False
