"""The liquid lab: where its place, a device's servo, the edits and their cost meet.

Nothing of it acts on the hand once the place is left: leaving it, closing the window, an exception in a slot or in
painting, all end in zero force first, then the servo, then the device.
"""

from __future__ import annotations

import logging
import math
import random
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import QObject, Qt, QTimer

from study_app.app.failures import Patience, UncaughtExceptions, guarded
from study_app.app.lab.jobs import LabOpening, LabSaving, Prices
from study_app.app.lab.lab_estimation import LabEstimation
from study_app.app.lab.view_values import lab_view
from study_app.devices import DEFAULT_DEVICE
from study_app.errors import StudyError
from study_app.evidence.appraisal import AppraisalClient, start_appraisal_worker
from study_app.gui.home.startup_window import LONG_AFTER_S
from study_app.gui.lab.lab_state import LabView
from study_app.gui.lab.view import LabPlace
from study_app.lab.ab_comparison import Setting, Side, Workbench
from study_app.lab.presets import Choice, liquids_at_hand, spoken

if TYPE_CHECKING:
    from study_app.lab.live import Live

INITIAL_A: Final = Choice("rek2024", "water", "Water")
INITIAL_B: Final = Choice("rek2024", "light_oil", "Light oil")
FRAME_MS: Final = 33
APPRAISE_AFTER_MS: Final = 300
COMPILING: Final = "Compiling the force model, once after an installation or an update; this takes about a minute"
log = logging.getLogger(__name__)


