"""What is played: the draft's bytes from a step on, if nothing from there to the end is faulty; and its sound part."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path as Folder
from typing import Any, Final

from study_app.designer.document.document import Document
from study_app.designer.document.names import named_at
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.designer.participant.shown_step import StepPosition, first_step, graph_of, reached, step_name, step_words
from study_app.errors import Problem, StudyError
from study_app.protocol.groups import numbered_parts
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import unbundled, with_liquid_files
from study_app.session.transitions.page_builder import Preview, preview
from study_app.store.study_versions import kept_content, kept_versions

MOST_EARLIER: Final = 5
"""So many kept versions are looked at for one without faults."""


def last_valid(opened: Document) -> Study | None:
    """Return the study as its file or the newest kept version of it has it, of those without faults."""
    earlier = (kept_content(version.hash) or b"" for version in reversed(kept_versions(opened.file)[-MOST_EARLIER:]))
    for text in (opened.saved.encode(), *(unbundled(content)[0] for content in earlier)):
        with suppress(Refused):
            study = read(text, opened.study.folder)
            if study.protocol is not None:
                return study
    return None


_STEPS: Final = ("pages", "blocks")
"""Sections whose tables must come in the sequence."""
_PARTS: Final = ("questionnaires", "tasks", "conditions", "liquids", "scales", "stimuli", "designs", "methods")


@dataclass(frozen=True, slots=True)
class Playable:
    """What is played."""

    source: bytes = field(repr=False)
    folder: Folder  # where its footage is
    protocol: Protocol = field(repr=False)
    step: int  # of the preview's schedule: the first that is shown
    words: str  # that step, as "Liquids, trial 3 of 6"
    position: StepPosition  # language and seed


class NotPlayableError(StudyError):
    """Faults from a step on, each as ``check`` prints it."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        self.problems = problems
        super().__init__("; ".join(map(str, problems)))


def playable(study: Study, path: Path, position: StepPosition | None = None) -> Playable:
    """Return what is played from a position on, or from the first step that shows an element.

    ``position``: where the preview is. Raises NotPlayableError if the study is faulty from there on.
    """
    position = position or StepPosition()
    if not study.is_toml:
        raise NotPlayableError(study.problems)
    language = position.language or next((str(one) for _, one in entries(study.document, "study.languages.*")), "")
    filled = _edited(study, tuple(_filled_texts(study, language)))
    found = filled
    if filled.protocol is None:
        found = _from_step(filled, path, position.name)
    if found.protocol is None:
        known = {(problem.place, problem.message): problem for problem in study.problems}
        own = tuple(one for problem in found.problems if (one := known.get((problem.place, problem.message))))
        raise NotPlayableError(own or found.problems)
    shown = preview(found.protocol, position.seed)
    step = _step_at(shown, position) if position.name else first_step(shown, path) or 0
    return Playable(
        with_liquid_files(found.text.encode(), found.folder),
        found.folder,
        found.protocol,
        step,
        step_words(shown, shown.schedule.steps[step], language),
        StepPosition(position.name, position.trial, language, position.seed),
    )


def _edited(study: Study, edits: tuple[Edit, ...]) -> Study:
    """Return a study after some edits; the same where one of them cannot be made."""
    try:
        return study.edited(*edits)[0] if edits else study
    except Refused:
        return study


def _filled_texts(study: Study, language: str) -> Iterator[Edit]:
    """Yield the edits that fill in the texts that languages lack that are not shown."""
    for fault in study.faults:
        text = value_at(study.document, fault.path)
        lacking = fault.missing_language
        if lacking and lacking != language and isinstance(text, Mapping) and text:
            yield Set((*fault.path, lacking), text.get(language) or next(iter(text.values())))
        elif fault.in_one_language and isinstance(text, str):
            languages = [str(one) for _, one in entries(study.document, "study.languages.*")]
            yield Set(fault.path, dict.fromkeys(languages, text))


def _from_step(study: Study, path: Path, name: str) -> Study:
    """Return a study that begins with the step of a name, or the first that shows an element, without earlier faults.

    Where sessions differ by group or number nothing is left out: another one may need it.
    """
    document, graph = study.document, graph_of(study.document)
    steps = [named_at(document, place) for place, _ in entries(document, "sequence.*")]
    if not steps or "groups" in document or "sequences" in document:
        return study
    shown = [frozenset[Path]() if step is None else reached(graph, [step]) for step in steps]
    looked_for = {(section, name) for section in (*_STEPS, "questionnaires")} if name else {path[:2]}
    first = next((at for at, found in enumerate(shown) if found & looked_for), 0)
    needed = frozenset[Path]().union(*shown[first:])
    faulty = {fault.path[:2] for fault in study.faults}
    tables = [table for section in _STEPS for table in _tables(document, section)]
    tables += [table for section in _PARTS for table in _tables(document, section) if table in faulty]
    edits: list[Edit] = [Unset(table) for table in tables if table not in needed]
    if "analysis" in document and any(table[0] == "analysis" for table in faulty):
        edits.append(Unset(("analysis",)))
    written = {table[1]: value_at(document, (*table, "part")) for table in _tables(document, "blocks")}
    parts = numbered_parts(
        [str(step[1]) for step in steps[first:] if step is not None],
        {str(block): part if isinstance(part, int) else None for block, part in written.items()},
    )
    edits += [Set(("blocks", block, "part"), part) for block, part in parts.items() if written[block] != part]
    return _edited(study, (Set(("sequence",), list(value_at(document, ("sequence",))[first:])), *edits))


def _tables(document: Mapping[str, Any], section: str) -> list[Path]:
    return [path for path, _ in entries(document, f"{section}.*")]


def _step_at(shown: Preview, position: StepPosition) -> int:
    """Return the index of the step at a position; the nearest trial of its block, or the first step."""
    steps = list(enumerate(shown.schedule.steps))
    named = [at for at, step in steps if step_name(step) == position.name]
    exact = [at for at in named if isinstance(step := steps[at][1], Trial) and step.index == position.trial]
    return next(iter([*exact, *named]), 0)
