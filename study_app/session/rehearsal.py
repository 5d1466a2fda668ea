"""Whole sessions with simulated participants, faster than real time, through everything a real one goes through.

The machine, the runner, the servo's compiled loop, the store and the checks of every questionnaire are the same; only
the device, the clock, the screen and the participant are simulated. Time is the servo's virtual clock, so that the same
call into another folder gives the same tables but for wall-clock times. Every row says that it is simulated.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from study_app.devices.scripted import ScriptedDevice
from study_app.errors import SessionError
from study_app.haptics.clock import VirtualClock
from study_app.haptics.pack import elements_needed
from study_app.haptics.servo import Servo
from study_app.protocol.answers import rate, rater
from study_app.protocol.load import load, source_bytes
from study_app.protocol.model import Protocol, Reach
from study_app.protocol.schedule import build_schedule, stream
from study_app.session.events import Begin, Chosen, Continue, ItemShown, Submitted
from study_app.session.pages import Page, QuestionnairePage, TaskPage, TextPage
from study_app.session.runner import Ports, Runner
from study_app.session.simulated import Draw, Explorer, Reacher, Senses, choices, reading_s
from study_app.store.journal import SessionClock
from study_app.store.layout import StudyFolder, check_unused
from study_app.store.session import SessionStore, begin

LOOK_S = 0.05  # the session looks at the device so often
IDLE_S = 0.5  # and while reading and answering
FRAME_S = 1 / 60
PAINT_S = (0.002, 0.006)  # from looking at the clock to the frame being on the screen


def rehearse(
    protocol: str | Path,
    *,
    participants: int,
    seed: int,
    results: Path | None = None,
    progress: Callable[[str], object] | None = None,
) -> Path:
    """Run a session each of P001, P002 … and return the study folder.

    Parameters
    ----------
    protocol : file or name of a protocol
    participants : how many
    seed : all randomness comes from it, the key's too
    results : study folder; by default ``results/<study>``
    progress : is told a line after each session

    Raises
    ------
    ProtocolError
        The protocol cannot be used.
    StoreError
        An id is used already, and then nothing was touched; or results cannot be written.
    SessionError
        A session broke; what was kept before is safe.
    """
    study = load(protocol)
    source = source_bytes(protocol)
    folder = Path("results") / study.study.name if results is None else Path(results)
    people = [f"P{number:03d}" for number in range(1, participants + 1)]
    for person in people:
        check_unused(StudyFolder(folder), person, 1)
    for person in people:
        began = time.perf_counter()
        lasted_s, answers = _session(study, source, person, seed, folder)
        if progress is not None:
            took_s = time.perf_counter() - began
            progress(f"{person}: {answers} responses, {lasted_s / 60:.1f} min of session in {took_s:.1f} s (simulated)")
    return folder


def _session(study: Protocol, source: bytes, person: str, seed: int, folder: Path) -> tuple[float, int]:
    """Run one session; return how long it lasted in its own time [s], and how many responses it left."""
    x, y, z = study.device.workspace_m
    device = ScriptedDevice(
        stream(seed, f"rehearsal/{person}/hand"),
        workspace_m=(x / 2, y / 2, z / 2),
        force_limit_n=study.device.force_limit_n,
    )
    elements = max(elements_needed(study.scene_for(condition)) for condition in study.conditions)
    servo = Servo(device, clock=VirtualClock(), rate_hz=study.device.rate_hz, elements=elements)
    with device, servo:
        clock = SessionClock(servo.now_ns)
        store = begin(
            folder,
            study,
            source,
            person,
            seed=seed,
            operator="",
            language=study.study.languages[0],
            device=device.describe() | _told(servo),
            screens={"participant": "simulated", "refresh_hz": 60},
            simulated=True,
            clock=clock,
        )
        with store:
            rehearsal = _Rehearsal(study, _Parts(device, servo, store, clock), person, seed)
            rehearsal.run()
        return clock.seconds(), rehearsal.answers


def _told(servo: Servo) -> dict[str, object]:
    """Return what the receipt may say of the servo: the size of its wake would name a parameter of a liquid."""
    return {name: value for name, value in servo.describe().items() if name != "elements"}


@dataclass(frozen=True, slots=True)
class _Parts:
    device: ScriptedDevice
    servo: Servo
    store: SessionStore
    clock: SessionClock


class _Rehearsal:
    """One session and its simulated participant."""

    def __init__(self, study: Protocol, parts: _Parts, person: str, seed: int) -> None:
        self.answers = 0
        self._study = study
        self._parts = parts
        self._now_s = parts.clock.seconds
        self._page: Page | None = None
        self._draw: Draw = stream(seed, f"rehearsal/{person}/behaviour").random
        self._paint: Draw = stream(seed, f"rehearsal/{person}/screen").random
        self._answer: Draw = stream(seed, f"rehearsal/{person}/answers").random
        self._person = rater(stream(seed, f"rehearsal/{person}/person").random)
        self._felt = Senses(study.scene.scale).felt()
        self._touch = parts.servo.telemetry.reader()
        self._next_frame_ns = 0
        ports = Ports(parts.servo, parts.store, self._present, self._now_s)
        schedule = build_schedule(study, person, seed)
        self._runner = Runner(study, schedule, parts.store.key.codes, ports, study.study.languages[0])

    def run(self) -> None:
        """Go from the first page to the last."""
        self._runner.post(Begin(self._now_s()))
        while not self._runner.finished:
            match self._page:
                case TextPage() as page:
                    self._pass(reading_s(page))
                    if page is self._page:
                        self._runner.post(Continue(self._now_s()))
                case TaskPage() as page:
                    self._do(page)
                case QuestionnairePage() as page:
                    self._fill_in(page)
                case _:
                    raise SessionError(f"the rehearsal broke: {self._parts.servo.fault or self._page}")

    def _present(self, page: Page) -> None:
        self._page = page

    def _pass(self, seconds: float) -> None:
        """Let time pass while nothing is done."""
        end_s = self._now_s() + seconds
        page = self._page
        while self._now_s() < end_s and page is self._page:
            self._advance(min(IDLE_S, end_s - self._now_s()))
            self._runner.poll()

    def _advance(self, seconds: float) -> None:
        self._parts.servo.advance(max(1, round(seconds * self._parts.servo.rate_hz)))

    def _do(self, page: TaskPage) -> None:
        """Do a task until its page is left, seeing every frame and feeling every tick."""
        device, draw = self._parts.device, self._draw
        senses = Senses(self._study.scene.scale)
        self._touch.read()
        self._next_frame_ns = self._parts.servo.now_ns()
        task = page.task
        hand = Reacher(task, device, draw) if isinstance(task, Reach) else Explorer(task, device, draw, self._now_s())
        while page is self._page:
            self._advance(LOOK_S)
            wants_to_go_on = self._see(senses, hand)
            senses.feel(np.asarray(self._touch.read()))
            self._runner.poll()
            if wants_to_go_on and page is self._page:
                self._runner.post(Continue(self._now_s()))
        device.rest()
        self._felt = senses.felt()

    def _see(self, senses: Senses, hand: Explorer | Reacher) -> bool:
        """Show the frames since the last look, and let the hand act on the newest; return whether it is done."""
        view = None
        while self._next_frame_ns <= self._parts.servo.now_ns():
            view = self._runner.view(self._next_frame_ns)
            if view is not None:
                low, high = PAINT_S
                painted_ns = self._next_frame_ns + round(1e9 * (low + (high - low) * self._paint()))
                self._runner.frame_shown(painted_ns, view.sample_time_ns)
                senses.see(painted_ns, view)
            self._next_frame_ns += round(1e9 * FRAME_S)
        return view is not None and hand.act(self._now_s(), view)

    def _fill_in(self, page: QuestionnairePage) -> None:
        """Answer every statement by what was felt, and confirm."""
        for item in page.items:
            self._runner.post(ItemShown(self._now_s(), item.id))
        answers = rate([item.id for item in page.items], self._felt, self._person, self._answer)
        for choice in choices(answers, self._draw, len(page.labels)):
            self._pass(choice.after_s)
            if page is not self._page:
                return
            self._runner.post(Chosen(self._now_s(), choice.item, choice.value))
        self._pass(1.0)
        self._runner.post(Submitted(self._now_s()))
        self.answers += len(answers)
