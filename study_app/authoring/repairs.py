"""Repairs: edits that remove a fault, each with the words of its button; only those are offered that do."""

import difflib
import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from study_app.authoring.changes.initial_values import initial
from study_app.authoring.changes.languages import filled_in
from study_app.authoring.edited_study import Study
from study_app.authoring.names import choices_at
from study_app.authoring.writer.edits import Edit, Insert, Rename, Set, Unset
from study_app.authoring.writer.refused import Refused
from study_app.number_text import number_of
from study_app.protocol.checks.force_limits import paced
from study_app.protocol.source.document import value_at
from study_app.protocol.source.problems import Fault, shown
from study_app.protocol.wording.languages import language_name

_MEANT: Final = re.compile(r'did you mean "([^"]+)"\?')
_BOUND: Final = re.compile(r"must be (?:at least |at most )?([\d.e+-]+)(?: |$)")
_ORDER: Final = re.compile(r'belongs to order = "([a-z]+)"')
_OUTSIDE: Final = re.compile(r"([xyz]) = [-\d.e+]+ mm with radius ([\d.e+-]+) mm leaves the tank")
_HALVINGS: Final = 12


@dataclass(frozen=True, slots=True)
class Repair:
    """What a button says, and the edits that it makes as one step."""

    words: str
    edits: tuple[Edit, ...]


