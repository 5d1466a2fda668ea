"""The lab's estimation from measured force: loaded and searched in a thread, applied through the lab's own edits."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from PySide6.QtCore import QObject

from study_app.app.failures import guarded
from study_app.errors import StudyError
from study_app.gui.lab.lab_state import DRAG, LSL, OFF, SOURCES, WAKE, EstimateRow, EstimateShown
from study_app.gui.lab.view import LabPlace
from study_app.lab.ab_comparison import Workbench
from study_app.lab.estimation.sources import available
from study_app.protocol.quantities import QUANTITIES

if TYPE_CHECKING:
    from study_app.lab.estimation.live_estimation import LiveEstimation
    from study_app.lab.live import Live

PREPARING: Final = "Loading the force model …"
NAMES: Final = {DRAG: ("drag_coefficient",), WAKE: ("drag_coefficient", "length", "scaling")}


class Lab(Protocol):
    """What an estimation needs of the lab."""

    bench: Workbench
    live: Live | None

    def feel(self, bench: Workbench) -> None: ...

    def fail(self, error: BaseException) -> None: ...


class LabEstimation(QObject):
    """An estimation for the lab's selected setting: `poll` with each frame, `shown` for its view, `close` to end."""

    def __init__(self, place: LabPlace, lab: Lab) -> None:
        super().__init__()
        self._lab = lab
        self._executor: ThreadPoolExecutor | None = None
        self._loading: Future[LiveEstimation] | None = None
        self._wanted: tuple[str, str, Path | None] = (OFF, DRAG, None)
        self.estimation: LiveEstimation | None = None
        self._trouble = self._refused = ""
        self._sources = (*SOURCES, *(LSL if available() else ()))
        place.estimate_source_chosen.connect(self._choose_source)
        place.estimate_parameters_chosen.connect(self._choose_parameters)
        place.estimate_apply_asked.connect(self._apply)
        place.estimate_follow_asked.connect(self._follow)

    def fail(self, error: BaseException) -> None:
        """End with zero force; the lab ends the estimation, too."""
        self._lab.fail(error)

    def poll(self) -> None:
        """Take what was measured since, and apply what is applied continuously."""
        if self._loading is not None and self._loading.done():
            loading, self._loading = self._loading, None
            self.estimation = loading.result()
            self._begin()
        if self.estimation is None or self._wanted[0] == OFF:
            return
        from study_app.lab.estimation.live_estimation import set_values  # noqa: PLC0415 - loads the compiler

        values = self.estimation.poll(self._lab.live, self._lab.bench)
        if self.estimation.trouble:
            self._trouble = f"{self.estimation.trouble[:1].upper()}{self.estimation.trouble[1:]}"
            self._wanted = (OFF, *self._wanted[1:])
        elif values:
            self._change(lambda bench: set_values(bench, values, held=True))

    def close(self) -> None:
        """Estimate nothing; a search that is under way ends by itself."""
        self._wanted, self._trouble = (OFF, *self._wanted[1:]), ""
        self._loading = None
        if self.estimation is not None:
            self.estimation.close()
        self.estimation = None
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(wait=False, cancel_futures=True)

    def shown(self) -> EstimateShown:
        source, parameters, _ = self._wanted
        shown = EstimateShown(self._sources, source, parameters, message=self._trouble)
        if source == OFF:
            return shown
        if self.estimation is None:
            return replace(shown, message=PREPARING)
        found = self.estimation.estimate
        rows = tuple(
            EstimateRow(_label(name), f"{value:.4g}", _interval(*found.intervals[name]))
            for name, value in found.values.items()
            if name in found.intervals
        )
        if found.identified:
            share = 100 * found.rms_n / found.force_rms_n if found.force_rms_n > 0 else 0.0
            message = f"Residual {found.rms_n:.3f} N, {share:.0f} % of the force; {found.seconds:.0f} s measured."
        else:
            message = f"{found.reason[:1].upper()}{found.reason[1:]}."
        if not self.estimation.applies:
            message += " Compared only: it is not applied."
        elif not found.identified:
            message += " Nothing is changed."
        applies = self.estimation.applies and self._lab.live is not None
        return replace(
            shown,
            rows=rows,
            message=f"{message}{self._refused}",
            sound=found.identified,
            may_apply=applies and found.identified,
            may_follow=applies,
            follows=self.estimation.follows,
        )

    @guarded
    def _choose_source(self, source: str, path: Path | None) -> None:
        self._want(source, self._wanted[1], path)

    @guarded
    def _choose_parameters(self, parameters: str) -> None:
        self._want(self._wanted[0], parameters, self._wanted[2])

    def _want(self, source: str, parameters: str, path: Path | None) -> None:
        """Estimate from a source; load what that needs in the thread first."""
        self._wanted, self._trouble, self._refused = (source, parameters, path), "", ""
        if self.estimation is not None:
            self._begin()
        elif source != OFF and self._loading is None:
            self._executor = ThreadPoolExecutor(1, thread_name_prefix="lab estimation")
            self._loading = self._executor.submit(_load, self._executor)

    def _begin(self) -> None:
        assert self.estimation is not None  # noqa: S101 - begun where it is loaded
        from study_app.lab.estimation.live_estimation import Chosen  # noqa: PLC0415 - loads the compiler

        source, parameters, path = self._wanted
        try:
            self.estimation.choose(Chosen(source, NAMES[parameters], path))  # type: ignore[arg-type]
        except StudyError as error:
            self._trouble = f"{error}"
            self._wanted = (OFF, parameters, None)

    @guarded
    def _apply(self) -> None:
        if self.estimation is not None:
            self._change(self.estimation.applied)

    def _change(self, edit: Callable[[Workbench], Workbench]) -> None:
        """Change the selected setting; where it refuses the values, say so and apply none continuously."""
        assert self.estimation is not None  # noqa: S101 - of which the values are
        try:
            bench = edit(self._lab.bench)
        except StudyError as error:
            self.estimation.follows = False
            self._refused = f" Not applied: {error}."
            return
        self._refused = ""
        self._lab.feel(bench)

    @guarded
    def _follow(self, on: bool) -> None:
        if self.estimation is not None:
            self.estimation.follows = on


def _load(executor: ThreadPoolExecutor) -> LiveEstimation:
    """Load and compile the estimation, in its thread."""
    from study_app.lab.estimation.fits import prepare  # noqa: PLC0415
    from study_app.lab.estimation.live_estimation import LiveEstimation  # noqa: PLC0415 - loads the compiler

    prepare()
    return LiveEstimation(executor)


def _label(name: str) -> str:
    place = "body" if name == "drag_coefficient" else "wake"
    return QUANTITIES[f"{place}.{name}"].label


def _interval(lower: float, upper: float) -> str:
    return f"{lower:.3g} … {upper:.3g}"
