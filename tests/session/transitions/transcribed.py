"""Transcripts of sessions: events, all that each one commands, and what becomes of the state."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any

from study_app.errors import SessionError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial, build_schedule
from study_app.session.pages import Page
from study_app.session.transitions.events import Adjust, Begin, Command, ShowPage, StartTrial, TaskDone, TimeUp, Write
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, initial_state
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import key_of
from tests.protocol.trials.matching import ALONE, matching
from tests.session import pairs, small
from tests.session.transitions.states import EVENTS as ALL_EVENTS
from tests.session.transitions.states import state_in
from tests.transcripts import value_of

FOLDER = Path(__file__).parent / "transcripts"
EVENTS: Mapping[str, type[Any]] = {kind.__name__: kind for kind in ALL_EVENTS}
SHOWN = ("phase", "index", "attempt", "interval", "steps", "force_off", "held", "invalid")
"""What is printed of a state."""
VALUE = (("levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nlevel = "value"'), ("standards = [1, 2]\n", ""))
UNTRAINED = ('sequence = ["training", "viscosity"]', 'sequence = ["viscosity"]')
DELAYS = (
    ('condition = "oil"\nvary = "viscosity_pa_s"', 'condition = "oil"\nvary = "delay_ms"'),
    ("standards = [1, 2]\nlevels = [0.1, 0.8]", "standards = [50, 100]\nlevels = [10, 80]"),
    ("levels = [0.2, 0.4, 0.8]", "levels = [10, 40, 80]"),
    ("standards = [1]", "standards = [50]"),
)
REPLIES = """
[scales.three]
labels.en = ["a", "b", "c"]
[designs.strength]
kind = "rating"
scale = "three"
[designs.number]
kind = "estimation"
question = "How thick?"
modulus = { level = 0.5, number = 10 }
"""


def opened(protocol: Protocol) -> SessionState:
    """Return a session before its first event."""
    key = key_of(protocol)
    return initial_state(protocol, build_schedule(protocol, "P001", 1), key.codes, "en", secret=key.secret)


def with_break(**changed: Any) -> Protocol:
    """Return the small study with a break in its first block."""
    tables = deepcopy(small.TABLES)
    tables["pages"]["rest"] = {"kind": "break", "title": "Rest", "body": "Breathe.", "min_s": 60, **changed}
    tables["blocks"]["feeling"] |= {"break_every": 1, "break_page": "rest"}
    return Protocol.model_validate(tables)


def to_page(state: SessionState, page_id: str) -> SessionState:
    """Walk to a page."""
    while not (state.phase is Phase.READING and state.page_id == page_id):
        state, _ = advance(state, small.next_event(state, 100.0))
    return state


def to_trial(state: SessionState, block: str, index: int, *, right: bool = True) -> SessionState:
    """Walk to the first interval of a trial of a study of pairs."""
    while not (state.phase is Phase.TASK and state.trial.block == block and state.trial.index == index):
        state, _ = advance(state, pairs.next_event(state, 0.0, right))
    return state


def to_setting(*edits: tuple[str, str]) -> SessionState:
    """Walk to the first interval whose level the participant sets."""
    state, _ = advance(opened(matching(*edits)), Begin(0.0))
    while not (state.adjusts and state.phase is Phase.TASK):
        resting = state.phase is Phase.RESTING
        state, _ = advance(state, TimeUp(state.until_s or 0.0) if resting else TaskDone(5.0, "complete", {}))
    return state


def replying(design: str, *edits: tuple[str, str]) -> SessionState:
    """Return a study of pairs with another design."""
    return pairs.opened(pairs.protocol(UNTRAINED, ('design = "2ifc"', f'design = "{design}"'), *edits, more=REPLIES))


STARTS: dict[str, Callable[[], SessionState]] = {
    **{f"small, {phase.name.lower()}": partial(state_in, phase) for phase in Phase},
    "small, answering without answers": lambda: small.walk(small.opened(), Phase.ANSWERING),
    "small, answering the third questionnaire": lambda: small.walk(small.opened(), Phase.ANSWERING, times=3),
    "small, last page": lambda: small.walk(small.opened(), Phase.READING, times=2),
    "small, in a break": lambda: to_page(opened(with_break()), "rest"),
    "small, in a break without a time": lambda: to_page(opened(with_break(min_s=None)), "rest"),
    "rek2024": lambda: opened(load("rek2024")),
    "mixed": lambda: opened(parse(text_of("mixed").encode(), "mixed")),
    "pairs": pairs.opened,
    "pairs, second pair": lambda: to_trial(pairs.opened(), "viscosity", 2),
    "pairs, second training pair": lambda: to_trial(pairs.opened(), "training", 2, right=False),
    "pairs, answering": lambda: pairs.walk(pairs.opened(), Phase.ANSWERING),
    "pairs of delays": lambda: to_trial(pairs.opened(pairs.protocol(*DELAYS)), "viscosity", 2),
    "estimation": lambda: replying("number", *VALUE),
    "rating": lambda: replying("strength", *VALUE),
    "yes and no": lambda: replying("yesno"),
    "matching": lambda: opened(matching()),
    "matching without the standard": lambda: opened(matching(ALONE)),
    "matching, setting": to_setting,
}


def play(start: str, lines: list[str]) -> Iterator[str]:
    """Yield each event with its commands."""
    state = STARTS[start]()
    for line in lines:
        yield line
        try:
            after, commands = advance(state, value_of(line, EVENTS))
        except SessionError as error:
            yield f"> refused: {error}"
            continue
        yield from (f"> {said(command)}" for command in commands)
        yield f"> {_state(state, after)}"
        state = after


def _state(before: SessionState, after: SessionState) -> str:
    if after == before:
        return "the same state"
    fields = {name: getattr(after, name) for name in SHOWN}
    answers = {name: answer.value for name, answer in after.answers.items() if answer.given}
    trial = f", trial {after.trial.number}" if after.phase not in FINAL and isinstance(after.step, Trial) else ""
    rest = ", ".join(f"{name} {value}" for name, value in fields.items() if value and name not in ("phase", "index"))
    results = [(result.trial, result.success, result.correct, result.catch) for result in after.heard]
    return f"{after.phase.name.lower()} at step {after.index}{trial}, {rest}, answers {answers}, heard {results[-2:]}"


def said(command: Command) -> str:
    """Return a command in words, with what its own representation hides."""
    match command:
        case Write(line, measured, waits):
            fields = " ".join(f"{name}={_rounded(value)!r}" for name, value in line.fields().items())
            return f"write {line.event} {fields}{', measured' * measured}{', waits' * waits}"
        case ShowPage(page):
            return f"show {_page(page)}"
        case StartTrial():
            presented = command.presented
            what = (presented.condition, presented.vary, _rounded(presented.value))
            times = f"delay {command.delay_s:g} s, lingers {command.linger_s:g} s"
            which = f"trial {command.trial}, attempt {command.attempt}, interval {command.interval}"
            return (
                f"start {which}: {what}, {times}, "
                f"{command.task.kind} for {command.task.limit_s:g} s{', adjusts' * command.adjusts}"
            )
        case Adjust(presented, delay_s, line):
            fields = {name: value for name, value in line.fields().items() if name != "scene"}
            return f"adjust to {_rounded(presented.value)}, delay {delay_s:g} s, {fields}"
        case _:
            return repr(command)


def _page(page: Page) -> str:
    parts = []
    for field in dataclasses.fields(page):
        value = getattr(page, field.name)
        if field.name in ("items", "item"):
            items = value if field.name == "items" else [value]
            value = [(item.id, item.number, item.required, item.text, getattr(item, "options", ())) for item in items]
        if field.name in ("task", "coming") and value is not None:
            value = value.kind if field.name == "task" else value.trial
        if value != field.default:
            parts.append(f"{field.name}={_rounded(value)!r}")
    return f"{type(page).__name__}({', '.join(parts)})"


def _rounded(value: Any) -> Any:
    return float(f"{value:.9g}") if isinstance(value, float) else value
