"""What the designer says of versions, drafts, playing and problems: texts written by hand, without a window."""

from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from study_app.designer import header, version_rows
from study_app.designer.document.document import Standing
from study_app.designer.document.elements import kind_and_title, place_words, title_of
from study_app.designer.document.study import Study
from study_app.designer.file import file_text
from study_app.designer.header import Notice, StudyChoice
from study_app.designer.new_study_page import KnownAnswer, header_state, template_choice
from study_app.designer.problems import fault_rows, problem_rows, warning_rows
from study_app.store.study_runs import Run
from study_app.store.study_versions import Kept
from tests.designer.support.designer import DEMO

NOWHERE = Path("nowhere")
NOW = datetime(2026, 3, 9, 18, 30, tzinfo=timezone(timedelta(hours=2)))
REHEARSED = Run(hash="r", version="0.3", rehearsals=1, last="2025-12-30T08:05:00+02:00")
PILOTED = Run(hash="p", version="0.9", pilots=2, rehearsals=3, last="2026-03-08T09:10:00+02:00")
RUN = Run(hash="s", version="1.2", sessions=4, pilots=1, last="2026-03-09T15:45:00+00:00")


@pytest.mark.parametrize(
    ("standing", "known", "chip"),
    [
        (Standing("1.0"), (), ("neutral", "ring", "Not yet run", "No session has been run with this study", "Save")),
        (Standing("1.0"), (REHEARSED,), ("neutral", "ring", "Rehearsed", "Version 0.3: 1 rehearsal", "Save")),
        (
            Standing("1.0"),
            (REHEARSED, PILOTED),
            (
                "neutral", "ring", "Piloted",
                "Version 0.3: 1 rehearsal\nVersion 0.9: 2 pilots, 3 rehearsals", "Save",
            ),
        ),
        (
            Standing("1.2", "1.2", 4),
            (RUN,),
            ("ok", "check", "1.2, run by 4", "Version 1.2: 4 sessions, 1 pilot", "Save"),
        ),
        (
            Standing("1.3", "1.2", asks=True),
            (RUN,),
            ("accent", "pen", "1.3, was 1.2", "Version 1.2: 4 sessions, 1 pilot", "Save 1.3 …"),
        ),
    ],
)  # fmt: skip
def test_the_chip_says_with_whom_a_version_was_run(
    standing: Standing, known: tuple[Run, ...], chip: tuple[str, ...]
) -> None:
    shown = version_rows.version_chip(standing, known)
    assert (shown.tone, shown.icon, shown.words, shown.tip, shown.save) == chip


def test_each_version_to_compare_with_has_its_own_words_newest_first(monkeypatch: pytest.MonkeyPatch) -> None:
    contents = {"a": b'[study]\nversion = "0.7"\n', "b": b'x = 1\nversion = "0.8"', "d": None}
    monkeypatch.setattr(version_rows, "kept_content", contents.get)
    rows = [
        ("a", "saved", "2026-03-07T12:01:00+02:00", "AK"), ("s", "saved", "2026-03-09T17:45:00+02:00", ""),
        ("b", "found", "2026-03-09T07:02:00+02:00", ""), ("d", "draft", "2026-03-08T23:03:00+02:00", ""),
        ("d", "saved", "never", "BL"),
    ]  # fmt: skip
    kept = [Kept(hash=hash_, origin=origin, at=at, by=by) for hash_, origin, at, by in rows]
    choices = version_rows.version_choices((REHEARSED, RUN), kept, "The file without the edits", NOW)
    assert choices == (
        ("file", "The file without the edits"),
        ("s", "1.2: 4 sessions, 1 pilot, last today 17:45"),
        ("r", "0.3: 1 rehearsal, last 30 Dec 2025 08:05"),
        ("d", "No version: saved by BL at an unknown time"),
        ("d", "Unsaved edits from another window, yesterday 23:03"),
        ("b", "0.8: the file before it was saved today 07:02"),
        ("a", "0.7: saved by AK 7 Mar 12:01"),
    )
    assert version_rows.version_choices((), (), "", NOW) == ()
    many = [Kept(hash=str(number), origin="draft", at="") for number in range(50)]
    assert [key for key, _ in version_rows.version_choices((), many, "", NOW)] == [*map(str, range(49, 9, -1))]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ([], ": only comments, order or formatting"),
        ([("A first look", "Another look")], ": Title"),
        ([("density_kg_m3 = 1400", "density_kg_m3 = 1300")], ": Thick"),
        ([("max_s = 30", "max_s = 31"), ("density_kg_m3 = 1400", "density_kg_m3 = 1300")], ": Thick, Explore"),
    ],
)
def test_a_draft_names_the_elements_that_were_edited(changes: list[tuple[str, str]], says: str) -> None:
    draft = DEMO
    for old, new in changes:
        assert old in draft, old
        draft = draft.replace(old, new, 1)
    assert version_rows.edited_elements_text(DEMO, draft, NOWHERE) == says
    assert version_rows.edited_elements_text(DEMO, "[", NOWHERE) == version_rows.draft_title("[", NOWHERE) == ""
    assert version_rows.draft_title(draft, NOWHERE) == ("Another look" if ": Title" in says else "A first look")


