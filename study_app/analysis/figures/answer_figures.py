"""The figures of answers to statements, with their captions: by setting, over delay, and of recognition.

Disagreement grows left and agreement right from one line; neutral answers stand in a column of their own on the same
scale, since splitting them over the line would make half of "neither" look like disagreement.

Darker means more, and every count stands in its cell, so that nothing depends on colour alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from study_app import figure_style as style
from study_app.analysis.data.blocks import Block, Kind
from study_app.analysis.data.measures import COUNT_COLUMNS, NEUTRAL, QUARTILES, by_participant
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures import delay_figures
from study_app.analysis.figures.delay_figures import line_words
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet, study_marks
from study_app.errors import AnalysisError

REASONS: Final = 5
REASON_SIGNS: Final = 80
"""How many reasons for exclusions a caption names; the codebook of an export holds all."""

FILES: Final = 3
"""Of files that are not as recorded so many are named."""

_NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def title(block: Block) -> str:
    """Return the heading of a block's figure."""
    if block.kind == "delays":
        return "Answers over added delay" if block.revealed else "Answers by delay setting"
    return f"Agreement for each {_noun(block)}"


def counts(study: Study, block: Block) -> list[str]:
    """Return what a figure says about n and about answers that are missing, the longest wording first."""
    people = people_a_setting(study, block)
    n = len(set(study.answers(block)["participant"]))
    gaps, missing = _missing(study, block)
    if set(people.values()) != {n}:
        low, high = min(people.values()), max(people.values())
        short = f"n = {low} to {high} of {n} participants" if low < high else f"n = {low} of {n} participants"
        whole, least = f"{short} in a {_noun(block)}", f"n = {low}–{high}"
    else:
        short, least = f"n = {n} participant" + ("s" if n != 1 else ""), f"n = {n}"
        presented = set(study.presented(block).values())
        whole = f"{short}, {_listed(presented)} presentations of a {_noun(block)}"
        if presented == {n}:
            whole = f"{short}, every {_noun(block)} {'presented to' if gaps else 'rated by'} all" if n > 1 else short
    return [f"{whole}{gaps}", *([f"{whole}{missing}"] if gaps else []), f"{short}{missing}", f"{least}{missing}"]


def _missing(study: Study, block: Block) -> tuple[str, str]:
    """Return how many of the ratings that were asked for are not there, in more and in fewer words; empty if none."""
    table = study.aggregate(block)
    there, asked = int(table["n"].sum()), int(table["presented"].sum())
    if there == asked:
        return "", ""
    return f", {asked - there} of {asked} ratings missing", f", {asked - there} missing"


def people_a_setting(study: Study, block: Block) -> dict[str, int]:
    """Return how many participants were presented each setting of a block."""
    rows = _counted_trials(study, block)
    return {code: int(rows.loc[rows["code"] == code, "participant"].nunique()) for code in block.codes}


def foot(block: Block) -> str:
    """Return the line under the plots over delay."""
    scale = f"1 = {block.labels[0]}, 7 = {block.labels[-1]}."
    if block.revealed:
        return f"Added delay, ms.   {scale}"
    return f"Delay settings by code; the order of the codes says nothing.   {scale}"


def caption(study: Study, block: Block) -> str:
    """Return the caption of a block's figure."""
    return " ".join(sentence for sentence in _sentences(study, block) if sentence)


def _sentences(study: Study, block: Block) -> list[str]:
    statements = f"{_number(len(block.items))} statement" + ("s" if len(block.items) != 1 else "")
    settings = f"{_number(len(block.settings))} {_noun(block)}" + ("s" if len(block.settings) != 1 else "")
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    start = f"{'Pilot. ' if study.pilot else ''}Agreement with {statements} on {settings}"
    head = f"{start} ({simulated}{counts(study, block)[0]})."
    drawn = _plots(study, block) if block.kind == "delays" else _bars(block)
    gone = [_left_out(study), _excluded_sessions(study), _excluded_trials(study, block)]
    return [
        head,
        *drawn,
        _blinded(study),
        _achieved(study, block),
        _unanswered(study, block),
        *gone,
        _invalid(study, block),
        _doubtful(study),
    ]


