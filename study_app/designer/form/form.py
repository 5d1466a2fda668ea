"""The form of one element of a study, made from its tables, faults and lines in the file."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from study_app.designer.document.additions import number_rows
from study_app.designer.document.elements import (
    FIRST,
    SEQUENCE,
    STUDY_LANGUAGES,
    distinct_title,
    element_of,
    kind_of,
    main_block_rows,
    place_text,
    position_of,
    short_note,
    title_of,
    unique_name,
    usage_text,
)
from study_app.designer.document.fields import (
    CONTRASTS,
    EXCLUSIONS,
    Choice,
    Row,
    key_order,
    kind_note,
    label_of,
    referenced_element,
    refused_at,
    row_at,
    rows,
    sections_of,
)
from study_app.designer.document.steps import (
    AddElement,
    AddEntry,
    AddNamed,
    AddToSession,
    Request,
    SetValue,
    index_of,
    shipped_liquids_to_add,
)
from study_app.designer.document.study import Study
from study_app.designer.form.card import EDITORS
from study_app.designer.form.rows import (
    NO_QUESTIONS,
    Entry,
    Form,
    FormRow,
    Section,
    new_element_label,
    question_lines,
    values_of,
)
from study_app.designer.measures.study_facts import copied_texts, texts_by_language, valid_part
from study_app.designer.outline import icon_of
from study_app.number_text import capitalised
from study_app.protocol.checks import fitting_rules
from study_app.protocol.model import RULE_LIMITS
from study_app.protocol.participants import ASSIGNMENT, sequences_in
from study_app.protocol.source import Fault, Path, Places, has, names, value_at
from study_app.protocol.warnings import untranslated_at
from study_app.protocol.wording import LANGUAGES, language_name, languages_of

_LIST_LABEL: Final = "In this order"
_MAX_DEPTH: Final = 3
"""Number of levels of nested tables in one form."""
KINDS: Final[Mapping[Path, str]] = {SEQUENCE: "Pages, blocks and questionnaires"}
_TO_FILL_IN: Final = "To be filled in"
"""The fault of a missing value in an unfinished entry."""
_UNREADABLE: Final = "Correct the text in the File tab"
_SECTIONS_WITH_LIQUIDS = ("liquids", "conditions", "blocks")
"""Sections whose elements can be opened in the lab."""


def form_of(study: Study, path: Path, to_write: tuple[Path, ...] = ()) -> Form:
    """Return the form of the element at ``path``; that of `STUDY_LANGUAGES` lists the texts ``to_write``."""
    if study.is_unreadable:
        lines = [f"Line {problem.line}: " if problem.line else "" for problem in study.problems]
        sentences = [_sentence(problem.message, problem.hint) for problem in study.problems]
        faults = tuple(map("".join, zip(lines, sentences, strict=True)))
        return Form(
            path=FIRST,
            title=title_of({}, FIRST),
            icon=icon_of(FIRST, {}),
            kind=_UNREADABLE,
            faults=faults,
            unreadable=True,
        )
    document, places = study.document, Places.of(study.text)
    if path == STUDY_LANGUAGES:
        return Form(
            path=path,
            title="Texts in every language" if to_write else "No texts are missing",
            icon="list",
            kind="Press Enter to go to the next missing text",
            sections=tuple(_text_sections(study, to_write, places)),
            around=tuple((place, title_of(document, place)) for place in (FIRST, path)),
            lists_texts=True,
        )
    own_row = row_at(document, path) if len(path) == 1 else None
    if own_row is not None and own_row.kind == "tables":
        own_row = replace(own_row, label=_LIST_LABEL)
        sections: tuple[Section, ...] = (Section(path, "", (_form_row(study, own_row, places),)),)
    else:
        sections = tuple(_sections(study, path, places, 0))
        main = path[:1] == ("blocks",) and value_at(document, (*path, "phase")) in (None, "main")
        if (path == SEQUENCE or main) and (block_rows := main_block_rows(document)):
            block_form_rows = tuple(_form_row(study, row, places) for row in block_rows)
            sections = (*sections, Section(path, "All main blocks", block_form_rows))
        if path[:1] == ("groups",) and (assignment := row_at(document, ASSIGNMENT)) is not None:
            sections = (Section(path, "", (_form_row(study, assignment, places),)), *sections)
    shown_paths = {row.path for section in sections for row in section.rows}
    shown_paths |= {section.path for section in sections if section.path != path}
    own_faults = [fault for fault in study.faults if fault.path[: len(path)] == path]
    own_faults = [
        fault
        for fault in own_faults
        if not any(fault.path[: len(path_shown)] == path_shown for path_shown in shown_paths)
    ]
    fault_sentences, is_unfinished = _fault_sentences(
        study, [fault for fault in own_faults if fault.path != (*path, "id")]
    )
    id_faults = tuple(_sentence(fault.message, fault.hint) for fault in own_faults if fault.path == (*path, "id"))
    value = value_at(document, path)
    name = value.get("id") if isinstance(value, Mapping) else None
    if name is None and len(path) == 2 and isinstance(value, Mapping):
        name = str(path[1])
    if name is None and id_faults:
        name = ""
    title = title_of(document, path)
    return Form(
        path=path,
        title=title,
        icon=icon_of(path, document),
        kind=kind_of(path) or KINDS.get(path, "File section"),
        id=None if name is None else str(name),
        sections=sections,
        faults=fault_sentences,
        unfinished=is_unfinished,
        id_faults=id_faults,
        position=position_of(document, path),
        questions=question_lines(study, path[:-1]) if path[2:3] == ("items",) else NO_QUESTIONS,
        around=tuple((path[:length], title_of(document, path[:length])) for length in (1, 2, 4) if length <= len(path)),
        feel=f"Feel {title}" if len(path) == 2 and path[0] in _SECTIONS_WITH_LIQUIDS else "",
        series=bool(number_rows(document, path)),
        used=usage_text(document, path),
        asks=tuple(_requests_to_add(document, path)),
    )


def _text_sections(study: Study, to_write: tuple[Path, ...], places: Places) -> Iterator[Section]:
    """Yield a section for each element with texts to write: elements in file order, texts in the order of the form."""
    document, by_element = study.document, dict[Path, list[Path]]()
    for path in to_write:
        if value_at(document, path) is not None:
            by_element.setdefault(element_of(study, path), []).append(path)
    for element in sorted(by_element, key=lambda path: places.line(path) or 0):
        order = key_order(document, element)
        paths = sorted(by_element[element], key=lambda path: order[str(path[len(element)])])
        element_rows = (row for path in paths if (row := row_at(document, path)) is not None)
        form_rows = tuple(_form_row(study, row, places) for row in element_rows)
        yield Section(STUDY_LANGUAGES, unique_name(document, element), form_rows)


def _requests_to_add(document: Mapping[str, Any], path: Path) -> Iterator[tuple[str, Request]]:
    """Yield label and request of each way to add a questionnaire to the session."""
    if len(path) != 2 or path[0] != "questionnaires":
        return
    steps = [
        ((*place, index), str(step)) for place, listed in sequences_in(document) for index, step in enumerate(listed)
    ]
    blocks = [step for step in steps if step[1] in names(document, "blocks")]
    main_blocks = [step for step in blocks if value_at(document, ("blocks", step[1], "phase")) in (None, "main")]
    taken = {place for place, step in steps if step == path[1]}
    taken |= set(_places_after(taken))  # a questionnaire cannot follow itself

    def step_requests(sentence: str, places: Iterable[Path]) -> Iterator[tuple[str, Request]]:
        free = tuple(place for place in places if place not in taken)
        if free:
            yield sentence, AddToSession(path, free)

    first_blocks = {place[:-1]: place for place, _ in reversed(blocks)}
    yield from step_requests("Before the first block\t(once)", first_blocks.values())
    for name in dict.fromkeys(step for _, step in blocks):
        title, block = distinct_title(document, ("blocks", name)), value_at(document, ("blocks", name))
        if isinstance(block, Mapping) and "design" not in block and (other := block.get("questionnaire")) != path[1]:
            instead = "" if other is None else f"; replaces {title_of(document, (path[0], str(other)))}"
            request = SetValue(("blocks", name, "questionnaire"), path[1])
            yield f"After each trial of {title}\t(about that trial{instead})", request
    block_ends = {
        name: _places_after(place for place, step in main_blocks if step == name)
        for name in dict.fromkeys(s for _, s in main_blocks)
    }
    for name, after in block_ends.items():
        yield from step_requests(f"After {distinct_title(document, ('blocks', name))}\t(once, about the block)", after)
    if len(block_ends) > 1:
        yield from step_requests(
            f"After each block\t({len(block_ends)} times, to compare the blocks)",
            _places_after(place for place, _ in main_blocks),
        )
    session_ends = {
        place[:-1]: place if step in names(document, "pages") else _places_after([place])[0] for place, step in steps
    }
    yield from step_requests("At the end\t(once, about the session)", session_ends.values())


def _places_after(places: Iterable[Path]) -> tuple[Path, ...]:
    return tuple((*place[:-1], index_of(place) + 1) for place in places)


def _sections(study: Study, path: Path, places: Places, depth: int) -> Iterator[Section]:
    array_row = row_at(study.document, path) if len(path) == 1 else None
    if array_row is not None and array_row.kind not in {"table", "tables"}:
        yield Section(path, "", (_form_row(study, array_row, places),))
        return
    shown: list[FormRow] = []
    absent: list[Row] = []
    inner_tables: list[Path] = []
    table_rows, not_permitted = rows(study.document, path), refused_at(study.document, path)
    rows_by_key = {row.path[-1]: row for row in table_rows}
    for row in table_rows:
        faulty = any(fault.path[: len(row.path)] == row.path for fault in study.faults)
        if row.kind == "table" and row.value is not None and depth < _MAX_DEPTH and isinstance(row.value, Mapping):
            inner_tables.append(row.path)
        elif (
            row.kind == "tables"
            and _facts_function(row) is None
            and depth < _MAX_DEPTH
            and len(row.path) > 1
            and isinstance(row.value, Mapping)
            and not any(isinstance(value, Mapping) for value in row.value.values())
        ):
            shown += [
                _form_row(study, replace(inner, label=f"{row.label}, {inner.label}"), places)
                for key in row.value
                if (inner := row_at(study.document, (*row.path, key))) is not None
            ]
        elif row.instead and not _is_given(rows_by_key[row.instead]) and (_is_given(row) or faulty):
            alternative_keys = tuple(
                (str(key), alternative.label)
                for key, alternative in rows_by_key.items()
                if key in {row.path[-1], row.instead}
            )
            shown.append(replace(_form_row(study, row, places), keys=alternative_keys))
        elif (row.value is None and not faulty and row.path[-1] in not_permitted) or (
            row.instead and _is_given(rows_by_key[row.instead]) and not _is_given(row)
        ):
            continue
        elif (
            row.value is None
            and not (row.required or faulty or row.path == CONTRASTS)
            and (row.kind == "table" or (row.default in (None, [], {}) and row.kind not in {"kind", "switch"}))
        ):
            absent.append(row)
        elif row.path[-1] != "id" or len(path) < 3:
            shown.append(_form_row(study, row, places))
    title = "" if depth == 0 else label_of(path[-1])
    shown_paths = {row.path for row in shown}
    own_faults = [
        fault
        for fault in study.faults
        if depth
        and fault.path[: len(path)] == path
        and not any(fault.path[: len(path)] == path for path in shown_paths)
        and not any(fault.path[: len(path)] == path for path in inner_tables)
    ]
    faults, is_unfinished = _fault_sentences(study, own_faults)
    rest_section = (title, tuple(row.path[-1] for row in (*shown, *absent)))
    for heading, keys in (*sections_of(study.document, path), rest_section):
        section_rows = tuple(row for key in keys for row in shown if row.path[len(path)] == key)
        missing = tuple(row for key in keys for row in absent if row.path[-1] == key)
        shown = [row for row in shown if row not in section_rows]
        absent = [row for row in absent if row not in missing]
        if section_rows or missing:
            yield Section(path, heading, section_rows, missing, faults, is_unfinished)
            faults = ()
    for table in inner_tables:
        yield from _sections(study, table, places, depth + 1)


def _is_given(row: Row) -> bool:
    return row.value not in (None, ())


def _form_row(study: Study, row: Row, places: Places) -> FormRow:
    document, path = study.document, row.path
    if path[:2] == EXCLUSIONS:
        row = _exclusion_row(study, row)
    own_faults = [fault for fault in study.faults if fault.path[: len(path)] == path and fault.kind != "no text"]
    faults, is_unfinished = _fault_sentences(study, own_faults)  # an empty field already shows that its text is missing
    faulty_languages = (
        ()
        if any(fault.path == path for fault in own_faults)
        else tuple(str(fault.path[len(path)]) for fault in own_faults)
    )
    if path == STUDY_LANGUAGES:
        row = replace(row, choices=tuple(Choice(code, language_name(code)) for code in LANGUAGES))
    codes, is_text = languages_of(document), row.kind in {"localised", "paragraphs"}
    is_judged = is_text and not study.is_in_entry(path)
    number = None
    if row.kind == "either":
        number = next((index for index, alternative in enumerate(row.either) if _fits_kind(alternative, row.value)), 0)
    return FormRow(
        **values_of(row),
        place=place_text(path, places.line(path)),
        faults=faults,
        unfinished=is_unfinished,
        faulty_languages=faulty_languages if is_text else (),
        languages=tuple((code, language_name(code)) for code in codes) if is_text else (),
        untranslated=tuple(untranslated_at(document, row.path, row.value, codes)) if is_judged else (),
        entries=tuple(_entries(study, row)),
        target=referenced_element(document, path) if row.kind == "reference" and isinstance(row.value, str) else None,
        notes=tuple(_reference_notes(document, row)),
        additions=tuple(_additions(study, row)),
        number=number,
        facts=facts(study, row) if (facts := _facts_function(row)) is not None else None,
    )  # fmt: skip


def _exclusion_row(study: Study, row: Row) -> Row:
    """Return a row of an exclusion with the rules that can apply to the study, or with the unit of the limit."""
    limit = RULE_LIMITS.get(str(value_at(study.document, (*row.path[:-1], "rule"))))
    if row.path[-1] == "limit" and limit is not None:
        return replace(row, unit=limit.unit, bounds=(f"{limit.least:g} to {limit.most:g}",))
    protocol = valid_part(study).protocol
    if row.path[-1] != "rule" or protocol is None:
        return row
    fitting = (row.value, *fitting_rules(protocol))
    return replace(row, choices=tuple(choice for choice in row.choices if choice.value in fitting))


def _reference_notes(document: Mapping[str, Any], row: Row) -> Iterator[tuple[str, str]]:
    if row.kind == "reference":
        for choice in row.choices:
            facts = (short_note(document, (section, str(choice.value))) for section in row.sections)
            yield str(choice.value), next(filter(None, facts), "") or kind_note(row.path, str(choice.value))


def _additions(study: Study, row: Row) -> Iterator[tuple[str, Request]]:
    """Yield label and request of each addition: a liquid, a reference, or an element together with a reference."""
    repeats = row.path[0] == "sequences" or row.path[-1] == "sequence"
    for name in (str(choice.value) for choice in row.choices if row.kind == "references"):
        if repeats or name not in (row.value or ()):
            yield _label_to_add(study.document, row, name), AddEntry(row.path, name)
    for section in row.sections:
        yield new_element_label(section), AddNamed(row.path, section)
    if row.path == ("liquids",):
        yield new_element_label("liquids"), AddElement(row.path)
        yield from ((request.label, request) for request in shipped_liquids_to_add(study))
    elif (row.kind == "reference" and row.sections == ("liquids",)) or row.path[::2] == ("blocks", "conditions"):
        yield from ((request.label, request) for request in shipped_liquids_to_add(study, row.path))


def _label_to_add(document: Mapping[str, Any], row: Row, name: str) -> str:
    """Return the title of an element that a list can refer to, with its kind if there are several kinds."""
    sections = (*row.sections, "liquids")  # without conditions, each liquid is a condition
    path = next(((section, name) for section in sections if has(document.get(section), name)), None)
    if path is None:
        return name
    return unique_name(document, path) if len(row.sections) > 1 else distinct_title(document, path)


def _entries(study: Study, row: Row) -> Iterator[Entry]:
    if row.path == STUDY_LANGUAGES:
        counts, copied = texts_by_language(study), copied_texts(study)
        for index, code in enumerate(row.value if isinstance(row.value, tuple) else ()):
            (present, required), untranslated = counts.get(str(code), (0, 0)), copied.get(str(code), 0)
            note = f"{present - untranslated} of {required} texts" + (
                f", {untranslated} to translate" if untranslated else ""
            )
            target: Path = STUDY_LANGUAGES if present - untranslated < required else ()
            yield Entry((*row.path, index), language_name(str(code)), note, required - present, target)
    if row.kind in {"list", "tables", "references"} and isinstance(row.value, tuple | Mapping):
        keys = row.value if isinstance(row.value, Mapping) else range(len(row.value))
        for key in keys:
            path = (*row.path, key)
            faults = sum(fault.path[: len(path)] == path for fault in study.shown_faults)
            if row.kind == "references":
                target_element = referenced_element(study.document, path)
                title = str(row.value[key]) if target_element is None else title_of(study.document, target_element)
                note = "" if target_element is None or isinstance(target_element[-1], int) else target_element[-1]
                yield Entry(path, title, note, faults, target_element or ())
            else:
                inner = value_at(study.document, path)
                note = inner.get("id", "") if isinstance(inner, Mapping) else ""
                yield Entry(path, title_of(study.document, path), str(note), faults, path)


def _fits_kind(row: Row, value: Any) -> bool:
    """Return whether a value is of the kind that a row edits."""
    if row.kind in {"number", "whole number"}:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(value, tuple):
        return row.kind in {"numbers", "vector", "points", "texts", "choices", "references", "list"}
    if isinstance(value, Mapping):
        return row.kind in {"table", "tables", "localised"}
    return row.kind not in {"numbers", "vector", "points", "texts", "choices", "references", "list", "table", "tables"}


def _fault_sentences(study: Study, faults: Sequence[Fault]) -> tuple[tuple[str, ...], bool]:
    """Return the sentences on faults, and whether all of them are in unfinished entries.

    Faults in unfinished entries are omitted if there are others.
    """
    shown = [fault for fault in faults if not study.is_unfinished(fault)]
    sentences = tuple(
        _TO_FILL_IN if fault.kind == "missing" and not shown else _sentence(fault.message, fault.hint)
        for fault in shown or faults
    )
    return sentences, bool(faults) and not shown


def _sentence(message: str, hint: str) -> str:
    sentence = capitalised(message)
    return f"{sentence} ({hint})" if hint else sentence


def _facts_function(row: Row) -> Callable[[Study, Row], Any] | None:
    special = EDITORS.get((row.model, str(row.path[-1])))
    return None if special is None else special.facts
