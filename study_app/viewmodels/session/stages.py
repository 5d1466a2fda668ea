"""The rows of the operator's rail, one for each page or trial of a session, or for a long block. No Qt here."""

from dataclasses import dataclass

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import FormStep, PageStep, Schedule, Step, Trial

# A block of more trials than this is one row of the rail ("Delay settings 1 to 7"), so that a day's study fits it.
ROWS_PER_BLOCK = 4


@dataclass(frozen=True, slots=True)
class Stage:
    """One row of the rail: the schedule's steps ``first`` to ``last`` under one neutral ``label``."""

    label: str
    first: int
    last: int


def operator_language(protocol: Protocol) -> str:
    """Return the language in which the operator reads a study's own texts: English, or the study's first."""
    return "en" if "en" in protocol.study.languages else protocol.study.languages[0]


def stages(protocol: Protocol, schedule: Schedule) -> tuple[Stage, ...]:
    """Return the rows of the rail: pages and settings one by one, longer blocks as one row."""
    language = operator_language(protocol)
    rows: list[Stage] = []
    index = 0
    while index < len(schedule.steps):
        step = schedule.steps[index]
        if not isinstance(step, Trial):
            rows.append(Stage(step_title(protocol, step, language), index, index))
            index += 1
            continue
        last = index
        while last + 1 < len(schedule.steps) and _same_block(step, schedule.steps[last + 1]):
            last += 1
        rows.extend(_block_rows(protocol, schedule, index, last, language))
        index = last + 1
    return tuple(rows)


def step_title(protocol: Protocol, step: PageStep | FormStep, language: str) -> str:
    """Return the title of a page or form."""
    if isinstance(step, FormStep):
        return form_title(protocol, step.form, language)
    return protocol.text(protocol.pages[step.page_id].title, language)


def form_title(protocol: Protocol, form: str, language: str) -> str:
    """Return the title of a form, or its id as words."""
    title = protocol.questionnaires[form].title
    return form.replace("_", " ").capitalize() if title is None else protocol.text(title, language)


def _same_block(trial: Trial, other: Step) -> bool:
    return isinstance(other, Trial) and other.block == trial.block


def _block_rows(protocol: Protocol, schedule: Schedule, first: int, last: int, language: str) -> list[Stage]:
    trials = [step for step in schedule.steps[first : last + 1] if isinstance(step, Trial)]
    if len(trials) <= ROWS_PER_BLOCK:
        return [Stage(trial.label(protocol, language), first + i, first + i) for i, trial in enumerate(trials)]
    label = protocol.text(protocol.blocks[trials[0].block].setting_label, language)
    return [Stage(f"{label} {trials[0].index} to {trials[-1].index}", first, last)]