def _bars(block: Block) -> list[str]:
    return [
        "Bars: number of answers, disagreement left and agreement right of the line; neutral answers apart in grey, on "
        "the same scale.",
        "Numbers: counts of answers; a segment too narrow for its number carries none (all counts are in the exported "
        "aggregate table). n next to a bar: valid answers where some are missing.",
        f"Levels, from 1 to 7: {', '.join(block.labels)}.",
    ]


def _plots(study: Study, block: Block) -> list[str]:
    quartiles = f"the middle half of the answers; quartiles {QUARTILES}."
    scale = f"Answers from 1 ({block.labels[0]}) to 7 ({block.labels[-1]})."
    if block.revealed:
        return [
            f"Thin lines: {line_words(len(set(study.answers(block)['participant'])))}, slightly apart in height where "
            f"they coincide; thick line: median; band: {quartiles}",
            scale,
        ]
    return ["Dots: participants, equal answers side by side; ring: median; band: " + quartiles, scale]


def _blinded(study: Study) -> str:
    if study.revealed:
        return ""
    return "Settings are shown by code in the order of the codes, since the key is sealed; the order says nothing."


def _achieved(study: Study, block: Block) -> str:
    """Say how far the delays that were shown differed from those on the axis."""
    errors = _counted_trials(study, block)["delay_error_mean_ms"].dropna()
    if block.kind != "delays" or not block.revealed or errors.empty:
        return ""
    return (
        "The axis shows the delay asked for; the delay achieved differed from it by "
        f"{errors.mean():+.1f} ms on average (trials: {errors.min():+.1f} to {errors.max():+.1f} ms)."
    ).replace("-", "−")


def _unanswered(study: Study, block: Block) -> str:
    table = study.aggregate(block)
    return f"Cannot judge: {table['cannot_judge'].sum()}; not answered: {table['missing'].sum()}."


def _left_out(study: Study) -> str:
    if not study.left_out:
        return ""
    sessions = "session is" if study.left_out == 1 else "sessions are"
    return f"{study.left_out} {sessions} left out, not having been completed."


def _excluded_sessions(study: Study) -> str:
    rows = study.excluded_sessions
    if rows.empty:
        return ""
    sessions = "session is" if len(rows) == 1 else "sessions are"
    return f"{len(rows)} {sessions} excluded ({_reasons(rows)})."


def _excluded_trials(study: Study, block: Block) -> str:
    """Say which cells of the figure are empty, the session of each being in it."""
    rows = study.excluded_trials(block)
    if rows.empty:
        return ""
    answers = "trial is excluded, its answers" if len(rows) == 1 else "trials are excluded, their answers"
    return f"{len(rows)} {answers} missing here ({_reasons(rows)})."


def _reasons(rows: pd.DataFrame) -> str:
    """List why rows are excluded: each reason once, with its number where it is not the only one."""
    counted = Counter(_shortened(str(reason)) for reason in rows["exclusion_reason"].fillna("no reason given"))
    reasons = [f"{count} × {reason}" if len(counted) > 1 else reason for reason, count in counted.most_common(REASONS)]
    more = sum(counted.values()) - sum(count for _, count in counted.most_common(REASONS))
    return "; ".join([*reasons, *([f"{more} × other"] if more else [])])


def _shortened(reason: str) -> str:
    words = " ".join(reason.split())
    return words if len(words) <= REASON_SIGNS else f"{words[: REASON_SIGNS - 1].rstrip()}…"


def _invalid(study: Study, block: Block) -> str:
    rows = _counted_trials(study, block)
    invalid = int((~rows["valid"].fillna(value=True)).sum())
    if not invalid:
        return ""
    return f"{invalid} of {len(rows)} trials exceeded the protocol's limits of timing and are included."


def _doubtful(study: Study) -> str:
    if not study.doubts:
        return ""
    names = sorted({doubt.path.relative_to(study.folder).as_posix() for doubt in study.doubts})
    more = f" and {len(names) - FILES} more" if len(names) > FILES else ""
    files = "file is" if len(names) == 1 else "files are"
    return f"{len(names)} {files} not as recorded, and used as found: {', '.join(names[:FILES])}{more}."


def _counted_trials(study: Study, block: Block) -> pd.DataFrame:
    return study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]


