"""Edits of whole elements: adding, copying, series, changes of kind, languages, order, repairs."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from study_app.designer.document.fields import (
    EXCLUSIONS,
    LETTER,
    Row,
    check_id,
    distinguishing_key,
    element_noun,
    initial_value,
    label_of,
    node_at,
    refused_at,
    row_at,
    rows,
    sections_at,
    table_of,
    violated_bound,
)
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Duplicate, Edit, Insert, Move, Rename, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.ids import MAX_ID, free_id
from study_app.number_text import MINUS, exact_text, number_of
from study_app.protocol.checks import TEXTS, check_paced, fitting_rules
from study_app.protocol.model import RULE_LIMITS, RULES
from study_app.protocol.participants import ASSIGNMENT
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.source import Fault, Path, entries, has, names, rule_of, shown_value, value_at
from study_app.protocol.warnings import untranslated_texts
from study_app.protocol.wording import LANGUAGES, language_name, languages_of


def edits_to_switch(study: Study, path: Path, kind: str | None) -> tuple[Edit, ...]:
    """Return the edits that change the kind of a table; None stands for the kind without the key.

    Keys that both kinds have keep their values, others are removed; keys that the new kind requires get an initial
    value.
    """
    key, tables = distinguishing_key(node_at(study.document, path))
    if not key or kind not in tables:
        raise Refused(f"the kind {kind!r} is not available here; choose one of these: {', '.join(map(str, tables))}")
    node = table_of((tables[kind],), {})
    if node is None:
        raise Refused(f"a table of kind {kind} cannot be added")
    value = value_at(study.document, path)
    table = value if isinstance(value, Mapping) else {}
    edits: list[Edit] = [Unset((*path, name)) for name in table if name != key and name not in node["properties"]]
    if kind is not None:
        edits.insert(0, Set((*path, key), kind))
    elif key in table:
        edits.insert(0, Unset((*path, key)))
    after, _ = study.with_edits(*edits)
    missing = [name for name in node.get("required", ()) if name not in {*table, key}]
    return (*edits, *(Set((*path, name), initial_value(after.document, (*path, name))) for name in missing))


def with_required_edits(study: Study, path: Path, *edits: Edit) -> tuple[Edit, ...]:
    """Return edits of a block's design, phase or order, or of an exclusion rule, with the edits that they require.

    An exclusion rule gets its usual limit. Keys that no longer belong to the block are removed. A block with a design
    is followed by its questionnaire, once, and its first condition becomes the standard unless the standard is among
    the conditions.
    """
    if path[:2] == EXCLUSIONS and path[-1] == "rule":
        return (*edits, *_limit_edits(study, path, edits))
    if path[:1] == ("blocks",) and path[2:] in (("phase",), ("order",)):
        return (*edits, *surplus_edits(study, path, edits))
    if path[:1] != ("blocks",) or path[2:3] != ("design",):
        return edits
    after = study.with_edits(*edits)[0].document
    block = value_at(after, path[:2])
    if not isinstance(block, Mapping):
        return edits
    required: list[Edit] = [Unset((*path[:2], key)) for key in refused_at(after, path[:2]) if key in block]
    sequence, questionnaire = value_at(after, ("sequence",)), block.get("questionnaire")
    if "design" in block:
        if (
            questionnaire is not None
            and isinstance(sequence, tuple)
            and path[1] in sequence
            and questionnaire not in sequence
        ):
            required.append(Insert(("sequence", sequence.index(path[1]) + 1), questionnaire))
        required += _standard_edits(block, path[:2])
    return (*edits, *required)


def surplus_edits(study: Study, path: Path, edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that remove the other keys of an element that are not permitted after an edit at ``path``."""
    removals: tuple[Edit, ...] = ()
    while surplus := [
        Unset(fault.path)
        for fault in study.with_edits(*edits, *removals)[0].faults
        if fault.kind == "surplus"
        and fault.path[:2] == path[:2]
        and fault.path != path
        and Unset(fault.path) not in removals
    ]:
        removals = (*removals, *surplus)
    return removals


