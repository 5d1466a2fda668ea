"""Repairs: edits that remove a fault, each with the words of its button; only those are offered that do."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.initial_values import initial
from study_app.designer.document.languages import filled_in
from study_app.designer.document.writer.edits import Edit, Insert, Rename, Set, Unset
from study_app.designer.document.writer.refused import Refused
from study_app.number_text import number_of
from study_app.protocol.checks.force_limits import paced
from study_app.protocol.source.document import value_at
from study_app.protocol.source.problems import Fault, shown
from study_app.protocol.wording.languages import language_name

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


def _stated(study: Study, fault: Fault) -> Iterator[Repair]:
    """Yield the value that the fault states, or the key that was meant; of a wrong sign the number without it."""
    if fault.use is None:
        return
    path, value = fault.use
    now = value_at(study.document, path)
    if fault.message == "unknown key":
        yield Repair(f'Use "{value}"', (Rename(path, value),))
    elif path != fault.path:
        words = f"Move to {value:g} mm" if isinstance(path[-1], int) else f"Use {path[-1]} = {shown(value)}"
        yield Repair(words, (Set(path, value),))
    elif isinstance(now, int | float) and isinstance(value, int | float) and now < 0 < value:
        yield Repair(f"Use {shown(-now)}", (Set(path, -now),))
    else:
        yield Repair(f"Use {shown(value)}", (Set(path, value),))


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
    _stated, _quoted_numbers, _levels, _texts, _steps, _missing, _surplus,
)  # fmt: skip