def test_each_line_above_the_study_has_its_own_words_buttons_and_look() -> None:
    problems = tuple(f"problem {number}" for number in range(1, 9))
    ended = "Played from Water: it broke. The recorded data will be deleted unless you save them."
    refused = "The study cannot be played from here: correct these problems first"
    to_show = (("problems", "Show problems"), ("close", "Close"))
    forced, weak = (header.device_question("Falcon", "Water", has_force=has) for has in (True, False))
    assert (forced, weak) == tuple(
        Notice(
            f"Play from Water using the device Falcon? {force} Hold Esc to stop.",
            (("play", "Play"), ("close", "Cancel")),
            "warn",
            "device",
        )
        for force in ("The force fades in when a trial begins.", "This device does not produce force.")
    )
    assert header.refusal_notice(problems) == Notice(refused, to_show, "bad", "warning", (*problems[:6], "and 2 more"))
    assert header.refusal_notice(problems[:6]).listed == problems[:6]
    assert header.playing_notice("Water", "Falcon") == Notice(
        "Playing from Water using the device Falcon. Hold Esc to stop.", (("stop", "Stop"),), "ok", "play"
    )
    assert header.ended_notice("Water", "it broke") == Notice(
        ended, (("keep", "Keep as pilot"), ("delete", "Delete")), "neutral", "flag"
    )
    assert header.kept_notice("a/b") == Notice("Saved as a pilot in a/b.", (("close", "Close"),), "ok", "check")


def test_the_header_counts_problems_before_warnings_and_says_where_a_study_is_from() -> None:
    chips = [header.problems_chip(*counts) for counts in ((2, 1), (1, 3), (0, 1), (0, 2), (0, 0))]
    assert chips == [
        ("bad", "warning", "2 problems"), ("bad", "warning", "1 problem"), ("warn", "warning", "1 warning"),
        ("warn", "warning", "2 warnings"), ("ok", "check", "No problems"),
    ]  # fmt: skip
    choices = [
        StudyChoice(title="Oil", file="oil.toml", source="x", shipped=shipped, original=original)
        for shipped, original in ((False, ""), (False, "demo"), (True, "demo"))
    ]
    assert [choice.words for choice in choices] == [
        "Oil  ·  oil.toml", "Oil  ·  oil.toml  (copy of demo)", "Oil  ·  oil.toml  (shipped)",
    ]  # fmt: skip
    empty = header_state(None, tuple(choices), 3, version_rows.VersionChip(words="1.0"))
    assert empty == header.HeaderState(studies=tuple(choices))


@pytest.mark.parametrize(
    ("found", "low", "high", "recovered", "most"),
    [
        (43.9, 30.0, 60.0, True, 100.0), (36.0, 30.0, 60.0, True, 100.0), (44.1, 30.0, 60.0, False, 100.0),
        (35.9, 30.0, 60.0, False, 100.0), (41.0, 40.5, 60.0, False, 100.0), (39.0, 30.0, 39.5, False, 70.0),
        (40.0, 40.0, 40.0, True, 70.0),
    ],
)  # fmt: skip
def test_a_known_answer_is_recovered_within_a_tenth_if_most_studies_enclose_it(
    found: float, low: float, high: float, recovered: bool, most: float
) -> None:
    answer = KnownAnswer(planted=40.0, unit="ms", source="a thesis", people=17, found=found, low=low, high=high)
    assert (answer.recovered, answer.most) == (recovered, most)
    assert answer.sentence.startswith(
        f"Simulated: 40 ms at 75 % correct (based on a thesis). Estimated: {found:.3g} ms; in 9 of 10 simulated "
        f"studies with 17 participants the estimate was between {low:.3g} and {high:.3g} ms. "
    )


def test_a_template_shows_its_length_needs_steps_and_languages() -> None:
    study = Study(DEMO, NOWHERE)
    shown = template_choice("demo", study)
    assert (shown.source, shown.title, shown.study_title) == ("template:demo", "demo", "A first look")
    assert shown.languages == tuple(study.document["study"]["languages"])
    assert [icon for icon, _ in shown.figures] == ["clock", "layers"]
    assert shown.figures[1][1] == "4 trials"
    assert shown.tags == (("device", "Up to 6 N"), ("lock", "Double-blind"))
    assert [title for _, title, _ in shown.session] == [
        title_of(study.document, path)
        for path in (
            ("pages", "welcome"), ("blocks", "liquids"), ("pages", "reaching"), ("blocks", "delays"),
            ("pages", "thanks"),
        )
    ]  # fmt: skip
    assert all(time.endswith(("s", "min")) for *_, time in shown.session)


def test_a_problem_has_the_name_icon_place_and_line_of_its_element() -> None:
    text = DEMO.replace("radius_mm = ", "radius_mm = -").replace('order = "shuffled"', 'order = "sideways"')
    study = Study(text, NOWHERE)
    lines = text.splitlines()
    rows = {row.fault.path: row for row in problem_rows(study)}
    assert list(rows) == sorted(rows, key=lambda path: rows[path].line or 0)
    for path, row in rows.items():
        assert lines[(row.line or 0) - 1].startswith(f"{path[-1]} =")
        assert row.element == path[:2]
        label = path[-1].removesuffix("_mm").replace("_", " ").capitalize()
        assert row.name == f"{kind_and_title(study.document, path[:2])}, {label}"
        assert row.place == f"{'.'.join(path)} · line {row.line}"
        assert not row.warning
    assert place_words(("a", 1, "b"), 7) == "a.2.b · line 7"
    assert place_words(("a",), None) == "a"
    warned = warning_rows(study, ["the liquid thick is thin", "blocks.delays.order: late", "other", "other"])
    assert [(row.element, row.message, row.warning) for row in warned] == [
        (("liquids", "thick"), "The liquid thick is thin", True),
        (("blocks", "delays"), "Late", True),
        (("study",), "Other", True),
    ]
    marked = file_text(study, "oil.toml", ("tasks", "reach"))
    assert (marked.name, marked.text) == ("oil.toml", text)
    ((first, last),) = marked.selected
    assert lines[first] == "[tasks.reach]"
    assert lines[last].split(" ")[0] in study.document["tasks"]["reach"]
    assert marked.faulty == tuple(sorted({(row.line or 0) - 1 for row in fault_rows(study)}))