class LabController(QObject):
    """The lab's stay at its place.

    Parameters
    ----------
    place : the widgets; this ends with them
    device, options : the device it begins with, and the values of devices' options, by name
    open_live, make_appraiser : what opens a device by its name, what begins the process that appraises
    chance : what a blinding is drawn from
    bench, liquids : what it begins with, and the liquids that can be chosen
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
        self.bench = Workbench(INITIAL_A.setting(), INITIAL_B.setting()) if bench is None else bench
        self.trouble = self.study = ""
        self._refused: tuple[str, str] | None = None
        self._entered = False
        self._prices = Prices(make_appraiser)
        self._opening = LabOpening(open_live, options)
        self._saving = LabSaving(liquids_at_hand() if liquids is None else liquids)
        self.estimation = LabEstimation(place, self)
        self.chance = chance if chance is not None else random.SystemRandom()
        self._said = ""
        self.uncaught = UncaughtExceptions(self._handle_uncaught)
        self.frames = self._timer(FRAME_MS, self._frame)
        self._due = self._timer(0, self._frame, once=True)
        self._cost_due = self._timer(APPRAISE_AFTER_MS, self._ask_price, once=True)
        self._connect()

    def _timer(self, interval_ms: int, slot: Callable[[], None], *, once: bool = False) -> QTimer:
        timer = QTimer(self)
        timer.setInterval(interval_ms)
        timer.setSingleShot(once)
        timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(slot)
        return timer

    def _connect(self) -> None:
        place, opening, saving = self.place, self._opening, self._saving
        for signal, slot in (
            (place.entered, self._enter),
            (place.left, self.leave),
            (place.changed, self._change),
            (place.liquid_chosen, self._choose),
            (place.copied, self._copy),
            (place.switched, self._switch),
            (place.blind_asked, self._blind),
            (place.undo_asked, self._undo),
            (place.redo_asked, self._redo),
            (place.device_chosen, self._open),
            (place.cancel_asked, self._cancel),
            (place.path_chosen, self._play),
            (place.stop_asked, self._stop_force),
            (place.fade_in_asked, self._fade_in),
            (place.hand_moved, self._point),
            (place.hand_pressed, self._press),
            (place.save_asked, self._save),
            (place.preset_opened, self._open_preset),
            (place.use_asked, self._use),
            (opening.opened, self._begin),
            (opening.failed, self._could_not_open),
            (opening.said, self._say),
            (saving.failed, self._could_not_save),
        ):
            signal.connect(slot)

    @property
    def liquids(self) -> tuple[Choice, ...]:
        return self._saving.liquids

    def leave(self) -> None:
        """Let go of the hand: zero force, the servo's end, the device; then of everything else."""
        if not self._entered:
            return
        self._entered = False
        for timer in (self.frames, self._due, self._cost_due):
            timer.stop()
        self._opening.cancel()
        try:
            self._let_go()
        except StudyError as error:
            log.warning("the servo did not stop properly: %s", error)
            self.place.message.emit("The device was not released properly", f"{error}.")
        finally:
            self.estimation.close()
            self._prices.close()
            self.uncaught.remove()

    def end(self, patience: Patience) -> None:
        """Leave, and wait for a preset that is being written, and for a device, so that it is let go of, too."""
        self.leave()
        self._saving.wait(patience.left_s)
        self._opening.wait(patience.left_s)

    def fail(self, error: BaseException) -> None:
        """Zero force, then say what failed; the force can be faded in again, through a device opened anew.

        A painter is at work for as long as something holds it, as a traceback does: Qt would paint nothing any more.
        """
        self._opening.cancel()
        try:
            self._let_go()
        except StudyError as second:
            log.warning("the servo did not stop properly: %s", second)
        self.estimation.close()
        traceback.clear_frames(error.__traceback__)
        known = isinstance(error, StudyError)
        said = f"{error}" if known else f"{type(error).__name__}: {error}; the force is off"
        before, self.trouble = self.trouble, said
        if not known and self.trouble != before:  # once, though it may come with every frame
            log.error("the lab failed: %s", error, exc_info=error)

    def view(self) -> LabView:
        return lab_view(
            self.bench,
            self.live,
            self._prices,
            liquids=self.liquids,
            device=self.device,
            opening=self._opening.busy_with,
            progress=self._said or (COMPILING if self._opening.lasts_s > LONG_AFTER_S else ""),
            cost_due=self._cost_due.isActive(),
            trouble=self.trouble,
            refused=self._refused,
            said=self._saving.said,
            study=self.study,
            estimate=self.estimation.shown(),
        )

    def feel_of_study(self, a: Setting, b: Setting, study: str) -> None:
        """Feel liquids of a study that is edited, which takes changes back; "" where it cannot."""
        self.study = study
        self.feel(Workbench(a, b), anew=True)

    @guarded
    def _enter(self) -> None:
        if self._entered:
            return
        self._entered = True
        self.uncaught.install()
        self.frames.start()
        self._open(self.device)

    @guarded
    def _frame(self) -> None:
        if self.live is not None:
            self.live.poll()
        self.estimation.poll()
        self._prices.take()
        self._show()

    def _show(self) -> None:
        self.place.show_view(self.view())

    @guarded
    def _open(self, name: str) -> None:
        self._let_go()
        self.device, self.trouble, self._said = name, "", ""
        self._opening.want(name)

    @guarded
    def _begin(self, live: Live) -> None:
        if not self._entered:
            live.close()
            return
        self.live = live
        live.feel(self.bench)
        self._cost_due.start()

    @guarded
    def _could_not_open(self, error: Exception) -> None:
        raise error

    @guarded
    def _cancel(self) -> None:
        self._opening.cancel()
        self.trouble = "No device is open"

    @guarded
    def _say(self, line: str) -> None:
        self._said = line

    @guarded
    def _change(self, name: str, value: object, held: bool) -> None:
        self._try(lambda: self.bench.change(name, value, held=held), name)  # type: ignore[arg-type]

    @guarded
    def _choose(self, side: Side, choice: Choice) -> None:
        self._try(lambda: self.bench.choose(side, spoken(choice.liquid), choice.scene), "")

    @guarded
    def _copy(self) -> None:
        self._try(self.bench.copy_to_other, "")

    def _try(self, edit: Callable[[], Workbench], name: str) -> None:
        """Make an edit, or keep why it was refused, for its parameter."""
        try:
            bench = edit()
        except StudyError as error:
            if name:
                self._refused = (name, str(error))
            else:
                self.trouble = str(error)
            return
        self.feel(bench)

    @guarded
    def _switch(self) -> None:
        """Feel the other setting; a knob that is held is let go of at once, for it was the other one's."""
        self.feel(self.bench.switch())
        self._show()

    @guarded
    def _blind(self, asked: bool) -> None:
        if asked:
            self.feel(self.bench.blinded(self.chance), anew=True)
        else:
            self.feel(self.bench.revealed())

    @guarded
    def _undo(self) -> None:
        self.feel(self.bench.undo())

    @guarded
    def _redo(self) -> None:
        self.feel(self.bench.redo())

    def feel(self, bench: Workbench, *, anew: bool = False) -> None:
        """Let a workbench be felt at once, and be appraised once it has rested for a while."""
        before, self.bench, self._refused = self.bench, bench, None
        self._forget_trouble()
        if bench.in_hand.scene != before.in_hand.scene:
            self._prices.forget()
            self._cost_due.start()
        if self.live is not None:
            self.live.feel(bench, anew=anew)
            waits_s = self.live.due_in_s
            if waits_s is not None and not self._due.isActive():
                self._due.start(math.ceil(1e3 * waits_s))

    @guarded
    def _ask_price(self) -> None:
        self._prices.ask(self.bench.in_hand.scene)

    @guarded
    def _play(self, name: str | None) -> None:
        if self.live is not None:
            self.live.play(name)

    @guarded
    def _stop_force(self) -> None:
        """Send zero force; a device that is being opened, which would bring its own, is given up."""
        if self.live is not None:
            self.live.stop_force()
        elif self._opening.busy_with is not None:
            self._cancel()

    @guarded
    def _fade_in(self) -> None:
        """Let the force return; where the servo stopped itself, by opening its device again."""
        if self.live is None or self.live.servo.fault is not None:
            self._open(self.device)
        else:
            self.live.fade_in()

    @guarded
    def _point(self, x_m: float, y_m: float, z_m: float) -> None:
        if self.live is not None:
            self.live.point_to(x_m, y_m, z_m)

    @guarded
    def _press(self, buttons: int) -> None:
        if self.live is not None:
            self.live.press(buttons)

    @guarded
    def _save(self, path: Path, setting: Setting) -> None:
        if self.bench.blind:
            self.trouble = "no preset can be saved during a blind comparison: end it first"
            return
        self._forget_trouble()
        self._saving.save(path, setting)

    @guarded
    def _use(self, study: Path, setting: Setting) -> None:
        self._forget_trouble()
        self._saving.use(study, setting)

    @guarded
    def _open_preset(self, path: Path) -> None:
        """Feel the first liquid of a file; its others are at hand from then on."""
        try:
            first = self._saving.open(path)
        except StudyError as error:
            self.trouble = str(error)
            return
        self._choose(self.bench.presented, first)

    @guarded
    def _could_not_save(self, error: Exception) -> None:
        """Show why a preset could not be written; the force continues. Any other exception is a bug and is raised."""
        if not isinstance(error, StudyError):
            raise error
        self.trouble = str(error)

    def _forget_trouble(self) -> None:
        """Let what went wrong before be over, unless it says why no device is open."""
        if self.live is not None:
            self.trouble = ""

    def _let_go(self) -> None:
        live, self.live = self.live, None
        if live is not None:
            live.close()

    def _handle_uncaught(self, error: BaseException) -> bool:
        self.fail(error)
        return False
