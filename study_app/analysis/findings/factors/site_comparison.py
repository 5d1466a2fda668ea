"""The comparison of a merged study's sites: in the level of the answers to every statement, and in what settings do.

Comparisons of settings are within participants, so that a difference in level between sites cannot appear in them. What
can is a difference between settings that is another at another site.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import rankdata

from study_app.analysis.designs.block_tests import SEALED, Asked
from study_app.analysis.designs.verdicts import FDR, in_family
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.html_page import paragraph
from study_app.analysis.report.item_tests import table_of_tests, tests_in_words
from study_app.analysis.report.r_syntax import r_number, r_text
from study_app.analysis.report.test_rows import judged_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding, Row
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import listed, settings_noun, test_name
from study_app.analysis.statistics.independent_groups import GroupsDiffer, groups_differ
from study_app.analysis.statistics.multiple_comparisons import false_discovery
from study_app.analysis.tables.compared_blocks import KINDS
from study_app.analysis.tables.measures import Array
from study_app.analysis.tables.planned_analysis import Decided

COMPARISON: Final = "comparison of sites"
LEVEL: Final = "Kruskal-Wallis"
PROFILE: Final = "permutation test of rank profiles"


@dataclass(frozen=True, slots=True)
class SiteTests:
    """Tests of each statement: of the participants' medians (``level``), and of the ``profile`` over settings."""

    level: tuple[Tested, ...] = ()
    profile: tuple[Tested, ...] = ()


def compared_sites(answers: Asked) -> tuple[SiteTests, tuple[NotTested, ...]]:
    """Test in every statement whether sites are answered alike, and whether settings differ alike at all sites.

    A participant's level is the median over all settings; the profile has the ranks of the settings by the answers, or
    of two settings the difference of the answers.
    """
    if not answers.sites:
        return SiteTests(), ()
    if not answers.block.revealed:
        return SiteTests(), (NotTested(COMPARISON, SEALED),)
    levels, profiles = {}, {}
    for item in answers.block.items:
        answers.each(f"{item.short}, sites")
        values = answers.values[item.id]
        levels[item.id] = _tested(answers, np.median(values, axis=1)[:, None], LEVEL)
        if answers.k == 2:
            profiles[item.id] = _tested(answers, np.diff(values, axis=1), f"{LEVEL} of differences")
        elif answers.k > 2:
            profiles[item.id] = _tested(answers, rankdata(values, axis=1, nan_policy="propagate"), PROFILE)
    family = f"{answers.block.id}: sites"
    return SiteTests(
        in_family(levels, answers.decided.alpha, f"{family}, level", false_discovery, FDR, primary=False),
        in_family(profiles, answers.decided.alpha, f"{family}, settings", false_discovery, FDR, primary=False),
    ), ()


def _tested(answers: Asked, values: Array, test: str) -> GroupsDiffer:
    return groups_differ(values, answers.sites, test=test, draws=answers.draws, seed=answers.seed)


def _rows(found: BlockFound) -> Iterator[Row]:
    tests = FINDING.of(found)
    yield from (judged_row(found, "sites differ", one) for one in tests.level)
    yield from (judged_row(found, "interaction of setting and site", one) for one in tests.profile)


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    tests, noun = FINDING.of(found), settings_noun(found)
    yield from table_of_tests("Do sites differ?", found, tests.level)
    yield from table_of_tests(f"Do differences between the {noun}s depend on the site?", found, tests.profile)
    if tests.level:
        yield paragraph(
            f"First each participant's median over the {noun}s is compared between sites, then the order of the "
            f"{noun}s by each participant's answers. All other tests compare within participants, so that a difference "
            "in level between sites does not enter them.",
            "soft",
        )


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    tests, noun = FINDING.of(found), settings_noun(found)
    yield from tests_in_words(
        found, tests.level, "sites differ in", "in no single statement a difference between sites"
    )
    nothing = f"in no single statement that differences between the {noun}s depend on the site"
    yield from tests_in_words(found, tests.profile, f"differences between the {noun}s depend on the site in", nothing)


def _methods(blocks: Sequence[BlockFound]) -> Iterator[str]:
    tests = [one for found in blocks for one in (*FINDING.of(found).level, *FINDING.of(found).profile)]
    if names := list(dict.fromkeys(test_name(one.outcome) for one in tests)):
        yield (
            f"Sites were compared by {listed(names)}, with participants exchanged between sites, p adjusted by {FDR}; "
            "all other tests are within participants, with the participants of all sites together."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    tests = FINDING.of(found)
    for kind, those in (("level", tests.level), ("profile", tests.profile)):
        for one in those:
            outcome = one.outcome
            if isinstance(outcome, GroupsDiffer) and outcome.statistic is not None:
                p = "NA" if outcome.p_chi2 is None else r_number(outcome.p_chi2)
                table = f"wide({r_text(found.id)}, {r_text(one.item)}, {codes})"
                yield f"sites({r_text(one.item)}, {table}, {r_text(kind)}, {r_number(outcome.statistic)}, {p})"


def _numbers(found: BlockFound) -> Mapping[str, Any]:
    tests = FINDING.of(found)
    return {"by_site": tests} if tests.level else {}


FINDING: Final[Finding[SiteTests]] = Finding(
    key="by_site",
    place=12.5,
    what=COMPARISON,
    empty=SiteTests(),
    tests=lambda answers, _found: compared_sites(answers),
    sealed=KINDS,
    about="sessions",
    numbers=_numbers,
    row_place=4.5,
    rows=_rows,
    part="sites",
    section=_section,
    sentences=_sentences,
    common_methods=_methods,
    calls=_calls,
)