def _noun(block: Block) -> str:
    return block.kind.removesuffix("s") if block.revealed else "setting"


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _listed(values: set[int]) -> str:
    low, high = min(values), max(values)
    return str(low) if low == high else f"{low} to {high}"


PANELS_A_ROW: Final = 3
ROW_PT: Final = 19.0
BAR_PT: Final = 12.4
LABEL_SIZE: Final = 7.5
COUNT_SIZE: Final = 5.8
WIDEST_ANSWER_PT: Final = 15.0
PANEL_PADDING_PT: Final = 7.0
NEUTRAL_GAP_PT: Final = 8.0
TOP_PT: Final = 52.0
HEADER_PT: Final = 7.0
FOOT_PT: Final = 16.0

DISAGREEMENT: Final = (3, 2, 1)
AGREEMENT: Final = (5, 6, 7)


@dataclass(frozen=True, slots=True)
class Panel:
    """One setting: ``name`` identifies its shapes in the file, ``title`` stands above, ``counts`` as ``aggregate``."""

    name: str
    title: str
    counts: pd.DataFrame


@dataclass(frozen=True, slots=True)
class _Widths:
    """Of every panel alike [pt]: one answer, the sides of the line, the neutral column and the column of n."""

    answer: float
    left: float
    right: float
    neutral: float
    n: float

    @property
    def total(self) -> float:
        return self.left + self.right + NEUTRAL_GAP_PT + self.neutral + self.n


