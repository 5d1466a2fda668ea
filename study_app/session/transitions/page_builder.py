"""Build the participant's pages from a session's state, with the protocol's and interface texts in one language.

The state is that of a running session or of a preview, which is the session that follows from a seed. For a preview the
codes are drawn from the seed and no sealed key is read, so that it reveals nothing about a study that is being run.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

from study_app.haptics.model.scene import Body
from study_app.protocol.model import PageText, Protocol, Questionnaire
from study_app.protocol.orders import FormStep, PageStep, Schedule, Trial, build_schedule, draw_key
from study_app.protocol.questions import ChoiceView, Context, NumberView, Question, Value
from study_app.protocol.randomization import draw_secret, group_of, stream
from study_app.protocol.trials import ORDINALS
from study_app.protocol.wording import Words, words
from study_app.session import pages
from study_app.session.transitions.state import Phase, Plan, SessionState
from study_app.store.journals.journal_events import Answer

PARTICIPANT: Final = "P001"
SEED: Final = 1
"""The default participant and seed of a preview."""
Kind: TypeAlias = Literal["text", "tank", "questions", "feedback"]


def build_page(state: SessionState) -> pages.Page:
    """Return the page for a state of any phase except OPENING."""
    match state.phase:
        case Phase.TASK | Phase.RESTING:
            page = replace(_task_page(state, state.trial), task=state.task, interval=_interval(state))
            return page if state.phase is Phase.RESTING else _with_presentation(state, page)
        case Phase.ANSWERING:
            return _answer_page(state)
        case Phase.FEEDBACK:
            return pages.FeedbackPage(right=state.heard[-1].correct is True)
        case Phase.PAUSED:
            coming = _task_page(state, state.step) if isinstance(state.step, Trial) else None
            return pages.PausePage(force_off=state.force_off, held=state.held, coming=coming)
        case Phase.STALLED if state.stall is not None and state.over:
            return build_page(replace(state, phase=state.stall.before, stall=None))
        case Phase.TROUBLE | Phase.STALLED:
            return pages.TroublePage(_interface_texts(state).trouble_title, _interface_texts(state).trouble_body)
        case Phase.COMPLETE:
            last = state.plan.schedule.steps[-1]  # a study's own last page replaces the title
            text = state.plan.protocol.pages[last.page_id] if isinstance(last, PageStep) else None
            title = _interface_texts(state).end_title if text is None else _text(state, text.title)
            return pages.EndPage(title, _interface_texts(state).end_body)
        case Phase.ENDED:
            return pages.EndPage(_interface_texts(state).ended_early_title, _interface_texts(state).ended_early_body)
        case _:
            return _text_page(state)


def _interface_texts(state: SessionState) -> Words:
    return words(state.plan.language)


def _text(state: SessionState, value: str | dict[str, str]) -> str:
    return state.plan.protocol.text(value, state.plan.language)


def _text_page(state: SessionState) -> pages.TextPage:
    protocol, language = state.plan.protocol, state.plan.language
    text = protocol.pages[state.page_id]
    return pages.TextPage(
        id=state.page_id,
        kind=text.kind,
        title=_text(state, text.title),
        paragraphs=protocol.paragraphs(text.body, language),
        button=_interface_texts(state).continue_ if text.button is None else _text(state, text.button),
        progress=_text_page_progress(state) if text.kind in {"instructions", "break"} else None,
        language=language,
        languages=state.languages,
        stays_until_s=state.stays_until_s,
        coming=None if (trial := _next_trial(state)) is None else _task_page(state, trial),
    )


def consent_hash(state: SessionState, text: PageText) -> str:
    """Return the SHA-256 of title and paragraphs as the participant read them: UTF-8, blank lines between them."""
    protocol, language = state.plan.protocol, state.plan.language
    shown = (_text(state, text.title), *protocol.paragraphs(text.body, language))
    return hashlib.sha256("\n\n".join(shown).encode()).hexdigest()


def _task_page(state: SessionState, trial: Trial) -> pages.TaskPage:
    protocol = state.plan.protocol
    return task_page(protocol, state.plan.language, trial, protocol.scene_for(_condition_of_ball(state, trial)).body)


def task_page(protocol: Protocol, language: str, trial: Trial, body: Body) -> pages.TaskPage:
    """Return the tank page of a trial in a session's own protocol, before anything is presented."""
    block = protocol.blocks[trial.block]
    task, questionnaire = protocol.tasks[block.task], protocol.questionnaire_of(block.id)
    is_adjusted = block.design is not None and protocol.design_of(block).adjusts
    follow_text = words(language).follow_target
    return pages.TaskPage(
        trial=trial.number,
        instruction=follow_text if task.instruction is None else protocol.text(task.instruction, language),
        task=task,
        workspace_m=protocol.device.workspace_m,
        body_radius_m=body.diameter_m / 2 / protocol.scene.scale,
        progress=_progress_in_block(protocol, trial, trial.label(protocol, language), trial.index),
        question=protocol.text(questionnaire.intro, language) if is_adjusted and questionnaire is not None else "",
    )


