"""What safety withheld of a force that a study sent late, with jitter or loss: a row for each range of levels."""

from collections.abc import Iterator
from itertools import takewhile

from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.results.level_results import LevelsFound
from study_app.protocol.checks.delayed_force import WITHHELD_PERCENT

EXPLAINED = (
    "Share of the requested force that limits, passivity controller and device withheld in the comparisons, those of "
    "trials that were presented again included: a late force pushes the hand, and the passivity controller limits "
    "the energy that it returns. What is withheld is not the force that the study is about."
)


def withheld(found: LevelsFound) -> Iterator[str]:
    """Yield the section; nothing where the force was prompt."""
    if not found.withheld:
        return
    standards = len({one.standard for one in found.withheld}) > 1
    unit = f" [{found.unit}]" if found.unit else ""
    yield heading(3, "Force withheld by safety")
    yield table(
        (*((f"Standard{unit}",) if standards else ()), f"Level{unit}", "intervals", "mean", "most"),
        [
            [
                *(((f"{one.standard:.4g}" if one.standard is not None else "–"),) if standards else ()),
                f"{one.low:.3g}" if one.low == one.high else f"{one.low:.3g} – {one.high:.3g}",
                str(one.n),
                f"{one.mean_percent:.1f} %",
                f"{one.most_percent:.1f} %",
            ]
            for one in found.withheld
        ],
        words=0,
    )
    yield paragraph(f"{' '.join(_up_to(found))} {EXPLAINED}", "soft")


def _up_to(found: LevelsFound) -> Iterator[str]:
    """Yield for each standard up to which level hardly anything was withheld in any comparison."""
    unit = f" {found.unit}" if found.unit else ""
    for standard in dict.fromkeys(one.standard for one in found.withheld):
        rows = [one for one in found.withheld if one.standard == standard]
        kept = list(takewhile(lambda one: one.most_percent <= WITHHELD_PERCENT, rows))
        at = "" if standard is None else f" at the standard of {standard:.4g}{unit}"
        until = f"up to {kept[-1].high:.3g}{unit}" if kept else "at no level presented"
        yield f"At most {WITHHELD_PERCENT:g} % was withheld in every comparison {until}{at}."
