"""Pages with the texts, the progress and the visible properties that belong to their state."""

from dataclasses import replace

import pytest

from study_app.protocol.load import load, parse
from study_app.protocol.orders.schedule import Trial
from study_app.session.pages import EndPage, Progress, TextPage, TroublePage
from study_app.session.transitions.events import Begin, Chosen, Submitted, TaskDone, TimeUp, WriteFailed
from study_app.session.transitions.page_builder import Moment, build_page, presented_condition, preview, previewed_page
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.protocol.edited_studies import text_of
from tests.session import pairs, small
from tests.session.transitions.states import shown, state_in, written
from tests.session.transitions.transcribed import REPLIES, UNTRAINED, VALUE, opened, replying, to_trial


def in_language(state: SessionState, language: str) -> SessionState:
    return replace(state, plan=replace(state.plan, language=language))


@pytest.mark.parametrize(
    ("language", "trouble", "complete", "early"),
    [
        (
            "en",
            ("One moment, please", "The force is off and your answers are saved. The researcher will help; "
             "you do not need to do anything."),
            ("Thank you", "The session is complete."),
            ("The session has ended", "Thank you for your time."),
        ),
        (
            "nl",
            ("Een ogenblik geduld", "De kracht is uit en uw antwoorden zijn bewaard. De onderzoeker helpt; "
             "u hoeft niets te doen."),
            ("Dank u wel", "De sessie is afgerond."),
            ("De sessie is beëindigd", "Dank u voor uw tijd."),
        ),
    ],
)  # fmt: skip
def test_pages_after_a_failure_and_at_the_end_have_their_own_texts(
    language: str, trouble: tuple[str, str], complete: tuple[str, str], early: tuple[str, str]
) -> None:
    for phase in (Phase.TROUBLE, Phase.STALLED):
        page = build_page(in_language(state_in(phase), language))
        assert isinstance(page, TroublePage)
        assert (page.title, page.paragraph) == trouble
    for state, texts in (
        (state_in(Phase.ENDED), early),
        (state_in(Phase.COMPLETE), ("Thanks", complete[1])),  # the study's last page has a title
        (pairs.walk(pairs.opened(), Phase.COMPLETE), complete),
    ):
        for over in (state, advance(state, WriteFailed(9.0, "disk full", ()))[0]):
            page = build_page(in_language(over, language))
            assert isinstance(page, EndPage)
            assert (page.title, page.paragraph) == texts


def test_intervals_are_announced_in_rests_and_named_in_their_tasks() -> None:
    """Only the rest before the first interval of a repeated trial announces a repetition."""
    state = to_trial(pairs.opened(), "viscosity", 1)
    announced = [(state.phase, build_page(state).interval.announced)]  # type: ignore[union-attr]
    for event in (
        TaskDone(10.0, "complete", {}, ("pace_error_percent",)),
        TimeUp(20.0),
        TaskDone(30.0, "complete", {}),
        TimeUp(40.0),
        TaskDone(50.0, "complete", {}),
        Chosen(60.0, "choice_2ifc", "second"),
        Submitted(70.0),
        TimeUp(80.0),
    ):
        state, commands = advance(state, event)
        if state.phase in {Phase.TASK, Phase.RESTING}:
            announced.append((state.phase, shown(commands).interval.announced))
    assert announced == [
        (Phase.TASK, "First of 2"),
        (Phase.RESTING, "Once more"),
        (Phase.TASK, "First of 2"),
        (Phase.RESTING, "Next: the second"),
        (Phase.TASK, "Second of 2"),
        (Phase.RESTING, "Next: the first"),  # of the next trial
        (Phase.TASK, "First of 2"),
    ]


def test_a_task_page_shows_the_video_and_overlay_of_the_presented_condition() -> None:
    study = parse(text_of("compared").encode(), "study.toml")
    filmed = study.conditions["thin"].model_copy(update={"view": "camera", "overlay": "hidden"})
    state = opened(study.model_copy(update={"conditions": study.conditions | {"thin": filmed}}))
    state = advance(state, Begin(0.0))[0]
    shown_views = []
    while len(shown_views) < 4:
        if state.phase is Phase.TASK:
            assert state.due is not None
            page = build_page(state)
            condition = state.due.intervals[state.interval - 1].condition
            shown_views.append((state.interval, condition))
            assert (page.video, page.overlay) == (condition == "thin", condition == "thick")  # type: ignore[union-attr]
        state, _ = advance(state, pairs.next_event(state, state.since_s + 100.0))
    assert {condition for _, condition in shown_views} == {"thin", "thick"}


