"""Page values and a clock for tests of the participant's widgets."""

from typing import Any

import numpy as np

from study_app.protocol.load import load
from study_app.protocol.questions import ChoiceView, ItemView, NumberView, RatingView, ShowIf, SliderView, TextView
from study_app.protocol.trials.tasks import AnyTask, Explore, Follow, Reach
from study_app.protocol.wording.languages import words
from study_app.session.pages import ChoicePage, NumberPage, Progress, QuestionnairePage, TaskPage, TextPage
from study_app.session.tasks import TankView, TaskView

THESIS = load("rek2024")
LABELS, DUTCH_LABELS = (THESIS.scales["agreement"].labels[language] for language in ("en", "nl"))
STATEMENTS = tuple(item.text["en"] for item in THESIS.questionnaires["liquid"].items)
FIVE = ("Not at all", "Slightly", "Somewhat", "Rather", "Very")
HANDS = (("left", "Left"), ("right", "Right"), ("both", "Both"))
DEVICES = (("mouse", "A mouse"), ("falcon", "A haptic device"), ("other", "Another one"))
QUESTIONS: tuple[ItemView, ...] = (
    NumberView("age", 1, "How old are you?", True, least=16, most=99, whole=True, unit="years"),
    ChoiceView("hand", 2, "Which hand do you write with?", True, options=HANDS),
    NumberView("since", 3, "Since when?", True, whole=True, show_if=ShowIf(item="hand", values="both")),
    ChoiceView("used", 4, "What have you used before?", False, options=DEVICES, several=True),
    RatingView("thick", 5, "How thick was it?", True, labels=FIVE, cannot_judge="Cannot judge"),
    SliderView("pleasant", 6, "How pleasant was it?", True, low="Unpleasant", high="Pleasant", step=5),
    TextView("comment", 7, "Anything else?", False, lines=1, longest=20),
)


def form(*items: ItemView, **changed: Any) -> QuestionnairePage:
    """Return a form of these questions, or of one or two of every kind."""
    fields: dict[str, Any] = {
        "trial": None,
        "title": "About you",
        "intro": "Please tell us about yourself.",
        "items": items or QUESTIONS,
        "labels": (),
        "cannot_judge": None,
        "progress": None,
        "form": "start",
    }
    return QuestionnairePage(**(fields | changed))


class ManualClock:
    """A manual clock that also advances a little with every reading."""

    def __init__(self) -> None:
        self.now_s, self.step_s = 100.0, 0.001

    def __call__(self) -> float:
        self.now_s += self.step_s
        return self.now_s


def questionnaire(statements: tuple[str, ...] = STATEMENTS, **changed: Any) -> QuestionnairePage:
    fields: dict[str, Any] = {
        "trial": 2,
        "title": "Liquid setting 1",
        "intro": "How much do you agree with each statement about what you just felt?",
        "items": tuple(ItemView(f"item{n}", n, text, required=True) for n, text in enumerate(statements, 1)),
        "labels": LABELS,
        "cannot_judge": None,
        "progress": Progress(part=1, parts=2, label="Liquid setting 1", index=1, of=3),
    }
    return QuestionnairePage(**(fields | changed))


ORDINALS = ("first", "second", "third", "fourth")
SOME = Progress(part=1, parts=1, label="Pair 57", index=57, of=220, at_most=True)


def choice(count: int = 2, language: str = "en") -> ChoicePage:
    said = words(language)
    options = tuple((name, said.design_answers[name]) for name in ORDINALS[:count])
    return ChoicePage(1, ChoiceView("choice", 1, said.design_questions["forced_choice"], True, options=options), SOME)


def number(language: str = "en") -> NumberPage:
    said = words(language)
    text = f"{said.modulus.format(number=10)} {said.design_questions['estimation']}"
    return NumberPage(1, NumberView("strength", 1, text, True, least=1e-9), SOME)


def reach(**changed: Any) -> Reach:
    fields: dict[str, Any] = {
        "kind": "reach",
        "targets_mm": ((-30, 0, 0), (30, 0, 0)),
        "radius_mm": 6,
        "dwell_s": 0.5,
        "count": 12,
        "instruction": "Hold the ball in the highlighted ring until it closes",
    }
    return Reach(**(fields | changed))


def explore() -> Explore:
    return Explore(kind="explore", min_s=30, max_s=120, instruction="Move the ball through the liquid")


def follow(**changed: Any) -> Follow:
    return Follow.model_validate({"kind": "follow", "instruction": "Keep the ball on the target"} | changed)


def task_page(task: AnyTask | None = None, **changed: Any) -> TaskPage:
    task = task or reach()
    fields: dict[str, Any] = {
        "trial": 3,
        "instruction": task.instruction,
        "task": task,
        "workspace_m": (0.1, 0.06, 0.06),
        "body_radius_m": 0.0034,
        "progress": Progress(part=2, parts=2, label="Delay setting 3", index=3, of=7),
    }
    return TaskPage(**(fields | changed))


def view(
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    lit: int | None = 1,
    reached: int = 5,
    dwell: float = 0.0,
    elapsed_s: float = 12.0,
    sample_ns: int = 7_000_000_000,
    target_m: tuple[float, float, float] | None = None,
    ball_hidden: bool = False,
) -> TankView:
    task = TaskView(lit=lit, reached=reached, of=12, dwell=dwell, elapsed_s=elapsed_s, target_m=target_m)
    return TankView(position_m=np.array(position_m), task=task, sample_time_ns=sample_ns, ball_hidden=ball_hidden)


def text_page(kind: Any = "instructions", **changed: Any) -> TextPage:
    fields: dict[str, Any] = {
        "id": kind,
        "kind": kind,
        "title": "Before you begin",
        "paragraphs": ("You will move a ball.", "Your name is not kept."),
        "button": "Go on",
    }
    return TextPage(**(fields | changed))


def follow_view(x: float = 0.0, ball: tuple[float, float, float] = (0, 0.02, 0), **changed: Any) -> TankView:
    """Return a view of a target that is followed, at a place along x [m]."""
    return view(ball, **({"lit": 0, "target_m": (x, 0.0, 0.0)} | changed))
