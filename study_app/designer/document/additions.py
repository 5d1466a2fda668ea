"""Edits of whole elements: new ones, copies, series, other kinds, languages, order, repairs."""

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
    key, named = distinguishing_key(node_at(study.document, path))
    if not key or kind not in named:
        raise Refused(f"the kind {kind!r} is not available here; choose one of these: {', '.join(map(str, named))}")
    node = table_of((named[kind],), {})
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
    needed = [name for name in node.get("required", ()) if name not in {*table, key}]
    return (*edits, *(Set((*path, name), initial_value(after.document, (*path, name))) for name in needed))


def edits_that_follow(study: Study, path: Path, *edits: Edit) -> tuple[Edit, ...]:
    """Return edits of a block's design, phase or order, or of an exclusion rule, and those they require.

    A rule gets its usual limit. Keys that no longer belong to the block are removed; a questionnaire comes after the
    block, once; with a design, the first condition becomes the standard unless the standard is among the conditions.
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
    others: list[Edit] = [Unset((*path[:2], key)) for key in refused_at(after, path[:2]) if key in block]
    sequence, form = value_at(after, ("sequence",)), block.get("questionnaire")
    if "design" in block:
        if form is not None and isinstance(sequence, tuple) and path[1] in sequence and form not in sequence:
            others.append(Insert(("sequence", sequence.index(path[1]) + 1), form))
        others += _standard_edits(block, path[:2])
    return (*edits, *others)


def surplus_edits(study: Study, path: Path, edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that remove an element's other keys which do not belong to it after an edit at ``path``."""
    gone: tuple[Edit, ...] = ()
    while surplus := [
        Unset(fault.path)
        for fault in study.with_edits(*edits, *gone)[0].faults
        if fault.kind == "surplus"
        and fault.path[:2] == path[:2]
        and fault.path != path
        and Unset(fault.path) not in gone
    ]:
        gone = (*gone, *surplus)
    return gone