def _condition_of_ball(state: SessionState, trial: Trial) -> str:
    """Return the condition whose ball a trial draws."""
    protocol = state.plan.protocol
    has_design = protocol.blocks[trial.block].design is not None
    return protocol.conditions_in(trial.block)[0] if has_design else state.plan.condition(trial)


def _with_presentation(state: SessionState, page: pages.TaskPage) -> pages.TaskPage:
    """Return a task page with the visible properties of the trial or interval."""
    condition_id = _condition_of_ball(state, state.trial)
    if state.due is not None:
        condition_id = state.due.intervals[state.interval - 1].condition
    condition = state.plan.protocol.conditions[condition_id]
    has_overlay = condition.overlay == "shown"
    return replace(page, adjusts=state.adjusts, video=condition.shows_video, overlay=has_overlay)


def _interval(state: SessionState) -> pages.Interval | None:
    """Return the interval of the current trial; None without a design."""
    design, texts = state.design, _interface_texts(state)
    if design is None:
        return None
    number, resting = state.interval, state.phase is Phase.RESTING
    ordinal = texts.design_answers[ORDINALS[number - 1]]
    beginning = texts.interval_begins.format(ordinal=ordinal, of=design.intervals)
    announcement = texts.once_more if number == 1 and state.invalid else texts.interval_coming[number - 1]
    text = announcement if resting else beginning
    return pages.Interval(number, design.intervals, resting, text)


def _answer_page(state: SessionState) -> pages.Page:
    design = state.design if isinstance(state.step, Trial) else None
    if design is None or design.reply == "rating":
        return _questionnaire_page(state)
    view, progress = state.questions[0].view(1, state.context), _progress(state, state.trial)
    if isinstance(view, ChoiceView):
        return pages.ChoicePage(state.trial.number, view, progress)
    assert isinstance(view, NumberView)  # noqa: S101 - the only other reply
    if design.first is not None and state.trial.index == 1:
        texts = _interface_texts(state)
        modulus = f"{design.first.number:g}".replace(".", texts.decimal_sign)
        view = replace(view, text=texts.modulus.format(number=modulus))
    return pages.NumberPage(state.trial.number, view, progress)


def _questionnaire_page(state: SessionState) -> pages.QuestionnairePage:
    questionnaire, step = state.questionnaire, state.step
    trial = step if isinstance(step, Trial) else None
    form = step.form if isinstance(step, FormStep) else None
    label = (form or "").replace("_", " ").capitalize() if trial is None else _label(state, trial)
    page = _questions_page(state.plan.protocol, questionnaire, state.questions, state.context, label)
    return replace(
        page,
        trial=None if trial is None else trial.number,
        intro="" if trial is not None and state.design is not None else page.intro,
        progress=None if trial is None else _progress(state, trial),
        chosen=tuple((item, answer.value) for item, answer in state.answers.items() if answer.given),
        form=form,
        time=step.time if isinstance(step, FormStep) else 1,
    )


def _questions_page(
    protocol: Protocol, questionnaire: Questionnaire, questions: Sequence[Question], context: Context, label: str
) -> pages.QuestionnairePage:
    """Return a page of questions without answers, outside a session.

    ``questions`` are in the order shown; ``label`` is the page's title if the questionnaire has none.
    """
    statements = len(questionnaire.statements) == len(questionnaire.items)
    scale = protocol.scales[questionnaire.scale or ""] if statements else None
    off_scale = None if scale is None else scale.cannot_judge
    return pages.QuestionnairePage(
        trial=None,
        title=label if questionnaire.title is None else protocol.text(questionnaire.title, context.language),
        intro=protocol.text(questionnaire.intro, context.language),
        items=tuple(item.view(number, context) for number, item in enumerate(questions, 1)),
        labels=() if scale is None else scale.labels[context.language],
        cannot_judge=None if off_scale is None else protocol.text(off_scale, context.language),
        progress=None,
    )


def _label(state: SessionState, trial: Trial) -> str:
    return trial.label(state.plan.protocol, state.plan.language)


def _progress(state: SessionState, trial: Trial) -> pages.Progress:
    return _progress_in_block(state.plan.protocol, trial, _label(state, trial), trial.index)


