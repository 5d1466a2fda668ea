"""A world of fakes that is played in transcripts: what the runner asks of whom, in which order, and what it keeps."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from study_app.errors import ServoFault
from study_app.haptics.model.layout import BUTTON_STOP, LIMITER_GLITCH
from study_app.session.device_buttons import CONTINUE
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown, Note
from study_app.session.transitions.state import Phase
from tests.session.fakes import AWAY, LEFT, RIGHT, World, step
from tests.session.transitions.transcribed import EVENTS
from tests.transcripts import acts, told, value_of

SHOWN = ("trial", "force_off", "held", "chosen", "paragraph")
"""What is printed of a page."""
NAMES: dict[str, Any] = {
    **EVENTS,
    "LEFT": LEFT,
    "RIGHT": RIGHT,
    "AWAY": AWAY,
    "STOP": BUTTON_STOP,
    "CONTINUE": CONTINUE,
    "GLITCH": LIMITER_GLITCH,
}


class Tape:
    """A recorder that is all memory."""

    def __init__(self) -> None:
        self.log: list[Any] = []
        self.ticks: list[int] = []

    def start(self, trial: int, attempt: int, rate_hz: float, _interval: int | None = None) -> None:
        self.log.append(f"record trial {trial}, attempt {attempt} at {rate_hz:g} Hz")
        self.ticks = []

    def append(self, samples: Any) -> None:
        self.ticks += samples["tick"].tolist()

    def frame(self, painted_ns: int, sample_ns: int, _video: Any = None) -> None:
        self.log.append(f"record a frame {(painted_ns - sample_ns) / 1e6:g} ms late")

    def stop(self) -> None:
        whole = not self.ticks or self.ticks == [*range(self.ticks[0], self.ticks[-1] + 1)]
        self.log.append(f"recorded ticks {self.ticks[:1]} to {self.ticks[-1:]}{'' if whole else ' with gaps'}")


class Played(World):
    """A world with a command (public method) for each event in it."""

    def __init__(self, seed: int = 1, *, paints: bool = True) -> None:
        self.ready = True
        tape = Tape()
        super().__init__(seed, tape, settled=lambda: self.ready)
        tape.log = self.log
        self.paints = paints
        self.runner.on_change(lambda _state: self.log.append("told"))
        self.seen = [0, 0, 0]  # entries of the log, lines, lines that waited

    def post(self, event: Any) -> None:
        self.runner.post(event)

    def go_on(self, steps: int = 1) -> None:
        """Advance by some pages or targets."""
        for _ in range(steps):
            step(self)

    def to(self, block: str = "", *, delayed: bool = False, phase: str = "task") -> None:
        """Advance to a phase, optionally of a given block or of a delayed trial."""
        for _ in range(200):
            state = self.state
            there = state.phase is Phase[phase.upper()] and (not block or state.trial.block == block)
            if there and (not delayed or state.plan.protocol.delay_s(state.plan.condition(state.trial)) > 0):
                return
            step(self)
        raise AssertionError(block)

    def choose_all(self, value: int) -> None:
        for item in self.state.trial.items:
            self.post(Chosen(self.clock(), item, value))

    def samples(self, seconds: float, position_m: Any = (0.0, 0.0, 0.0), **fields: Any) -> None:
        """Let the servo go on; nobody looks."""
        self.servo.run(seconds, position_m, **fields)

    def servo_is(self, **changes: Any) -> None:
        for name, value in changes.items():
            setattr(self.servo, name, ServoFault(value) if name == "refuses" else value)

    def lose(self, samples: int) -> None:
        self.servo.telemetry.dropped = samples

    def paint(self, late_ms: float = 0.0, *, view: bool = True) -> None:
        """Report a frame of the current view or of the newest sample, painted after a delay."""
        now_ns = self.servo.now_ns()
        view_now = self.runner.view(now_ns) if view else None
        self.runner.frame_shown(now_ns + round(late_ms * 1e6), view_now.sample_time_ns if view_now else now_ns)

    def view(self) -> str:
        """Yield the current view."""
        now_ns = self.servo.now_ns()
        view = self.runner.view(now_ns)
        if view is None:
            return "nothing is drawn"
        age_ms = (now_ns - view.sample_time_ns) / 1e6
        return f"drawn {tuple(view.position_m.tolist())}, {age_ms:g} ms old, {view.task}"

    def disk_takes_nothing(self) -> None:
        self.journal.fails_after = len(self.journal.lines)

    def disk_takes_data(self) -> None:
        self.journal.fails_after = None

    def journal_is(self, **changes: Any) -> None:
        for name, value in changes.items():
            setattr(self.journal, name, value)

    def settle(self, ready: bool) -> None:
        """Say whether all recordings are on the disk."""
        self.ready = ready

    def pages_answer(self) -> None:
        """Let each page report, while it is presented, that its questions are shown."""

        def answer(page: Any) -> None:
            for item in page.items if isinstance(page, QuestionnairePage) else ():
                self.post(ItemShown(self.clock(), item.id))

        self.on_page = answer

    def pages_mark(self) -> None:
        """Let each page post a note while it is presented."""
        self.on_page = lambda page: self.post(Note(self.clock(), "mark", type(page).__name__))

    def _news(self) -> Iterator[str]:
        """Yield the news: calls in order, journal lines without zeros, and the state."""
        words: list[str] = []
        log, lines, waited = self.seen
        pages = iter(self.pages[len(self.pages) - sum(name.endswith("Page") for name in self.log[log:]) :])
        for name in self.log[log:]:
            if lines < len(self.journal.lines) and self.journal.lines[lines]["event"] == name:
                fields = {key: value for key, value in self.journal.lines[lines].items() if value not in (None, 0)}
                waits = self.journal.waited[waited : waited + 1] == [name]
                waited += waits
                lines += 1
                yield from [", ".join(words)] if words else []
                words = []
                rest = " ".join(f"{key}={_rounded(value)}" for key, value in fields.items() if key != "event")
                yield f"{name} {rest}{', waits' * waits}"
            else:
                words.append(_page(next(pages)) if name.endswith("Page") else name)
        yield from [", ".join(words)] if words else []
        self.seen = [len(self.log), lines, waited]
        yield self._state()

    def _state(self) -> str:
        runner, state, task = self.runner, self.state, self.runner.task
        trial = f", trial {state.trial.number}, attempt {state.attempt}" if state.phase is Phase.TASK else ""
        task_words = f", {task.elapsed_s:g} s, {task.reached} reached, dwell {task.dwell:.4g}" if task else ""
        ended = ", ending" * runner.ending + ", finished" * runner.finished
        stalled = f", stalled: {runner.stalled}" if runner.stalled else ""
        servo = f"force {'on' if self.servo.force_is_on else 'off'}, scene {self.servo.scene}"
        tables = f"{self.journal.tables_written} tables"
        return f"{state.phase.name.lower()}{trial}{task_words}{ended}{stalled}, {servo}, {tables}"


def _page(page: Any) -> str:
    fields = {field.name: getattr(page, field.name) for field in dataclasses.fields(page)}
    return f"{type(page).__name__}({', '.join(f'{name}={fields[name]!r}' for name in SHOWN if fields.get(name))})"


def _rounded(value: Any) -> Any:
    return float(f"{value:.6g}") if isinstance(value, float) else value


def begun(start: str) -> Played:
    """Return a world after the commands of its start."""
    fields, _, commands = start.partition(":")
    world: Played = value_of(f"world({fields})", {"world": Played, "True": True, "False": False})
    for command in filter(None, map(str.strip, commands.split(";"))):
        list(told(world, command, NAMES))
    list(world._news())
    return world


play = acts(begun, NAMES)