def _limit_edits(study: Study, path: Path, edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that give an exclusion rule its usual limit, or remove the limit of a rule without one."""
    rule = value_at(study.with_edits(*edits)[0].document, path)
    limit_path = (*path[:-1], "limit")
    if (limit := RULE_LIMITS.get(str(rule))) is not None:
        return (Set(limit_path, limit.usual),)
    return () if value_at(study.document, limit_path) is None else (Unset(limit_path),)


def _standard_edits(block: Mapping[str, Any], path: Path) -> tuple[Edit, ...]:
    """Return the edit that makes the first of several conditions the standard, unless one of them already is."""
    conditions = block.get("conditions", ())
    needs_standard = isinstance(conditions, tuple) and len(conditions) > 1 and block.get("standard") not in conditions
    return (Set((*path, "standard"), conditions[0]),) if needs_standard else ()


def edits_to_add_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that add a language: plain texts become tables without a text in the new language."""
    codes = languages_of(study.document)
    if code in codes:
        raise Refused(f"the study already includes {language_name(code)}")
    if code not in LANGUAGES:
        raise Refused(f'the program does not support "{code}"; supported languages: {", ".join(LANGUAGES)}')
    tables = (Set(path, {codes[0]: text}) for path, text in localised_texts(study) if isinstance(text, str))
    return (Set(("study", "languages"), [*codes, code]), *tables, *_instrument_text_edits(study, (*codes, code)))


def _instrument_text_edits(study: Study, codes: tuple[str, ...]) -> Iterator[Edit]:
    """Yield the edits that copy the texts of standard questionnaires without one of the languages into the study."""
    for path, instrument in entries(study.document, "questionnaires.*.instrument"):
        if instrument in Instrument.names() and not {"intro", "items"} & value_at(study.document, path[:-1]).keys():
            table, scales = Instrument(instrument).tables_in(codes)
            yield from (
                Set((*path[:-1], key), toml_types(value)) for key, value in table.items() if key != "instrument"
            )
            known = names(study.document, "scales")
            yield from (Set(("scales", name), toml_types(scale)) for name, scale in scales.items() if name not in known)


def texts_to_write(study: Study) -> tuple[Path, ...]:
    """Return the paths of texts that are missing in a language of the study or not translated yet."""
    to_write = {fault.path for fault in study.faults if fault.kind == "no text"}
    to_write |= {text.path for text in untranslated_texts(study.document)}
    return tuple(path for path, _ in localised_texts(study) if path in to_write)


def edits_to_remove_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that remove a language and its texts."""
    codes = languages_of(study.document)
    if code not in codes or len(codes) == 1:
        raise Refused("a study needs at least one language")
    removals = (
        Unset((*path, code)) for path, text in localised_texts(study) if isinstance(text, Mapping) and code in text
    )
    return (*removals, Set(("study", "languages"), [other for other in codes if other != code]))


def edits_to_fill_in(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that copy the first language's texts to missing texts of a language."""
    first = languages_of(study.document)[0]
    edits: list[Edit] = []
    for path, text in localised_texts(study):
        if isinstance(text, Mapping) and code not in text and first in text:
            edits.append(Set((*path, code), (list(text[first]) if isinstance(text[first], tuple) else text[first])))
        elif isinstance(text, str):
            edits.append(Set(path, {first: text, code: text}))
    return tuple(edits)


def toml_types(value: Any) -> Any:
    """Return a value in types that TOML has: lists instead of tuples, and no keys with the value None."""
    if isinstance(value, Mapping):
        return {key: toml_types(part) for key, part in value.items() if part is not None}
    return [toml_types(part) for part in value] if isinstance(value, list | tuple) else value


def localised_texts(study: Study) -> Iterator[tuple[Path, Any]]:
    """Yield every localised text of a study with its path, including labels of scales."""
    for pattern in TEXTS:
        yield from entries(study.document, pattern)


def edits_to_move(study: Study, entry: Path, to: int) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that move an entry of a list before the entry ``to``, and its new path.

    ``to`` is an index before the move; the length of the list means its end. The parts of a session are renumbered if
    their numbers were correct before.
    """
    array, index = entry[:-1], int(entry[-1])
    to -= index < to
    moves = () if index == to else (Move(entry, to),)
    return (*moves, *_edits_to_renumber(study, array, moves)), (*array, to)


def _edits_to_renumber(study: Study, array: Path, moves: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that number the parts of the session 1, 2 … again."""
    if array != ("sequence",) or not moves or any(fault.path[2:] == ("part",) for fault in study.faults):
        return ()
    after, _ = study.with_edits(*moves)
    blocks: Any = after.document.get("blocks", {})
    edits: list[Edit] = []
    old = number = 0
    for name in after.document["sequence"]:
        part = blocks[name].get("part") if has(blocks, name) else None
        if not isinstance(part, int):
            continue
        number += part != old
        old = part
        if part != number:
            edits.append(Set(("blocks", name, "part"), number))
    return tuple(edits)


_MAX_SHORT_TEXT: Final = 40


def _initial_short_text(text: str) -> str:
    """Return the beginning of a question's text, which is its short text until that is edited."""
    return " ".join(text.split())[:_MAX_SHORT_TEXT].rstrip(" ?.!:")


def short_text_edits(study: Study, path: Path, language: str, text: str) -> tuple[Edit, ...]:
    """Return the edit that derives a question's short text from its typed text; none if it was edited separately.

    The short text of a copied question, which equals that of the original, is derived from the text again.
    """
    short_path = (*path[:-1], "short")
    before, short = value_at(study.document, path), value_at(study.document, short_path)
    if path[-1] != "text" or isinstance(before, Mapping) != isinstance(short, Mapping):
        return ()
    old_text, short_text = _text_in(before, language), _text_in(short, language)
    others = [value for _, value in entries(study.document, f"{path[0]}.{path[1]}.*.*.short")]
    is_copy = sum(_text_in(other, language) == short_text for other in others) > 1
    if old_text is None or short_text is None or not (is_copy or short_text == _initial_short_text(old_text)):
        return ()
    return (Set((*short_path, language) if isinstance(short, Mapping) else short_path, _initial_short_text(text)),)


def _text_in(value: Any, language: str) -> str | None:
    text = value.get(language) if isinstance(value, Mapping) else value
    return text if isinstance(text, str) else None


_HALVINGS: Final = 12
_GROUPS: Final[Path] = ("groups",)


@dataclass(frozen=True, slots=True)
class Repair:
    """A repair of a fault: the label of its button, and the edits that it makes as one step."""

    label: str
    edits: tuple[Edit, ...]


def repairs(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs that remove a fault without adding another one."""
    candidates = (*_level_repairs(study, fault), *_proposed_repairs(study, fault), *_repairs_by_kind(study, fault))
    return tuple(repair for repair in candidates if _removes_fault(study, fault, repair))


def _removes_fault(study: Study, fault: Fault, repair: Repair) -> bool:
    """Return whether a repair removes a fault and adds none."""
    try:
        after, _ = study.with_edits(*repair.edits)
    except Refused:
        return False
    known = {(problem.path, problem.message) for problem in study.faults}
    problems_after = {(problem.path, problem.message) for problem in after.faults}
    return (fault.path, fault.message) not in problems_after and len(problems_after) <= len(known)


def _proposed_repairs(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the repair that uses the value or key proposed by the fault; a wrong sign is only reversed."""
    if fault.use is None:
        return
    path, value = fault.use
    current = value_at(study.document, path)
    if fault.kind == "unknown key":
        yield Repair(f'Use "{value}"', (Rename(path, value),))
        return
    if (
        isinstance(current, int | float)
        and isinstance(value, int | float)
        and current < 0 < value
        and path == fault.path
    ):
        value = -current
    label = f"Use {shown_value(value)}"
    if path != fault.path:
        label = f"Move to {value:g} mm" if isinstance(path[-1], int) else f"Use {path[-1]} = {shown_value(value)}"
    yield Repair(label, (Set(path, value),))


def _repairs_by_kind(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the repairs that follow from the kind of a fault."""
    path, value = fault.path, value_at(study.document, fault.path)
    languages = value_at(study.document, ("study", "languages"))
    sequence = value_at(study.document, ("sequence",))
    if fault.kind == "missing" and path:
        with suppress(Refused):
            yield Repair("Add it", (Set(path, initial_value(study.document, path)),))
    elif fault.kind in {"surplus", "unknown key"}:
        if path in {ASSIGNMENT, _GROUPS}:
            yield _groups_repair(study)
        yield Repair("Remove", (Unset(path),))
    elif fault.kind == "other language":
        yield Repair("Remove this text", (Unset(path),))
    elif fault.kind == "not a number" and isinstance(value, str) and (number := number_of(value)) is not None:
        yield Repair(f"Change to the number {shown_value(number)}", (Set(path, number),))
    elif fault.kind == "one language" and isinstance(value, str) and languages:
        yield Repair("Use this text in every language", (Set(path, dict.fromkeys(languages, value)),))
    elif fault.kind == "not in sequence" and isinstance(sequence, tuple):
        yield Repair("Add to the session", (Insert(("sequence", max(len(sequence) - 1, 0)), path[-1]),))
    elif (missing_language := fault.missing_language) and fault.kind == "no text":
        first = languages_of(study.document)[0]
        yield Repair(
            f"Copy {language_name(first)} to {language_name(missing_language)}",
            edits_to_fill_in(study, missing_language),
        )
    elif missing_language and isinstance(value, Mapping) and value:
        first = next(iter(value))
        label = f"Copy {language_name(first)} to {language_name(missing_language)}"
        yield Repair(label, (Set((*path, missing_language), value[first]),))


def _groups_repair(study: Study) -> Repair:
    """Return the repair that adds groups until there are two."""
    known = names(study.document, "groups")
    group_ids = list(known)
    while len(group_ids) < 2:
        group_ids.append(free_id(group_ids, element_noun("groups")))
    edits = tuple(Set((*_GROUPS, name), {}) for name in group_ids[len(known) :])
    return Repair("Add another group" if known else "Add two groups", edits)


def _level_repairs(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the repair that lowers the highest level of a stimulus to the device's limits."""
    levels = value_at(study.document, fault.path)
    if fault.path[:1] != ("stimuli",) or fault.path[-1:] != ("levels",) or not isinstance(levels, tuple):
        return
    if len(levels) == 2 and all(isinstance(level, int | float) for level in levels):
        highest = _highest_level(study, fault, *levels)
        if highest is not None:
            lowered = _lowered_levels(study, str(fault.path[1]), highest)
            edits = (Set(("methods", name, "levels"), list(listed)) for name, listed in lowered.items())
            yield Repair(f"Highest level {shown_value(highest)}", (Set((*fault.path, 1), highest), *edits))


def _lowered_levels(study: Study, stimulus: str, highest: float) -> dict[str, tuple[float, ...]]:
    """Return the level lists of a stimulus' methods, capped at ``highest``; only lists with a level above it.

    A method that another stimulus also uses keeps its levels.
    """
    blocks = () if study.formed is None else study.formed.blocks.values()
    lowered_levels: dict[str, tuple[float, ...]] = {}
    for name in {str(block.method) for block in blocks if block.stimulus == stimulus}:
        levels = value_at(study.document, ("methods", name, "levels"))
        shared = any(block.method == name and block.stimulus != stimulus for block in blocks)
        if isinstance(levels, tuple) and not shared and any(level > highest for level in levels):
            lowered_levels[name] = tuple(dict.fromkeys(min(level, highest) for level in levels))
    return lowered_levels


def _highest_level(study: Study, fault: Fault, low: float, high: float) -> float | None:
    """Return the highest level at which the fault does not occur, rounded down to three or four digits.

    None if it already occurs just above ``low``.
    """
    formed = study.formed
    if formed is None:
        return None
    name = str(fault.path[1])

    def passes(level: float) -> bool:
        stimulus = formed.stimuli[name].model_copy(update={"levels": (low, level)})
        lowered = _lowered_levels(study, name, level).items()
        methods = {name: formed.methods[name].model_copy(update={"levels": levels}) for name, levels in lowered}
        changed = formed.model_copy(
            update={"stimuli": {**formed.stimuli, name: stimulus}, "methods": {**formed.methods, **methods}}
        )
        return not any(problem.path == fault.path for problem in check_paced(changed))

    valid_level, too_high_level = low, high
    for _ in range(_HALVINGS):
        middle = (valid_level + too_high_level) / 2
        valid_level, too_high_level = (middle, too_high_level) if passes(middle) else (valid_level, middle)
    for digits in (3, 4):
        step = 10.0 ** (int(f"{valid_level:e}".split("e")[1]) - digits + 1)
        rounded = round(step * int(valid_level / step + 1e-9), 12)
        if low < rounded and passes(rounded):
            return int(rounded) if rounded.is_integer() else rounded
    return None


_MAX_ROUNDS: Final = 12


def edits_to_add(
    study: Study, section: Path, *, name: str = "", behind: str | int | None = None
) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that add an element to a section or list as one step, and its path.

    ``name`` is the preferred name of a table; it is inserted after the table or entry ``behind``, or at the end.
    """
    row = row_at(study.document, section)
    if row is None or row.kind not in {"tables", "list"}:
        raise Refused(f"new elements cannot be added to {label_of(section[-1])}")
    is_list = row.kind == "list"
    value: dict[str, Any] = {}
    path: Path
    first: Edit
    if is_list:
        count = len(row.value or ())
        path = (*section, behind + 1 if isinstance(behind, int) and behind < count else count)
        entry = row_at(study.document, path)
        initial = initial_value(study.document, path) if entry is not None and entry.kind == "references" else value
        if section == EXCLUSIONS:
            value |= _new_exclusion(study)
        first = Insert(path, initial) if row.value else Set(section, [initial])
    else:
        path = (*section, free_id(names(study.document, str(section[0])), name or element_noun(section[-1])))
        first = Set(path, value, behind if isinstance(behind, str) else None)
    others: list[Edit] = []
    tried = {(fault.path, fault.message) for fault in study.faults}
    for _ in range(_MAX_ROUNDS):
        after, _splices = study.with_edits(first, *others)
        fault = next((problem for problem in after.faults if (problem.path, problem.message) not in tried), None)
        if fault is None:
            break
        tried.add((fault.path, fault.message))
        inner_path = fault.path[len(path) :] if fault.path[: len(path)] == path else ()
        if inner_path and value_at(after.document, fault.path) is None:
            missing_row = row_at(after.document, fault.path)
            if (
                missing_row is not None
                and missing_row.kind == "reference"
                and missing_row.sections
                and not missing_row.choices
            ):
                added_edits, added_path = edits_to_add(after, missing_row.sections[:1])
                others += added_edits
                _set_nested(value, inner_path, added_path[-1])
            else:
                _set_nested(value, inner_path, initial_value(after.document, fault.path))
        elif inner_path and fault.permitted:
            for permitted_value in fault.permitted:
                _set_nested(value, inner_path, permitted_value)
                if fault.path not in {problem.path for problem in study.with_edits(first, *others)[0].faults}:
                    break
        else:
            others += (edit for edit in _edits_outside(after, fault) if not _removes_path(edit, path))
    return (first, *others), path


def _new_exclusion(study: Study) -> dict[str, Any]:
    """Return an exclusion with the first applicable rule that the study does not have yet, and its usual limit."""
    known = {value for _, value in entries(study.document, "analysis.exclusions.*.rule")}
    fitting = tuple(RULES) if study.formed is None else fitting_rules(study.formed)
    rule = next((rule for rule in fitting if rule not in known), fitting[0])
    limit = RULE_LIMITS.get(rule)
    return {"rule": rule} if limit is None else {"rule": rule, "limit": limit.usual}


def _removes_path(edit: Edit, path: Path) -> bool:
    return isinstance(edit, Unset) and path[: len(edit.path)] == edit.path


def addition_repairs(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs of a reference to a missing element that add an element with its name."""
    name = value_at(study.document, fault.path)
    if fault.kind != "unknown name" or not isinstance(name, str):
        return ()
    additions: list[Repair] = []
    for section in sections_at(fault.path):
        with suppress(Refused):
            check_id(name)
            additions.append(
                Repair(f'Add {element_noun(section)} "{name}"', edits_to_add(study, (section,), name=name)[0])
            )
    return tuple(repair for repair in additions if _removes_fault(study, fault, repair))


def edits_to_duplicate(study: Study, path: Path, copy_name: str = "") -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element right after itself as one step, and the path of the copy.

    The copy is named ``copy_name``, or has the next free name. It has the next free code letter and the texts of the
    original, and is added to the session if required.
    """
    table = value_at(study.document, path)
    if not isinstance(table, Mapping):
        raise Refused(f"{label_of(path[-1])} cannot be copied")
    last = path[-1]
    name = table.get("id", last) if isinstance(last, int) else last
    if isinstance(last, int):
        pattern = ".".join((*map(str, path[:2]), "*", "*"))
        taken = [entry.get("id") for _, entry in entries(study.document, pattern) if isinstance(entry, Mapping)]
        copy: Path = (*path[:-1], last + 1)
        edits: list[Edit] = [Duplicate(path)]
        if isinstance(name, str):
            edits.append(Set((*copy, "id"), free_id(filter(None, taken), name)))
    else:
        copy = (*path[:-1], copy_name or free_id(names(study.document, str(path[0])), str(name)))
        edits = [Duplicate(path, str(copy[-1]))]
    return (*edits, *_edits_for_copy(study, study.with_edits(*edits)[0], copy)), copy


def _edits_for_copy(before: Study, after: Study, path: Path) -> tuple[Edit, ...]:
    """Return the additional edits that a copy needs: a free code letter and a step in the session."""
    edits: list[Edit] = []
    for row in rows(after.document, path):
        if row.value is not None and rule_of(LETTER) in row.bounds:
            letters = [letter for _, letter in entries(after.document, f"{path[0]}.*.{row.path[-1]}")]
            edits += [Set(row.path, initial_value(after.document, row.path))] if letters.count(row.value) > 1 else []
    after, _ = after.with_edits(*edits)
    for fault in after.faults:
        if fault.path == path and fault not in before.faults:
            edits += _edits_outside(after, fault)
    return tuple(edits)


def _edits_outside(study: Study, fault: Fault) -> tuple[Edit, ...]:
    """Return the edits elsewhere that a new element needs, such as a step in the session, or a scale."""
    if offered := repairs(study, fault):
        return offered[0].edits
    row = row_at(study.document, fault.path)
    if row is None or row.kind != "reference" or row.value is not None:
        return ()
    if row.choices:
        return (Set(row.path, row.choices[0].value),)
    edits, added = edits_to_add(study, row.sections[:1])
    return (*edits, Set(row.path, added[-1]))


def _set_nested(value: dict[str, Any], path: Path, inner: Any) -> None:
    for step in path[:-1]:
        value = value.setdefault(str(step), {})
    value[str(path[-1])] = inner


_MAX_COPIES: Final = 24
"""Greatest number of values of a series; code letters end at Z."""
_NUMBER_KINDS: Final = frozenset({"number", "whole number"})
"""Kinds of rows with one number."""
_MAX_DEPTH: Final = 2


def number_rows(document: Mapping[str, Any], path: Path) -> tuple[Row, ...]:
    """Return the numbers of an element that a series can vary, in the order of its form.

    Pages have none, since they differ only in their texts. For a block that compares conditions by a design, the
    numbers of its first condition are included; a copy that varies one of them has its own conditions.
    """
    section = row_at(document, path[:1])
    if len(path) != 2 or path[0] == "pages" or section is None or section.kind != "tables":
        return ()
    value = value_at(document, path)
    first_condition = _compared_conditions(value)[:1]
    tables = [table for table in (path, *first_condition) if isinstance(value_at(document, table), Mapping)]
    return tuple(row for table in tables for row in _number_rows(document, table, _MAX_DEPTH))


def _compared_conditions(block: Any) -> tuple[Path, ...]:
    """Return the paths of the conditions that a block compares by a design."""
    condition_ids = block.get("conditions") if isinstance(block, Mapping) and "design" in block else None
    return tuple(("conditions", name) for name in condition_ids) if isinstance(condition_ids, tuple) else ()


def _number_rows(document: Mapping[str, Any], path: Path, max_depth: int) -> Iterator[Row]:
    not_permitted = refused_at(document, path)
    inner_tables: list[Path] = []
    for row in rows(document, path):
        if row.kind == "table" and isinstance(row.value, Mapping) and max_depth > 1:
            inner_tables.append(row.path)
        elif row.kind in _NUMBER_KINDS and (row.value is not None or row.path[-1] not in not_permitted):
            is_number = isinstance(row.value, int | float) and not isinstance(row.value, bool)
            yield row if is_number else replace(row, value=None)
    for inner_table in inner_tables:
        yield from _number_rows(document, inner_table, max_depth - 1)


def number_row(document: Mapping[str, Any], path: Path, field: Path) -> Row:
    """Return the row of the number in which a series of copies differs.

    ``field`` may be a path in the element that was copied.
    """
    number = next((row for row in number_rows(document, path) if row.path[2:] == field[2:]), None)
    if number is None:
        raise Refused("choose one of this element's numeric fields")
    return number


def check_values(document: Mapping[str, Any], row: Row, values: Sequence[float]) -> None:
    """Raise Refused if a series of an element cannot have these values."""
    taken = [row.value]
    for value in values:
        if bound := violated_bound(document, row, value):
            raise Refused(f"{exact_text(value)} is not permitted: {row.label} must be {bound}")
        if value in taken:
            raise Refused(f"{exact_text(value)} is listed twice or is equal to the original value")
        taken.append(value)
    if not 0 < len(values) <= _MAX_COPIES:
        raise Refused(f"a series must contain 1 to {_MAX_COPIES} copies")


def edits_to_copy_with(study: Study, path: Path, row: Row, value: float) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element with another number, and the path of the copy.

    The number becomes part of the copy's ID and titles. If it is a number of a block's conditions, these are copied,
    too, and the title of the block is numbered instead, because results show it before unblinding.
    """
    if row.path[:2] != path:
        return _edits_to_copy_block(study, path, row, value)
    number_text = _number_in_id(value)
    stem = str(path[1]).removesuffix("" if row.value is None else f"_{_number_in_id(row.value)}")
    name = f"{stem[: MAX_ID - len(number_text) - 1]}_{number_text}"
    edits, copy = edits_to_duplicate(study, path, free_id(names(study.document, str(path[0])), name))
    titles = (Set((*copy, *place), text) for place, text in _titles_of_copy(study.document, path, row, value))
    return (*edits, Set((*copy, *row.path[2:]), value), *titles), copy


def _edits_to_copy_block(study: Study, path: Path, row: Row, value: float) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy a block and its conditions with another number, and the path of the copy."""
    edits, copy = edits_to_duplicate(study, path)
    block, condition_copies = value_at(study.document, path), dict[str, str]()
    number = 1 + sum(_compared_conditions(other) != () for other in study.document["blocks"].values())
    for place, text in _titles(study.document, path):
        edits = (*edits, Set((*copy, *place), f"{re.sub(r' [0-9]+$', '', text)} {number}"))
    for condition in dict.fromkeys(_compared_conditions(block)):
        after, _ = study.with_edits(*edits)
        condition_edits, condition_copy = edits_to_copy_with(
            after, condition, number_row(after.document, condition, row.path), value
        )
        edits, condition_copies[str(condition[1])] = (*edits, *condition_edits), str(condition_copy[1])
    edits = (*edits, Set((*copy, "conditions"), [condition_copies[name] for name in block["conditions"]]))
    return (
        *edits,
        *(
            Set((*copy, "standard"), condition_copies[name])
            for name in condition_copies
            if name == block.get("standard")
        ),
    ), copy


def _titles_of_copy(document: Mapping[str, Any], path: Path, row: Row, value: float) -> Iterator[tuple[Path, str]]:
    """Yield the titles of a copy: the new number replaces the one at their end, or is appended."""
    number = re.compile(rf"(?:(?<!\w)[-{MINUS}])?\d+(?:[.,]\d+)?(?=\s*(?:{re.escape(row.unit)})?\s*$)")
    for title_path, text in _titles(document, path):
        match = number.search(text)
        ends_with_number = match is not None and number_of(match[0]) == row.value
        new = number.sub(exact_text(value), text) if ends_with_number else f"{text}, {exact_text(value)} {row.unit}"
        yield title_path, new.rstrip()


def _titles(document: Mapping[str, Any], path: Path) -> Iterator[tuple[Path, str]]:
    """Yield the title of an element in each language, with its path within the element."""
    title = value_at(document, (*path, "title"))
    for language, text in title.items() if isinstance(title, Mapping) else (("", title),):
        if isinstance(text, str) and text.strip():
            yield ("title", *filter(None, [language])), text


def _number_in_id(value: float) -> str:
    """Return a number in the notation for IDs, such as "0_5" or "minus_60"."""
    return exact_text(value).replace("-", "minus_").replace(".", "_")[: MAX_ID // 2]
