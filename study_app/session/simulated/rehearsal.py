"""Whole sessions with simulated participants, faster than real time, through everything a real one goes through.

The machine, the runner, the servo's compiled loop, the store and the checks of every questionnaire are the same; only
the device, the clock, the screen and the participant are simulated. Time is the servo's virtual clock, so that the same
call into another folder gives the same tables but for wall-clock times. Every row says that it is simulated.

What a participant does and answers in a trial is drawn from streams of that trial. A rehearsal that was killed and
resumed answers as one that was not: from what is felt in the whole session, which is computed again for that.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from study_app.devices.registry import moves_by_itself, open_device
from study_app.devices.simulated.hand_commands import hand_of
from study_app.errors import SessionError, StoreError
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol, Reach
from study_app.protocol.orders.schedule import Schedule, build_schedule, stream
from study_app.protocol.questions.simulated_answers import Felt, rater
from study_app.session.pages import Page, PausePage, QuestionnairePage, TaskPage, TextPage
from study_app.session.ports import KeptSession, Ports
from study_app.session.resume import FIRST, REHEARSED_SCREENS, Start, find_protocol, resume_at, source_to_resume
from study_app.session.runner import Runner
from study_app.session.simulated.observers import Draw, Explorer, Reacher, Senses, filled_in, reading_s
from study_app.session.transitions.events import Begin, Chosen, Continue, Event, ItemShown, ResumeAsked, Submitted
from study_app.session.trial import TankView
from study_app.session.unkept import Unkept
from study_app.store.clock import SessionClock
from study_app.store.folders import StudyFolder, locate, rehearsal_folder
from study_app.store.journals import journal
from study_app.store.progress import progress_of
from study_app.store.sessions.begin import begin
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.participant_ids import check_unused
from study_app.store.sessions.reopen import reopen
from study_app.store.tables.study_description import check_study
from study_app.workspace import workspace

LOOK_S = 0.05  # the session looks at the device so often
IDLE_S = 0.5  # and while reading and answering
FRAME_S = 1 / 60
PAINT_S = (0.002, 0.006)  # from looking at the clock to the frame being on the screen


def rehearse(
    protocol: str | Path,
    *,
    participants: int,
    seed: int,
    device: str = "scripted",
    results: Path | None = None,
    recordings: bool = True,
    progress: Callable[[str], object] | None = None,
) -> Path:
    """Run a session each of P001, P002 … and return the study folder.

    Parameters
    ----------
    protocol : file or name of a protocol
    participants : how many
    seed : all randomness comes from it, the key's too
    device : "scripted" or "falcon-emulated"
    results : study folder; by default a new ``results/<study>-rehearsal-<n>`` of the workspace
    recordings : whether every turn of the servo and every frame of a trial is kept
    progress : is told a line after each session

    Raises
    ------
    ProtocolError
        The protocol cannot be used.
    StoreError
        The folder holds another study or an id is used already, and then nothing was touched; or results cannot be
        written.
    DeviceError
        The device is not known, or cannot be opened.
    SessionError
        The device does not move by itself, or a session broke; what was kept before is safe.
    """
    if not moves_by_itself(device):
        raise SessionError(f"device '{device}' waits for a person: rehearse on scripted or falcon-emulated")
    source = source_bytes(protocol)
    study = parse(source, str(protocol))
    folder = rehearsal_folder(workspace().results, study.study.name) if results is None else Path(results)
    check_study(StudyFolder(folder), study.study.name)
    people = [f"P{number:03d}" for number in range(1, participants + 1)]
    for person in people:
        check_unused(StudyFolder(folder), person, 1)
    for person in people:
        began = time.perf_counter()
        with Machine(study, person, seed, device) as machine:
            store = begin(
                folder,
                study,
                source,
                person,
                seed=seed,
                operator="",
                language=study.study.languages[0],
                device=machine.described,
                screens=REHEARSED_SCREENS,
                simulated=True,
                recordings=recordings,
                clock=SessionClock(machine.servo.now_ns),
            )
            lasted_s, answers = _run(study, build_schedule(study, person, seed), machine, store, FIRST)
            proof = store.fingerprint
        if progress is not None:
            took_s = time.perf_counter() - began
            held = f"{lasted_s / 60:.1f} min of session in {took_s:.1f} s (simulated)"
            progress(f"{person}: {answers} responses, {held}, fingerprint {proof}")
    return folder


def resume(session_folder: Path, *, protocol: str | Path | None = None) -> None:
    """Go on with a rehearsed session whose program was ended, to its last page.

    Parameters
    ----------
    protocol : file or name of its protocol; by default it is looked for

    Raises
    ------
    StoreError
        The session cannot be opened, is finished, or began with another protocol.
    SessionError
        No protocol at hand is the session's, or the session broke; what was kept before is safe.
    """
    lines = journal.read(locate(session_folder)[1].journal)
    begun = progress_of(lines).start
    read = partial(source_to_resume, session_folder)
    name = find_protocol(begun, read=read) if protocol is None else str(protocol)
    source = read(name)
    study = parse(source, name)
    person, seed = begun["participant"], begun["seed"]
    with Machine(study, person, seed, begun["device"]) as machine:
        store = reopen(
            session_folder,
            study,
            source,
            operator="",
            device=machine.described,
            screens=REHEARSED_SCREENS,
            now_ns=machine.servo.now_ns,
            now=max(datetime.now().astimezone(), datetime.fromisoformat(lines[-1]["at"])),
        )
        schedule = build_schedule(study, person, seed)
        _run(study, schedule, machine, store, resume_at(study, schedule, lines))


class Machine:
    """A device with a simulated hand, and its servo on a clock that stands still but for the servo.

    Both end with the block.
    """

    def __init__(self, study: Protocol, person: str, seed: int, device: str) -> None:
        x, y, z = study.device.workspace_m
        self.device = open_device(
            device,
            random=stream(seed, f"rehearsal/{person}/hand"),
            workspace_m=(x / 2, y / 2, z / 2),
            force_limit_n=study.device.force_limit_n,
        )
        hand = hand_of(self.device)
        assert hand is not None  # noqa: S101 - it moves by itself
        self.hand = hand
        elements = max(elements_needed(study.scene_for(condition)) for condition in study.conditions)
        self.servo = Servo(self.device, clock=VirtualClock(), rate_hz=study.device.rate_hz, elements=elements)

    @property
    def described(self) -> dict[str, Any]:
        """What the receipt says of device and servo."""
        return self.device.describe() | self.servo.describe()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.servo.stop()
        self.device.close()


def _run(study: Protocol, schedule: Schedule, machine: Machine, store: SessionStore, start: Start) -> tuple[float, int]:
    """Run an open session to its end; return how long it lasted in its own time [s], and its answers."""
    with store:
        known = {} if start is FIRST else _felt_in_whole_session(study, schedule, machine.device.name, store.key.codes)
        rehearsal = Rehearsal(study, schedule, machine, store, start, known=known)
        rehearsal.run()
    return store.clock.seconds(), rehearsal.answers


def _felt_in_whole_session(
    study: Protocol, schedule: Schedule, device: str, codes: dict[str, dict[str, str]]
) -> dict[int, Felt]:
    """Return what is felt in each trial (by number) of a session that is not interrupted."""
    felt: dict[int, Felt] = {}
    with Machine(study, schedule.participant, schedule.seed, device) as machine:
        Rehearsal(study, schedule, machine, Unkept(machine.servo.now_ns, codes), felt=felt.__setitem__).run()
    return felt


class Rehearsal:
    """One session and its simulated participant.

    Parameters
    ----------
    store : where it is kept
    felt : is told of every trial what was felt in it
    known : what is answered by instead, by trial number
    """

    def __init__(
        self,
        study: Protocol,
        schedule: Schedule,
        machine: Machine,
        store: KeptSession,
        start: Start = FIRST,
        felt: Callable[[int, Felt], object] | None = None,
        known: Mapping[int, Felt] | None = None,
    ) -> None:
        self.answers = 0
        self._known = known or {}
        self._tell_felt = felt
        self._study = study
        self._machine = machine
        self._seed = schedule.seed
        self._who = schedule.participant
        self._now_s = store.clock.seconds
        self._page: Page | None = None
        self._person = rater(self._stream("person"))
        self._felt = Senses(study.scene.scale).felt()
        self._touch = machine.servo.telemetry.reader()
        self._next_frame_ns = 0
        self._paint: Draw = self._stream("screen")
        ports = Ports(machine.servo, store, self._present, self._now_s, store.recorder)
        self._runner = Runner(study, schedule, store.key.codes, ports, study.study.languages[0], start)

    def _stream(self, name: str) -> Draw:
        return stream(self._seed, f"rehearsal/{self._who}/{name}").random

    def _post(self, event: Event) -> None:
        self._runner.post(event)
        self._notice()

    def _poll(self) -> None:
        self._runner.poll()
        self._notice()

    def _notice(self) -> None:
        """End where a person would wait for the disk."""
        if self._runner.stalled is not None:
            raise StoreError(self._runner.stalled)

    def run(self) -> None:
        """Go from the first page to the last."""
        self._post(Begin(self._now_s()))
        if isinstance(self._page, PausePage):  # before the trial that a resumed session goes on with
            self._post(ResumeAsked(self._now_s(), "participant"))
        while not self._runner.finished:
            match self._page:
                case TextPage() as page:
                    self._pass(reading_s(page))
                    if page is self._page:
                        self._post(Continue(self._now_s()))
                case TaskPage() as page:
                    self._do(page)
                case QuestionnairePage() as page:
                    self._fill_in(page)
                case _:
                    raise SessionError(f"the rehearsal broke: {self._machine.servo.fault or self._page}")

    def _present(self, page: Page) -> None:
        self._page = page

    def _pass(self, seconds: float) -> None:
        """Let time pass while nothing is done."""
        end_s = self._now_s() + seconds
        page = self._page
        while self._now_s() < end_s and page is self._page:
            self._advance(min(IDLE_S, end_s - self._now_s()))
            self._poll()

    def _advance(self, seconds: float) -> None:
        """Let the servo take its turns; who ends the program ends them, and without them no time passes."""
        servo = self._machine.servo
        if servo.advance(max(1, round(seconds * servo.rate_hz))) == 0 and servo.fault is None:
            raise SessionError("the rehearsal was ended from outside")

    def _do(self, page: TaskPage) -> None:
        """Do a task until its page is left, seeing every frame and feeling every tick."""
        arm, draw = self._machine.hand, self._stream(f"{page.trial}/behaviour")
        self._paint = self._stream(f"{page.trial}/screen")
        senses = Senses(self._study.scene.scale)
        self._touch.read()
        self._next_frame_ns = self._machine.servo.now_ns()
        task = page.task
        hand = Reacher(task, arm, draw) if isinstance(task, Reach) else Explorer(task, arm, draw, self._now_s())
        self._see(senses)  # the first frame, with which the trial begins, is painted at once
        while page is self._page:
            self._advance(LOOK_S)
            view = self._see(senses)
            wants_to_go_on = view is not None and hand.act(self._now_s(), view)
            senses.feel(np.asarray(self._touch.read()))
            self._poll()
            if wants_to_go_on and page is self._page:
                self._post(Continue(self._now_s()))
        arm.rest()
        self._felt = senses.felt()
        if self._tell_felt is not None:
            self._tell_felt(page.trial, self._felt)

    def _see(self, senses: Senses) -> TankView | None:
        """Show the frames that are due since the last look; return what the newest showed, None where none was due."""
        view = None
        while self._next_frame_ns <= self._machine.servo.now_ns():
            view = self._runner.view(self._next_frame_ns)
            if view is not None:
                low, high = PAINT_S
                painted_ns = self._next_frame_ns + round(1e9 * (low + (high - low) * self._paint()))
                self._runner.frame_shown(painted_ns, view.sample_time_ns)
                senses.see(painted_ns, view)
            self._next_frame_ns += round(1e9 * FRAME_S)
        return view

    def _fill_in(self, page: QuestionnairePage) -> None:
        """Answer every statement by what was felt, and confirm."""
        for item in page.items:
            self._post(ItemShown(self._now_s(), item.id))
        felt = self._known.get(page.trial, self._felt)
        for choice in filled_in(page, felt, self._person, self._stream(f"{page.trial}/answers")):
            self._pass(choice.after_s)
            if page is not self._page:
                return
            self._post(Chosen(self._now_s(), choice.item, choice.value))
        self._pass(1.0)
        self._post(Submitted(self._now_s()))
        self.answers += len(page.items)
