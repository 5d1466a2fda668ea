"""New studies: a copy of a template or of another study, with a name of its own."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from study_app.designer.document.changes import filled_in, with_language, without_language
from study_app.designer.document.names import languages_of
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Set
from study_app.designer.document.toml_text import Refused
from study_app.designer.new_study.templates import FOLDER, templates
from study_app.ids import MAX_SHORT_NAME, free_short_name, short_name_of
from study_app.protocol.source.document import Path as Place
from study_app.protocol.source.files import shipped
from study_app.protocol.source.problems import did_you_mean
from study_app.store.drafts import unsaved_files
from study_app.store.study_versions import save
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True)
class Answers:
    """What a new study begins with; what is left out stays as it is in the template.

    Texts of languages that the template lacks are missing. Where it lacks all of them, the first one has the texts of
    the template's first language.
    """

    title: str = ""
    languages: tuple[str, ...] = ()
    values: tuple[tuple[Place, Any], ...] = ()  # answers to the template's own questions


NO_ANSWERS: Final = Answers()
FIRST_VERSION: Final = "0.1"
_NAME: Final = re.compile(rf"[a-z][a-z0-9]{{0,{MAX_SHORT_NAME - 1}}}")
_SELF: Final = "liquid-study check NAME"


def template(name: str) -> Study:
    """Return a template.

    Raises Refused if there is none of this name.
    """
    if name not in templates():
        raise Refused(f'there is no template "{name}": {did_you_mean(name, templates())}')
    return read((FOLDER / f"{name}.toml").read_bytes())


def copy_of(study: Study, name: str) -> Study:
    """Return a copy of a study under another name, comments included, as version 0.1.

    Raises Refused if the name is not permitted, or the study cannot be read.
    """
    _check_name(name)
    named = Study(study.text.replace(_SELF, f"liquid-study check {name}"), study.folder)
    return named.edited(Set(("study", "name"), name), Set(("study", "version"), FIRST_VERSION))[0]


def answered(study: Study, answers: Answers) -> Study:
    """Return a study with the answers to the questions that it begins with.

    Raises Refused if an answer is not permitted.
    """
    for place, value in answers.values:
        study, _ = study.edited(Set(place, value))
        fault = next((one for one in study.faults if one.path[: len(place)] == place), None)
        if fault is not None:
            raise Refused(f"{fault.message}{f' ({fault.hint})' if fault.hint else ''}")
    if answers.title:
        head = study.document["study"]
        by_language = isinstance(head, Mapping) and isinstance(head.get("title"), Mapping)
        place = ("study", "title", languages_of(study.document)[0]) if by_language else ("study", "title")
        study, _ = study.edited(Set(place, answers.title))
    there = languages_of(study.document)
    for code in answers.languages:
        if code not in there:
            study, _ = study.edited(*with_language(study, code))
    if answers.languages and set(there).isdisjoint(answers.languages):  # no text would be left
        study, _ = study.edited(*filled_in(study, answers.languages[0]))
    for code in there:
        if answers.languages and code not in answers.languages:
            study, _ = study.edited(*without_language(study, code))
    return study


def check_free(name: str) -> Path:
    """Return the file of a new study in the workspace's protocols.

    Raises Refused if the name is not permitted, or taken.
    """
    _check_name(name)
    file = workspace().protocols / f"{name}.toml"
    if file.exists():
        raise _refused(f"{file} is already there", name)
    return file


def write_new(study: Study, name: str) -> Path:
    """Write a copy of a study into the workspace's protocols and return its file.

    Raises Refused if the name is not permitted, or taken; StoreError if it cannot be written.
    """
    file = check_free(name)
    save(file, copy_of(study, name).text, "")
    return file


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        rule = f"write at most {MAX_SHORT_NAME} small letters and digits, a letter first"
        raise _refused(f'"{name}" is not a short name: {rule}', name)
    if name in shipped():
        raise _refused(f'"{name}" is a study that ships with the program', name)


def taken_names() -> set[str]:
    """Return the short names of studies: those that ship, and those of the workspace, saved or not."""
    folder = workspace().protocols
    return {*shipped(), *(file.stem for file in (*folder.glob("*.toml"), *unsaved_files(folder)))}


def _refused(why: str, name: str) -> Refused:
    free = free_short_name(taken_names(), short_name_of(name) or "study")
    return Refused(f'{why}; "{free}" is free', free)
