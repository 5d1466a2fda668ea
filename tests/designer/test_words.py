"""The designer's texts on versions, drafts, playing and problems: calls and their results, without a window.

People change ``words.txt``; no option regenerates it.
"""

from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest

from study_app.designer import header, version_rows
from study_app.designer.document import document
from study_app.designer.document.elements import kind_and_title, place_text
from study_app.designer.document.study import Study
from study_app.designer.file import file_text
from study_app.designer.new_study_page import KnownAnswer, header_state, template_choice
from study_app.designer.problems import fault_rows, problem_rows, warning_rows
from study_app.errors import StudyError
from study_app.store.versions.study_runs import Run
from study_app.store.versions.study_versions import Kept
from tests.designer.support.designer import DEMO
from tests.golden import check_kept
from tests.transcripts import calls, played

NOWHERE = Path("nowhere")
KEPT = (
    ("a", "saved", "2026-03-07T12:01:00+02:00", "AK"), ("s", "saved", "2026-03-09T17:45:00+02:00", ""),
    ("b", "found", "2026-03-09T07:02:00+02:00", ""), ("d", "draft", "2026-03-08T23:03:00+02:00", ""),
    ("d", "saved", "never", "BL"),
)  # fmt: skip
"""Hash, origin, time and operator of kept versions; s was run."""
CONTENTS = {"a": b'[study]\nversion = "0.7"\n', "b": b'x = 1\nversion = "0.8"', "d": None}


def demo(*changes: str) -> str:
    """Return the demo with texts that are replaced in turn."""
    text = DEMO
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def recovery(estimate: float, low: float, high: float) -> tuple[Any, ...]:
    """Return the verdict on an estimate of 40 ms, and its sentence."""
    answer = KnownAnswer(planted=40.0, unit="ms", source="a thesis", people=17, found=estimate, low=low, high=high)
    return answer.recovered, answer.most, answer.sentence


NAMES = {
    **{name: getattr(header, name) for name in (
        "StudyChoice", "device_question", "refusal_notice", "playing_notice", "ended_notice", "kept_notice",
        "problems_chip",
    )},
    **{name: getattr(version_rows, name) for name in (
        "version_chip", "version_choices", "edited_elements_text", "draft_title",
    )},
    **{name: getattr(document, name) for name in ("Standing", "version_standing", "check_version", "next_version")},
    "words": lambda choice: choice.label, "template_choice": template_choice, "place_text": place_text, "demo": demo,
    "recovery": recovery, "warned": lambda *said: [row.message for row in warning_rows(Study(DEMO, NOWHERE), said)],
    "STUDY": Study(DEMO, NOWHERE), "NOWHERE": NOWHERE, "DEMO": DEMO,
    "NOW": datetime(2026, 3, 9, 18, 30, tzinfo=timezone(timedelta(hours=2))),
    "KEPT": [Kept(hash=hash_, origin=origin, at=at, by=by) for hash_, origin, at, by in KEPT],
    "REHEARSED": Run(hash="r", version="0.3", rehearsals=1, last="2025-12-30T08:05:00+02:00"),
    "PILOTED": Run(hash="p", version="0.9", pilots=2, rehearsals=3, last="2026-03-08T09:10:00+02:00"),
    "RUN": Run(hash="s", version="1.2", sessions=4, pilots=1, last="2026-03-09T15:45:00+00:00"),
}  # fmt: skip


def test_each_call_has_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(version_rows, "kept_content", CONTENTS.get)
    file = Path(__file__).with_name("words.txt")
    check_kept(file, played(file, calls(NAMES, StudyError)))
    many = [Kept(hash=str(number), origin="draft", at="") for number in range(50)]
    choices = version_rows.version_choices((), many, "", NAMES["NOW"])
    assert [key for key, _ in choices] == [*map(str, range(49, 9, -1))]
    empty = header_state(None, (), 3, version_rows.VersionChip(text="1.0"))
    assert empty == header.HeaderState()


def test_a_problem_has_the_name_icon_place_and_line_of_its_element() -> None:
    text = demo("radius_mm = ", "radius_mm = -", 'order = "shuffled"', 'order = "sideways"')
    study = Study(text, NOWHERE)
    lines = text.splitlines()
    rows = {row.fault.path: row for row in problem_rows(study)}
    assert list(rows) == sorted(rows, key=lambda path: rows[path].line or 0)
    for path, row in rows.items():
        assert lines[(row.line or 0) - 1].startswith(f"{path[-1]} =")
        assert row.element == path[:2]
        label = path[-1].removesuffix("_mm").replace("_", " ").capitalize()
        assert row.name == f"{kind_and_title(study.document, path[:2])}, {label}"
        assert (row.place, row.warning) == (f"{'.'.join(path)} · line {row.line}", False)
    warned = warning_rows(study, ["the liquid thick is thin", "blocks.delays.order: late", "other", "other"])
    assert [(row.element, row.warning) for row in warned] == [
        (("liquids", "thick"), True), (("blocks", "delays"), True), (("study",), True),
    ]  # fmt: skip
    marked = file_text(study, "oil.toml", ("tasks", "reach"))
    assert (marked.name, marked.text) == ("oil.toml", text)
    ((first, last),) = marked.selected
    assert lines[first] == "[tasks.reach]"
    assert lines[last].split(" ")[0] in study.document["tasks"]["reach"]
    assert marked.faulty == tuple(sorted({(row.line or 0) - 1 for row in fault_rows(study)}))
