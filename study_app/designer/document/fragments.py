"""Elements of a study as TOML on their own, with their comments: copied, and pasted into the same or another study."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, Final

from study_app.designer.document.additions import added
from study_app.designer.document.changes import short_of
from study_app.designer.document.fields import label_of, row_at
from study_app.designer.document.names import languages_of, references_to, renamed
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Rename, Set, WriterError, apply, insert_block, same
from study_app.designer.document.toml_text import Editor, Refused, applied, spans_of, tables
from study_app.ids import MAX_FROM_TEXT, free_id, id_of
from study_app.protocol.source.document import Path, entries, frozen, names, value_at

MOST_LINES: Final = 200
_BULLET: Final = re.compile(r"^\s*(?:[-*•]|\d{1,3}[.)])\s+")


def copied(study: Study, paths: Sequence[Path]) -> str:
    """Return elements as TOML, each with its own comments; "" where none of them is a table."""
    spans = spans_of(study.text)
    found: list[str] = []
    for path in paths:
        value = value_at(study.document, path)
        if not isinstance(value, Mapping) or len(path) < 2:
            continue
        pieces = spans.pieces(path)
        if pieces and all(piece.node.kind in {"table", "array table"} for piece in pieces):
            texts = [study.text[piece.start : piece.end].replace("\r\n", "\n") for piece in pieces]
            found.append("\n".join(text if text.endswith("\n") else f"{text}\n" for text in texts))
        else:
            found.append(tables(path, _plain(value), "\n", entry=isinstance(path[-1], int)))
    return "\n".join(found)


def pasted(study: Study, selected: Path, text: str) -> tuple[str, tuple[Path, ...]]:
    """Return a text with elements, as TOML, pasted after the selected one of their kind, and the paths of these.

    Names already in use get a number, also in references within the pasted text. Lines that are not TOML become
    questions of the selected questionnaire.
    """
    text = text.replace("\r\n", "\n").strip("\n") + "\n"
    try:
        document = frozen(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, ValueError):
        return _questions_of(study, selected, text)
    if not document:
        raise Refused("there is nothing to paste: copy elements, or lines for questions")
    for section in document:
        row = row_at(study.document, (section,))
        if row is None or row.kind != "tables" or not isinstance(document[section], Mapping):
            raise Refused(f"{label_of(section)} is not a section of tables: only elements of a study are pasted")
        for name, table in document[section].items():
            if not isinstance(table, Mapping):
                raise Refused(f"{section}.{name} is not a table: only elements of a study are pasted")
    if any(True for _ in spans_of(text).section(None)):  # keys before the first header would end up in another table
        paths = [(section, name) for section in document for name in document[section]]
        text = "\n".join(tables(path, _plain(document[path[0]][path[1]]), "\n") for path in paths)
    if list(document) == ["questionnaires"]:
        [*forms] = document["questionnaires"].values()
        if len(forms) == 1 and list(forms[0]) == ["items"] and isinstance(forms[0]["items"], tuple):
            return _items(study, selected, text, document)
    return _tables(study, selected, text, document)


def _tables(study: Study, selected: Path, text: str, document: Mapping[str, Any]) -> tuple[str, tuple[Path, ...]]:
    paths: list[Path] = []
    for section in document:
        taken = set(names(study.document, section))
        for name in document[section]:
            new = free_id({*taken, *(set(document[section]) - {name})}, name) if name in taken else name
            if new != name:
                inner = frozen(tomllib.loads(text))
                text, _ = apply(text, Rename((section, name), new, references_to(inner, (section, name))))
            taken.add(new)
            paths.append((section, new))
    meant = {key: dict(value) if isinstance(value, Mapping) else value for key, value in study.document.items()}
    for section, inner in tomllib.loads(text).items():
        meant[section] = {**meant.get(section, {}), **inner}
    after = [path for path in (selected[:2], *_last(study, paths[0][0])) if path[:1] == paths[0][:1]]
    return _inserted(study, after, text, meant), tuple(paths)


def _items(study: Study, selected: Path, text: str, document: Mapping[str, Any]) -> tuple[str, tuple[Path, ...]]:
    """Paste questions into the selected questionnaire, or into that of their own name."""
    [name] = document["questionnaires"]
    form = str(selected[1]) if selected[:1] == ("questionnaires",) and len(selected) > 1 else name
    if form not in names(study.document, "questionnaires"):
        raise Refused("select the questionnaire that the questions are pasted into")
    if form != name:
        text, _ = apply(text, Rename(("questionnaires", name), form))
    there = _ids(study, form)
    count = len(document["questionnaires"][name]["items"])
    for index in range(count):
        inner = frozen(tomllib.loads(text))
        place = ("questionnaires", form, "items", index)
        own = inner["questionnaires"][form]["items"][index]
        if isinstance(own, Mapping) and own.get("id") in there:
            others = {one.get("id") for one in inner["questionnaires"][form]["items"] if isinstance(one, Mapping)}
            for edit in renamed(inner, place, free_id(there | {str(one) for one in others}, str(own["id"]))):
                text, _ = apply(text, edit)
    new = tomllib.loads(text)["questionnaires"][form]["items"]
    there_now = [item for _, item in entries(study.document, f"questionnaires.{form}.items.*")]
    at = int(selected[3]) + 1 if len(selected) == 4 and selected[1] == form else len(there_now)
    meant = _plain(study.document)
    meant["questionnaires"][form]["items"] = [*map(_plain, there_now[:at]), *new, *map(_plain, there_now[at:])]
    after = [("questionnaires", form, "items", at - 1)] if at else [("questionnaires", form)]
    paths = tuple(("questionnaires", form, "items", at + index) for index in range(count))
    items = spans_of(study.text).node(("questionnaires", form, "items"))
    if items is not None:  # an array of inline tables
        made, _ = study.edited(Set(("questionnaires", form, "items"), meant["questionnaires"][form]["items"]))
        return made.text, paths
    return _inserted(study, after, text, meant), paths


def _inserted(study: Study, after: Sequence[Path], text: str, meant: Mapping[str, Any]) -> str:
    """Return the study's text with another one after the first existing one of some elements, else at its end."""
    spans = spans_of(study.text)
    pieces = next((pieces for path in after if (pieces := spans.pieces(path))), [])
    if any(piece.node.kind not in {"table", "array table"} for piece in pieces):
        pieces = []
    editor = Editor(study.text)
    at = pieces[-1].end if pieces else len(study.text)
    insert_block(spans, editor, at, text.replace("\n", spans.newline))
    made = applied(study.text, editor.splices)
    try:
        there = tomllib.loads(made)
    except tomllib.TOMLDecodeError as error:
        raise Refused("the text cannot be pasted here: paste it into the file instead") from error
    if not same(there, _plain(meant)):
        raise WriterError("pasting made another document than the one meant")
    return made


