"""The participant's window, compared with reviewed texts: what each kind of page tells, and what keys and views do.

The tank is painted, not told: the places of its things are recorded, and one coarse picture of each case.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF, QTimer
from PySide6.QtWidgets import QWidget

from study_app.protocol.questions import ChoiceView, ItemView, NumberView, RatingView, ShowIf, SliderView, TextView
from study_app.session.pages import (
    ChoicePage,
    EndPage,
    FeedbackPage,
    Interval,
    NumberPage,
    PausePage,
    Progress,
    TaskPage,
    TroublePage,
)
from study_app.session.tasks import TankView
from study_app.video.frames import VideoFrame
from tests import golden
from tests.gui.drawn import grabbed_pixels
from tests.gui.participant.driver import KEY, Participant
from tests.gui.small import (
    DUTCH_LABELS,
    FIVE,
    QUESTIONS,
    STATEMENTS,
    explore,
    follow,
    follow_view,
    form,
    questionnaire,
    reach,
    task_page,
    text_page,
    view,
)
from tests.gui.transcript import GOLDEN, comes_and_goes, compare, spoken

TILES = 8
FULL, SMALL, LARGE, NARROW = (1366, 768), (1024, 640), (1920, 1080), (683, 384)
LONG = tuple(f"Sentence {number} is about the study. " * 20 for number in range(1, 5))
PAIR = Progress(part=1, parts=1, label="Pair 57", index=57, of=220, at_most=True)
ORDINALS = tuple((ordinal, ordinal.title()) for ordinal in ("first", "second", "third", "fourth"))
ENTER, SPACE, TAB, LEFT, RIGHT, UP, DOWN, HOME, END = (
    getattr(KEY, f"Key_{name}") for name in ("Return", "Space", "Tab", "Left", "Right", "Up", "Down", "Home", "End")
)


@dataclass(frozen=True)
class Click:
    """A click on a named button, optionally within a question."""

    name: str
    question: int | None = None


@dataclass(frozen=True)
class Wait:
    """A wait for seconds of the session's clock."""

    by_s: float


class Case:
    """A window and its steps: pages and views to show, keys to press, texts to type, names to click."""

    def __init__(self, *steps: Any, size: Any = FULL, said: str = "en", **named: Any) -> None:
        self.steps, self.size, self.said, self.named = steps, size, said, named


def choice(count: int) -> ChoicePage:
    return ChoicePage(1, ChoiceView("choice", 1, "Which was stronger?", True, options=ORDINALS[:count]), PAIR)


NUMBER = NumberPage(1, NumberView("strength", 1, "The first is 10. How strong was this?", True, least=1e-9), PAIR)


def interval(number: int, *, resting: bool = False, adjusts: bool = False) -> TaskPage:
    announced = "Next: the second" if resting else ("First of 2", "Second of 2")[number - 1]
    task = follow().lasting(60.0) if adjusts else follow()
    page = task_page(task, question="Make both equal.", interval=Interval(number, 2, resting, announced))
    return replace(page, adjusts=adjusts)


def alone(index: int, **changed: Any) -> Any:
    return form(replace(QUESTIONS[index], **({"number": 1} | changed)))  # type: ignore[arg-type]


def statements(count: int = 9, **changed: Any) -> Any:
    return questionnaire(STATEMENTS[:count], **changed)


MIXED: tuple[ItemView, ...] = (
    ChoiceView("hand", 1, "Which hand?", True, options=(("left", "Left"), ("right", "Right"))),
    RatingView("a", 2, "How thick?", False, labels=FIVE[:3], show_if=ShowIf(item="hand", values="left")),
    RatingView("b", 3, "How thin?", True, labels=("Not", "", "", "", "", "", "Very"), cannot_judge="Cannot judge"),
    SliderView("c", 4, "How warm?", False, low="Cold", high="Warm", step=20),
    NumberView("d", 5, "How large?", False, least=0, most=2.5, unit="cm"),
    NumberView("e", 6, "How far?", True, least=3),
    NumberView("f", 7, "How near?", True, most=3, whole=True),
    TextView("g", 8, "What else?", True, lines=3, longest=12),
)
PARTS = Progress(part=2, parts=3, label="Delay setting 3", index=3, of=7)

