"""What the operator is to see of a session under way: telemetry in; views, traces and figures out."""

from study_app.app.session.parts import Parts
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.window import OperatorWindow
from study_app.viewmodels.force_traces import Forces
from study_app.viewmodels.operator import OperatorView, operator_view
from study_app.viewmodels.servo_health import ServoHealth


class OperatorMonitor:
    """Looks at servo and hand once a frame; ``forces`` is None, and no force is looked at, in a double-blind study.

    Parameters
    ----------
    refresh_hz
        Frames a second of the participant's screen.
    """

    def __init__(self, parts: Parts, refresh_hz: float) -> None:
        self._parts = parts
        self._reader = parts.servo.telemetry.reader()
        self._faulty = False
        self._faults = 0
        self.health = ServoHealth(parts.servo.rate_hz, refresh_hz)
        study = parts.session.protocol
        self.forces = Forces(study.device.force_limit_n) if study.study.blinding == "single" else None

    def look(self) -> None:
        """Take what the servo did since the last look, and where the hand is."""
        self._count_faults()
        samples = self._reader.read()
        self.health.take(samples)
        if self.forces is not None:
            self.forces.take(samples)
        self.health.hand(self._parts.clock(), self._parts.aim_m())

    def show_traces(self, operator: OperatorWindow) -> None:
        """Draw the hand's place, at once."""

        def draw() -> None:
            operator.show_traces(self.health, self._parts.clock())
            operator.position.plot.paint_now()

        operator.panels.draw(operator.position, draw)

    def show_forces(self, operator: OperatorWindow) -> None:
        """Draw the force and the wake where they are seen, at once."""
        forces, card = self.forces, operator.force
        if forces is None or not isinstance(card, ForceCard):
            return

        def draw() -> None:
            operator.show_forces(forces, self._parts.servo.now_ns())
            for plot in (card.plot, card.wake):
                plot.paint_now()

        operator.panels.draw(card, draw)

    def show_lateness(self, operator: OperatorWindow) -> None:
        """Draw how late ticks were, at once."""
        self.health.overruns = self._parts.servo.overruns

        def draw() -> None:
            operator.show_lateness(self.health)
            operator.lateness.plot.paint_now()

        operator.panels.draw(operator.lateness, draw)

    def view(self, trouble: str, stalled: str | None) -> OperatorView:
        """Return what the operator is to see now; ``stalled`` is why the disk takes nothing, None while it does."""
        parts = self._parts
        self._count_faults()
        return operator_view(
            parts.session,
            parts.journal.progress,
            self.health.vitals(),
            now_s=parts.clock(),
            force_on=parts.servo.force_is_on,
            trouble=trouble or parts.servo.fault or stalled or "",
            waits=stalled is not None and not trouble,
            device_ready=not self._faulty,
            faults=self._faults,
            rate_hz=parts.servo.rate_hz,
            forces=None if self.forces is None else self.forces.figures(),
            lost={one.trial: one.reason for one in parts.recorder.lost} if parts.recorder is not None else {},
            dropped=parts.recorder.dropped if parts.recorder is not None else 0,
            outlets_lost=None if parts.outlets is None else parts.outlets.lost,
        )

    def _count_faults(self) -> None:
        """Count the servo going from well to faulty."""
        faulty = self._parts.servo.fault is not None
        self._faults += faulty and not self._faulty
        self._faulty = faulty
