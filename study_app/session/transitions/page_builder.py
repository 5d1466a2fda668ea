"""Pages made of a session's state: the protocol's texts and the interface's words, in the participant's language."""

from __future__ import annotations

from study_app.protocol.orders.schedule import Trial
from study_app.protocol.wording.languages import Words, words
from study_app.session.pages import (
    EndPage,
    ItemView,
    Page,
    PausePage,
    Progress,
    QuestionnairePage,
    TaskPage,
    TextPage,
    TroublePage,
)
from study_app.session.transitions.state import Phase, SessionState


def page(state: SessionState) -> Page:
    """Return what the participant sees in any phase but the one before the first page."""
    match state.phase:
        case Phase.TASK:
            return _task_page(state, state.trial)
        case Phase.ANSWERING:
            return _questionnaire_page(state)
        case Phase.PAUSED:
            paused = _task_page(state, state.step) if isinstance(state.step, Trial) else None
            return PausePage(force_off=state.force_off, held=state.held, coming=paused)
        case Phase.TROUBLE:
            return TroublePage(_words(state).trouble_title, _words(state).trouble_body)
        case Phase.COMPLETE:
            return EndPage(_words(state).end_title, _words(state).end_body)
        case Phase.ENDED:
            return EndPage(_words(state).ended_early_title, _words(state).ended_early_body)
        case _:
            return _text_page(state)


def _words(state: SessionState) -> Words:
    return words(state.plan.language)


def _text(state: SessionState, value: str | dict[str, str]) -> str:
    return state.plan.protocol.text(value, state.plan.language)


def _text_page(state: SessionState) -> TextPage:
    protocol, language = state.plan.protocol, state.plan.language
    text = protocol.pages[state.page_id]
    return TextPage(
        id=state.page_id,
        kind=text.kind,
        title=_text(state, text.title),
        paragraphs=protocol.paragraphs(text.body, language),
        button=_words(state).continue_ if text.button is None else _text(state, text.button),
        progress=_progress_between(state) if text.kind in {"instructions", "break"} else None,
        language=language,
        languages=state.languages,
        stays_until_s=state.stays_until_s,
        coming=None if (trial := _coming(state)) is None else _task_page(state, trial),
    )


def _task_page(state: SessionState, trial: Trial) -> TaskPage:
    protocol = state.plan.protocol
    task = protocol.tasks[protocol.blocks[trial.block].task]
    return TaskPage(
        trial=trial.number,
        instruction=_text(state, task.instruction),
        task=task,
        workspace_m=protocol.device.workspace_m,
        body_radius_m=protocol.scene_for(state.plan.condition(trial)).body.diameter_m / 2 / protocol.scene.scale,
        progress=_progress(state, trial),
    )


def _questionnaire_page(state: SessionState) -> QuestionnairePage:
    protocol, language, trial = state.plan.protocol, state.plan.language, state.trial
    questionnaire = state.questionnaire
    scale = protocol.scales[questionnaire.scale]
    items = [questionnaire.item(item) for item in trial.items]
    label = trial.label(protocol, language)
    return QuestionnairePage(
        trial=trial.number,
        title=label if questionnaire.title is None else _text(state, questionnaire.title),
        intro=_text(state, questionnaire.intro),
        items=tuple(
            ItemView(item.id, number, _text(state, item.text), item.required) for number, item in enumerate(items, 1)
        ),
        labels=scale.labels[language],
        cannot_judge=None if scale.cannot_judge is None else _text(state, scale.cannot_judge),
        progress=_progress(state, trial),
        chosen=tuple((item, answer.value) for item, answer in state.answers.items() if answer.given),
    )


def _progress(state: SessionState, trial: Trial) -> Progress:
    """Return where a trial is among its block's."""
    return _among(state, trial, trial.label(state.plan.protocol, state.plan.language), trial.index)


def _progress_between(state: SessionState) -> Progress | None:
    """Return where a page to read is: before the first trial of its part, or after so many; None outside the parts."""
    steps, coming = state.plan.schedule.steps, _coming(state)
    done = next((step for step in reversed(steps[: state.index]) if isinstance(step, Trial)), None)
    if done is not None and (coming is None or state.plan.protocol.pages[state.page_id].kind == "break"):
        return None if done.part is None else _among(state, done, "", done.index + 1)
    if coming is None or coming.part is None:
        return None
    return _among(state, coming, "", coming.index)


def _coming(state: SessionState) -> Trial | None:
    """Return the next trial after the present step."""
    return next((step for step in state.plan.schedule.steps[state.index + 1 :] if isinstance(step, Trial)), None)


def _among(state: SessionState, trial: Trial, label: str, index: int) -> Progress:
    return Progress(part=trial.part, parts=state.plan.protocol.parts, label=label, index=index, of=trial.of)