@style.own_settings()
def draw_agreement(
    panels: Sequence[Panel],
    items: Sequence[str],
    labels: Sequence[str],
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    fonts: Sequence[str],
) -> Sheet:
    """Draw the panels over one axis of statements.

    Parameters
    ----------
    items : sequence of str
        Short texts in the order of the questionnaire, which is the order of the rows of every ``Panel.counts``.
    labels : sequence of str
        The names of the seven levels, lowest first.
    counts : sequence of str
        What the figure says about n, the longest first; one is chosen by the room there is.
    """
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    wrapped = [ruler.wrap(item, 118, LABEL_SIZE) for item in items]
    label_pt = max(ruler.text_width(line, LABEL_SIZE) for lines in wrapped for line in lines)
    columns = min(len(panels), PANELS_A_ROW)
    panel_pt = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - label_pt - 6) / columns
    widths = _widths(panels, panel_pt - 2 * PANEL_PADDING_PT)

    rows = -(-len(panels) // PANELS_A_ROW)
    plot_pt = len(items) * ROW_PT
    row_pt = HEADER_PT + plot_pt + FOOT_PT
    sheet = Sheet(style.PAGE_WIDTH_PT, TOP_PT + rows * row_pt + (rows - 1) * 12, fonts)
    sheet.heading(title, marks, counts)
    left_pt = MARGIN_PT + label_pt + 6
    _legend(sheet, labels, left_pt)
    for place, panel in enumerate(panels):
        row, column = divmod(place, PANELS_A_ROW)
        top, x = TOP_PT + row * (row_pt + 12) + HEADER_PT, left_pt + column * panel_pt
        if column == 0:
            _row_labels(sheet, wrapped, top, plot_pt)
        else:
            sheet.line((x, x), (top - 14, top + plot_pt + 10), color=style.BORDER, linewidth=0.5)
        _agreement_panel(sheet, panel, widths, x + (panel_pt - widths.total) / 2, top, plot_pt)
    return sheet


def _widths(panels: Sequence[Panel], room: float) -> _Widths:
    """Give one answer the same width everywhere, the widest that fits, and words above and below their room."""
    tables = [panel.counts for panel in panels]
    left = max(int(table[[f"count_{level}" for level in DISAGREEMENT]].sum(axis=1).max()) for table in tables)
    right = max(int(table[[f"count_{level}" for level in AGREEMENT]].sum(axis=1).max()) for table in tables)
    neutral = max(int(table[f"count_{NEUTRAL}"].max()) for table in tables)
    n = 17.0 if any(_lacks_answers(table).any() for table in tables) else 0.0
    least = (32.0, 26.0, 27.0)
    room -= NEUTRAL_GAP_PT + n
    answer = WIDEST_ANSWER_PT
    while sum(_sides(answer, (left, right, neutral), least)) > room:
        answer *= 0.99
    return _Widths(answer, *_sides(answer, (left, right, neutral), least), n)


def _lacks_answers(counts: pd.DataFrame) -> pd.Series[bool]:
    """Return for each row whether an answer is missing, the trial's having been left out included."""
    return counts["n"] < counts["presented"] + counts["presented_excluded"]


def _sides(answer: float, most: Sequence[int], least: Sequence[float]) -> tuple[float, float, float]:
    left, right, neutral = (max(answer * count, floor) for count, floor in zip(most, least, strict=True))
    return left, right, neutral


def _legend(sheet: Sheet, labels: Sequence[str], x: float) -> None:
    """Name the levels in their order; the neutral one, which stands apart in the panels, stands apart here."""
    short = legend_labels(labels)
    order = [*DISAGREEMENT[::-1], *AGREEMENT, NEUTRAL]
    size, swatch, gap = 7.0, 7.0, 9.0
    total = sum(swatch + 4 + sheet.text_width(short[level - 1], size) + gap for level in order) + gap
    x = min(x + PANEL_PADDING_PT, max(sheet.width_pt - MARGIN_PT - total + gap, MARGIN_PT))
    for level in order:
        if level == NEUTRAL:
            x += gap
        sheet.box(x, 26.6, swatch, swatch, style.LEVEL_COLOURS[level - 1])
        sheet.text(x + swatch + 4, 32.7, short[level - 1], size=size, colour=style.TEXT_SOFT)
        x += swatch + 4 + sheet.text_width(short[level - 1], size) + gap


def legend_labels(labels: Sequence[str]) -> list[str]:
    """Shorten the middle levels by the ending they share with the outer level of their side.

    "Completely disagree, Mostly disagree" becomes "Completely disagree, Mostly".
    """
    short = list(labels)
    for outer, inner in ((1, (2, 3)), (7, (5, 6))):
        ending = labels[outer - 1].split()[1:]
        for level in inner:
            words = labels[level - 1].split()
            shared = 0
            while shared < min(len(ending), len(words) - 1) and words[-1 - shared] == ending[-1 - shared]:
                shared += 1
            short[level - 1] = " ".join(words[: len(words) - shared])
    return short if len(set(short[:3])) == 3 and len(set(short[4:])) == 3 else list(labels)


def _row_labels(sheet: Sheet, wrapped: Sequence[Sequence[str]], top: float, plot_pt: float) -> None:
    for row, lines in enumerate(wrapped):
        middle = top + (row + 0.5) * ROW_PT + 2.7
        for number, line in enumerate(lines):
            sheet.text(MARGIN_PT, middle + (number - (len(lines) - 1) / 2) * 8.4, line, size=LABEL_SIZE)
    sheet.text(MARGIN_PT, top + plot_pt + 10, "counts of answers", size=6.5, colour=style.TEXT_SOFT)


def _agreement_panel(sheet: Sheet, panel: Panel, widths: _Widths, x: float, top: float, plot_pt: float) -> None:
    """Draw one panel; the axes' unit is one answer."""
    zero = x + widths.left
    base = zero + widths.right + NEUTRAL_GAP_PT
    sheet.text(zero, top - 5, panel.title, size=8, weight="bold", ha="center")
    sheet.text(base + widths.neutral / 2, top - 5, "neutral", size=6.5, colour=style.TEXT_SOFT, ha="center")
    sheet.text(zero - 3.5, top + plot_pt + 10, "disagree", size=6.5, colour=style.TEXT_SOFT, ha="right")
    sheet.text(zero + 3.5, top + plot_pt + 10, "agree", size=6.5, colour=style.TEXT_SOFT)

    axes = sheet.axes(x, top, widths.total, plot_pt)
    axes.set_label(panel.name)
    axes.set_xlim(-widths.left / widths.answer, (widths.total - widths.left) / widths.answer)
    axes.set_ylim(len(panel.counts) - 0.5, -0.5)
    apart = (base - zero) / widths.answer
    lacking = _lacks_answers(panel.counts)
    for y, (_, row) in enumerate(panel.counts.iterrows()):
        edge = 0.0
        for level in DISAGREEMENT:
            edge -= row[COUNT_COLUMNS[level - 1]]
            _segment(sheet, axes, edge, y, level, int(row[COUNT_COLUMNS[level - 1]]), widths.answer)
        edge = 0.0
        for level in AGREEMENT:
            _segment(sheet, axes, edge, y, level, int(row[COUNT_COLUMNS[level - 1]]), widths.answer)
            edge += row[COUNT_COLUMNS[level - 1]]
        _segment(sheet, axes, apart, y, NEUTRAL, int(row[COUNT_COLUMNS[NEUTRAL - 1]]), widths.answer)
        if lacking.iloc[y]:
            sheet.text(
                x + widths.total,
                top + (y + 0.5) * ROW_PT + 2,
                f"n {row['n']}",
                size=5.8,
                colour=style.TEXT_SOFT,
                ha="right",
            )
    axes.axvline(0, color=style.TEXT_SOFT, linewidth=0.9, zorder=3)
    axes.axvline(apart, color=style.AXIS, linewidth=0.5, zorder=3)


def _segment(sheet: Sheet, axes: Axes, left: float, y: int, level: int, count: int, answer_pt: float) -> None:
    """Draw ``count`` answers of one level from ``left``, with the number inside where it fits."""
    if count == 0:
        return
    bar = axes.barh(
        y,
        count,
        left=left,
        height=BAR_PT / ROW_PT,
        color=style.LEVEL_COLOURS[level - 1],
        edgecolor="white",
        linewidth=min(0.5, 0.15 * answer_pt),
        zorder=2,
    )
    bar[0].set_gid(f"{axes.get_label()}-row{y + 1}-level{level}")
    if sheet.text_width(str(count), COUNT_SIZE) <= count * answer_pt - 0.2:
        axes.text(
            left + count / 2,
            y,
            str(count),
            fontproperties=sheet.font(COUNT_SIZE),
            color=style.LEVEL_INKS[level - 1],
            ha="center",
            va="center_baseline",
            zorder=4,
        )


def liquids(study: Study, block: Block | None = None, *, fonts: Sequence[str] | None = None) -> Figure:
    """Draw the counts of answers as diverging bars, a panel per setting.

    Parameters
    ----------
    block : Block, optional
        One of ``study.blocks``; by default the first that compares liquids.
    fonts : sequence of str, optional
        Font families, best first; by default those for screens.

    Raises
    ------
    AnalysisError
        No such block, or no session was completed.
    """
    block = block or _only(study, "liquids")
    _require_answers(study, block)
    table = study.aggregate(block)
    panels = [
        Panel(setting.code, block.name(setting), table[table["code"] == setting.code].reset_index(drop=True))
        for setting in block.settings
    ]
    return draw_agreement(
        panels,
        [item.short for item in block.items],
        block.labels,
        title=title(block),
        marks=study_marks(study),
        counts=counts(study, block),
        fonts=fonts or style.screen_fonts(),
    ).figure


def delays(
    study: Study,
    block: Block | None = None,
    *,
    fonts: Sequence[str] | None = None,
    lowest: Mapping[str, float] = MappingProxyType({}),
) -> Figure:
    """Draw the answers over the delay that was asked for, a small plot per statement; by code while blinded.

    Parameters and errors as in :func:`liquids`. A participant's repeated answers are drawn as their median. ``lowest``
    maps items to the lowest delay at which a trend shows [ms], which is marked.
    """
    block = block or _only(study, "delays")
    _require_answers(study, block)
    answers = study.answers(block)
    people = sorted(answers["participant"].unique())
    plots = [
        delay_figures.Plot(item.short, by_participant(answers, people, block.columns, item.id), lowest.get(item.id))
        for item in block.items
    ]
    return delay_figures.draw_answers(
        plots,
        block.codes,
        block.delays_ms if block.revealed else None,
        title=title(block),
        marks=study_marks(study),
        counts=counts(study, block),
        foot=foot(block),
        fonts=fonts or style.screen_fonts(),
    ).figure


def render(study: Study, block: Block, form: str, lowest: Mapping[str, float] = MappingProxyType({})) -> bytes:
    """Return the figure of a block as a file of ``form`` (png, svg or pdf); ``lowest`` as in :func:`delays`."""
    fonts = style.fonts_for(form)
    drawn = (
        delays(study, block, fonts=fonts, lowest=lowest)
        if block.kind == "delays"
        else liquids(study, block, fonts=fonts)
    )
    return style.file_bytes(drawn, form, f"{study.name}: {title(block)}")


def _only(study: Study, kind: Kind) -> Block:
    blocks = study.blocks_of(kind)
    if not blocks:
        raise AnalysisError(f"{study.folder}: the study {study.name!r} has no part that compares {kind}")
    return blocks[0]


def _require_answers(study: Study, block: Block) -> None:
    if not len(study.answers(block)):
        columns = ["participant", "session", "status", "excluded"]
        states = ", ".join(
            f"{participant} session {session} {'excluded' if excluded else status}"
            for participant, session, status, excluded in study.participants[columns].head(5).itertuples(index=False)
        )
        raise AnalysisError(
            f"{study.folder}: no completed session with answers in {block.id!r} yet ({states}): figures are drawn from "
            "completed sessions; export writes what there is"
        )


CELL_PT: Final = (52.0, 26.0)
NAMES_PT: Final = 14.0
MATRIX_TOP_PT: Final = 30.0
MATRIX_FOOT_PT: Final = 18.0
GROUND: Final = (0.043, 0.396, 0.639)  # style.ACCENT
DARKEST: Final = 0.6
"""Opacity of the ground under all of a row: the counts, always dark, keep a contrast of at least 5."""


@style.own_settings()
def draw_recognition(
    table: Sequence[Sequence[int]],
    settings: Sequence[str],
    labels: Sequence[str],
    right: Sequence[int | None],
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    foot: str,
    fonts: Sequence[str],
) -> Sheet:
    """Draw a row a setting and a column a name; the last two columns are undecided and unanswered.

    Parameters
    ----------
    table : (settings, labels + 2) counts
    right : sequence
        The column that is right for each setting; None where none is.
    """
    names = [*labels, "undecided", "unanswered"]
    kept = [place for place in range(len(names)) if place <= len(labels) or any(row[place] for row in table)]
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    first_pt = max(ruler.text_width(name, 7.5) for name in settings) + 10
    width, height = CELL_PT
    names_wrapped = [ruler.wrap(names[place], width - 4, 7) for place in kept]
    top = MATRIX_TOP_PT + NAMES_PT + 8.5 * (max(map(len, names_wrapped)) - 1)
    sheet = Sheet(style.PAGE_WIDTH_PT, top + height * len(settings) + MATRIX_FOOT_PT, fonts)
    sheet.heading(title, marks, counts)
    left = MARGIN_PT + first_pt
    for column, place in enumerate(kept):
        gap = 8.0 if place >= len(labels) else 0.0
        x = left + column * width + gap
        colour = style.TEXT if place < len(labels) else style.TEXT_SOFT
        for number, line in enumerate(reversed(names_wrapped[column])):
            sheet.text(x + width / 2, top - 4 - 8.5 * number, line, size=7, colour=colour, ha="center")
        axes = sheet.axes(x, top, width, height * len(settings))
        axes.set_label(f"name{place + 1}")
        _column(sheet, axes, [row[place] for row in table], [sum(row) for row in table], [at == place for at in right])
    for number, name in enumerate(settings):
        sheet.text(left - 6, top + height * (number + 0.5) + 2.6, name, size=7.5, ha="right")
    sheet.text(MARGIN_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _column(sheet: Sheet, axes: Axes, counts: Sequence[int], totals: Sequence[int], right: Sequence[bool]) -> None:
    rows = len(counts)
    axes.set_xlim(0, 1)
    axes.set_ylim(rows, 0)
    for row, (count, total, is_right) in enumerate(zip(counts, totals, right, strict=True)):
        share = count / total if total else 0.0
        axes.add_patch(
            Rectangle(
                (0.03, row + 0.05),
                0.94,
                0.9,
                facecolor=(*GROUND, DARKEST * share) if count else style.GROUND,
                edgecolor=style.TEXT if is_right else style.BORDER,
                linewidth=1.6 if is_right else 0.5,
                gid=f"{axes.get_label()}-setting{row + 1}",
            )
        )
        axes.text(
            0.5,
            row + 0.5,
            f"{count}" + (f"  ({share:.0%})" if count else ""),
            fontproperties=sheet.font(7.5, "bold" if is_right else "regular"),
            color=style.TEXT,
            ha="center",
            va="center",
        )
