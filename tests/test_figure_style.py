import matplotlib as mpl
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.page_layout import Sheet
from tests.analysis.colours import EYES, smallest

# Pairs of colours in CIELAB and their difference (Sharma, Wu & Dalal 2005, table 1).

# Levels 1 to 7; smallest differences of neighbours, and of mirrored levels, to normal, protan, deutan and tritan eyes.


def luminance(colour: str) -> float:
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(colour: str, other_colour: str) -> float:
    low, high = sorted((luminance(colour), luminance(other_colour)))
    return (high + 0.05) / (low + 0.05)


def test_no_eye_takes_a_level_for_its_neighbour_or_its_opposite() -> None:
    for eye in EYES:
        neighbours, mirrored = smallest(style.LEVEL_COLOURS, eye)
        assert neighbours > 15, eye
        assert mirrored > 25, eye


def test_in_grey_neighbouring_levels_of_a_side_differ() -> None:
    # Printed without colour both ends are dark: which side an answer is on is told by its place, never by the grey.
    greys = [luminance(colour) for colour in style.LEVEL_COLOURS]
    assert greys[:4] == sorted(greys[:4])
    assert greys[3:] == sorted(greys[3:], reverse=True)
    for colour, next_colour in zip(style.LEVEL_COLOURS, style.LEVEL_COLOURS[1:], strict=False):
        assert contrast(colour, next_colour) > 1.5


@pytest.mark.parametrize("level", range(1, 8))
def test_counts_on_every_level_are_legible(level: int) -> None:
    assert contrast(style.LEVEL_COLOURS[level - 1], style.LEVEL_INKS[level - 1]) >= 4.5


@pytest.mark.parametrize(
    ("ink", "ground"),
    [
        (style.TEXT, "#ffffff"),
        (style.TEXT_SOFT, "#ffffff"),
        (style.WARN, style.WARN_GROUND),
        (style.SEALED, style.SEALED_GROUND),
    ],
)
def test_words_are_legible(ink: str, ground: str) -> None:
    assert contrast(ink, ground) >= 4.5


def drawn_figure() -> Figure:
    sheet = Sheet(100, 40, style.fonts())
    sheet.text(10, 20, "Text $kept$ as text")
    return sheet.figure


def test_svg_keeps_text_as_text_without_reading_it_as_mathematics() -> None:
    assert b"Text $kept$ as text" in style.file_bytes(drawn_figure(), "svg", "Title")


def test_pdf_embeds_truetype() -> None:
    content = style.file_bytes(drawn_figure(), "pdf", "Title")
    assert b"/CIDFontType2" in content
    assert b"/Type3" not in content


@pytest.mark.parametrize("kind", style.FORMATS)
def test_no_file_tells_a_date(kind: str) -> None:
    content = style.file_bytes(drawn_figure(), kind, "Title").lower()
    for word in (b"creationdate", b"moddate", b"dc:date", b"creation time"):
        assert word not in content


@pytest.mark.slow
@pytest.mark.parametrize("kind", style.FORMATS)
def test_the_users_settings_change_nothing_and_come_back(kind: str) -> None:
    plain = style.file_bytes(drawn_figure(), kind, "Title")
    with mpl.rc_context({"savefig.bbox": "tight", "pdf.fonttype": 3, "svg.fonttype": "path", "path.simplify": False}):
        assert style.file_bytes(drawn_figure(), kind, "Title") == plain
        assert mpl.rcParams["pdf.fonttype"] == 3


def test_wrapping_breaks_at_spaces_and_never_loses_a_word() -> None:
    sheet = Sheet(200, 40, style.FALLBACK_FONTS)
    words = "The strength of the force feedback is adequate"
    lines = sheet.wrap(words, 60, 8)
    assert " ".join(lines) == words
    assert len(lines) > 1
    assert all(sheet.text_width(line, 8) <= 60 for line in lines)
    assert sheet.wrap("Incomprehensibilities", 20, 8) == ["Incomprehensibilities"]