PAGES = {
    "instructions": Case(text_page(progress=PARTS), TAB, TAB, SPACE, KEY.Key_Escape),
    "instructions, long": Case(
        text_page(paragraphs=LONG), DOWN, KEY.Key_PageDown, END, HOME, KEY.Key_End, Click("Go on"), size=SMALL
    ),
    "instructions, large text": Case(text_page(), ENTER, size=SMALL, text_scale=2.0),
    "consent": Case(
        text_page("consent", languages=("en", "nl", "ar")),
        SPACE,
        TAB,
        TAB,
        TAB,
        RIGHT,
        text_page("consent", languages=("en", "nl", "ar"), language="ar"),
        LEFT,
        ENTER,
        ENTER,
    ),
    "consent, declined": Case(text_page("consent", language="nl"), Click("Ik wil niet meedoen"), said="nl"),
    "break": Case(
        text_page("break", stays_until_s=130.0, progress=Progress(part=1, parts=2, label="", index=4, of=3)),
        SPACE,
        Wait(29.4),
        Wait(0.6),
        SPACE,
        size=LARGE,
    ),
    "break of pairs": Case(text_page("break", progress=replace(PAIR, part=None)), ENTER, said="de"),
    "debrief": Case(
        text_page("debrief", progress=Progress(part=2, parts=2, label="", index=8, of=7)), ENTER, text_scale=1.5
    ),
    "end": Case(EndPage("Thank you", "Let the operator know."), ENTER, KEY.Key_Escape),
    "end, mouse": Case(EndPage("Thank you", "Let the operator know."), captures_pointer=True, said="fr"),
    "trouble": Case(TroublePage("One moment", "Help comes."), ENTER, KEY.Key_Escape),
    "pause": Case(text_page(), PausePage(force_off=False), SPACE, ENTER, KEY.Key_Escape),
    "force off": Case(task_page(), PausePage(force_off=True), SPACE, ENTER, said="nl", size=NARROW),
    "held": Case(PausePage(True, "force"), ENTER, PausePage(True, "pause"), PausePage(False, "pause"), ENTER),
    "force off, mouse": Case(PausePage(True, "force"), captures_pointer=True),
    "feedback": Case(FeedbackPage(True), ENTER, FeedbackPage(False), said="nl"),
    "two choices": Case(choice(2), TAB, KEY.Key_Escape, KEY.Key_2, KEY.Key_1),
    "four choices": Case(choice(4), RIGHT, RIGHT, UP, SPACE, ENTER, size=SMALL),
    "four choices from right to left": Case(choice(4), RIGHT, LEFT, KEY.Key_4, said="ar"),
    "number": Case(NUMBER, ENTER, "0", ENTER, "7", Click("⌫"), Click("2"), Click("."), Click("5"), ENTER),
    "number, large text": Case(NUMBER, "x", ENTER, "1e3", ENTER, size=SMALL, text_scale=2.0, said="nl"),
    "setting": Case(
        interval(1),
        interval(2, resting=True),
        interval(2, adjusts=True),
        RIGHT,
        LEFT,
        UP,
        DOWN,
        Click("Less"),
        Click("Done"),
        ENTER,
        size=NARROW,
    ),
    "setting, large text": Case(interval(2, adjusts=True), size=NARROW, text_scale=2.0),
}

