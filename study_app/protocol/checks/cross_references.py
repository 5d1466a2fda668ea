"""Names that must fit together: references to tables, the sequence, lists without repeats, items, languages.

These checks read the document itself, so that they also see the sound keys of tables that are broken elsewhere.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from study_app.protocol.groups import SEQUENCES, sequences_in
from study_app.protocol.source.document import Path, entries, names
from study_app.protocol.source.problems import ALIKE, ONE_LANGUAGE, Fault, did_you_mean
from study_app.protocol.wording.languages import LANGUAGES, language_name

REFERENCES = {
    "conditions.*.liquid": "liquids",
    "conditions.*.liquids.*": "liquids",
    "questionnaires.*.scale": "scales",
    "questionnaires.*.items.*.scale": "scales",
    "blocks.*.conditions.*": "conditions",
    "blocks.*.task": "tasks",
    "blocks.*.questionnaire": "questionnaires",
    "blocks.*.break_page": "pages",
    "blocks.*.stimulus": "stimuli",
    "blocks.*.standard": "conditions",
    "stimuli.*.condition": "conditions",
    "designs.*.scale": "scales",
}

CHOICES = {
    **{pattern: (section,) for pattern, section in REFERENCES.items()},
    **{f"{pattern}.*": ("pages", "blocks", "questionnaires") for pattern in SEQUENCES},
    "blocks.*.design": ("designs",),
    "blocks.*.method": ("methods",),
    "analysis.published.*.block": ("blocks",),
}
"""Every place that names a table, with the sections whose tables it may name; a design or method may be a kind, too."""

ITEM_REFERENCES = (
    "conditions.*.label",
    "analysis.primary.*",
    "analysis.names.*",
    "analysis.rising.*",
    "analysis.falling.*",
    "analysis.noticed",
    "questionnaires.*.items.*.show_if.item",
    "questionnaires.*.scores.*.items.*",
    "questionnaires.*.scores.*.reverse.*",
    "questionnaires.*.scores.*.weights_from.*",
)
"""Every place that names an item; within a questionnaire one of its own items."""

TEXTS = (
    "study.title",
    "tasks.*.instruction",
    "scales.*.labels",
    "scales.*.cannot_judge",
    "questionnaires.*.title",
    "questionnaires.*.intro",
    "questionnaires.*.items.*.text",
    "questionnaires.*.items.*.short",
    "questionnaires.*.items.*.low",
    "questionnaires.*.items.*.high",
    "questionnaires.*.items.*.unit",
    "questionnaires.*.items.*.options.*.text",
    "pages.*.title",
    "pages.*.body",
    "pages.*.button",
    "designs.*.question",
    "blocks.*.title",
    "blocks.*.setting_label",
)

WITHOUT_REPEATS = ("study.languages", "conditions.*.liquids", "blocks.*.conditions")

Document = Mapping[str, Any]


def _unknown(path: Path, name: Any, kind: str, known: Collection[str]) -> Iterator[Fault]:
    if isinstance(name, str) and name not in known:
        yield Fault(path, f'there is no {kind} "{name}"', did_you_mean(name, known))


def references(document: Document) -> Iterator[Fault]:
    """Check that every name that stands for a table names one."""
    for pattern, section in REFERENCES.items():
        known = names(document, section)
        for path, name in entries(document, pattern):
            yield from _unknown(path, name, "stimulus" if section == "stimuli" else section.removesuffix("s"), known)


def sequence(document: Document) -> Iterator[Fault]:
    """Check that each sequence names pages, blocks and forms, and that none is left out but pages of breaks.

    Blocks and forms come once in a sequence. `groups` checks that no block is left out of a study with groups.
    """
    pages, blocks = names(document, "pages"), names(document, "blocks")
    forms = names(document, "questionnaires")
    for name in pages:
        if name in blocks:
            yield Fault(("blocks", name), "a page has this name too", "rename one: sequence could not tell them apart")
    if not document.keys() & {"sequence", "sequences", "groups"}:
        yield Fault(("sequence",), "is missing", "list the pages and blocks of a session in their order")
    breaks = [page for _, page in entries(document, "blocks.*.break_page")]
    used: set[str] = set()
    for place, steps in sequences_in(document):
        seen: set[str] = set()
        for index, name in enumerate(steps):
            path = (*place, index)
            yield from _unknown(path, name, "page or block", {*pages, *blocks, *forms})
            if name in blocks and name in seen:
                yield Fault(path, f'block "{name}" comes twice', "give the block repetitions")
            elif name in forms and (name in pages or name in blocks) and name not in used:
                other = "page" if name in pages else "block"
                where = ("questionnaires", name)
                yield Fault(where, f"a {other} has this name too", "rename one: sequence could not tell them apart")
            elif name in forms and name in seen:
                yield Fault(path, f'form "{name}" comes twice', "give the second one a name of its own")
            seen.add(str(name))
        used |= seen
    if not used:
        return
    for section, tables in (("pages", pages), ("blocks", () if "groups" in document else blocks)):
        for name in tables:
            if name not in used and not (section == "pages" and name in breaks):
                yield Fault((section, name), "comes nowhere in sequence", "add it there, or take it out")


def repeats(document: Document) -> Iterator[Fault]:
    """Check that no list names a thing twice."""
    for pattern in WITHOUT_REPEATS:
        for path, listed in entries(document, pattern):
            if isinstance(listed, tuple):
                for index, entry in enumerate(listed):
                    if entry in listed[:index]:
                        yield Fault((*path, index), f'"{entry}" is listed twice', "remove one")


def items(document: Document) -> Iterator[Fault]:
    """Check that an item's id is its own, and the same statement wherever two questionnaires share one."""
    statements: dict[str, Any] = {}
    seen: set[tuple[Any, str]] = set()
    for path, item in entries(document, "questionnaires.*.items.*"):
        name = item.get("id") if isinstance(item, Mapping) else None
        if not isinstance(name, str):
            continue
        if (path[1], name) in seen:
            yield Fault((*path, "id"), f'a second item "{name}" in this questionnaire', "every item needs its own id")
        elif statements.setdefault(name, item.get("text")) != item.get("text"):
            message = f'item "{name}" has another text in another questionnaire'
            yield Fault((*path, "id"), message, "give it another id")
        seen.add((path[1], name))


