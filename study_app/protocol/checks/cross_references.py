"""Checks of names: references to tables, sequences, groups, items and their scales, languages.

These checks read the document itself, so that they include the valid keys of tables with other invalid keys.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import permutations
from typing import Any, TypeVar

from pydantic import ValidationError

from study_app.protocol.participants.groups import ASSIGNMENT, SEQUENCES, sequences_in
from study_app.protocol.questions import POINTS, Context, Question, Scale, ShowIf, Statement, question_of
from study_app.protocol.source.document import Path, entries, names, value_at
from study_app.protocol.source.problems import Fault, did_you_mean, unknown_name
from study_app.protocol.wording.languages import LANGUAGES, REFUSED, language_name, missing_text

_REFERENCES = {
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
    "analysis.contrasts.*.blocks.*": "blocks",
    "analysis.contrasts.*.conditions.*": "conditions",
    "analysis.contrasts.*.form": "questionnaires",
    "analysis.contrasts.*.groups.*": "groups",
}

CHOICES = {
    **{pattern: (section,) for pattern, section in _REFERENCES.items()},
    **{f"{pattern}.*": ("pages", "blocks", "questionnaires") for pattern in SEQUENCES},
    "blocks.*.design": ("designs",),
    "blocks.*.method": ("methods",),
    "analysis.published.*.block": ("blocks",),
}
"""Patterns of the references to tables, with the sections of these; a design or method may also be a kind."""

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
"""Patterns of the references to items; within a questionnaire, they refer to its own items."""

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

_WITHOUT_REPEATS = ("study.languages", "conditions.*.liquids", "blocks.*.conditions")
_DECIDED_LISTS = ("primary", "names", "rising", "falling")

Document = Mapping[str, Any]
_T = TypeVar("_T")


def _unknown_name(path: Path, name: Any, kind: str, known: Collection[str]) -> Iterator[Fault]:
    if isinstance(name, str) and name not in known:
        yield unknown_name(path, f'there is no {kind} "{name}"', name, known)


def _repeated_names(listed: Sequence[tuple[Path, Any]]) -> Iterator[Fault]:
    for at, (path, name) in enumerate(listed):
        if name in [earlier for _, earlier in listed[:at]]:
            yield Fault(path, f'"{name}" is listed twice', kind="surplus")


def check_references(document: Document) -> Iterator[Fault]:
    """Check that every reference to a table has an existing target."""
    for pattern, section in _REFERENCES.items():
        known, kind = names(document, section), "stimulus" if section == "stimuli" else section.removesuffix("s")
        for path, name in entries(document, pattern):
            yield from _unknown_name(path, name, kind, known)


def check_sequences(document: Document) -> Iterator[Fault]:
    """Check that each sequence names pages, blocks and forms, and that only break pages are omitted.

    Blocks and forms occur once in a sequence. `check_groups` checks that no block is omitted in a study with groups.
    """
    pages, blocks, forms = (names(document, section) for section in ("pages", "blocks", "questionnaires"))
    rename_hint = "rename one of them: every entry of sequence needs its own name"
    for name in pages:
        if name in blocks:
            yield Fault(("blocks", name), "a page has the same name", rename_hint)
    if not document.keys() & {"sequence", "sequences", "groups"}:
        hint = "list the pages and blocks of a session in order"
        yield Fault(("sequence",), "is missing", hint, kind="missing")
    breaks = [page for _, page in entries(document, "blocks.*.break_page")]
    used: set[str] = set()
    for sequence_path, steps in sequences_in(document):
        seen: set[str] = set()
        since_block: set[str] = set()  # the steps since the last block, or since the start
        for index, name in enumerate(steps):
            path = (*sequence_path, index)
            yield from _unknown_name(path, name, "page or block", {*pages, *blocks, *forms})
            if name in blocks and name in seen:
                message = f'block "{name}" occurs twice'
                yield Fault(path, message, "use repetitions in the block", kind="surplus")
            elif name in forms and (name in pages or name in blocks) and name not in used:
                other = "page" if name in pages else "block"
                yield Fault(("questionnaires", name), f"a {other} has the same name", rename_hint)
            elif name in forms and name in since_block:
                message = f'form "{name}" occurs twice after the same block'
                yield Fault(path, message, "put a block between them", kind="surplus")
            seen.add(str(name))
            since_block = {*(since_block if name not in blocks else ()), str(name)}
        used |= seen
    unused = [("pages", name) for name in pages if name not in breaks]
    unused += [("blocks", name) for name in blocks if "groups" not in document]
    for path in unused if used else ():
        if path[1] not in used:
            yield Fault(path, "is not listed in sequence", "add it there, or remove it", kind="not in sequence")


def check_repeats(document: Document) -> Iterator[Fault]:
    """Check that no list contains a name twice."""
    for pattern in _WITHOUT_REPEATS:
        for path, listed in entries(document, pattern):
            yield from _repeated_names([((*path, *at), entry) for at, entry in entries(listed, "*")])


def check_items(document: Document) -> Iterator[Fault]:
    """Check that item ids are unique within a questionnaire, and name the same statement in all questionnaires."""
    statements: dict[str, Any] = {}
    seen: set[tuple[Any, str]] = set()
    for path, name in entries(document, "questionnaires.*.items.*.id"):
        if not isinstance(name, str):
            continue
        text = value_at(document, (*path[:-1], "text"))
        if (path[1], name) in seen:
            yield Fault(path, f'this questionnaire already has an item "{name}"', "every item needs its own ID")
        elif statements.setdefault(name, text) != text:
            yield Fault(path, f'item "{name}" is worded differently in another questionnaire', "use a different ID")
        seen.add((path[1], name))


def check_statements_differ(document: Document) -> Iterator[Fault]:
    """Check that a questionnaire's statements, their short names and a scale's points differ."""
    for name in names(document, "questionnaires"):
        for key in ("text", "short"):
            readers = "figures" if key == "short" else "participants"
            yield from _repeated_texts(list(entries(document, f"questionnaires.{name}.items.*.{key}")), "item", readers)
    for path, labels in entries(document, "scales.*.labels.*"):
        points = [((*path, *at), label) for at, label in entries(labels, "*")]
        for _, off_scale_label in entries(document, f"scales.{path[1]}.cannot_judge"):
            points.append(
                (
                    (*path[:2], "cannot_judge"),
                    off_scale_label.get(path[-1]) if isinstance(off_scale_label, Mapping) else off_scale_label,
                )
            )
        yield from _repeated_texts(points, "label")


def _repeated_texts(located_texts: list[tuple[Path, Any]], kind: str, readers: str = "participants") -> Iterator[Fault]:
    """Yield a fault for every text that looks like an earlier one in all languages, else for each such language.

    Readers do not distinguish texts by case, width or white space, nor Latin letters from Cyrillic or Greek ones that
    look the same.
    """
    seen: set[tuple[str, str]] = set()
    for path, entry in located_texts:
        texts = entry if isinstance(entry, Mapping) else {"": entry}
        visible_texts = {(language, visible_text(text)) for language, text in texts.items() if isinstance(text, str)}
        message, hint = f"reads the same as an earlier {kind}", f"{readers} could not tell them apart: change one"
        repeated = sorted(language for language, _ in visible_texts & seen)
        if repeated and len(repeated) == len(visible_texts):
            yield Fault(path, message, hint, kind="alike")
        else:
            for language in repeated:
                yield Fault((*path, language), f"{message} in {language_name(language)}", hint, kind="alike")
        seen |= visible_texts


_LOOKALIKES = str.maketrans("аеіјорсухѕһοαρνικ", "aeijopcyxshoapvik")
"""Small Cyrillic and Greek letters, mapped to the Latin letters that look the same."""


def visible_text(text: str) -> str:
    """Return the visible content of a text, normalised for format marks, case, width and alphabet."""
    visible = "".join(letter for letter in text if unicodedata.category(letter) != "Cf")
    return " ".join(unicodedata.normalize("NFKC", visible).casefold().translate(_LOOKALIKES).split())


def check_languages(document: Document) -> Iterator[Fault]:
    """Check that every text exists in exactly the study's languages."""
    stated = [(path, name) for path, name in entries(document, "study.languages.*") if isinstance(name, str)]
    for path, name in stated:
        if name not in LANGUAGES or name in REFUSED:
            known = REFUSED.get(
                name,
                f"supported languages: {', '.join(LANGUAGES)}; run liquid-study language {name} to create a file for a "
                "new language",
            )
            yield Fault(path, f'the program does not support "{name}"', known, permitted=tuple(LANGUAGES))
    codes = tuple(name for _, name in stated)
    texts = (texts_of_pattern for pattern in TEXTS for texts_of_pattern in entries(document, pattern)) if codes else ()
    for path, text in texts:
        if isinstance(text, str) and len(codes) > 1:
            listed = ", ".join(f'{language} = "…"' for language in codes)
            message = "is written in one language, but the study has several languages"
            yield Fault(path, message, f"write {{ {listed} }}", kind="one language")
        elif isinstance(text, Mapping):
            for language in codes:
                if language not in text:
                    yield missing_text(path, language)
            for language in text:
                if language not in codes:
                    hint = f"languages of the study: {', '.join(codes)}"
                    yield Fault((*path, language), "is not a language of the study", hint, kind="other language")