QUESTIONNAIRES = {
    "statements": Case(
        statements(cannot_judge="Cannot judge"), KEY.Key_6, RIGHT, RIGHT, SPACE, DOWN, UP, Click("Cannot judge", 3),
        KEY.Key_7, Click("Continue"), TAB, KEY.Key_Escape, END, ENTER,
    ),
    "statements, small": Case(
        statements(4, chosen=(("item1", 6), ("item2", None)), cannot_judge="Cannot judge", labels=DUTCH_LABELS),
        KEY.Key_3,
        KEY.Key_4, ENTER, size=SMALL, said="nl", text_scale=1.5,
    ),
    "one statement": Case(statements(1, intro="", progress=None), KEY.Key_0, KEY.Key_9, KEY.Key_5, ENTER, ENTER),
    "form": Case(
        form(), Click("Continue"), "42", ENTER, KEY.Key_3, "7", ENTER, KEY.Key_1, KEY.Key_2, DOWN, KEY.Key_4, HOME,
        RIGHT,
        DOWN, "Fine.", ENTER, ENTER,
    ),
    "form, small": Case(
        form(progress=PARTS, chosen=(("age", 33), ("hand", "both"), ("used", ("mouse", "other")), ("thick", None))),
        ENTER,
        TAB, TAB, ENTER, KEY.Key_PageDown, KEY.Key_PageUp, size=SMALL, said="nl", text_scale=1.5,
    ),
    "form from right to left": Case(form(), "12", ENTER, Click("Both"), Click("Left"), said="ar"),
    "mixed": Case(
        form(*MIXED), KEY.Key_1, Click("Right"), Click("Left"), KEY.Key_3, Click("Cannot judge", 3), TAB, RIGHT,
        RIGHT, KEY.Key_PageUp, DOWN, "2,6",
        ENTER,
        KEY.Key_Backspace, "5", ENTER, "2", ENTER, "4", ENTER, "4.5", ENTER, "3", "One, two", ENTER, "three", TAB,
        ENTER,
        KEY.Key_PageUp, KEY.Key_Escape, size=LARGE,
    ),
    "number": Case(alone(0), TAB, "12", ENTER, "34", KEY.Key_Backspace, Click("7"), Click("⌫"), Click("5"), ENTER),
    "number, entered before": Case(replace(alone(0), chosen=(("age", 42),)), KEY.Key_Backspace, KEY.Key_Backspace,
        TAB, ENTER),
    "one choice": Case(alone(1), RIGHT, SPACE, DOWN, KEY.Key_3, KEY.Key_3, ENTER, size=SMALL),
    "several": Case(alone(3), KEY.Key_1, KEY.Key_3, KEY.Key_1, Click("A haptic device"), ENTER, said="nl"),
    "rating": Case(alone(4), KEY.Key_6, LEFT, RIGHT, SPACE, END, SPACE, ENTER),
    "slider": Case(alone(5), END, KEY.Key_PageDown, LEFT, DOWN, UP, HOME, ENTER),
    "text": Case(alone(6, required=True), ENTER, "a text longer than it may be", KEY.Key_Backspace, ENTER, ENTER),
}  # fmt: skip


def filmed(
    x: float, colour: tuple[int, int, int] | None, number: int = 0, size: tuple[int, int] = (320, 180)
) -> TankView:
    width, height = size
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., :3] = colour or (0, 0, 0)
    frame = (
        VideoFrame(
            number=number,
            width=width,
            height=height,
            stride=4 * width,
            pixels=memoryview(pixels),
            due_ns=0,
            age_ns=None,
            period_ns=33_333_333,
        )
        if colour
        else None
    )
    return replace(follow_view(x, (0.03, 0.01, 0)), video=frame)


COUNTING = reach(timeout_s=60, targets_mm=((-30, 0, -20), (30, 0, 20), (0, 20, 0)))
TANKS = {
    "reach": Case(
        task_page(COUNTING), view((0.01, 0.0, 0.01), lit=0, reached=0, elapsed_s=1.0),
        view((0.028, 0.004, 0.018), lit=1, dwell=0.3, reached=3, sample_ns=8_000_000_000),
        view((-0.04, 0.02, -0.02), lit=2, dwell=1.0, reached=11, elapsed_s=50.0), SPACE,
        view((0.0, 0.0, 0.03), lit=None, reached=12, elapsed_s=60.0), statements(1), size=NARROW,
    ),
    "reach without a count": Case(
        task_page(reach(count=None, duration_s=30), progress=None), view(elapsed_s=3.0), view(elapsed_s=29.5),
        view(elapsed_s=30.0), size=NARROW, said="nl", text_scale=1.5,
    ),
    "reach by mouse": Case(
        task_page(COUNTING), view((0.03, 0.0, -0.02)), view((0.035, 0.004, 0.03)), view((-0.03, 0.0, 0.0)),
        captures_pointer=True, size=NARROW,
    ),
    "explore": Case(
        task_page(explore(), progress=Progress(part=1, parts=2, label="Liquid setting 1", index=1, of=3)),
        view(lit=None, elapsed_s=29.9), SPACE,
        view((0.0, -0.03, -0.03), lit=None, elapsed_s=30.0), SPACE, view(lit=None, elapsed_s=111.0), KEY.Key_Escape,
        size=NARROW,
    ),
    "follow": Case(
        task_page(follow()), follow_view(-0.02), follow_view(0.015, sample_ns=9), follow_view(0.015, ball_hidden=True),
        follow_view(0.0, (0.05, 0.03, 0.03)), said="ar", size=NARROW,
    ),
    "intervals": Case(
        interval(1), follow_view(0.02, (0.02, 0.0, 0.0), elapsed_s=3.9), interval(2, resting=True),
        follow_view(0.0, (0.02, 0.0, 0.01), elapsed_s=0.0), follow_view(0.0, (0.001, 0.0, 0.0), elapsed_s=0.0),
        interval(2),
        follow_view(0.01), choice(2), size=NARROW,
    ),
    "video": Case(
        task_page(follow(), video=True), filmed(0.0, (200, 30, 60)), filmed(0.01, (20, 130, 60)), filmed(0.01, None),
        size=NARROW,
    ),
    "video of other ratios": Case(
        task_page(follow(), video=True, overlay=False), filmed(0.0, (20, 130, 60), 0, (400, 40)),
        filmed(0.0, (20, 130, 60), 1, (40, 400)), filmed(0.0, (200, 30, 60), 2),
        task_page(follow(), video=True, overlay=False), task_page(follow()), filmed(0.0, None), size=NARROW,
    ),
    "video without an overlay": Case(task_page(follow(), video=True, overlay=False), filmed(0.0, (200, 30, 60)),
        size=NARROW),
    "without a photodiode": Case(task_page(), view((0.03, 0, 0)), size=NARROW),
}  # fmt: skip