def alike(document: Document) -> Iterator[Fault]:
    """Check that statements of a questionnaire, their short names and the points of a scale differ."""
    for name in names(document, "questionnaires"):
        for key in ("text", "short"):
            yield from _alike(list(entries(document, f"questionnaires.{name}.items.*.{key}")), "item")
    for path, labels in entries(document, "scales.*.labels.*"):
        points = [((*path, index), label) for index, label in enumerate(labels if isinstance(labels, tuple) else ())]
        for _, off in entries(document, f"scales.{path[1]}.cannot_judge"):
            points.append(((*path[:2], "cannot_judge"), off.get(path[-1]) if isinstance(off, Mapping) else off))
        yield from _alike(points, "label")


def _alike(found: list[tuple[Path, Any]], kind: str) -> Iterator[Fault]:
    """Yield a fault for every text that reads as an earlier one does; an entry may hold a text per language."""
    seen: set[tuple[str, str]] = set()
    for path, entry in found:
        texts = entry if isinstance(entry, Mapping) else {"": entry}
        read = {(language, _read(text)) for language, text in texts.items() if isinstance(text, str)}
        if read & seen:
            yield Fault(path, f"{ALIKE} {kind} does", "people could not tell the two apart: change one")
        seen |= read


def _read(text: str) -> str:
    """Return a text as people tell texts apart: not by case, width or white space."""
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())


def languages(document: Document) -> Iterator[Fault]:
    """Check that every text exists in every language of the study and in no other."""
    wanted = tuple(name for _, name in entries(document, "study.languages.*") if isinstance(name, str))
    for path, name in entries(document, "study.languages.*"):
        if isinstance(name, str) and name not in LANGUAGES:
            hint = f"known: {', '.join(LANGUAGES)}"
            yield Fault(path, f'the program has no words in "{name}"', hint)
    if not wanted:
        return
    for pattern in TEXTS:
        for path, text in entries(document, pattern):
            yield from _translations(path, text, wanted)


def _translations(path: Path, text: Any, wanted: tuple[str, ...]) -> Iterator[Fault]:
    if isinstance(text, str) and len(wanted) > 1:
        listed = ", ".join(f'{language} = "…"' for language in wanted)
        yield Fault(path, ONE_LANGUAGE, f"write {{ {listed} }}")
    elif isinstance(text, Mapping):
        for language in wanted:
            if language not in text:
                hint = f"add {language}: every text exists in every language of the study"
                yield Fault(path, f"is missing in {language_name(language)}", hint, missing_language=language)
        for language in text:
            if language not in wanted:
                yield Fault((*path, language), "is not a language of the study", f"these are: {', '.join(wanted)}")
