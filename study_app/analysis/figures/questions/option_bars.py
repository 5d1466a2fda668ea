"""Choices: how often each option was chosen, a bar for each option of each setting."""

from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.questions.group_rows import Look, QuestionFigure, rows
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.tables.asked_questions import AskedQuestion

ROW_PT: Final = 20.0


@style.own_settings()
def draw(asked: AskedQuestion, found: QuestionFound, look: Look) -> Sheet:
    """Draw the counts of all options."""
    several = len(found.groups) > 1
    bars = [
        (f"{group.name}: {words}" if several else words, int(group.numbers["counts"][option]), int(group.numbers["n"]))
        for group in found.groups
        for option, words in asked.levels.items()
    ]
    sheet, axes = rows([name for name, _, _ in bars], [n for _, _, n in bars], look, row_pt=ROW_PT)
    most = max((n for _, _, n in bars), default=1) or 1
    axes.set_xlim(0, most * 1.06)
    for place, (_, count, n) in enumerate(bars):
        axes.barh(place, n, height=0.56, color=style.GROUND)
        axes.barh(place, count, height=0.56, color=style.ACCENT, gid=f"bar-{place}")
        axes.text(count + 0.01 * most, place, str(count), va="center", fontproperties=sheet.font(6.5))
    return sheet


FIGURE: Final = QuestionFigure("counts", draw, "How often each option was chosen; grey: all who answered.")
