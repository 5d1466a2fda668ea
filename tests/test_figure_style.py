import matplotlib as mpl
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from tests.analysis.colours import EYES, ciede2000, smallest

# Pairs of colours in CIELAB and their difference (Sharma, Wu & Dalal 2005, table 1).
SHARMA = [
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
    ((50, 3.1571, -77.2803), (50, 0, -82.7485), 2.8615),
    ((50, -1.3802, -84.2814), (50, 0, -82.7485), 1.0000),
    ((50, 0, 0), (50, -1, 2), 2.3669),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0009), 7.1792),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0011), 7.2195),
    ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
    ((50, 2.5, 0), (73, 25, -18), 27.1492),
    ((50, 2.5, 0), (56, -27, -3), 31.9030),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
]

# Levels 1 to 7; smallest differences of neighbours, and of mirrored levels, to normal, protan, deutan and tritan eyes.
PALETTES = {
    "ours": (style.LEVEL_COLOURS, (19.8, 16.1, 16.3, 19.3), (35.9, 28.9, 33.5, 44.4)),
    "vik": (
        ("#6d1007", "#b75a26", "#d69f7e", "#ebe6e2", "#7db0c9", "#116496", "#02256d"),
        (20.8, 17.6, 16.3, 19.3),
        (35.9, 28.9, 33.5, 44.4),
    ),
    "Brewer's PuOr": (
        ("#b35806", "#f1a340", "#fee0b6", "#f7f7f7", "#d8daeb", "#998ec3", "#542788"),
        (9.8, 9.4, 9.6, 7.1),
        (23.8, 24.2, 25.2, 19.9),
    ),
    "Brewer's RdBu": (
        ("#b2182b", "#ef8a62", "#fddbc7", "#f7f7f7", "#d1e5f0", "#67a9cf", "#2166ac"),
        (9.4, 7.1, 8.6, 12.3),
        (23.4, 16.5, 19.7, 30.0),
    ),
}


def luminance(colour: str) -> float:
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(("one", "other", "difference"), SHARMA)
def test_published_differences_of_colours(
    one: tuple[float, float, float], other: tuple[float, float, float], difference: float
) -> None:
    assert ciede2000(one, other) == pytest.approx(difference, abs=5e-5)
    assert ciede2000(other, one) == pytest.approx(difference, abs=5e-5)


@pytest.mark.parametrize("palette", PALETTES)
def test_published_differences_of_palettes_to_four_kinds_of_eyes(palette: str) -> None:
    colours, neighbours, mirrored = PALETTES[palette]
    for eye, next_to, across in zip(EYES, neighbours, mirrored, strict=True):
        assert smallest(colours, eye) == pytest.approx((next_to, across), abs=0.06), eye


def test_no_eye_takes_a_level_for_its_neighbour_or_its_opposite() -> None:
    for eye in EYES:
        neighbours, mirrored = smallest(style.LEVEL_COLOURS, eye)
        assert neighbours > 15, eye
        assert mirrored > 25, eye


def test_in_grey_neighbours_on_one_side_differ_and_sides_are_told_by_place() -> None:
    # Printed without colour both ends are dark: which side an answer is on is told by its place, never by the grey.
    greys = [luminance(colour) for colour in style.LEVEL_COLOURS]
    assert greys[:4] == sorted(greys[:4])
    assert greys[3:] == sorted(greys[3:], reverse=True)
    for one, other in zip(style.LEVEL_COLOURS, style.LEVEL_COLOURS[1:], strict=False):
        assert contrast(one, other) > 1.5


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


def drawn() -> Figure:
    sheet = Sheet(100, 40, style.PRINT_FONTS)
    sheet.text(10, 20, "Text $kept$ as text")
    return sheet.figure


def test_svg_keeps_text_as_text_without_reading_it_as_mathematics() -> None:
    assert b"Text $kept$ as text" in style.file_bytes(drawn(), "svg", "Title")


def test_pdf_embeds_truetype() -> None:
    content = style.file_bytes(drawn(), "pdf", "Title")
    assert b"/CIDFontType2" in content
    assert b"/Type3" not in content


@pytest.mark.parametrize("kind", style.FORMATS)
def test_no_file_tells_a_date(kind: str) -> None:
    content = style.file_bytes(drawn(), kind, "Title").lower()
    for word in (b"creationdate", b"moddate", b"dc:date", b"creation time"):
        assert word not in content


@pytest.mark.slow
@pytest.mark.parametrize("kind", style.FORMATS)
def test_the_users_settings_change_nothing_and_come_back(kind: str) -> None:
    plain = style.file_bytes(drawn(), kind, "Title")
    with mpl.rc_context({"savefig.bbox": "tight", "pdf.fonttype": 3, "svg.fonttype": "path", "path.simplify": False}):
        assert style.file_bytes(drawn(), kind, "Title") == plain
        assert mpl.rcParams["pdf.fonttype"] == 3


def test_a_text_is_as_wide_as_measured() -> None:
    sheet = Sheet(200, 40, style.PRINT_FONTS)
    text = sheet.text(10, 20, "Strength is adequate", size=8, weight="bold")
    width_pt = text.get_window_extent().width * 72 / style.PNG_DPI
    assert sheet.text_width("Strength is adequate", 8, "bold") == pytest.approx(width_pt, abs=0.5)


def test_wrapping_breaks_at_spaces_and_never_loses_a_word() -> None:
    sheet = Sheet(200, 40, style.PRINT_FONTS)
    words = "The strength of the force feedback is adequate"
    lines = sheet.wrap(words, 60, 8)
    assert " ".join(lines) == words
    assert len(lines) > 1
    assert all(sheet.text_width(line, 8) <= 60 for line in lines)
    assert sheet.wrap("Incomprehensibilities", 20, 8) == ["Incomprehensibilities"]
