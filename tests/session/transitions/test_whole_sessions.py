"""Sessions without incidents: each page and the time of each rest, computed from the text of the study."""

import hashlib
import tomllib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from study_app.protocol.load import parse
from study_app.session.pages import FeedbackPage, QuestionnairePage, TaskPage, TextPage
from study_app.session.transitions.events import StartTrial, TimeUp, Write
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import text_of as levels_text
from tests.session import pairs, small
from tests.session.transitions.states import shown
from tests.session.transitions.transcribed import opened

PAIRS = levels_text(*pairs.EDITS, more=pairs.PRACTICE).replace("until = { right = 2, of = 3 }\n", "")
FADE_OUT_S = 0.05
"""Time in which the force fades out before a rest [s]."""


def held(state: SessionState, next_event: Callable[[SessionState, float], Any]) -> Iterator[tuple[float, Any, Any]]:
    """Yield the time of each event of a session, the state after it, and its commands."""
    at_s = 1.0
    while state.phase not in FINAL:
        event = next_event(state, at_s)
        if isinstance(event, TimeUp) and state.until_s is not None:
            assert advance(state, TimeUp(state.until_s - 1e-6))[1] == (), "before its end"
            event = TimeUp(state.until_s)
        state, commands = advance(state, event)
        yield event.at_s, state, commands
        at_s = event.at_s + 1.25


def test_each_page_has_the_texts_and_numbers_of_the_file() -> None:
    text = text_of("session").replace("[scene.velocity]", "[scene]\nscale = 4\n[scene.velocity]")
    raw, version = tomllib.loads(text), "1"
    state = opened(parse(text.encode(), "study.toml"))
    for _, _, commands in held(state, small.next_event):
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
    for at_s, after, commands in held(opened(parse(text.encode(), "study.toml")), pairs.next_event):
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
