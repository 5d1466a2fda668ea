"""How simulated participants answer statements: noise, response bias, spread of slopes, lapses.

The three kinds of participants that ``power`` compares have values from published ratings, in points of a scale of
seven points: residual SD, SD of random intercepts and SD of random slopes of a linear mixed model of each attribute, in
which the mean of the other assessors predicts a rating. ``tests/benchmarks/analysis/rating_data.py`` computes them:

- consistent: a trained panel. `TVbo`, R package lmerTest 3.1-3 (Kuznetsova, Brockhoff & Christensen 2017, Journal of
  Statistical Software 82(13)): 8 assessors, 12 products, 2 replicates, scale 0 to 15; medians over 15 attributes.
- typical: panelists who rate sensory descriptors. `sensochoc`, R package SensoMineR 1.27 (Lê & Husson 2008, Journal of
  Sensory Studies 23, 14): 29 panelists, 6 chocolates, 2 sessions, scale 0 to 10; medians over 14 descriptors.
- noisy: the largest of the same 14 values, each by itself.
"""

from collections.abc import Mapping
from typing import Annotated, Final

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.source.table import Table

LAPSE_POINTS: Final = 3.0
"""Points by which an erroneous answer exceeds that of the answer model. [choice]"""


class SimulatedParticipants(Table):
    """How simulated participants answer statements; without this table, `power` uses published values."""

    noise_sd: Annotated[float, within(0, 3, "half of the scale of seven points")] = Field(
        default=1.10,
        description="SD of a participant's answers to identical trials, in scale points (mean across participants).",
    )
    bias_sd: Annotated[float, within(0, 3, "half of the scale of seven points")] = Field(
        default=0.76,
        description="Between-participant SD of response bias, in scale points. The bias is added to every answer.",
    )
    slope_sd: Annotated[
        float, within(0, 2, "with an SD of 2, three in ten participants respond in the opposite direction")
    ] = Field(
        default=0.50,
        description=(
            "Between-participant SD of the slope of answers across conditions, relative to the mean slope; used in "
            "power analyses but not in rehearsals."
        ),
    )
    lapse_rate: Annotated[float, within(0, 0.5, "at most half of the answers can be errors")] = Field(
        default=0.0,
        description=(
            "Proportion of erroneous answers, each of which is simulated as 3 points too high; used in power analyses "
            "but not in rehearsals."
        ),
    )

    def described(self) -> str:
        """Return the values as text."""
        lapses = f", lapse rate {self.lapse_rate:g}" if self.lapse_rate else ""
        return f"noise SD {self.noise_sd:g}, response bias SD {self.bias_sd:g}, slope SD {self.slope_sd:g}{lapses}"


REHEARSED: Final = SimulatedParticipants(noise_sd=0.65, bias_sd=0.4, slope_sd=0)
"""The participants of rehearsals if the study does not describe them. [choice]"""

CONSISTENT, TYPICAL, NOISY, STATED = "consistent", "typical", "noisy", "as in the study file"
PUBLISHED: Final[Mapping[str, SimulatedParticipants]] = {
    CONSISTENT: SimulatedParticipants(noise_sd=0.63, bias_sd=0.50, slope_sd=0.50),
    TYPICAL: SimulatedParticipants(),
    NOISY: SimulatedParticipants(noise_sd=1.25, bias_sd=1.00, slope_sd=0.92),
}


def compared_kinds(stated: SimulatedParticipants | None) -> dict[str, SimulatedParticipants]:
    """Return the kinds of participants for which power is compared, first the stated or the typical one."""
    first = {TYPICAL: PUBLISHED[TYPICAL]} if stated is None else {STATED: stated}
    return first | {kind: PUBLISHED[kind] for kind in (CONSISTENT, NOISY)}
