"""A session on the real servo and a simulated device, on a virtual clock, and what is felt in transcripts."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

from study_app.devices.hand import HandOrders, hand_of
from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, stream
from study_app.session.device_buttons import ANSWERS, CONTINUE
from study_app.session.pages import TaskPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin, Continue
from study_app.session.transitions.state import Phase
from tests.protocol.trials.level_studies import key_of, study
from tests.protocol.trials.matching import matching
from tests.session import small
from tests.session.fakes import FakeJournal
from tests.session.transitions.transcribed import EVENTS
from tests.transcripts import acts

TO_AND_FRO_M = 0.03
SWING_S = np.arange(0, 60, 0.005)
STILL_N, FELT_N = 1e-9, 0.5
TOLD = ("trial", "attempt", "outcome", "by", "value", "steps", "what", "kind", "text")
"""What is printed of a line: nothing that was measured."""
EXPLORED = ('kind = "follow"\ncycles = 1', 'kind = "explore"\nmin_s = 1\nmax_s = 2\ninstruction = "Stir."')
UNJUDGED = ("[liquids", "[limits]\nlevel_error_percent = 100\nwithheld_percent = 100\n\n[liquids")
TIMED = ("repetitions = 4", "repetitions = 4\nmost_s = 2")
FOLLOWED = (
    ('kind = "explore"\nmin_s = 1\nmax_s = 3', 'kind = "follow"\ncycles = 1\namplitude_mm = 15\nradius_mm = 5'),
    ('liquid = "thin"\n\n[conditions.other]', 'liquid = "thin"\nball = "hidden"\n\n[conditions.other]'),
)
PAIRS = '\n[designs.pairs]\nkind = "2ifc"\nfeedback = "always"\n'


class Bench:
    """A session at its first page or interval with windows that paint immediately."""

    def __init__(self, rig: Rig, protocol: Protocol) -> None:
        key = key_of(protocol)
        self.servo, self.device = rig.servo, rig.device
        hand = hand_of(rig.device)
        assert hand is not None
        self.hand: HandOrders = hand
        self.journal = FakeJournal([])
        self.pages: list[Any] = []
        self.paints = True
        ports = Ports(rig.servo, self.journal, self.present, self.clock, paints=False)
        schedule = build_schedule(protocol, "P001", 1)
        self.runner = Runner(protocol, schedule, key.codes, ports, "en", secret=key.secret)
        self.reader = rig.servo.telemetry.reader()
        self.servo.advance(20)
        self.runner.post(Begin(self.clock()))

    @property
    def state(self) -> Any:
        return self.runner.state

    def present(self, page: Any) -> None:
        self.pages.append(page)
        if self.paints and isinstance(page, TaskPage) and not (page.interval and page.interval.resting):
            self.paint()

    def paint(self) -> None:
        """Report the first frame of a tank, or a later one."""
        self.runner.frame_shown(self.servo.now_ns(), self.servo.now_ns())

    def clock(self) -> float:
        return self.servo.now_ns() / 1e9

    def swing(self) -> None:
        """Move the hand to and fro, so that any liquid resists it."""
        places = np.column_stack((TO_AND_FRO_M * np.sin(8 * SWING_S), 0 * SWING_S, 0 * SWING_S))
        self.hand.follow(SWING_S, places)

    def run(self, seconds: float) -> Any:
        """Let time pass and return the force at each tick [N] (n,)."""
        self.reader.read()
        forces = []
        for _ in range(round(seconds * 50)):
            self.servo.advance(20)
            self.runner.poll()
            forces.append(np.linalg.norm(self.reader.read().device_force_n, axis=1))
        return np.concatenate(forces)

    def look(self, ticks: int) -> None:
        """Advance by ticks and poll the device once."""
        self.servo.advance(ticks)
        self.runner.poll()

    def run_to(self, phase: Phase) -> None:
        for _ in range(500):
            if self.state.phase is phase:
                return
            self.run(0.02)
        raise AssertionError(phase)

    def to_setting(self) -> None:
        """Go on to the first interval whose level the participant sets."""
        while not (self.state.adjusts and self.state.phase is Phase.TASK):
            self.run(0.02)


def pairs(*edits: tuple[str, str]) -> Protocol:
    """Return the study of pairs with feedback, with edits of its text."""
    return study(('design = "2ifc"', 'design = "pairs"'), *edits, more=PAIRS)


def setting(*edits: tuple[str, str]) -> Protocol:
    """Return a study whose levels are set, and of which nothing is judged."""
    return matching(EXPLORED, UNJUDGED, *edits)


STARTS: dict[str, Callable[[], Protocol]] = {
    "pairs": pairs,
    "three intervals": partial(pairs, ('kind = "2ifc"', 'kind = "3ifc"')),
    "pairs, followed": partial(pairs, *FOLLOWED),
    "setting": setting,
    "setting in 2 s": partial(setting, TIMED),
    "small": small.protocol,
}


@contextmanager
def small_bench() -> Iterator[Bench]:
    """Yield a session of the small study in its practice, with a hand that moves to and fro in a thick liquid."""
    protocol = small.protocol()
    with open_rig("scripted", study_settings(protocol, stream(1, "hand")), clock=VirtualClock()) as rig:
        bench = Bench(rig, protocol)
        bench.swing()
        bench.runner.post(Continue(bench.clock()))
        yield bench


class Felt:
    """Commands for events on a bench; each yields the forces and pages that follow."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.seen = 0

    def run(self, seconds: float) -> str:
        force_n = self.bench.run(seconds).max()
        return "still" if force_n < STILL_N else "felt" if force_n > FELT_N else "weak"

    def swing(self) -> None:
        self.bench.swing()

    def to(self, phase: str) -> None:
        self.bench.run_to(Phase[phase])

    def to_setting(self) -> None:
        self.bench.to_setting()

    def press(self, *buttons: int) -> None:
        self.bench.hand.press(sum(buttons))

    def release(self) -> None:
        self.bench.hand.release()

    def reach_to(self, *place_m: float) -> None:
        self.bench.hand.reach_to(*place_m)

    def paints(self, on: bool) -> None:
        self.bench.paints = on

    def paint(self) -> None:
        self.bench.paint()

    def view(self) -> str:
        view = self.bench.runner.view(self.bench.servo.now_ns())
        assert view is not None
        place_mm = [round(1000 * coordinate_m) for coordinate_m in view.position_m.tolist()]
        return f"ball at {place_mm} mm{', hidden' * view.ball_hidden}, lit {view.task.lit}, target {view.task.target_m}"

    def answer(self, value: str) -> None:
        self.bench.runner.post(EVENTS["Chosen"](self.bench.clock(), self.bench.state.items[0], value))
        self.bench.runner.post(EVENTS["Submitted"](self.bench.clock()))

    def _news(self) -> Iterator[str]:
        """Tell new lines, and where the session is."""
        for line in self.bench.journal.lines[self.seen :]:
            fields = {name: line[name] for name in TOLD if line.get(name) is not None}
            values = [item["value"] for item in line.get("items", ())]
            yield f"{line['event']} {fields}{f' {values}' if values else ''}"
        self.seen = len(self.bench.journal.lines)
        task = self.bench.runner.task
        elapsed = f", {task.elapsed_s:.1f} s" if task else ""
        yield f"{self.bench.state.phase.name.lower()}, attempt {self.bench.state.attempt}{elapsed}"


def player(rig: Callable[[Protocol], Any]) -> Callable[[str, list[str]], Iterator[str]]:
    """Return a function that plays each transcript on a new rig."""

    def play(start: str, lines: list[str]) -> Iterator[str]:
        protocol = STARTS[start]()
        with rig(protocol) as open_rig:
            felt = Felt(Bench(open_rig, protocol))
            felt.bench.swing()
            list(felt._news())
            names: dict[str, Any] = {"LESS": ANSWERS[0], "MORE": ANSWERS[1], "CONTINUE": CONTINUE, "STOP": BUTTON_STOP}
            for kind, make_event in EVENTS.items():
                names[kind] = lambda *arguments, make_event=make_event: felt.bench.runner.post(
                    make_event(felt.bench.clock(), *arguments)
                )
            yield from acts(lambda _: felt, names)(start, lines)

    return play
