"""What safety withheld of a force that a study sent late, with jitter or loss: a row for each range of levels."""

from __future__ import annotations

from collections.abc import Iterator

from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.results.levels import LevelsFound

EXPLAINED = (
    "Share of the requested force that passivity controller, slew limit and device withheld in the comparisons, those "
    "of trials that were presented again included: a late force pushes the hand, and the passivity controller limits "
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
    yield paragraph(EXPLAINED, "soft")