def test_a_follow_task_without_an_instruction_has_the_programs_own_in_the_language() -> None:
    for language, instruction in (
        ("en", "Keep the ball on the moving target."),
        ("de", "Halten Sie die Kugel auf dem sich bewegenden Ziel."),
    ):
        text = text_of("compared").replace("study.name", f'study.languages = ["{language}"]\nstudy.name')
        page = previewed_page(preview(parse(text.encode(), "study.toml")), 0, Moment("tank"), language)
        assert page.instruction == instruction  # type: ignore[union-attr]


def test_trials_and_breaks_of_a_block_with_a_criterion_say_at_most() -> None:
    """Two of six practice trials are done when the break comes."""
    state, progress = pairs.opened(), {}
    while state.phase is not Phase.COMPLETE:
        state, commands = advance(state, pairs.next_event(state, state.since_s + 100.0, right=False))
        page = shown(commands)
        if isinstance(page, TextPage) or state.phase is Phase.TASK:
            progress.setdefault((state.index, type(page).__name__), page.progress)
    practice = [value for value in progress.values() if value.part is None]
    assert practice[:3] == [
        Progress(part=None, parts=1, label=label, index=index, of=6, at_most=True)
        for label, index in (("Pair 1", 1), ("Pair 2", 2), ("Pair 2", 3))
    ]
    main = [value for value in progress.values() if value.part == 1]
    assert main[0] == Progress(part=1, parts=1, label="Pair 1", index=1, of=12, at_most=False)


def test_a_rating_page_lacks_the_introduction_and_a_modulus_uses_the_languages_decimal_sign() -> None:
    rating = pairs.walk(replying("strength", *VALUE), Phase.ANSWERING)
    assert build_page(rating).intro == ""  # type: ignore[union-attr]
    assert rating.questionnaire.intro
    edits = (UNTRAINED, ('design = "2ifc"', 'design = "number"'), *VALUE)
    state = pairs.opened(pairs.protocol(*edits, more=REPLIES.replace("number = 10", "number = 2.5")))
    state = in_language(pairs.walk(state, Phase.ANSWERING), "nl")
    assert build_page(state).item.text == "Deze krijgt het getal 2,5. Voer 2,5 in."  # type: ignore[union-attr]


def test_a_form_that_is_asked_again_says_how_often_and_after_which_block() -> None:
    text = text_of("mixed").replace('"load", "usability"', '"load", "start", "usability"')
    state, commands = advance(opened(parse(text.encode(), "study.toml")), Begin(0.0))
    pages, lines = [], []
    while state.phase is not Phase.COMPLETE:
        lines += [command.line for command in commands if written((command,)) == ["form_shown"]]
        if state.phase is Phase.ANSWERING:
            page = build_page(state)
            pages.append((page.form, page.time, page.trial))  # type: ignore[union-attr]
            for item in page.items:  # type: ignore[union-attr]
                if item.id in state.shown:
                    state, _ = advance(state, Chosen(1.0, item.id, item.simulated(5.0, lambda: 0.5)))
            state, commands = advance(state, Submitted(2.0))
        else:
            state, commands = advance(state, small.next_event(state, 100.0))
    assert [page for page in pages if page[0] == "start"] == [("start", 1, None), ("start", 2, None)]
    afters = [(line.form, line.after) for line in lines]
    assert afters[0] == ("start", None)
    assert {after for _, after in afters[1:]} == {"stir"}
    assert ("start", "stir") in afters


@pytest.mark.parametrize("assignment", ["randomised", "existing"])
def test_a_preview_of_a_study_with_groups_has_the_steps_of_one_group(assignment: str) -> None:
    study = parse(text_of("grouped").encode(), "study.toml")
    edited = study.model_copy(update={"study": study.study.model_copy(update={"group_assignment": assignment})})
    protocol = preview(edited).protocol
    steps = {group: edited.for_session(group, 1).sequence for group in edited.groups}
    assert len({*map(str, steps.values())}) == len(steps) > 1
    expected = [steps[next(iter(edited.groups))]] if assignment == "existing" else [*steps.values()]
    assert protocol.sequence in expected
    assert not protocol.groups


def test_the_presented_condition_of_a_preview_is_that_of_the_drawn_code() -> None:
    for name, has_design in (("demo", False), ("viscosityjnd", True)):
        shown_study = preview(load(name))
        for index, step in enumerate(shown_study.schedule.steps):
            expected = None
            if isinstance(step, Trial):
                block = shown_study.protocol.blocks[step.block]
                if block.design is None:
                    expected = shown_study.codes[step.block][step.code]
                else:
                    expected = shown_study.protocol.conditions_in(step.block)[0]
            assert presented_condition(shown_study, index) == expected
        blocks = shown_study.protocol.blocks.values()
        assert any(block.design is not None for block in blocks) == has_design