def _questions_of(study: Study, selected: Path, pasted_text: str) -> tuple[str, tuple[Path, ...]]:
    """Return a study with a question for each line, of the kind of the selected one, in the first language."""
    if selected[:1] != ("questionnaires",) or len(selected) < 2:
        raise Refused("this is not TOML: select a questionnaire to paste its lines as questions")
    lines = [_BULLET.sub("", line).strip() for line in pasted_text.split("\n") if line.strip()]
    if len(lines) > MOST_LINES:
        raise Refused(f"these are {len(lines)} lines: paste at most {MOST_LINES} questions at once")
    form = str(selected[1])
    items = [item for _, item in entries(study.document, f"questionnaires.{form}.items.*")]
    at = int(selected[3]) if len(selected) == 4 else len(items) - 1
    like = items[at] if 0 <= at < len(items) and isinstance(items[at], Mapping) else {}
    kind = {key: like[key] for key in ("kind", "scale") if key in like}
    languages = languages_of(study.document)
    now, taken = study, _ids(study, form)
    paths: list[Path] = []
    for line in lines:
        name = free_id(taken, id_of(line, MAX_FROM_TEXT) or "question")
        taken.add(name)
        text, short = ({languages[0]: one} if len(languages) > 1 else one for one in (line, short_of(line)))
        value = {"id": name, **kind, "text": text, "short": short}
        edits, path = added(now, ("questionnaires", form, "items"), value, behind=at)
        now, _ = now.edited(*edits)
        paths.append(path)
        at = int(path[-1])
    return now.text, tuple(paths)


def _ids(study: Study, form: str) -> set[str]:
    return {str(name) for _, name in entries(study.document, f"questionnaires.{form}.items.*.id")}


def _last(study: Study, section: str | int) -> list[Path]:
    return [(section, name) for name in reversed(names(study.document, str(section)))]


def _plain(value: Any) -> Any:
    """Return a value as ``tomllib`` reads it: arrays as lists."""
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, tuple | list) else value
