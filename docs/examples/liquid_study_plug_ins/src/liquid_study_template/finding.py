"""A finding: how many answers are at an end of the scale, where differences cannot be seen."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from study_app.analysis.findings.finding import Absent, BlockAnswers, Finding
from study_app.analysis.html_page import heading, paragraph
from study_app.analysis.results import BlockResult


class EndsOfScale(Finding[Mapping[str, float]]):
    """The share of answers at an end of the scale, statement by statement."""

    key = "liquid-study-template:ends_of_scale"
    what = "answers at the ends of the scale"
    empty = MappingProxyType({})

    @classmethod
    def test(cls, answers: BlockAnswers, found: BlockResult) -> tuple[Mapping[str, float], Absent]:
        """Return the value: a share for each statement, from arrays (participants, settings, presentations)."""
        shares = {}
        for item, values in answers.single.items():
            given = values[~np.isnan(values)]
            if len(given):
                shares[item] = float(np.isin(given, (1, 7)).mean())
        return shares, ()

    def section(self) -> Iterator[str]:
        """Return the HTML of its part of the report."""
        yield heading(3, "Answers at the ends of the scale")
        yield paragraph(
            "; ".join(f"{item.replace('_', ' ')}: {100 * share:.0f} %" for item, share in self.value.items())
        )

    def methods(self) -> Iterator[str]:
        """Return the sentences of the methods paragraph."""
        yield "The share of answers at the ends of the scale was counted."