def _limit_edits(study: Study, path: Path, edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that give an exclusion rule its usual limit, or remove the limit of a rule without one."""
    rule = value_at(study.with_edits(*edits)[0].document, path)
    place = (*path[:-1], "limit")
    if (limit := RULE_LIMITS.get(str(rule))) is not None:
        return (Set(place, limit.usual),)
    return () if value_at(study.document, place) is None else (Unset(place),)


def _standard_edits(block: Mapping[str, Any], path: Path) -> tuple[Edit, ...]:
    """Return the edit that makes the first of several conditions the standard, unless one of them is."""
    conditions = block.get("conditions", ())
    is_edited = isinstance(conditions, tuple) and len(conditions) > 1 and block.get("standard") not in conditions
    return (Set((*path, "standard"), conditions[0]),) if is_edited else ()


def with_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that add a language: plain texts become tables, whose new texts are missing."""
    codes = languages_of(study.document)
    if code in codes:
        raise Refused(f"the study already includes {language_name(code)}")
    if code not in LANGUAGES:
        raise Refused(f'the program does not support "{code}"; supported languages: {", ".join(LANGUAGES)}')
    tables = (Set(path, {codes[0]: text}) for path, text in texts_of(study) if isinstance(text, str))
    return (Set(("study", "languages"), [*codes, code]), *tables, *_instrument_texts(study, (*codes, code)))


def _instrument_texts(study: Study, codes: tuple[str, ...]) -> Iterator[Edit]:
    """Yield the edits that write the texts of standard questionnaires that lack a language into the study."""
    for path, of in entries(study.document, "questionnaires.*.instrument"):
        if of in Instrument.names() and not {"intro", "items"} & value_at(study.document, path[:-1]).keys():
            table, scales = Instrument(of).tables_in(codes)
            yield from (
                Set((*path[:-1], key), as_written(value)) for key, value in table.items() if key != "instrument"
            )
            known = names(study.document, "scales")
            yield from (Set(("scales", name), as_written(scale)) for name, scale in scales.items() if name not in known)


def texts_to_write(study: Study) -> tuple[Path, ...]:
    """Return the places of texts that some language of the study lacks, or that are not translated yet."""
    lacking = {fault.path for fault in study.faults if fault.kind == "no text"}
    lacking |= {text.path for text in untranslated_texts(study.document)}
    return tuple(path for path, _ in texts_of(study) if path in lacking)


def without_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that remove a language and its texts."""
    codes = languages_of(study.document)
    if code not in codes or len(codes) == 1:
        raise Refused("a study needs at least one language")
    gone = (Unset((*path, code)) for path, text in texts_of(study) if isinstance(text, Mapping) and code in text)
    return (*gone, Set(("study", "languages"), [other for other in codes if other != code]))


def edits_to_fill_in(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that copy the first language's texts to missing texts of a language."""
    first = languages_of(study.document)[0]
    edits: list[Edit] = []
    for path, text in texts_of(study):
        if isinstance(text, Mapping) and code not in text and first in text:
            edits.append(Set((*path, code), (list(text[first]) if isinstance(text[first], tuple) else text[first])))
        elif isinstance(text, str):
            edits.append(Set(path, {first: text, code: text}))
    return tuple(edits)


def as_written(value: Any) -> Any:
    """Return a value as TOML writes it: lists instead of tuples, and no omitted keys."""
    if isinstance(value, Mapping):
        return {key: as_written(part) for key, part in value.items() if part is not None}
    return [as_written(part) for part in value] if isinstance(value, list | tuple) else value


def texts_of(study: Study) -> Iterator[tuple[Path, Any]]:
    """Yield every localised text of a study with its place, including labels of scales."""
    for pattern in TEXTS:
        yield from entries(study.document, pattern)


def edits_to_move(study: Study, entry: Path, to: int) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that move an entry of a list before the entry ``to``, and its new path.

    ``to`` is an index before the move; the length of the list means its end. Parts of the study are renumbered if they
    were numbered correctly before.
    """
    place, index = entry[:-1], int(entry[-1])
    to -= index < to
    moves = () if index == to else (Move(entry, to),)
    return (*moves, *_edits_to_renumber(study, place, moves)), (*place, to)


def _edits_to_renumber(study: Study, place: Path, moves: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that number the parts of the session 1, 2 … again."""
    if place != ("sequence",) or not moves or any(fault.path[2:] == ("part",) for fault in study.faults):
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


_LONGEST: Final = 40


def _initial_short_text(text: str) -> str:
    """Return the initial short text of a question: the beginning of its text."""
    return " ".join(text.split())[:_LONGEST].rstrip(" ?.!:")


def short_text_edits(study: Study, path: Path, language: str, text: str) -> tuple[Edit, ...]:
    """Return the edit of a question's short text when its text is typed; none if it was edited separately.

    The short text of a copy, which repeats another one, also follows the text.
    """
    place = (*path[:-1], "short")
    before, short = value_at(study.document, path), value_at(study.document, place)
    if path[-1] != "text" or isinstance(before, Mapping) != isinstance(short, Mapping):
        return ()
    old, own = _text_in(before, language), _text_in(short, language)
    others = [value for _, value in entries(study.document, f"{path[0]}.{path[1]}.*.*.short")]
    is_copy = sum(_text_in(other, language) == own for other in others) > 1
    if old is None or own is None or not (is_copy or own == _initial_short_text(old)):
        return ()
    return (Set((*place, language) if isinstance(short, Mapping) else place, _initial_short_text(text)),)


def _text_in(value: Any, language: str) -> str | None:
    text = value.get(language) if isinstance(value, Mapping) else value
    return text if isinstance(text, str) else None


_HALVINGS: Final = 12
_GROUPS: Final[Path] = ("groups",)


@dataclass(frozen=True, slots=True)
class Repair:
    """A repair: the text of its button, and the edits that it makes as one step."""

    words: str
    edits: tuple[Edit, ...]


def repairs(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs for a fault, each of which removes it."""
    offered = (*_level_repairs(study, fault), *_stated_repairs(study, fault), *_repairs_by_kind(study, fault))
    return tuple(repair for repair in offered if _removes_fault(study, fault, repair))


def _removes_fault(study: Study, fault: Fault, repair: Repair) -> bool:
    """Return whether a repair removes a fault and adds none."""
    try:
        after, _ = study.with_edits(*repair.edits)
    except Refused:
        return False
    known = {(problem.path, problem.message) for problem in study.faults}
    problems_after = {(problem.path, problem.message) for problem in after.faults}
    return (fault.path, fault.message) not in problems_after and len(problems_after) <= len(known)


def _stated_repairs(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the value or key that the fault proposes; for a wrong sign, the number without it."""
    if fault.use is None:
        return
    path, value = fault.use
    now = value_at(study.document, path)
    if fault.kind == "unknown key":
        yield Repair(f'Use "{value}"', (Rename(path, value),))
        return
    if isinstance(now, int | float) and isinstance(value, int | float) and now < 0 < value and path == fault.path:
        value = -now
    sentence = f"Use {shown_value(value)}"
    if path != fault.path:
        sentence = f"Move to {value:g} mm" if isinstance(path[-1], int) else f"Use {path[-1]} = {shown_value(value)}"
    yield Repair(sentence, (Set(path, value),))


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
    elif (lacking := fault.missing_language) and fault.kind == "no text":
        first = languages_of(study.document)[0]
        yield Repair(f"Copy {language_name(first)} to {language_name(lacking)}", edits_to_fill_in(study, lacking))
    elif lacking and isinstance(value, Mapping) and value:
        first = next(iter(value))
        sentence = f"Copy {language_name(first)} to {language_name(lacking)}"
        yield Repair(sentence, (Set((*path, lacking), value[first]),))


def _groups_repair(study: Study) -> Repair:
    """Return the repair that adds groups until there are two."""
    known = names(study.document, "groups")
    taken = list(known)
    while len(taken) < 2:
        taken.append(free_id(taken, element_noun("groups")))
    edits = tuple(Set((*_GROUPS, name), {}) for name in taken[len(known) :])
    return Repair("Add another group" if known else "Add two groups", edits)


def _level_repairs(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the highest level within the limit."""
    levels = value_at(study.document, fault.path)
    if fault.path[:1] != ("stimuli",) or fault.path[-1:] != ("levels",) or not isinstance(levels, tuple):
        return
    if len(levels) == 2 and all(isinstance(level, int | float) for level in levels):
        highest = _highest_level(study, fault, *levels)
        if highest is not None:
            lowered = _lowered_levels(study, str(fault.path[1]), highest)
            edits = (Set(("methods", name, "levels"), list(own)) for name, own in lowered.items())
            yield Repair(f"Highest level {shown_value(highest)}", (Set((*fault.path, 1), highest), *edits))


def _lowered_levels(study: Study, stimulus: str, highest: float) -> dict[str, tuple[float, ...]]:
    """Return the listed levels of a stimulus' methods, capped at the highest one, if any exceeds it.

    A method that another stimulus also uses keeps its levels.
    """
    blocks = () if study.formed is None else study.formed.blocks.values()
    lowered_levels: dict[str, tuple[float, ...]] = {}
    for name in {str(block.method) for block in blocks if block.stimulus == stimulus}:
        own = value_at(study.document, ("methods", name, "levels"))
        shared = any(block.method == name and block.stimulus != stimulus for block in blocks)
        if isinstance(own, tuple) and not shared and any(level > highest for level in own):
            lowered_levels[name] = tuple(dict.fromkeys(min(level, highest) for level in own))
    return lowered_levels


def _highest_level(study: Study, fault: Fault, low: float, high: float) -> float | None:
    """Return the highest level without this kind of fault, with three digits; None if ``low`` already has it."""
    formed = study.formed
    if formed is None:
        return None
    name = str(fault.path[1])

    def passes(level: float) -> bool:
        stimulus = formed.stimuli[name].model_copy(update={"levels": (low, level)})
        lowered = _lowered_levels(study, name, level).items()
        methods = {name: formed.methods[name].model_copy(update={"levels": own}) for name, own in lowered}
        changed = formed.model_copy(
            update={"stimuli": {**formed.stimuli, name: stimulus}, "methods": {**formed.methods, **methods}}
        )
        return not any(problem.path == fault.path for problem in check_paced(changed))

    least, most = low, high
    for _ in range(_HALVINGS):
        middle = (least + most) / 2
        least, most = (middle, most) if passes(middle) else (least, middle)
    for digits in (3, 4):
        step = 10.0 ** (int(f"{least:e}".split("e")[1]) - digits + 1)
        rounded = round(step * int(least / step + 1e-9), 12)
        if low < rounded and passes(rounded):
            return int(rounded) if rounded.is_integer() else rounded
    return None


_ROUNDS: Final = 12


def edits_to_add(
    study: Study, section: Path, *, name: str = "", behind: str | int | None = None
) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that add an element to a section or list as one step, and its path.

    ``name`` is the preferred name of a table; it is inserted after the table or entry ``behind``, or at the end.
    """
    row = row_at(study.document, section)
    if row is None or row.kind not in {"tables", "list"}:
        raise Refused(f"new elements cannot be added to {label_of(section[-1])}")
    several = row.kind == "list"
    value: dict[str, Any] = {}
    path: Path
    first: Edit
    if several:
        count = len(row.value or ())
        path = (*section, behind + 1 if isinstance(behind, int) and behind < count else count)
        entry = row_at(study.document, path)
        made = initial_value(study.document, path) if entry is not None and entry.kind == "references" else value
        if section == EXCLUSIONS:
            value |= _usual_rule(study)
        first = Insert(path, made) if row.value else Set(section, [made])
    else:
        path = (*section, free_id(names(study.document, str(section[0])), name or element_noun(section[-1])))
        first = Set(path, value, behind if isinstance(behind, str) else None)
    others: list[Edit] = []
    tried = {(fault.path, fault.message) for fault in study.faults}
    for _ in range(_ROUNDS):
        after, _splices = study.with_edits(first, *others)
        fault = next((problem for problem in after.faults if (problem.path, problem.message) not in tried), None)
        if fault is None:
            break
        tried.add((fault.path, fault.message))
        inner = fault.path[len(path) :] if fault.path[: len(path)] == path else ()
        if inner and value_at(after.document, fault.path) is None:
            asked = row_at(after.document, fault.path)
            if asked is not None and asked.kind == "reference" and asked.sections and not asked.choices:
                named, made = edits_to_add(after, asked.sections[:1])
                others += named
                _set_nested(value, inner, made[-1])
            else:
                _set_nested(value, inner, initial_value(after.document, fault.path))
        elif inner and fault.permitted:
            for word in fault.permitted:
                _set_nested(value, inner, word)
                if fault.path not in {problem.path for problem in study.with_edits(first, *others)[0].faults}:
                    break
        else:
            others += (edit for edit in _edits_outside(after, fault) if not _unsets(edit, path))
    return (first, *others), path


def _usual_rule(study: Study) -> dict[str, Any]:
    """Return the first exclusion rule that applies to the study and is not in it yet, with its usual limit."""
    known = {value for _, value in entries(study.document, "analysis.exclusions.*.rule")}
    fitting = tuple(RULES) if study.formed is None else fitting_rules(study.formed)
    rule = next((rule for rule in fitting if rule not in known), fitting[0])
    limit = RULE_LIMITS.get(rule)
    return {"rule": rule} if limit is None else {"rule": rule, "limit": limit.usual}


def _unsets(edit: Edit, path: Path) -> bool:
    return isinstance(edit, Unset) and path[: len(edit.path)] == edit.path


def additions_for(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs for a reference to a missing element: each adds an element with that name."""
    name = value_at(study.document, fault.path)
    if fault.kind != "unknown name" or not isinstance(name, str):
        return ()
    repairs: list[Repair] = []
    for section in sections_at(fault.path):
        with suppress(Refused):
            check_id(name)
            repairs.append(
                Repair(f'Add {element_noun(section)} "{name}"', edits_to_add(study, (section,), name=name)[0])
            )
    return tuple(repair for repair in repairs if _removes_fault(study, fault, repair))


def edits_to_duplicate(study: Study, path: Path, wanted: str = "") -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element right after itself as one step, and the path of the copy.

    The copy gets the name ``wanted``, or the next free one, the next free code letter, and a place in the session if it
    needs one. Its texts are those of the original.
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
        copy = (*path[:-1], wanted or free_id(names(study.document, str(path[0])), str(name)))
        edits = [Duplicate(path, str(copy[-1]))]
    return (*edits, *_edits_to_fit(study, study.with_edits(*edits)[0], copy)), copy


def _edits_to_fit(before: Study, after: Study, path: Path) -> tuple[Edit, ...]:
    """Return the additional edits that a copy needs: a free code letter and a place in the session."""
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
    """Return the edits elsewhere that a new element needs, such as its place in the session, or a scale."""
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


_MOST: Final = 24
"""Greatest number of values of a series; code letters end at Z."""
_NUMBERS: Final = frozenset({"number", "whole number"})
"""Kinds of rows with one number."""
_DEEPEST: Final = 2


def number_rows(document: Mapping[str, Any], path: Path) -> tuple[Row, ...]:
    """Return the numbers of an element that a series can vary, in the order of its form.

    Pages differ only in their texts, so they have none. A block that compares conditions by a design also has those of
    its first condition: its copy then has its own conditions.
    """
    section = row_at(document, path[:1])
    if len(path) != 2 or path[0] == "pages" or section is None or section.kind != "tables":
        return ()
    value = value_at(document, path)
    compared = _compared_conditions(value)[:1]
    varied = [table for table in (path, *compared) if isinstance(value_at(document, table), Mapping)]
    return tuple(row for table in varied for row in _number_rows(document, table, _DEEPEST))


def _compared_conditions(block: Any) -> tuple[Path, ...]:
    """Return the paths of the conditions that a block compares by a design."""
    names_in_block = block.get("conditions") if isinstance(block, Mapping) and "design" in block else None
    return tuple(("conditions", name) for name in names_in_block) if isinstance(names_in_block, tuple) else ()


def _number_rows(document: Mapping[str, Any], path: Path, deepest: int) -> Iterator[Row]:
    refused = refused_at(document, path)
    below: list[Path] = []
    for row in rows(document, path):
        if row.kind == "table" and isinstance(row.value, Mapping) and deepest > 1:
            below.append(row.path)
        elif row.kind in _NUMBERS and (row.value is not None or row.path[-1] not in refused):
            known = isinstance(row.value, int | float) and not isinstance(row.value, bool)
            yield row if known else replace(row, value=None)
    for inner in below:
        yield from _number_rows(document, inner, deepest - 1)


def number_row(document: Mapping[str, Any], path: Path, field: Path) -> Row:
    """Return the number that a series varies, ``field`` in the element or in one of which it is a copy."""
    number = next((row for row in number_rows(document, path) if row.path[2:] == field[2:]), None)
    if number is None:
        raise Refused("choose one of this element's numeric fields")
    return number


def check_values(document: Mapping[str, Any], row: Row, values: Sequence[float]) -> None:
    """Reject values that copies of an element cannot have."""
    known = [row.value]
    for value in values:
        if why := violated_bound(document, row, value):
            raise Refused(f"{exact_text(value)} is not permitted: {row.label} must be {why}")
        if value in known:
            raise Refused(f"{exact_text(value)} is listed twice or is equal to the original value")
        known.append(value)
    if not 0 < len(values) <= _MOST:
        raise Refused(f"a series must contain 1 to {_MOST} copies")


def edits_to_copy_with(study: Study, path: Path, row: Row, value: float) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element with another number, and the path of the copy.

    The number is a part of the copy's ID and titles. If it is a number of a block's conditions, these are copied, too,
    and the title of the block is numbered, because results show it before unblinding.
    """
    if row.path[:2] != path:
        return _edits_to_copy_block(study, path, row, value)
    word = _number_in_id(value)
    stem = str(path[1]).removesuffix("" if row.value is None else f"_{_number_in_id(row.value)}")
    name = f"{stem[: MAX_ID - len(word) - 1]}_{word}"
    edits, copy = edits_to_duplicate(study, path, free_id(names(study.document, str(path[0])), name))
    titles = (Set((*copy, *place), text) for place, text in _titles_of_copy(study.document, path, row, value))
    return (*edits, Set((*copy, *row.path[2:]), value), *titles), copy


def _edits_to_copy_block(study: Study, path: Path, row: Row, value: float) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy a block and its conditions with another number, and the path of the copy."""
    edits, copy = edits_to_duplicate(study, path)
    block, own = value_at(study.document, path), dict[str, str]()
    number = 1 + sum(_compared_conditions(other) != () for other in study.document["blocks"].values())
    for place, text in _titles(study.document, path):
        edits = (*edits, Set((*copy, *place), f"{re.sub(r' [0-9]+$', '', text)} {number}"))
    for condition in dict.fromkeys(_compared_conditions(block)):
        after, _ = study.with_edits(*edits)
        made, own_path = edits_to_copy_with(after, condition, number_row(after.document, condition, row.path), value)
        edits, own[str(condition[1])] = (*edits, *made), str(own_path[1])
    edits = (*edits, Set((*copy, "conditions"), [own[name] for name in block["conditions"]]))
    return (*edits, *(Set((*copy, "standard"), own[name]) for name in own if name == block.get("standard"))), copy


def _titles_of_copy(document: Mapping[str, Any], path: Path, row: Row, value: float) -> Iterator[tuple[Path, str]]:
    """Yield the titles of a copy: the number at their end is replaced, or the new number is added."""
    number = re.compile(rf"(?:(?<!\w)[-{MINUS}])?\d+(?:[.,]\d+)?(?=\s*(?:{re.escape(row.unit)})?\s*$)")
    for place, text in _titles(document, path):
        last = number.search(text)
        replaces = last is not None and number_of(last[0]) == row.value
        new = number.sub(exact_text(value), text) if replaces else f"{text}, {exact_text(value)} {row.unit}"
        yield place, new.rstrip()


def _titles(document: Mapping[str, Any], path: Path) -> Iterator[tuple[Path, str]]:
    """Yield the title of an element in each language, with its place in the element."""
    title = value_at(document, (*path, "title"))
    for language, text in title.items() if isinstance(title, Mapping) else (("", title),):
        if isinstance(text, str) and text.strip():
            yield ("title", *filter(None, [language])), text


def _number_in_id(value: float) -> str:
    """Return a number as a part of an id: "0_5", "minus_60"."""
    return exact_text(value).replace("-", "minus_").replace(".", "_")[: MAX_ID // 2]
