"""The list of pages in Help, its search, and the text of a page for a reader without HTML."""

import re

import pytest

from study_app import documentation
from study_app.gui.help.view import anchor_of, entries, found, text_of


def test_every_page_is_listed_once_below_the_heading_of_its_section() -> None:
    rows = entries()
    assert sorted(row.page for row in rows) == list(documentation.names())
    assert [row.page for row in rows if row.heads] == ["index", *documentation.sections()]
    names = [row.page for row in rows]
    assert names.index("begin") < names.index("first-session") < names.index("do")


ASKED = [
    # A researcher, before the first participant
    ("How many people do I need?", "sample size", "power", "`power` simulates whole studies"),
    ("How many participants?", "how many participants", "power", "`power` simulates whole studies"),
    ("How many do others have?", "participants", "power", "`analysis.participants` is the planned number"),
    ("Which effect is assumed?", "effect size", "power", "Other statements have no effect"),
    ("What do I tell them?", "what to tell the participant", "participants", "What must not be said"),
    ("What may the board ask?", "ethics board", "participants", "How large can the force be?"),
    ("Liquid and delay at once: how?", "two factors interaction", "contrasts", "The report tests no interaction"),
    ("Which interval is it?", "confidence interval of a threshold", "statistics", "equal-tailed, of the posterior"),
    ("How is it cited?", "how to cite", "index", "Please cite the program"),
    ("We measured our syrup.", "own liquid measured viscosity", "liquid-files", "viscosity_pa_s = 3"),
    ("Is ketchup possible?", "shear thinning", "materials", "Its parameters are those that a rheometer measures"),
    ("A threshold at which percentage?", "threshold definition", "level-results", "75 % correct"),
    ("Is anything sent?", "telemetry", "participants", "files on this computer"),
    ("A staircase, or always the same levels?", "staircase or constant", "methods", "**`updown`**: one step down"),
    ("Can a person come on two days?", "second visit another day", "groups", "`sequences` those of session 1, 2"),
    ("Which of three is different: how?", "3AFC odd one out", "trials", "the odd or repeated interval"),
    ("How right is the force?", "how accurate is the force", "accuracy", "is within 3 %"),
    ("Does it drive our Touch?", "3D Systems Touch", "device-contract", "Devices, none tried"),
    (
        "Can I tell them if they were right?",
        "feedback after each trial",
        "trials",
        "Only then can a block have feedback",
    ),
    ("Is the force safe?", "maximum force safe", "safety", "the force limit (8 N)"),
    # A researcher, after five participants
    ("A word in a question is wrong.", "typo after five participants", "designer", "proposes the next version"),
    ("The study file is wrong: edit it?", "mistake in the study file", "designer", "proposes the next version"),
    (
        "May I change the liquids now?",
        "change protocol after first participant",
        "designer",
        "With changed liquids, conditions, stimuli or blocks, sessions are refused there",
    ),
    ("There is a new version: take it?", "update in the middle of a study", "year", "Do not update if you can stay."),
    ("May questions come in any order?", "shuffled questions", "questions", "`shuffled`: drawn each time"),
    # An assistant, with a participant in the room
    (
        "The tank is on my screen, not on theirs.",
        "window on the wrong monitor",
        "this-machine",
        "the participant's screen",
    ),
    ("I see no taskbar any more.", "not full screen", "run-a-session", "On a single one use `--windowed`"),
    ("I typed P12 instead of P21.", "wrong participant number", "run-a-session", "A wrong participant ID"),
    ("She has to go to the toilet.", "participant needs a break", "run-a-session", "P pauses"),
    ("Honey buzzes, but the device is sound.", "buzzing", "run-a-session", "If only a thick liquid vibrates, lower"),
    ("The handle shakes.", "device starts buzzing", "run-a-session", "If the handle vibrates or pulls"),
    ("May I put it online?", "share data without personal data", "files", "Before you share"),
    ("The power failed.", "power cut during a trial", "run-a-session", "No answer is lost."),
    ("The device hums.", "headphones noise motors", "run-a-session", "masked by headphones or noise"),
    ("He comes again.", "second session same participant", "run-a-session", "enter the same ID and *Session* 2"),
    # An analyst, with a folder of results
    ("Where are reaction times?", "reaction time", "level-results", "time to answer"),
    ("What is in this column?", "what a column means", "data-dictionary", "Largest magnitude of the force sent"),
    ("How do I leave one trial out?", "exclude one trial", "answers-to-report", "or one of its trials (`--trial N`)"),
    ("How do I read recordings?", "open recordings in matlab", "export", "`parquetread` in MATLAB"),
    ("At how many hertz?", "sampling rate", "export", "a row per tick: 1,000 per second"),
    ("Are p-values corrected?", "multiple comparisons", "statistics", "Primary statements are corrected by Holm"),
    (
        "Do trials with valid = false count?",
        "invalid trials counted",
        "valid-trials",
        "count whether it is valid or not",
    ),
    ("Verify says: not sound.", "not sound", "back-ups", "the lines above it name file and cause"),
    ("Where can I unblind?", "unblind on another computer", "back-ups", "the folder is enough"),
    (
        "How do I align answers with EEG?",
        "align with EEG",
        "lab-streaming-layer",
        "Markers have the time of their event",
    ),
    ("May I use my own observer?", "run headless from a script", "api", "`question.felt` has for each interval"),
    ("How late was everything together?", "total latency", "photodiode", "From a motion of the hand to the screen"),
]
"""What new readers asked, the words that they typed into the search, the page, and what answers them there."""


@pytest.mark.parametrize(("words", "page", "answer"), [asked[1:] for asked in ASKED], ids=[asked[0] for asked in ASKED])
def test_the_words_of_a_reader_find_the_page_with_the_answer_first(words: str, page: str, answer: str) -> None:
    assert found(words)[0].page == page
    assert answer in " ".join(documentation.page(page).split())


def test_a_search_finds_words_that_begin_alike_the_best_page_first_at_its_heading() -> None:
    assert found("") == entries()
    pages = [row.page for row in found("photodiodes zebra")]
    assert pages[0] == "photodiode"
    assert "timing" in pages
    assert found("zebra") == ()
    assert not any(row.heads for row in found("photodiode"))
    assert (found("new versions")[0].page, found("new versions")[0].anchor) == (
        "year",
        "a-new-version-of-the-program-in-the-middle-of-a-study",
    )
    assert next(row.page for row in found("spss")) == "export"  # a list of pages comes after them


def test_a_search_finds_generated_parts() -> None:
    assert "data-dictionary" in [row.page for row in found("lateness_p99_ms")]
    assert "protocol-format" in [row.page for row in found("breaking_span_m")]
    assert "commands" in [row.page for row in found("--answers-only")]


def test_texts_have_neither_comments_nor_html_nor_empty_cells() -> None:
    for page in documentation.names():
        text = text_of(page)
        prose = re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)
        assert "<!--" not in text, page
        assert not re.search(r"<(img|details|summary|b)\b", prose), page
        assert "| |" not in text, page


def test_anchors_are_those_of_links() -> None:
    assert anchor_of("Tables and report") == "tables-and-report"
    assert anchor_of("“125 ms” & more: a test?") == "125-ms--more-a-test"
