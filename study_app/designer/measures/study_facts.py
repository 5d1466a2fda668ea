"""Facts on a study, even a faulty one: its texts by language, its valid part, and numbers of that."""

from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import Any, Final

from study_app.designer.document.additions import localised_texts
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import alternatives, initial_value, is_localised, label_of, referenced_element
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Set, Unset, intended_document
from study_app.designer.document.toml_text import Refused
from study_app.haptics.model.slope_limits import HAND_MPS, steady_force
from study_app.protocol.file_format import schema
from study_app.protocol.load import validate_document
from study_app.protocol.model import Protocol
from study_app.protocol.orders import duration_range_s, expected_duration_s, orders_of, variants
from study_app.protocol.source import Fault, Path, frozen, has, value_at
from study_app.protocol.warnings import describe_untranslated, untranslated_texts, warnings
from study_app.protocol.wording import languages_of
from study_app.store.verification import Telltales
from study_app.store.workstation import device_without_force

_PLANNED: Final = ("analysis", "participants")
PARTICIPANTS: Final = 12
"""Participants of a study without `analysis.participants`."""
_MIN_WORD_LETTERS: Final = 3
"""Minimum number of letters of an ID, with which it does not occur in a text by chance."""
READ_SECTIONS: Final = ("pages", "blocks", "tasks", "designs")
"""Sections whose texts are read before the last answer; statements, which all see alike, may name conditions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Revealing:
    """A text that reveals a condition: path, title of the element, label of the key, and the revealing word."""

    path: Path
    element: str
    key: str
    word: str


def texts_by_language(study: Study) -> dict[str, tuple[int, int]]:
    """Return the numbers of existing and required texts of each language."""
    languages = languages_of(study.document)
    counts = {code: [0, 0] for code in languages}
    missing = {(fault.path, fault.missing_language) for fault in study.faults if fault.kind == "no text"}
    for path, value in localised_texts(study):
        is_instrument = value_at(study.document, (*path[:2], "instrument")) is not None
        for position, code in enumerate(languages):
            counts[code][1] += 1
            text = value.get(code) if isinstance(value, Mapping) else value if position == 0 else ""
            is_in_program = is_instrument and (path, code) not in missing
            counts[code][0] += is_in_program or bool(text.strip() if isinstance(text, str) else text)
    return {code: (present, required) for code, (present, required) in counts.items()}


def missing_texts(study: Study) -> dict[str, int]:
    """Return the number of missing texts of each language that has some."""
    return {
        code: required - present for code, (present, required) in texts_by_language(study).items() if present < required
    }


def copied_texts(study: Study) -> dict[str, int]:
    """Return the number of untranslated texts of each language that has some."""
    return dict(Counter(text.language for text in untranslated_texts(study.document)))


def _translation_warnings(study: Study) -> tuple[str, ...]:
    """Return a warning for each language with untranslated texts."""
    return tuple(describe_untranslated(study.document, lists_places=False))


def revealing_texts(study: Study, protocol: Protocol) -> tuple[Revealing, ...]:
    """Return the texts that contain the name of a liquid or condition, or a delay, that participants must not know."""
    telltales = Telltales(_telltale_words(protocol))
    debriefs = {name for name, page in protocol.pages.items() if page.kind == "debrief"}
    revealing = []
    for path, value in localised_texts(study):
        if path[0] not in READ_SECTIONS or (path[0] == "pages" and path[1] in debriefs):
            continue
        texts = value.values() if isinstance(value, Mapping) else (value,)
        words = [word for text in texts if isinstance(text, str) for word in telltales.in_text(text.casefold())]
        if words:
            element = title_of(study.document, path[:2])
            revealing.append(Revealing(path=path, element=element, key=label_of(path[-1]), word=words[0]))
    return tuple(revealing)


def _telltale_words(protocol: Protocol) -> set[str]:
    """Return the names of the conditions and liquids that main blocks compare, and their delays with units."""
    telltales: set[str] = set()
    for block in protocol.main_blocks:
        names = protocol.conditions_in(block.id)
        if len(names) < 2 and block.stimulus is None:
            continue
        for name in names:
            condition = protocol.conditions[name]
            ids = {name, *condition.liquid_ids}
            telltales |= {name.replace("_", " ").casefold() for name in ids if len(name) >= _MIN_WORD_LETTERS}
            if condition.delay_ms:
                telltales.add(f"{condition.delay_ms:g} ms")
    return telltales


@cache
def text_keys() -> frozenset[str]:
    """Return the keys of localised texts in all models of the file format."""
    models = [schema(), *schema()["$defs"].values()]
    properties = (pair for model in models for pair in model.get("properties", {}).items())
    return frozenset(key for key, node in properties if is_localised(tuple(alternatives(node))))


_MAX_ROUNDS: Final = 8
"""Greatest number of repeated validations, because omitting an element may break others that refer to it."""
TEXT: Final = "…"
_SUBSTITUTES: Final = {
    ("study", "version"): "1", ("study", "name"): "study", ("study", "title"): TEXT,
    ("device", "workspace_mm"): (1000, 1000, 1000),
}  # fmt: skip
_OPTIONAL_TABLES: Final = (("analysis",), ("limits",))
"""Tables without which a session can run."""
_FORCE_TABLES: Final = (("device",), ("scene",))
"""Tables on which every force depends, but no sum over the session."""
_TABLES_WITHOUT_SUMS: Final = (*_OPTIONAL_TABLES, *_FORCE_TABLES)
_MARK: Final = "\u034f"
"""The combining grapheme joiner, an invisible character that makes equal texts different."""


@dataclass(frozen=True, slots=True)
class ValidPart:
    """The protocol of a study without its faulty elements; None if a fault affects everything.

    ``is_complete`` means that no element was omitted, so that sums over the session are valid; ``forces`` means that no
    value of device and scene was omitted, so that forces are valid.
    """

    protocol: Protocol | None
    is_complete: bool
    forces: bool = True


@lru_cache(maxsize=2)
def valid_part(study: Study) -> ValidPart:
    """Return the part of a study that has no faults."""
    return restored_part(study, {})


def restored_part(study: Study, before: Mapping[str, Any]) -> ValidPart:
    """Return the valid part of a study; faulty values are replaced by those of the document ``before``, if any."""
    if study.formed is not None or not (study.is_toml or before):
        return ValidPart(study.formed, is_complete=study.formed is not None)
    document: Any = study.document
    faults: list[Fault] = list(study.faults) if study.is_toml else validate_document(document)[1]
    is_complete = forces = True
    for number in range(_MAX_ROUNDS):
        for fault in sorted(faults, key=_sort_key, reverse=True):
            changed_path, value = _restoring_change(document, fault, before) or _repairing_change(
                document, fault, after_omissions=number > 0
            )
            keeps_element = value is not None or fault.kind == "unknown key" or changed_path[:1] in _TABLES_WITHOUT_SUMS
            if not changed_path:
                changed_path, value = fault.path[:2], _initial_value(document, fault.path[:2])
                if value is None:
                    return ValidPart(None, is_complete=False)
            if value_at(document, changed_path) is None and value is None:
                continue  # another fault of the same element already removed it
            is_complete = is_complete and keeps_element
            forces = forces and (fault.kind == "unknown key" or fault.path[:1] not in _FORCE_TABLES)
            edit = Unset(changed_path) if value is None else Set(changed_path, value)
            with suppress(Refused):  # its table was removed
                document = frozen(intended_document(document, edit))
        protocol, faults = validate_document(document)
        if protocol is not None:
            return ValidPart(protocol, is_complete, forces)
    return ValidPart(None, is_complete=False)


def _restoring_change(document: Any, fault: Fault, before: Mapping[str, Any]) -> tuple[Path, Any] | None:
    """Return the path to change because of a fault, and its earlier value; None if there is none."""
    if not before or fault.missing_language:
        return None
    path, value = fault.path, value_at(document, fault.path)
    earlier = value_at(before, _path_before(document, path, before))
    if fault.kind == "one language" and isinstance(value, str):
        return path, dict.fromkeys(languages_of(document), value)
    if fault.kind == "alike":  # invisible marks make the text unique
        marks = _MARK * (1 + max((step for step in path if isinstance(step, int)), default=0))
        texts = value.items() if isinstance(value, Mapping) else ()
        return path, {code: f"{text}{marks}" for code, text in texts} or f"{value}{marks}"
    target = referenced_element(before, path) if fault.kind == "unknown name" and earlier == value else None
    if target is not None and value_at(document, target[:1]) is not None:
        return target, value_at(before, target)
    return (path, earlier) if earlier is not None and earlier != value else None


def _path_before(document: Any, path: Path, before: Any) -> Path:
    """Return the earlier path of an element; questions are matched by ID, not by position."""
    path_before: list[str | int] = []
    for step in path:
        document = document[step] if has(document, step) else None
        name = document.get("id") if isinstance(document, Mapping) and path[-1] != "id" else None
        if isinstance(step, int) and name is not None:
            entries_before = before if isinstance(before, list | tuple) else ()
            same = (
                index
                for index, entry in enumerate(entries_before)
                if isinstance(entry, Mapping) and entry.get("id") == name
            )
            step = next(same, len(entries_before))  # noqa: PLW2901 - the step of the other document
        path_before.append(step)
        before = before[step] if has(before, step) else None
    return tuple(path_before)


def _sort_key(fault: Fault) -> tuple[str, ...]:
    """Return a sort key that sorts list entries by index."""
    return tuple(f"{step:06}" if isinstance(step, int) else step for step in fault.path)


def _repairing_change(document: Any, fault: Fault, *, after_omissions: bool) -> tuple[Path, Any]:
    """Return the path to change because of a fault, and its new value, None to omit it; () if there is no repair.

    With ``after_omissions`` the fault may be due to an omitted element; its key is then omitted, not its element.
    """
    path = fault.path
    if (missing := fault.missing_language) and path and path[-1] != missing:
        value = value_at(document, path)
        others = value.values() if isinstance(value, Mapping) else ()
        return (*path, missing), next(iter(others), TEXT)
    if fault.kind == "unknown key":
        return path, None
    if fault.kind == "part" and fault.use is not None:
        return fault.use
    first_key = 0 if path[:1] == ("study",) else 1  # the ID of an element may equal the key of a text
    for length in range(len(path), 1 + first_key, -1):
        if path[length - 1] in text_keys():
            return path[:length], _neutral_text(document)
    if path[:2] in _SUBSTITUTES:
        return path[:2], _SUBSTITUTES[path[0], path[1]]  # type: ignore[index]
    if path[:1] == ("questionnaires",) and path[2:3] == ("items",) and len(path) > 3:
        return (path[:5], f"item_{path[3]}") if path[4:] == ("id",) else (path[:4], None)
    if path[:1] == ("scales",) and path[2:3] == ("labels",) and len(path) == 4:
        labels = value_at(document, path[:3])
        by_language = labels.items() if isinstance(labels, Mapping) else ()
        return path, next((texts for code, texts in by_language if code != path[3]), None)
    if path[:1] in _OPTIONAL_TABLES:
        return path[:1], None
    if path[:1] in _FORCE_TABLES:
        return path[:2], None if value_at(document, path[:2]) is not None else _initial_value(document, path[:2])
    is_list_entry = len(path) > 1 and isinstance(path[-1], int) and isinstance(value_at(document, path), str)
    if is_list_entry:
        return path, None
    if after_omissions and len(path) > 2 and value_at(document, path[:3]) is not None:
        return path[:3], None
    return (path[:2], None) if len(path) > 1 and isinstance(value_at(document, path[:2]), Mapping) else ((), None)


def _initial_value(document: Any, path: Path) -> Any:
    """Return a valid value for a key; None if there is none."""
    try:
        return initial_value(document, path) if path else None
    except Refused:
        return None


def _neutral_text(document: Any) -> Any:
    codes = languages_of(document)
    return dict.fromkeys(codes, TEXT) if len(codes) > 1 else TEXT


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Numbers of a study; None if they depend on a faulty element."""

    expected_s: float | None = None  # expected duration of a session
    range_s: tuple[float, float] | None = None  # expected durations of the shortest and the longest session
    steps_s: dict[str, float] = field(default_factory=dict)  # expected duration of each page, form and block, by ID
    # numbers of trials, answers and breaks in the longest session, including practice
    trials: int | None = None
    answers: int | None = None
    breaks: int | None = None
    forces_n: dict[str, float] = field(default_factory=dict)  # force of each liquid [N] against a hand at 0.1 m/s
    missing: dict[str, int] = field(default_factory=dict)  # number of missing texts of each language that has some
    # the warnings of ``check``, except those that need simulations, and those on untranslated texts
    warnings: tuple[str, ...] = ()


