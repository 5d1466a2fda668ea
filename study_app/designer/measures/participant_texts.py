"""Texts of a study: how many each language has, and those that a participant reads that reveal a condition."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from study_app.designer.document.changes import is_copied, languages_of, texts_of
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import alternatives, is_localised, label_of
from study_app.designer.document.study import Study
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.protocol.source.json_schema import schema
from study_app.protocol.wording.languages import language_name
from study_app.store.verification.leaks import Telltales

SHORTEST: Final = 3
"""Letters of an id that does not stand in a text by chance."""
READ: Final = ("pages", "blocks", "tasks", "designs")
"""Sections whose texts are read before the last answer; statements may name what is compared, as all see the same."""


@dataclass(frozen=True, slots=True)
class Revealing:
    """A text that reveals a condition: its key, the element's title, and the word that reveals it."""

    path: Path
    element: str
    key: str
    word: str


def texts_by_language(study: Study) -> dict[str, tuple[int, int]]:
    """Return for each language how many texts it has, and how many it should have."""
    languages = languages_of(study)
    counted = {code: [0, 0] for code in languages}
    for _, value in texts_of(study):
        for place, code in enumerate(languages):
            counted[code][1] += 1
            text = value.get(code) if isinstance(value, Mapping) else value if place == 0 else ""
            counted[code][0] += bool(text.strip() if isinstance(text, str) else text)
    return {code: (there, wanted) for code, (there, wanted) in counted.items()}


def missing_texts(study: Study) -> dict[str, int]:
    """Return how many texts each language lacks; none where it lacks none."""
    return {code: wanted - there for code, (there, wanted) in texts_by_language(study).items() if there < wanted}


def copied_texts(study: Study) -> dict[str, int]:
    """Return for each further language how many of its texts are those of the first one, or of a new question."""
    first, *others = languages_of(study)
    texts = [value for _, value in texts_of(study) if isinstance(value, Mapping)]
    counted = {code: sum(is_copied(value, code, first) for value in texts) for code in others}
    return {code: count for code, count in counted.items() if count}


def own_texts(study: Study, counts: Mapping[str, tuple[int, int]]) -> dict[str, tuple[int, int]]:
    """Return for each language how many of its texts, of `texts_by_language`, are not copied, and how many it needs."""
    copied = copied_texts(study)
    return {code: (there - copied.get(code, 0), wanted) for code, (there, wanted) in counts.items()}


def to_translate(study: Study) -> tuple[str, ...]:
    """Return a warning for each language with copied texts; they prevent no session."""
    first = language_name(languages_of(study)[0])
    return tuple(
        f"study.languages: {counted(count, 'text')} to translate to {language_name(code)}, as in {first} so far"
        for code, count in copied_texts(study).items()
    )


def revealing(study: Study, protocol: Protocol) -> tuple[Revealing, ...]:
    """Return the texts that name a liquid, a condition or a delay which participants must not know."""
    words = Telltales(_words(protocol))
    debriefs = {name for name, page in protocol.pages.items() if page.kind == "debrief"}
    found = []
    for path, value in _texts(study.document):
        if path[0] not in READ or (path[0] == "pages" and path[1] in debriefs):
            continue
        texts = value.values() if isinstance(value, Mapping) else (value,)
        words_there = [word for text in texts if isinstance(text, str) for word in words.in_text(text.casefold())]
        if words_there:
            element = title_of(study.document, path[:2])
            found.append(Revealing(path, element, label_of(path[-1]), words_there[0]))
    return tuple(found)


def _words(protocol: Protocol) -> set[str]:
    """Return the names of what main blocks compare, and their delays with the unit."""
    found: set[str] = set()
    for block in protocol.main_blocks:
        names = protocol.conditions_in(block.id)
        if len(names) < 2 and block.stimulus is None:
            continue
        for name in names:
            condition = protocol.conditions[name]
            ids = {name, *condition.liquid_ids}
            found |= {one.replace("_", " ").casefold() for one in ids if len(one) >= SHORTEST}
            if condition.delay_ms:
                found.add(f"{condition.delay_ms:g} ms")
    return found


def _texts(value: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield every text of the study that is in its languages, with its place."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            place = (*path, key)
            texts = inner.values() if isinstance(inner, Mapping) else (inner,)
            if key in text_keys() and len(path) > 0 and all(isinstance(one, str) for one in texts):
                yield place, inner
            else:
                yield from _texts(inner, place)
    elif isinstance(value, tuple):
        for at, inner in enumerate(value):
            yield from _texts(inner, (*path, at))


@cache
def text_keys() -> frozenset[str]:
    """Return the keys that have a text for each language, of every model of the grammar."""
    models = [schema(), *schema()["$defs"].values()]
    properties = (pair for model in models for pair in model.get("properties", {}).items())
    return frozenset(key for key, node in properties if is_localised(tuple(alternatives(node))))
