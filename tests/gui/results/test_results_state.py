"""Texts of the results window, and figures in the colours of a theme."""

import pytest
from PySide6.QtCore import QSize

from study_app.gui.results.figures import drawn_svg, figure_counts, themed_svg
from study_app.gui.sessions.session_facts import occurring_states, session_filter
from study_app.gui.theme.theme import DARK, LIGHT
from tests.gui.results.sample import COLOURS, SVG, facts


def test_who_is_in_the_figures_and_why_the_others_are_not():
    held = [facts(f"P{number:03d}") for number in range(1, 13)]
    assert figure_counts(held) == ("12 of 12 sessions in the figures", "")
    held += [facts("P013", status="unfinished"), facts("P014", excluded="asleep")]
    assert figure_counts(held) == ("12 of 14 sessions in the figures", "P013 is not complete; P014 is excluded.")
    assert figure_counts([]) == ("", "")
    assert figure_counts(held[:1])[0] == "1 of 1 session in the figures"


def test_many_that_are_not_are_counted():
    held = [facts(f"P{number:03d}", status="withdrawn") for number in range(1, 10)]
    assert figure_counts(held)[1] == "P001, P002, P003, P004 and 5 others are not complete."


def test_an_incomplete_excluded_session_is_mentioned_once():
    assert figure_counts([facts("P001", status="withdrawn", excluded="left")])[1] == "P001 is excluded."


@pytest.mark.parametrize(
    ("words", "status", "expected"),
    [
        ("", "", ["P001", "P002", "Q003"]),
        (" p00", "", ["P001", "P002"]),
        ("", "unfinished", ["P002"]),
        ("", "excluded", ["Q003"]),
        ("", "invalid", ["P001"]),
        ("q", "unfinished", []),
        ("novice", "", ["P002"]),
    ],
)
def test_sessions_are_found_by_participant_and_state(words, status, expected):
    held = [
        facts("P001", validity="invalid"),
        facts("P002", status="unfinished", group="novices"),
        facts("Q003", excluded="x"),
    ]
    assert [session.participant for session in held if session_filter(words, status)(session)] == expected
    assert [state for state, _ in occurring_states(held)] == ["completed", "unfinished", "invalid", "excluded"]


def test_in_the_light_theme_a_figure_looks_as_in_print():
    themed = themed_svg(SVG, COLOURS, LIGHT)
    for role in ("text", "accent", "grid"):
        assert getattr(LIGHT, role).encode().lower() in themed.lower()
    assert b"#02256d" in themed


def test_in_the_dark_theme_paper_and_letters_change_and_levels_do_not():
    themed = themed_svg(SVG, COLOURS, DARK)
    assert COLOURS["text"].encode() not in themed
    assert f'id="paper" style="fill: {DARK.surface}"'.encode() in themed
    assert f'id="level7" style="fill: #02256d; stroke: {DARK.ctl}"'.encode() in themed
    assert b'fill: #ffffff" id="white">7<' in themed, "letters on a dark level stay white"
    assert f'fill: {DARK.text}" id="ink"'.encode() in themed
    assert b'id="shade" style="fill: #0b65a3; fill-opacity: 0.3"' in themed, "a shade under light letters stays deep"


def test_a_figure_is_drawn_at_the_screens_resolution(qapp):
    image = drawn_svg(themed_svg(SVG, COLOURS, DARK), QSize(200, 100), 2.0)
    assert (image.width(), image.height(), image.devicePixelRatio()) == (400, 200, 2.0)
    assert image.pixelColor(2, 2).name() == DARK.surface.lower()
    assert image.pixelColor(200, 100).name() == "#02256d"