SEQUENCE_KEYS = ("sequence", "sequences")


def check_groups(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Check that there are at least two groups, and that every block and every sequence is used."""
    if all(key in document for key in SEQUENCE_KEYS):
        yield Fault(("sequences",), "specify either sequence or sequences, not both")
    tables = [table for _, table in entries(document, "groups.*") if isinstance(table, Mapping)]
    if not tables:
        if value_at(document, ASSIGNMENT) == "pre-existing":
            yield Fault(ASSIGNMENT, "the study does not have groups", "add groups", kind="surplus")
        return
    if len(names(document, "groups")) == 1:
        yield Fault(("groups",), "the study has only one group", "add another group", kind="surplus")
    have_own = [any(key in table for key in SEQUENCE_KEYS) for table in tables]
    for key, other in permutations(SEQUENCE_KEYS):
        if key in document and all(have_own):
            yield Fault((key,), f"is not used, because every group has its own {key} or {other}", kind="surplus")
    used = {step for _, steps in sequences_in(document) for step in steps if isinstance(step, str)}
    for block in names(document, "blocks"):
        if used and block not in used:
            yield Fault(
                ("groups",), f'block "{block}" is not in the sequence of any group', "add it to a group, or remove it"
            )


def check_decisions(document: Document) -> Iterator[Fault]:
    """Check that decisions refer to existing statements, each at most once."""
    questions = [item for _, item in entries(document, "questionnaires.*.items.*") if isinstance(item, Mapping)]
    named_questions = [item for item in questions if isinstance(item.get("id"), str)]
    statements = {item["id"] for item in named_questions if "kind" not in item}
    kinds = {item["id"]: item["kind"] for item in named_questions if isinstance(item.get("kind"), str)}
    decided = {key: list(entries(document, f"analysis.{key}.*")) for key in _DECIDED_LISTS}
    for places in (*decided.values(), list(entries(document, "analysis.noticed"))):
        for path, name in places:
            if isinstance(name, str) and name in kinds and name not in statements:
                message = f'"{name}" is a {kinds[name]}, but the report tests only statements with {POINTS} points'
                hint = "choose an item without a kind"
                yield Fault(path, message, hint, kind="surplus")
            else:
                yield from _unknown_name(path, name, "item", statements)
        yield from _repeated_names(places)
    falling, named = ([name for _, name in decided[key]] for key in ("falling", "names"))
    for path, name in decided["rising"]:
        if name in falling:
            yield Fault(path, f'"{name}" is also expected to decrease', "an item can be in only one of the two lists")
    for path, name in entries(document, "conditions.*.label"):
        if isinstance(name, str) and name not in named:
            yield Fault(path, f'"{name}" is not among analysis.names', "add it there", kind="surplus")


def check_questions(document: Document) -> Iterator[Fault]:
    """Check the items of every questionnaire: scales, display conditions and scores."""
    scales = {
        str(path[1]): scale
        for path, table in entries(document, "scales.*")
        if (scale := _valid_or_none(Scale.model_validate, table)) is not None
    }
    language = next((name for _, name in entries(document, "study.languages.*") if isinstance(name, str)), "en")
    for path, table in entries(document, "questionnaires.*"):
        if not isinstance(table, Mapping):
            continue
        parsed_items = (((*path, *at), _valid_or_none(question_of, item)) for at, item in entries(table, "items.*"))
        valid_items = [(place, item) for place, item in parsed_items if item is not None]
        items = [item for _, item in valid_items]
        if any(isinstance(item, Statement) for item in items):
            if "scale" not in table:
                message = "the scale is needed for statements (items without a kind)"
                yield Fault((*path, "scale"), "is missing", message, kind="missing")
            elif (scale := scales.get(str(table["scale"]))) is not None and scale.points != POINTS:
                message = f"has {scale.points} points, but statements need {POINTS}"
                hint = f'write kind = "rating" and scale = "{table["scale"]}" in the items'
                yield Fault((*path, "scale"), message, hint)
        yield from _check_show_if(table, valid_items, Context(scales, table.get("scale"), language))
        numbers = [item.id for item in items if item.value_type != "text"]
        choices = [item.id for item in items if item.value_type == "text"]
        for key, answered, known in (("items", "a number", numbers), ("weights_from", "a choice", choices)):
            for place, name in entries(table, f"scores.*.{key}.*"):
                if isinstance(name, str) and name not in known:
                    message = f'there is no item "{name}" whose answer is {answered}'
                    yield unknown_name((*path, *place), message, name, known)


def _valid_or_none(read: Callable[[Any], _T], table: Any) -> _T | None:
    """Return the scale or question that ``read`` makes of a table; None if that is invalid."""
    try:
        return read(table) if isinstance(table, Mapping) else None
    except (KeyError, ValidationError):
        return None


def _check_show_if(table: Document, items: Sequence[tuple[Path, Question]], context: Context) -> Iterator[Fault]:
    earlier: dict[str, Question] = {}
    ids = [item.id for _, item in items]
    for path, item in items:
        if (rule := item.show_if) is not None:
            rule_path = (*path, "show_if")
            if rule.item not in ids:
                missing = f'there is no item "{rule.item}" in this questionnaire'
                yield Fault(rule_path, missing, did_you_mean(rule.item, earlier), kind="unknown name")
            elif rule.item not in earlier:
                yield Fault(rule_path, f'"{rule.item}" comes later', "choose an earlier item")
            elif table.get("item_order", "fixed") != "fixed":
                hint = 'write item_order = "fixed": an item must follow the item that it depends on'
                yield Fault(rule_path, "item_order is shuffled", hint)
            else:
                yield from _check_permitted_answers(rule_path, rule, earlier[rule.item], context)
        earlier[item.id] = item


def _check_permitted_answers(path: Path, rule: ShowIf, earlier: Question, context: Context) -> Iterator[Fault]:
    try:
        levels = list(earlier.levels(context))
    except KeyError:  # its scale, or a text in the language, is missing, which another check reports
        levels = []
    for value in rule.permitted:
        if levels and str(value) not in levels:
            yield Fault(path, f'"{value}" is not one of its answers', f"choose one of these: {', '.join(levels)}")
        elif earlier.value_type != "text" and isinstance(value, str):
            yield Fault(path, f'"{value}" is not one of its answers', "specify a number")
    if not rule.permitted and earlier.value_type == "text":
        yield Fault(path, f'the answer to "{rule.item}" is not a number', 'write is = "…"')
