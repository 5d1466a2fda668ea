"""Sliders and numbers: every answer as a dot, quartiles as a band, the median as a line."""

from collections import Counter
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.questions.group_rows import FOOT_PT, LEFT_PT, RIGHT_PT, Look, QuestionFigure, rows
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.tables.asked_questions import AskedQuestion

ROW_PT: Final = 30.0
BAND: Final = 0.22
PILE: Final = 0.07  # from one of equal answers to the next


@style.own_settings()
def draw(asked: AskedQuestion, found: QuestionFound, look: Look) -> Sheet:
    """Draw the answers."""
    groups = found.groups
    sheet, axes = rows(
        [group.name for group in groups], [int(group.numbers["n"]) for group in groups], look, row_pt=ROW_PT
    )
    values = [value for group in groups for value in group.numbers["values"]]
    low, high = asked.bounds or (min(values, default=0.0), max(values, default=1.0))
    span = (high - low) or 1.0
    axes.set_xlim(low - 0.03 * span, high + 0.03 * span)
    for place, group in enumerate(groups):
        numbers = group.numbers
        axes.plot([low, high], [place, place], color=style.GRID, linewidth=0.8, zorder=0)
        if numbers["median"] is None:
            continue
        axes.fill_between([numbers["q1"], numbers["q3"]], place - BAND, place + BAND, color=style.BAND, linewidth=0)
        axes.plot([numbers["median"]] * 2, [place - BAND, place + BAND], color=style.ACCENT, linewidth=1.6)
        for value, many in sorted(Counter(numbers["values"]).items()):
            ys = [place + PILE * (number - (many - 1) / 2) for number in range(many)]
            axes.plot([value] * many, ys, "o", markersize=2.6, color=style.PARTICIPANT, gid=f"{group.code}")
    y = sheet.height_pt - FOOT_PT + 12
    view = asked.question.view(0, asked.context)
    ends = (f"{low:g} {getattr(view, 'low', '')}".strip(), f"{high:g} {getattr(view, 'high', '')}".strip())
    sheet.text(LEFT_PT, y, ends[0], size=6.5, colour=style.TEXT_SOFT)
    sheet.text(sheet.width_pt - RIGHT_PT, y, ends[1], size=6.5, colour=style.TEXT_SOFT, ha="right")
    return sheet


FIGURE: Final = QuestionFigure(
    "distribution", draw, "Every answer is a dot; line: median; band: from the lower to the upper quartile."
)
