"""The figure of how participants reach under a delay, measured from recordings."""

from typing import Final

from study_app.analysis.figures import movement_plots, small_multiples
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.report.html_page import drawn
from study_app.analysis.results.block_results import Results
from study_app.analysis.results.finding import BlockFigure, Finding
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.performance import OF_REACHES

TITLE: Final = "Reaching over added delay"
MOVES = {
    "movement_time_s": "Movement time, s",
    "path_mm": "Path, mm",
    "overshoot_mm": "Overshoot, mm",
    "submovements": "Submovements",
}


def _figure(drawing: Drawing) -> Picture | None:
    block, measured = drawing.block, drawing.results.performance
    if not drawing.found.delays_ms or measured is None or not measured.recorded_in(block.id):
        return None
    people = sorted({trial.participant for trial in measured.reached if trial.block == block.id})
    plots = [
        movement_plots.Measured(MOVES[measure], measured.by_participant(people, block, measure))
        for measure in OF_REACHES
    ]
    n = f"n = {len(people)} participant" + ("" if len(people) == 1 else "s")
    caption = (
        f"How participants reached, over the delay that was asked for ({drawing.simulated}{n} with recordings). "
        f"Thin lines: {small_multiples.line_words(len(people))}; thick line: median; band: the middle half. "
        "Movement time: from the lighting of a target to the entry that was held. Scales do not begin at zero. "
        f"{_kept(block, drawing.results)}"
    )
    return drawing.picture(
        TITLE,
        caption,
        lambda **own: (
            movement_plots.draw(
                plots,
                [setting.delay_ms or 0.0 for setting in block.settings],
                counts=[f"{n} with recordings", n],
                foot="Added delay, ms. A participant's point: the median of a trial's reaches, the first left out.",
                **own,
            ).figure
        ),
    )


def _kept(block: Block, results: Results) -> str:
    """Say how many trials kept to the limits of timing."""
    here = [one for one in results.delivered if one.block == block.id]
    judged, valid = sum(one.judged for one in here), sum(one.valid for one in here)
    if not judged:
        return "Whether trials kept to the protocol's limits of timing was not measured."
    return f"Trials that kept to the protocol's limits of timing: {valid} of {judged}; all are included."


FINDING: Final[Finding[None]] = Finding(
    key="movement",
    place=11,
    empty=None,
    part="figure of movement",
    section=lambda _found, _results, pictures: drawn(pictures, "movement"),
    figure=BlockFigure(name="movement", title=TITLE, draw=_figure),
)