def repairs(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs of a fault: after each of them it is gone."""
    offered = (repair for kind in _KINDS for repair in kind(study, fault))
    return (*(repair for repair in offered if removes(study, fault, repair)), *_every_text(study, fault))


def removes(study: Study, fault: Fault, repair: Repair) -> bool:
    """Return whether a fault is gone after a repair, and there are not more than before."""
    try:
        after, _ = study.edited(*repair.edits)
    except Refused:
        return False
    known = {(one.path, one.message) for one in study.faults}
    found = {(one.path, one.message) for one in after.faults}
    return (fault.path, fault.message) not in found and len(found) <= len(known)


def _meant(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the word that was meant, for a key or a value."""
    if found := _MEANT.search(fault.hint):
        word = found[1]
        edit = Rename(fault.path, word) if fault.message == "unknown key" else Set(fault.path, word)
        yield Repair(f'Use "{word}"', (edit,))


def _named(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the nearest name for one that names nothing."""
    name, choices = value_at(study.document, fault.path), choices_at(study.document, fault.path)
    if is_unknown_name(fault) and isinstance(name, str) and choices and not _MEANT.search(fault.hint):
        nearest = difflib.get_close_matches(name, choices, n=1, cutoff=0.0)[0]
        yield Repair(f'Use "{nearest}"', (Set(fault.path, nearest),))


def is_unknown_name(fault: Fault) -> bool:
    """Return whether a text names something that is not in the study."""
    return fault.message.startswith("there is no ")


def _missing(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield an initial value for a key that is missing."""
    if fault.message == "is missing" and fault.path:
        with suppress(Refused):
            yield Repair("Add it", (Set(fault.path, initial(study.document, fault.path)),))


def _surplus(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the removal of what does not belong there."""
    message = fault.message
    if message == "unknown key" or message.endswith("is listed twice") or "belong" in message:
        yield Repair("Remove", (Unset(fault.path),))
    if message == "is not a language of the study":
        yield Repair("Remove this text", (Unset(fault.path),))


def _constrained(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the order that a key belongs to."""
    if found := _ORDER.match(fault.message):
        edit = Set((*fault.path[:-1], "order"), found[1])
        yield Repair(f'Use order = "{found[1]}"', (edit,))


def _targets(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the nearest place in the tank for a target."""
    found, point = _OUTSIDE.match(fault.message), value_at(study.document, fault.path)
    size = value_at(study.document, ("device", "workspace_mm"))
    if found is None or not isinstance(point, tuple) or not isinstance(size, tuple):
        return
    axis = "xyz".index(found[1])
    most = math.floor(size[axis] / 2 - float(found[2]))
    if most >= 0:
        place = math.copysign(most, point[axis])
        yield Repair(f"Move to {place:g} mm", (Set((*fault.path, axis), int(place)),))


def _within_bounds(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the nearest permitted number; of one with a wrong sign that without it."""
    if found := _BOUND.search(fault.message):
        now, number = value_at(study.document, fault.path), float(found[1])
        if isinstance(now, int | float) and now < 0 < number:
            yield Repair(f"Use {shown(-now)}", (Set(fault.path, -now),))
            return
        value = int(number) if number.is_integer() else number
        yield Repair(f"Use {found[1]}", (Set(fault.path, value),))


def _quoted_numbers(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the number that a text holds where a number must be."""
    text = value_at(study.document, fault.path)
    number = number_of(text) if isinstance(text, str) and "number" in fault.message else None
    if number is not None:
        yield Repair(f"Use {shown(number)} as a number", (Set(fault.path, number),))


def _texts(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield a copy of the text in the first language, for languages that lack it."""
    languages = value_at(study.document, ("study", "languages"))
    text = value_at(study.document, fault.path)
    if (lacking := fault.missing_language) and isinstance(text, Mapping) and text:
        first = next(iter(text))
        words = f"Copy {language_name(first)} to {language_name(lacking)}"
        yield Repair(words, (Set((*fault.path, lacking), text[first]),))
    elif fault.in_one_language and isinstance(text, str) and languages:
        copies = dict.fromkeys(languages, text)
        yield Repair("Use this text in every language", (Set(fault.path, copies),))


def _every_text(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield copies of all texts in the first language that another one lacks; they are too many to be tried out."""
    lacking = fault.missing_language
    edits = filled_in(study, lacking) if lacking else ()
    if lacking and len(edits) > 1 and any(edit.path[: len(fault.path)] == fault.path for edit in edits):
        yield Repair(f"Copy all {len(edits)} to {language_name(lacking)}", edits)


def _steps(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the place in the session that a page or block lacks."""
    sequence = value_at(study.document, ("sequence",))
    if fault.message == "comes nowhere in sequence" and isinstance(sequence, tuple):
        at = max(len(sequence) - 1, 0)
        yield Repair("Add to the session", (Insert(("sequence", at), fault.path[-1]),))


def _levels(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the highest level that is not beyond a limit."""
    levels = value_at(study.document, fault.path)
    if fault.path[:1] != ("stimuli",) or fault.path[-1:] != ("levels",) or not isinstance(levels, tuple):
        return
    if len(levels) == 2 and all(isinstance(level, int | float) for level in levels):
        highest = highest_level(study, fault, *levels)
        if highest is not None:
            lowered = _lowered(study, str(fault.path[1]), highest)
            edits = (Set(("methods", name, "levels"), list(own)) for name, own in lowered.items())
            yield Repair(f"Highest level {shown(highest)}", (Set((*fault.path, 1), highest), *edits))


def _lowered(study: Study, stimulus: str, highest: float) -> dict[str, tuple[float, ...]]:
    """Return the levels that methods of a stimulus list, none above the highest, of those that have one above it.

    A method of another stimulus, too, keeps its levels.
    """
    blocks = () if study.formed is None else study.formed.blocks.values()
    found: dict[str, tuple[float, ...]] = {}
    for name in {str(block.method) for block in blocks if block.stimulus == stimulus}:
        own = value_at(study.document, ("methods", name, "levels"))
        shared = any(block.method == name and block.stimulus != stimulus for block in blocks)
        if isinstance(own, tuple) and not shared and any(level > highest for level in own):
            found[name] = tuple(dict.fromkeys(min(level, highest) for level in own))
    return found


def highest_level(study: Study, fault: Fault, low: float, high: float) -> float | None:
    """Return the highest level, in three digits, without this kind of fault; None where not even ``low`` is."""
    formed = study.formed
    if formed is None:
        return None
    name = str(fault.path[1])

    def passes(level: float) -> bool:
        stimulus = formed.stimuli[name].model_copy(update={"levels": (low, level)})
        lowered = _lowered(study, name, level).items()
        methods = {one: formed.methods[one].model_copy(update={"levels": own}) for one, own in lowered}
        changed = formed.model_copy(
            update={"stimuli": {**formed.stimuli, name: stimulus}, "methods": {**formed.methods, **methods}}
        )
        return not any(one.path == fault.path for one in paced(changed))

    least, most = low, high
    for _ in range(_HALVINGS):
        middle = (least + most) / 2
        least, most = (middle, most) if passes(middle) else (least, middle)
    for digits in (3, 4):
        step = 10.0 ** _exponent(least, digits)
        rounded = round(step * int(least / step + 1e-9), 12)
        if low < rounded and passes(rounded):
            return int(rounded) if rounded.is_integer() else rounded
    return None


def _exponent(value: float, digits: int) -> int:
    """Return the power of ten of the last of so many digits."""
    return int(f"{value:e}".split("e")[1]) - digits + 1


_KINDS: Final[tuple[Callable[[Study, Fault], Iterator[Repair]], ...]] = (
    _meant, _named, _within_bounds, _quoted_numbers, _levels, _targets, _texts, _steps, _constrained, _missing,
    _surplus,
)  # fmt: skip
