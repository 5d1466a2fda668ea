"""Sessions without incidents: each line and each page, computed from the schedule and the text of the study."""

import hashlib
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from study_app.protocol.load import parse
from study_app.protocol.orders.schedule import FormStep, PageStep
from study_app.session.pages import FeedbackPage, QuestionnairePage, TaskPage, TextPage
from study_app.session.transitions.events import (
    Begin,
    Chosen,
    Continue,
    Event,
    ItemShown,
    StartTrial,
    Submitted,
    TaskDone,
    TimeUp,
    Write,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import text_of as levels_text
from tests.session import pairs
from tests.session.transitions.states import shown
from tests.session.transitions.transcribed import opened

PAIRS = levels_text(*pairs.EDITS, more=pairs.PRACTICE).replace("until = { right = 2, of = 3 }\n", "")
FADE_OUT_S = 0.05
"""Time in which the force fades out before a rest [s]."""


def next_event(state: SessionState, at_s: float) -> Event:
    """Return an event that brings a session a step further; each measure has a value of its own."""
    if state.phase is Phase.TASK:
        return TaskDone(at_s, "complete", {"duration_s": at_s / 8})
    if state.phase in {Phase.RESTING, Phase.FEEDBACK}:
        assert advance(state, TimeUp(state.until_s - 1e-6))[1] == (), "before its end"
        return TimeUp(state.until_s)
    if state.phase is Phase.ANSWERING:
        for number, (item, question) in enumerate(zip(state.items, state.questions, strict=True)):
            if item in state.shown and state.due is None and item not in state.answers:
                return ItemShown(at_s, item)
            if item in state.shown and not (item in state.answers and state.answers[item].given):
                simulated = question.view(1, state.context).simulated(3.0 + number, lambda: 0.7)
                return Chosen(at_s, item, pairs.answer_of(state) if state.due else simulated)
        return Submitted(at_s)
    return Begin(at_s) if state.phase is Phase.OPENING else Continue(at_s)


def held(state: SessionState) -> Iterator[tuple[float, SessionState, SessionState, tuple[Any, ...]]]:
    """Yield the time of each event of a session, the states before and after it, and its commands."""
    at_s = 1.0
    while state.phase not in FINAL:
        before, event = state, next_event(state, at_s)
        state, commands = advance(state, event)
        yield event.at_s, before, state, commands
        at_s = event.at_s + 1.25


def expected_lines(state: SessionState, answers: dict[int, dict[str, Any]]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each line with its fields, but for the times and kinds of answers; ``answers`` are those given, by step."""
    study = state.plan.protocol
    for index, step in enumerate(state.plan.schedule.steps):
        given = answers.get(index, {})
        match step:
            case PageStep(page):
                yield "page_shown", {"page": page}
                yield "page_left", {"page": page}
                continue
            case FormStep(form, after=after):
                of_form = {"form": form} | ({} if after is None else {"after": after})
                yield "form_shown", of_form
                yield from choices(given, {"form": form})
                yield "form_answered", of_form | {"items": [*given.items()]}
                continue
        which = {"trial": step.number, "attempt": 1}
        design = study.blocks[step.block].design
        names = ("block", "phase", "part", "index", "of", "code")
        yield "trial_started", which | {name: getattr(step, name) for name in names}
        for interval in (1, 2) if design else ():
            yield "interval_started", which | {"interval": interval}
            yield "interval_ended", which | {"interval": interval, "outcome": "complete"}
        yield "trial_ended", which | {"outcome": "complete"}
        if given:
            yield from choices(given, {"trial": step.number}, is_shown=design is None)
            yield "responses", which | {"items": [*given.items()]}
        if design and step.phase == "practice":
            yield "feedback_shown", which


def choices(
    given: dict[str, Any], of: dict[str, Any], *, is_shown: bool = True
) -> Iterator[tuple[str, dict[str, Any]]]:
    for item, value in given.items():
        if is_shown:
            yield "item_shown", of | {"item": item}
        yield "choice", of | {"item": item, "value": value}


LEFT_OUT = {"kind", "level", "standard", "arrangement", "catch", "duration_s", "text_sha256", "study_version"}


@pytest.mark.parametrize("text", [text_of("session"), text_of("mixed"), PAIRS])
def test_each_line_follows_from_the_schedule(text: str) -> None:
    state = opened(parse(text.encode(), "study.toml"))
    lines, answers = [], dict[int, dict[str, Any]]()
    measured, times = set[str](), dict[tuple[str, str], float]()
    for at_s, before, _, commands in held(state):
        for write in (command for command in commands if isinstance(command, Write)):
            fields, event = write.line.fields(), write.line.event
            waits = event in {"choice", "responses", "form_answered"} or "study_version" in fields
            assert write.waits == waits, event
            measured |= {event} if fields.get("duration_s") == at_s / 8 else set()
            if event == "choice":
                answers.setdefault(before.index, {})[fields["item"]] = fields["value"]
            times |= {(event, fields["item"]): at_s} if "item" in fields else {}
            for row in fields.get("items", ()):
                assert row["number"] == before.items.index(row["item"]) + 1
                assert row["onset_s"] == times.pop(("item_shown", row["item"]), None)
                assert {row["first_s"], row["last_s"]} == {times["choice", row["item"]]}
            if "items" in fields:
                fields["items"] = [(row["item"], row["value"]) for row in fields["items"]]
            lines.append((event, {name: value for name, value in fields.items() if name not in LEFT_OUT}))
    assert lines == list(expected_lines(state, answers))
    assert measured == {"interval_ended" if "stimuli" in text else "trial_ended"}


def test_each_page_has_the_texts_and_numbers_of_the_file() -> None:
    text = text_of("session").replace("[scene.velocity]", "[scene]\nscale = 4\n[scene.velocity]")
    raw, version = tomllib.loads(text), "1"
    state = opened(parse(text.encode(), "study.toml"))
    for _, _, _, commands in held(state):
        page = shown(commands)
        if isinstance(page, TextPage):
            of_file = raw["pages"][page.id]
            assert (page.kind, page.title, page.paragraphs) == (
                of_file["kind"], of_file["title"], tuple(of_file["body"].split("\n\n")))  # fmt: skip
            assert (page.button, page.language, page.languages) == (of_file.get("button", "Continue"), "en", ())
        if isinstance(page, TaskPage | QuestionnairePage):
            step = next(step for step in state.plan.schedule.steps if getattr(step, "number", 0) == page.trial)
            block = raw["blocks"][step.block]
            assert page.progress is not None
            labels = (
                f"{block['setting_label']} {step.index}" if len(block["conditions"]) > 1 else block["setting_label"]
            )
            assert (page.progress.part, page.progress.parts, page.progress.index, page.progress.of) == (
                block.get("part"), 2, step.index, len(block["conditions"]))  # fmt: skip
            assert (page.progress.label, page.progress.at_most) == (labels, False)
        if isinstance(page, TaskPage):
            assert page.instruction == raw["tasks"][block["task"]]["instruction"]
            assert (page.workspace_m, page.question) == ((0.1, 0.06, 0.06), "")
            (start,) = (command for command in commands if isinstance(command, StartTrial))
            assert (start.trial, start.attempt, start.interval, start.adjusts) == (page.trial, 1, None, False)
        if isinstance(page, QuestionnairePage) and not page.chosen:
            form = raw["questionnaires"][block["questionnaire"]]
            assert (page.title, page.intro) == (form.get("title", labels), form["intro"])
            texts = {item["id"]: item["text"] for item in form["items"]}
            assert [item.text for item in page.items] == [texts[item.id] for item in page.items]
            scale = raw["scales"][form["scale"]]
            assert (page.labels, page.cannot_judge) == (tuple(scale["labels"]["en"]), scale.get("cannot_judge"))
            assert (page.form, page.time) == (None, 1)
        for write in commands:
            if isinstance(write, Write) and write.line.event == "page_left" and write.line.page == "welcome":
                read = hashlib.sha256(b"Welcome\n\nOne.\n\nTwo.").hexdigest()
                assert (write.line.text_sha256, write.line.study_version) == (read, version)


def test_intervals_rests_and_feedback_last_as_long_as_the_design_says() -> None:
    text = PAIRS.replace('design = "2ifc"', 'design = "pairs"')
    text += '\n[designs.pairs]\nkind = "2ifc"\npause_s = 0.75\nbetween_s = 2.5\nfeedback_s = 1.5\n'
    seen = set()
    for at_s, _, after, commands in held(opened(parse(text.encode(), "study.toml"))):
        page = shown(commands)
        if after.phase is Phase.RESTING:
            first = after.interval == 1
            assert after.until_s == pytest.approx(at_s + (2.5 if first else FADE_OUT_S + 0.75))
            assert not first or after.plan.schedule.steps[after.index - 1].block == after.trial.block
            assert (page.interval.number, page.interval.of, page.interval.resting) == (after.interval, 2, True)
        if after.phase is Phase.TASK:
            (start,) = (command for command in commands if isinstance(command, StartTrial))
            assert (start.interval, page.interval.number, page.interval.resting) == (
                after.interval,
                after.interval,
                False,
            )
            assert start.presented == after.due.intervals[after.interval - 1]
            assert start.task == page.task == after.plan.protocol.tasks["stir"]
        if isinstance(page, FeedbackPage):
            assert (after.until_s, page.right) == (at_s + 1.5, True)
        seen.add(after.phase)
    assert {Phase.RESTING, Phase.TASK, Phase.FEEDBACK, Phase.ANSWERING} <= seen