def _text_page_progress(state: SessionState) -> pages.Progress | None:
    """Return the progress shown on a text page, or None outside the parts of the study.

    A page before the first trial of a part shows the progress of the next trial, a break that of the last one. A break
    among trials of intervals has a label, and is shown outside the parts, too.
    """
    steps, next_trial = state.plan.schedule.steps, _next_trial(state)
    last_trial = next((step for step in reversed(steps[: state.index]) if isinstance(step, Trial)), None)
    if last_trial is not None and (next_trial is None or state.plan.protocol.pages[state.page_id].kind == "break"):
        has_design = state.plan.protocol.blocks[last_trial.block].design is not None
        if has_design and next_trial is not None:
            return _progress_in_block(state.plan.protocol, last_trial, _label(state, last_trial), last_trial.index + 1)
        return (
            None
            if last_trial.part is None
            else _progress_in_block(state.plan.protocol, last_trial, "", last_trial.index + 1)
        )
    if next_trial is None or next_trial.part is None:
        return None
    return _progress_in_block(state.plan.protocol, next_trial, "", next_trial.index)


def _next_trial(state: SessionState) -> Trial | None:
    return next((step for step in state.plan.schedule.steps[state.index + 1 :] if isinstance(step, Trial)), None)


def _progress_in_block(protocol: Protocol, trial: Trial, label: str, index: int) -> pages.Progress:
    """Return the progress at trial ``index`` of a block; a block with a criterion may end early."""
    at_most = protocol.blocks[trial.block].until is not None
    return pages.Progress(part=trial.part, parts=protocol.parts, label=label, index=index, of=trial.of, at_most=at_most)


@dataclass(frozen=True, slots=True)
class Preview:
    """A previewed session with its protocol, which in a study with groups has the steps of the participant's group.

    ``codes`` is block → code → condition or track; levels are drawn from ``secret``.
    """

    protocol: Protocol = field(repr=False)
    schedule: Schedule
    codes: Mapping[str, Mapping[str, str]] = field(repr=False)
    secret: bytes = field(repr=False)


def preview(study: Protocol, seed: int = SEED, participant: str = PARTICIPANT) -> Preview:
    """Return the first session that a new study folder would have with this seed and participant.

    All its randomness, including the codes, follows from the seed; the number in the participant's id determines the
    row of a square.
    """
    draw = stream(seed, "blinding").random
    secret = draw_secret(draw)
    codes = draw_key(study, draw)
    group = group_of(study.shares, secret, 1) if study.randomises else next(iter(study.groups), None)
    protocol = study.for_session(group, 1)
    return Preview(protocol, build_schedule(protocol, participant, seed), codes, secret)


@dataclass(frozen=True, slots=True)
class Moment:
    """One page of a step: its kind and, for the tank of a trial with a design, the interval (from 1)."""

    kind: Kind
    interval: int = 1


def pages_of_step(shown: Preview, index: int) -> tuple[Moment, ...]:
    """Return the pages of a step, in the order in which a session shows them."""
    step = shown.schedule.steps[index]
    if isinstance(step, PageStep):
        return (Moment("text"),)
    if isinstance(step, FormStep):
        return (Moment("questions"),)
    state = _state(shown, index, shown.protocol.study.languages[0])
    design = state.design
    if design is None:
        return (Moment("tank"), *([Moment("questions")] if state.asks else []))
    sequence = [Moment("tank", number) for number in range(1, design.intervals + 1)]
    if state.asks and not design.adjusts:
        sequence.append(Moment("questions"))
        if design.has_correct_answer and design.shows_feedback(step.phase == "practice"):
            sequence.append(Moment("feedback"))
    return tuple(sequence)


def previewed_page(
    shown: Preview, index: int, moment: Moment, language: str, answers: Mapping[str, Value] | None = None
) -> pages.Page:
    """Return a page of a step (by its index in the schedule) as shown in a session, in one of the languages.

    Earlier ``answers`` (by item) that would not be accepted are left out.
    """
    if moment.kind == "feedback":
        return pages.FeedbackPage(right=True)
    state = replace(_state(shown, index, language), interval=moment.interval)
    if moment.kind == "tank":
        return build_page(replace(state, phase=Phase.TASK))
    if moment.kind == "text":
        page = build_page(replace(state, phase=Phase.READING))
        return replace(page, coming=None) if isinstance(page, pages.TextPage) else page
    questions = {question.id: question for question in state.questions}
    kept_answers = {
        item: Answer(onset_s=0.0, first_s=0.0, last_s=0.0, value=value)
        for item, value in (answers or {}).items()
        if item in questions and questions[item].problem(value, state.context) is None
    }
    return build_page(replace(state, phase=Phase.ANSWERING, answers=kept_answers))


def presented_condition(shown: Preview, index: int) -> str | None:
    """Return the condition of a trial; None for other steps and for trials that vary a number."""
    step = shown.schedule.steps[index]
    if not isinstance(step, Trial):
        return None
    return _condition_of_ball(_state(shown, index, shown.protocol.study.languages[0]), step)


def _state(shown: Preview, index: int, language: str) -> SessionState:
    plan = Plan(shown.protocol, shown.schedule, shown.codes, language, secret=shown.secret)
    return SessionState(plan=plan, index=index)
