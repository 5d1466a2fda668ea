"""The studies that the designer can open, and how they are described."""

from functools import cache, lru_cache
from pathlib import Path

from study_app.designer.document.document import Document
from study_app.designer.document.elements import study_title
from study_app.designer.document.study import read
from study_app.designer.new_study.new_study import taken_names, template
from study_app.designer.new_study.template_choices import (
    SHIPPED,
    TEMPLATES,
    TemplateChoice,
    copy_choice,
    copy_name,
    template_choice,
)
from study_app.designer.new_study.templates import templates
from study_app.designer.place.designer_view import HeaderState, StudyChoice, problems_chip
from study_app.designer.versions.version_rows import VersionChip
from study_app.errors import StudyError
from study_app.gui.home.study_facts import holds_liquids_alone, is_shipped, sources
from study_app.protocol.load import read_document
from study_app.protocol.source.files import find, shipped, shipped_file
from study_app.store.drafts import draft_of, drafted_files, unsaved_files
from study_app.store.study_settings import kept_original
from study_app.workspace import workspace


def studies(opened: Document | None) -> tuple[StudyChoice, ...]:
    """Return what can be opened: the open file, drafts that were never saved, recent files, names at hand.

    They are in the order of their titles; studies that ship with the program come last.
    """
    found = dict.fromkeys([*map(str, unsaved_files(workspace().protocols)), *sources()])
    own = "" if opened is None else source_of(opened.file)
    if opened is not None:
        found[own] = None
    drafted = {file.resolve() for file in drafted_files()}
    choices = []
    for source in found:
        file = _resolved(source)
        if Path(source).suffix == ".toml" and Path(source).exists() and holds_liquids_alone(source):
            continue
        title = _title(file, drafted=file in drafted) if opened is None or source != own else opened.title
        stem = Path(source).stem
        ships, original = is_shipped(source), "" if file is None else kept_original(file)
        choices.append(StudyChoice(title or stem, f"{stem}.toml", source, ships, file in drafted, original))
    return tuple(sorted(choices, key=lambda choice: (choice.shipped, choice.title.casefold(), choice.source)))


def _title(file: Path | None, *, drafted: bool) -> str:
    """Return the title of a study, of its draft where one is kept; "" where it has none or cannot be read."""
    if file is not None and drafted and (draft := draft_of(file)) is not None:
        return study_title(read(draft.text.encode(), file.parent).document)
    try:
        state = None if file is None else file.stat()
    except OSError:
        return ""
    return "" if file is None or state is None else _title_of_file(file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _title_of_file(file: Path, _changed_ns: int, _size: int) -> str:
    try:
        document, _places = read_document(file.read_bytes(), file.name)
    except (StudyError, OSError):
        return ""
    return study_title(document)


def header_state(
    opened: Document | None, choices: tuple[StudyChoice, ...], warnings: int, version: VersionChip
) -> HeaderState:
    """Return the header's state of the open study; ``warnings`` is how many it has."""
    if opened is None:
        return HeaderState(choices)
    draft = "Saved" if not opened.edited and opened.base else "Not saved yet"
    if opened.kept is not None and (opened.edited or not opened.base):
        draft = f"Draft kept {opened.kept:%H:%M}"
    return HeaderState(
        choices,
        source_of(opened.file),
        problems_chip(len(opened.study.faults), warnings),
        "" if opened.read_only else draft,
        opened.done[-1].words if opened.done else "",
        opened.undone[-1].words if opened.undone else "",
        not opened.read_only and (opened.edited or not opened.base),
        bool(opened.read_only),
        version,
    )


def source_of(file: Path) -> str:
    """Return what a study's file is opened by: its name at hand, else its path."""
    found = _file(file.stem)
    return file.stem if found is not None and found.resolve() == file.resolve() else str(file)


def new_choices(source: str = "") -> tuple[TemplateChoice, ...]:
    """Return what a new study can begin as: templates, the empty one last, then studies to copy.

    Raises StudyError if the study ``source`` cannot be read.
    """
    in_order = [name for name in TEMPLATES if name in templates()]
    choices = [_template_choice(name) for name in dict.fromkeys((*in_order, *templates()))]
    taken = taken_names()
    copied = dict.fromkeys([source, *shipped()] if source and not source.startswith("template:") else shipped())
    for name in copied:
        file = shipped_file(name) if name in shipped() else find(name)
        note = SHIPPED if name in shipped() else str(file.name)
        document, _places = read_document(file.read_bytes(), name)
        choices.append(copy_choice(name, document, note, copy_name(file.stem, taken)))
    return tuple(choices)


@cache
def _template_choice(name: str) -> TemplateChoice:
    return template_choice(name, template(name))


def _resolved(source: str) -> Path | None:
    file = Path(source) if Path(source).suffix == ".toml" else _file(source)
    return None if file is None else file.resolve()


def _file(source: str) -> Path | None:
    try:
        return find(source)
    except StudyError:
        return None
