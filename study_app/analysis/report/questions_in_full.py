"""The appendix of the report: all questions in full, in all languages and versions, and changes between versions.

The texts are from the receipts; the study's file is not needed.
"""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from study_app.analysis.html_page import bullets, heading, paragraph, table_of
from study_app.analysis.wording import listed
from study_app.store.versions import RecordedContent, content_changes


class _Text(NamedTuple):
    """A text that participants read: its ID ("delay.harder"), its language ("" if there is only one), and its words."""

    id: str
    language: str
    words: str


def changed_questions(contents: Sequence[RecordedContent]) -> Iterator[str]:
    """Yield a caveat for each version of the study's file in which the wording of questions changed."""
    for before, after in itertools.pairwise(contents):
        old, new = ({text[:2]: text.words for text in _texts(content.protocol)} for content in (before, after))
        reworded = sorted({place[0] for place in old.keys() & new.keys() if old[place] != new[place]})
        if reworded:
            yield (
                f"The wording of {listed(reworded)} changed in version {after.name}. Answers from before and after the "
                "change are analysed together; “Questions in full” shows both wordings."
            )


def appendix(contents: Sequence[RecordedContent]) -> Iterator[str]:
    """Yield the section with all texts of all versions, and the changes between versions."""
    versions: dict[_Text, list[str]] = {}
    for content in contents:
        for text in _texts(content.protocol):
            versions.setdefault(text, []).append(content.version)
    if not versions:
        return
    yield heading(2, "Questions in full")
    several, languages = len(contents) > 1, len({text.language for text in versions}) > 1
    yield table_of(
        sorted(versions, key=lambda text: text[:2]),
        ("ID", lambda text: text.id),
        ("language", lambda text: text.language) if languages else None,
        ("text", lambda text: text.words),
        ("versions", lambda text: ", ".join(dict.fromkeys(versions[text]))) if several else None,
        words=4,
    )
    for after, sentences in content_changes(contents):
        yield heading(3, f"Changes in version {after.name}")
        yield bullets(sentences)
    if several:
        yield paragraph(
            "The changes were identified from the receipts, which do not record liquids or conditions.", "soft"
        )


def _texts(protocol: Mapping[str, Any]) -> Iterator[_Text]:
    """Yield the texts of each questionnaire and question, with options and ends, and the labels of each scale."""
    only = str(protocol["study"]["languages"][0])
    for name, questionnaire in protocol["questionnaires"].items():
        yield from _translations(name, questionnaire.get("intro"), only)
        for item in questionnaire["items"]:
            place = f"{name}.{item['id']}"
            for key in ("text", "low", "high", "unit"):
                yield from _translations(place if key == "text" else f"{place}, {key}", item.get(key), only)
            for option in item.get("options", ()):
                yield from _translations(f"{place}, option {option['id']}", option["text"], only)
    for name, scale in protocol.get("scales", {}).items():
        yield from _translations(f"scale {name}", scale["labels"], only)
        yield from _translations(f"scale {name}, cannot judge", scale.get("cannot_judge"), only)


def _translations(name: str, text: Any, only: str) -> Iterable[_Text]:
    """Return a text in each of its languages; ``only`` is the language of a text without translations."""
    by_language = text if isinstance(text, Mapping) else {only: text} if text else {}
    return [
        _Text(id=name, language=language, words=" · ".join(words) if isinstance(words, list) else str(words))
        for language, words in by_language.items()
    ]