GROUPS = {"pages": PAGES, "questionnaires": QUESTIONNAIRES, "tanks": TANKS}


def plain(value: Any) -> str:
    """Return a value of a frame as text: places and numbers to a tenth, so that they do not depend on the machine."""
    match value:
        case float():
            return f"{value:.2f}"
        case QPointF():
            return f"{value.x():.1f},{value.y():.1f}"
        case QRectF():
            return " ".join(f"{coordinate:.0f}" for coordinate in value.getRect())
        case tuple():
            return f"({' '.join(map(plain, value))})"
    return str(value)


def picture(widget: QWidget) -> Iterator[str]:
    """Yield the mean of each colour in the tiles of a widget's picture, in steps of 16 of 255."""
    image = grabbed_pixels(widget)
    height, width = (length // TILES * TILES for length in image.shape[:2])
    tiles = image[:height, :width].reshape(TILES, height // TILES, TILES, width // TILES, 3)
    for number, row in enumerate(np.round(tiles.astype(float).mean((1, 3)) / 16).astype(int)):
        yield f"tiles {number}: {' '.join(''.join(f'{part:x}' for part in tile) for tile in row)}"


def lines(participant: Participant) -> Iterator[str]:
    """Yield the spoken lines of a window, and the positions of the things in its tank."""
    focus = participant.focus
    yield f"keyboard at {getattr(focus, 'text', focus.accessibleName)()!r}"
    yield from spoken(participant.window)
    if (tank := participant.window.tank) is not None:
        yield from (f"thing {name}: {plain(thing.state)} @{plain(thing.place)}" for name, thing in tank.parts.items())


def act(participant: Participant, step: Any) -> None:
    match step:
        case KEY():
            participant.press(step)
        case str():
            participant.type(step)
        case Click():
            participant.click(step.name, step.question)
        case TankView():
            participant.window.show_view(step)
        case Wait():
            participant.clock.now_s += step.by_s
            for timer in participant.page.findChildren(QTimer):
                timer.timeout.emit()
        case _:
            participant.show(step)
    participant.settle()


def named(step: Any) -> str:
    match step:
        case KEY():
            return step.name
        case str() | Click() | Wait():
            return repr(step)
        case TankView():
            return f"view at {step.position_m}, {step.task}"
    return f"show {type(step).__name__}"


def transcript(participant: Participant, case: Case) -> Iterator[str]:
    """Yield the events and changed lines of each step, and finally the picture of the tank."""
    participant.clock.step_s = 0.0
    before: list[str] = []
    for step in case.steps:
        participant.events.clear()
        act(participant, step)
        yield f"-- {named(step)}"
        yield from (f"told {event}" for event in participant.events)
        after = list(lines(participant))
        yield from comes_and_goes(before, after)
        before = after
    if participant.window.tank is not None:
        yield from picture(participant.window.tank)


@pytest.mark.parametrize("group", ["tanks", *(pytest.param(name, marks=pytest.mark.slow) for name in list(GROUPS)[:2])])
def test_transcripts_of_pages(opening: Callable[..., Participant], pytestconfig: pytest.Config, group: str) -> None:
    transcripts = []
    for name, case in GROUPS[group].items():
        participant = opening(None, case.size, case.said, **case.named)
        transcripts += [f"== {name}", *transcript(participant, case)]
        participant.close()
    if group == "tanks":
        golden.compare(GOLDEN / "participant_tanks.txt", transcripts, pytestconfig)
    else:
        compare(f"participant, {group}", transcripts, pytestconfig)