@lru_cache(maxsize=2)
def facts(study: Study) -> Facts:
    """Return the numbers and warnings of a study, as far as its faults permit."""
    missing, translation_warnings = missing_texts(study), _translation_warnings(study)
    valid = valid_part(study)
    if (protocol := valid.protocol) is None:
        return Facts(missing=missing, warnings=translation_warnings)
    study_facts = Facts(
        steps_s={step: expected_duration_s(protocol, step) for step in protocol.steps},
        missing=missing,
        warnings=translation_warnings,
    )
    if valid.forces:
        forces_n = {name: steady_force(protocol.scene_of(name), HAND_MPS).force_n for name in protocol.liquids}
        study_facts = replace(study_facts, forces_n=forces_n)
    if not valid.is_complete:
        return study_facts
    session = max((variant.protocol for variant in variants(protocol)), key=expected_duration_s)  # as in `check`
    orders = orders_of(session)
    check_warnings = warnings(protocol, simulates=False, without_force=device_without_force()) if valid.forces else ()
    return replace(
        study_facts,
        expected_s=expected_duration_s(session),
        range_s=duration_range_s(session),
        trials=sum(block.trials for block in orders.blocks),
        answers=orders.answers,
        breaks=sum(block.breaks for block in orders.blocks),
        warnings=(*check_warnings, *translation_warnings),
    )


def planned_participants(study: Study) -> int | None:
    """Return the planned number of participants, even if other parts are faulty; None if it is not stated."""
    planned = value_at(study.document, _PLANNED)
    faulty = any(fault.path == _PLANNED for fault in study.faults)
    return planned if isinstance(planned, int) and not faulty else None
