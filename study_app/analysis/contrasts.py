"""Contrasts: the hypotheses that a study states, tested on one number of each participant.

A comparison within participants tests their differences between two conditions; for thresholds these are differences
of logarithms, whose mean gives a ratio. A comparison of groups tests the participants' values, and an interaction tests
the differences within participants between groups. Three tests must agree (see `statistics.mean_tests`). Thresholds are
weighted as in the random-effects mean; two blocks with the same levels and design are fitted with a common width.
Equivalence is tested as in all other analyses, with a correction over the hypotheses that state a bound.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from study_app import number_text
from study_app.analysis.data.blocks import OF_SESSION, Item, PlacedQuestion, PlacedScore, name_in_sentence
from study_app.analysis.data.measures import by_participant
from study_app.analysis.data.study_tables import Study, group_members
from study_app.analysis.findings.finding import FOUND, HOLM, TESTS, BlockAnswers, verdict
from study_app.analysis.html_page import bullets, ends_of, heading, paragraph, table_of
from study_app.analysis.levels.answers import Settings
from study_app.analysis.levels.evaluate import TRACK_COLUMNS
from study_app.analysis.levels.exponents import Exponents
from study_app.analysis.levels.sensitivities import Sensitivities
from study_app.analysis.levels.statistic import LevelStatistic
from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds, thresholds_compared
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.questions import scored
from study_app.analysis.results import BADGES, ContrastResult, ContrastSide, LevelsResult, Results
from study_app.analysis.statistics.effect_sizes import (
    PRIOR_SCALE,
    EffectSize,
    cliffs_delta,
    d_z,
    hedges_g,
    jzs_bayes_factor,
    paired_delta,
)
from study_app.analysis.statistics.equivalence import is_beyond, p_equivalent, people_beyond
from study_app.analysis.statistics.mean_tests import SAME, Means, means_of, p_differs, resamples_for
from study_app.analysis.statistics.outcome import SIDES, Array, Interval, clopper_pearson, holm
from study_app.analysis.statistics.thresholds import random_effects_weights
from study_app.analysis.wording import inclusion_text, interval, listed, ms, number, p_equals, p_value, significant
from study_app.protocol.model import MEAN_SETTING, Contrast
from study_app.protocol.participants import fewest_participants
from study_app.protocol.quantities import quoted_title, with_article

_STATISTICS: Final[Mapping[str, tuple[type[LevelStatistic[Any]], str]]] = {
    "threshold": (Thresholds, "threshold"),
    "exponent": (Exponents, "exponent"),
    "d_prime": (Sensitivities, "d_prime"),
    "pse": (Settings, "pse"),
}
"""The statistic that provides each measure, and the attribute of its rows."""

RATIOS: Final = ("threshold", "pse")
"""Measures that are compared as ratios if all blocks space their levels by ratios."""

_WEIGHTED: Final = (
    "Thresholds are weighted as in the group mean. If two blocks have the same levels and design, their thresholds "
    "are estimated with a common width of the psychometric function, so their ratio may differ from the ratio of the "
    "thresholds in the tables. The intervals of the means in a hypothesis omit the uncertainty of the width and the "
    "lapse rate, which the tables include. "
)
_SIZES: Final = (
    "Standardised effects give all participants equal weight: d_z is the mean within-participant difference divided "
    "by the standard deviation of the differences, and g is Hedges' g for two groups. Their 95 % confidence intervals "
    "are calculated from the noncentral t distribution."
)
_DELTA: Final = (
    " Between groups, Cliff's delta is the probability that an answer in the first group is larger than one in the "
    "second, minus the probability that it is smaller. Within participants, it is the proportion of participants whose "
    "answer is larger in the first condition, minus the proportion whose answer is smaller."
)
_BAYES: Final = (
    "Bayes factors are two-sided JZS Bayes factors (Rouder et al., 2009) that compare the hypothesis of a difference "
    f"with the null hypothesis, using a Cauchy prior with scale {number(PRIOR_SCALE, 3)}."
)
_SUBSTANTIAL: Final = 3.0
"""Smaller Bayes factors are weak evidence (Jeffreys 1961)."""
_UNADJUSTED: Final = "The confidence intervals are not adjusted for the number of hypotheses. "
_MOST_NAMED: Final = 20

_TOO_FEW: Final = "fewer than two participants have both values"
_ALIKE: Final = "the values do not vary between participants, so a t test is not possible"


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantValue:
    """A participant's value on the scale of the test (the logarithm for a ratio), and its estimation variance.

    A variance of 0 means that it is unknown; all participants then have equal weights.
    """

    value: float
    variance: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastSamples:
    """The values that a contrast tests, and the reasons for exclusions.

    ``samples`` has the sorted values of each group, or one sample with the differences within participants. ``shared``
    is the variance of an error that all participants share. ``sides`` has the values on each side by participant;
    ``cells``, only for an interaction, has those of each group in each condition.
    """

    samples: tuple[tuple[ParticipantValue, ...], ...]
    left_out: Mapping[str, str]
    shared: float = 0.0
    sides: tuple[Mapping[str, ParticipantValue], ...] = ()
    cells: tuple[Mapping[str, ParticipantValue], ...] = ()

    @property
    def values(self) -> tuple[Array, ...]:
        """The values of each sample."""
        return tuple(np.array([measured.value for measured in sample]) for sample in self.samples)

    @property
    def smallest(self) -> int:
        """The number of participants in the smaller sample."""
        return min(map(len, self.samples))

    def means(self, alpha: float) -> Means | None:
        """Return the mean, or the difference of the groups' means; None if a sample has fewer than two values."""
        if self.smallest < 2:
            return None
        compared = []
        for group, (sample, values) in enumerate(zip(self.samples, self.values, strict=True)):
            variances = np.array([measured.variance for measured in sample])
            weights = random_effects_weights(values, variances)[0] if variances.all() else None
            compared.append(means_of(values[None], weights, group=group, resamples=resamples_for(alpha)))
        means = compared[0] if len(compared) == 1 else compared[0] - compared[1]
        return means.widened(self.shared) if self.shared else means


def contrast_results(
    study: Study, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult]
) -> tuple[ContrastResult, ...]:
    """Test the contrasts of a study, with Holm's correction for differences and for equivalence.

    Empty while the key is sealed.
    """
    alpha = study.decided.alpha
    tests = [
        _test_contrast(study, contrast, answers, levels, alpha / len(study.contrasts)) for contrast in study.contrasts
    ]
    adjusted = holm([test.largest_p for test in tests])
    with_bound = [index for index, test in enumerate(tests) if test.contrast.bound is not None]
    adjusted_equivalence = dict(zip(with_bound, holm([tests[index].p_equivalent for index in with_bound]), strict=True))
    return tuple(
        _add_verdict(study, result, p, adjusted_equivalence.get(index))
        for index, (result, p) in enumerate(zip(tests, adjusted, strict=True))
    )


def _add_verdict(study: Study, tested: ContrastResult, p: float | None, p_equal: float | None) -> ContrastResult:
    alpha = study.decided.alpha
    outcome: Any = verdict(p, None, alpha, primary=study.decided.binding)
    equivalent = None if tested.contrast.bound is None else p_equal is not None and p_equal <= alpha
    if equivalent and outcome in ("not shown", "not tested"):
        outcome = "equivalent"
    return replace(
        tested,
        p_adjusted=p,
        p_equivalent=p_equal,
        members=len(study.contrasts),
        equivalent=equivalent,
        verdict=outcome,
        not_excluded=tested.not_excluded if equivalent else None,
    )


def _collect_samples(
    study: Study, contrast: Contrast, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult]
) -> ContrastSamples:
    sides: list[Mapping[str, ParticipantValue]] = [
        _participant_values(study, contrast, block, condition, answers, levels)
        for block, condition in zip(
            contrast.blocks if len(contrast.blocks) == 2 else contrast.blocks * 2,
            contrast.conditions or (None, None),
            strict=True,
        )
    ]
    shared = 0.0
    spacings = {level.spacing for level in levels if level.block in contrast.blocks}
    if contrast.measure == "threshold" and len(contrast.blocks) == 2 and len(spacings) == 1:
        sides, shared = _thresholds_in_two_blocks(study, contrast, math.log(10) if spacings == {"log"} else 1.0)
    members = group_members(study)
    people = [person for person in study.people if contrast.groups is None or members.get(person) in contrast.groups]
    missing = (
        f"no {contrast.measure_text}"
        if contrast.measure in _STATISTICS
        else f"an answer to {contrast.measure} is missing"
    )
    names = _condition_names(study, contrast) or _block_titles(study, contrast)
    asked = [_question_or_score(study, contrast, contrast.form or contrast.blocks[end]) for end in (0, -1)]
    hidden = [study.hidden_from(item) if isinstance(item, PlacedQuestion) else set() for item in asked]
    left_out = {
        person: f"{f'{contrast.measure} was not shown' if person in unseen else missing} in {quoted_title(name)}"
        for side, name, unseen in zip(sides[::-1], names[::-1], hidden[::-1], strict=True)
        for person in people
        if person not in side
    }  # fmt: skip
    included = [person for person in people if person not in left_out]
    values = {person: sides[0][person] for person in included}
    if contrast.within is not None:
        values = {
            person: ParticipantValue(
                value=sides[0][person].value - sides[1][person].value,
                variance=sides[0][person].variance + sides[1][person].variance,
            )
            for person in included
        }
    cells = tuple(
        {person: side[person] for person in included if members[person] == group}
        for group in contrast.groups or ()
        for side in sides
        if contrast.is_interaction
    )
    if contrast.groups is not None:  # the shared error cancels between groups
        sides = [
            {person: values[person] for person in included if members[person] == group} for group in contrast.groups
        ]
        samples, shared = tuple(tuple(side.values()) for side in sides), 0.0
    else:
        sides, samples = [{person: side[person] for person in included} for side in sides], (tuple(values.values()),)
    return ContrastSamples(
        samples=tuple(map(_sorted_by_value, samples)), left_out=left_out, shared=shared, sides=tuple(sides), cells=cells
    )


def _sorted_by_value(sample: Iterable[ParticipantValue]) -> tuple[ParticipantValue, ...]:
    return tuple(sorted(sample, key=lambda measured: measured.value))


def _summarize_side(name: str, values: Mapping[str, ParticipantValue], *, ratio: bool) -> ContrastSide:
    """Return the values of one side in display units, with their mean."""
    scale = math.exp if ratio else float
    means = ContrastSamples(samples=(_sorted_by_value(values.values()),), left_out={}).means(0.05)
    low, high = (None, None) if means is None else (scale(float(end[0])) for end in means.interval(0.95))
    return ContrastSide(
        name=name,
        values={person: scale(measured.value) for person, measured in values.items()},
        mean=None if means is None else scale(float(means.mean[0])),
        low=low,
        high=high,
        sd=_sample_sd([measured.value for measured in values.values()]),
        standard_error=None if means is None else float(means.error[0]),
    )


def _sample_sd(values: Sequence[float]) -> float | None:
    return float(np.std(values, ddof=1)) if len(values) > 1 else None


class _StandardisedEffects(NamedTuple):
    """The standardised effect, Cliff's delta and the Bayes factor of a hypothesis; None if not applicable."""

    effect: EffectSize | None
    ordinal: EffectSize | None
    bayes_factor: float | None


def _standardised_effects(compared: ContrastSamples, *, is_ordinal: bool) -> _StandardisedEffects:
    """Return the standardised effects of a hypothesis with equal weights for all participants."""
    first, *others = compared.values
    if others:
        effect, ordinal = hedges_g(first, others[0]), cliffs_delta(first, others[0])
    else:
        effect, ordinal = d_z(first), paired_delta(first)
    t, sizes = None if effect is None else effect.t, [len(sample) for sample in compared.values]
    factor = None if t is None else jzs_bayes_factor(t, *sizes)
    return _StandardisedEffects(effect, ordinal if is_ordinal else None, factor)


def _thresholds_in_two_blocks(
    study: Study, contrast: Contrast, per_u: float
) -> tuple[list[Mapping[str, ParticipantValue]], float]:
    """Return the thresholds in two blocks, multiplied by ``per_u``, and the variance that common widths add."""
    first, second = (next(level for level in study.levels if level.id == block) for block in contrast.blocks)
    sides, shared = thresholds_compared(first, second, tracks(study)[list(TRACK_COLUMNS)])
    return [
        {person: ParticipantValue(value=per_u * u.value, variance=per_u**2 * u.variance) for person, u in side.items()}
        for side in sides
    ], per_u**2 * shared


def _question_or_score(study: Study, contrast: Contrast, place: str) -> PlacedQuestion | PlacedScore | None:
    """Return the question or score that a contrast compares in a form or block; None if there is none."""
    for question in study.others.questions:
        if (question.where.id, question.id) == (place, contrast.measure):
            return question
    scores = (score for score in study.others.scores if (score.where.id, score.name) == (place, contrast.measure))
    return next(scores, None)


def _scale_ends(study: Study, contrast: Contrast) -> tuple[float, float] | None:
    """Return the ends of the scale of a question or score; None for statements and for measures without a scale."""
    if _statement(study, contrast) is not None:
        return None
    asked = _question_or_score(study, contrast, contrast.form or contrast.blocks[0])
    return asked.bounds if isinstance(asked, PlacedScore) else None if asked is None else asked.scale_ends


def _numbers_of(study: Study, asked: PlacedQuestion | PlacedScore) -> pd.DataFrame:
    """Return the answers to a question, or the scores, with ``participant``, ``code``, ``after_block``, ``score``."""
    rows = scored(study, asked) if isinstance(asked, PlacedScore) else study.answers_to(asked)
    return rows.rename(columns={"value": "score"}).dropna(subset=["score"]).astype({"score": float})


def _values_in_form(study: Study, contrast: Contrast, form: str, block: str) -> Mapping[str, ParticipantValue]:
    """Return each participant's answer or score in a form after a block, averaged over sessions."""
    asked = _question_or_score(study, contrast, form)
    if asked is None:
        return {}
    numbers = _numbers_of(study, asked)
    return _participant_means(numbers[numbers["after_block"] == block])


def _values_after_trials(
    study: Study, contrast: Contrast, block: str, condition: str | None
) -> Mapping[str, ParticipantValue]:
    """Return each participant's answer or score after the trials of a block, averaged first within conditions.

    Without a ``condition``, participants need an answer in every condition of the block.
    """
    asked = _question_or_score(study, contrast, block)
    if asked is None:
        return {}
    codes = {setting.code for setting in asked.where.settings if condition in (None, setting.condition)}
    numbers = _numbers_of(study, asked)
    means = numbers[numbers["code"].isin(codes)].groupby(["participant", "code"], as_index=False)["score"].mean()
    answered_codes = means.groupby("participant")["code"].transform("nunique")
    return _participant_means(means[answered_codes == len(codes)])


def _participant_means(numbers: pd.DataFrame) -> Mapping[str, ParticipantValue]:
    means = numbers.groupby("participant")["score"].mean()
    return {str(person): ParticipantValue(value=float(mean)) for person, mean in means.items()}


def _agreement_values(
    study: Study, statement: str, answers: BlockAnswers, condition: str | None
) -> Mapping[str, ParticipantValue]:
    """Return each participant's agreement with a statement about a condition, or the mean over all conditions.

    A hypothesis about a condition that the block pools with replicates compares this condition alone.
    """
    columns = answers.block.columns
    codes = [setting.code for setting in answers.block.settings if condition in (None, setting.condition)]
    if condition is not None and len(set(columns.values())) < len(columns):
        table, own_columns = study.answers(answers.block), {code: place for place, code in enumerate(codes)}
        rows = by_participant(table[table["code"].isin(codes)], answers.people, own_columns, statement)
    else:
        rows = answers.values[statement][:, sorted({columns[code] for code in codes})]
    return {
        person: ParticipantValue(value=float(value))
        for person, value in zip(answers.people, rows.mean(axis=1), strict=True)
        if not math.isnan(value)
    }


def _participant_values(
    study: Study,
    contrast: Contrast,
    block: str,
    condition: str | None,
    answers: Sequence[BlockAnswers],
    levels: Sequence[LevelsResult],
) -> Mapping[str, ParticipantValue]:
    """Return each participant's value in a block: the mean over standards or, for statements, over conditions."""
    if contrast.form is not None:
        return _values_in_form(study, contrast, contrast.form, block)
    if contrast.measure not in _STATISTICS:
        block_answers = next((answered for answered in answers if answered.block.id == block), None)
        if block_answers is None or contrast.measure not in block_answers.values:
            return _values_after_trials(study, contrast, block, condition)
        return _agreement_values(study, contrast.measure, block_answers, condition)
    result = next(level for level in levels if level.block == block)
    statistic, attribute = _STATISTICS[contrast.measure]
    ratio = _is_ratio(contrast, levels)
    measured_values: dict[str, list[ParticipantValue]] = {}
    for row in statistic.participant_rows(result):
        if (value := getattr(row, attribute)) is not None:
            measured = ParticipantValue(
                value=math.log(value) if ratio else value, variance=_variance_of_estimate(row, result, ratio=ratio)
            )
            measured_values.setdefault(str(row.participant), []).append(measured)
    return {
        person: ParticipantValue(
            value=float(np.mean([measured.value for measured in values])),
            variance=sum(measured.variance for measured in values) / len(values) ** 2,
        )
        for person, values in measured_values.items()
    }


def _variance_of_estimate(row: Any, result: LevelsResult, *, ratio: bool) -> float:
    """Return the variance of an estimate on the scale of the test; 0 if it is unknown."""
    if not isinstance(row, ThresholdEstimate) or row.variance is None:
        return 0.0
    per_u = math.log(10) * (1.0 if ratio else row.threshold) if result.spacing == "log" else 1.0
    return row.variance * per_u**2


def _is_ratio(contrast: Contrast, levels: Sequence[LevelsResult]) -> bool:
    return contrast.measure in RATIOS and all(
        level.spacing == "log" for level in levels if level.block in contrast.blocks
    )


def _test_contrast(
    study: Study, contrast: Contrast, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult], strictest: float
) -> ContrastResult:
    """Return a contrast before correction, with enough resamples for an alpha of ``strictest``."""
    compared = _collect_samples(study, contrast, answers, levels)
    ratio, means = _is_ratio(contrast, levels), compared.means(strictest)
    names, within = _side_names(study, contrast), _within_names(study, contrast)
    largest = None if _statement(study, contrast) is None else contrast.largest_difference
    is_ordinal = contrast.measure not in _STATISTICS and not contrast.is_interaction
    standardised = _standardised_effects(compared, is_ordinal=is_ordinal)
    effect = ends = p_equal = p = p_bootstrap = p_skewed = statistic = error = None
    method, why = "none", _TOO_FEW if means is None else _ALIKE
    if means is not None:
        mean, (low, high) = float(means.mean[0]), (float(end[0]) for end in means.interval(0.95))
        effect = math.exp(mean) if ratio else mean
        if contrast.bound is not None:
            bound = bound_as_tested(contrast.bound, ratio=ratio)
            p_equal = float(p_equivalent(means, bound, compared.smallest, largest)[0])
        if means.error[0] > SAME:
            ps = p_differs(means, SIDES[contrast.expected])
            p, p_bootstrap, p_skewed = float(ps.t[0]), float(ps.bootstrap[0]), float(ps.skewed[0])
            statistic, error = float(means.t()[0]), float(means.error[0])
            low, high = (math.exp(end) if ratio else end for end in (low, high))
            ends = Interval(low=low, high=high, level=0.95, method=f"t({means.freedom})")
            sides = "two-sided" if contrast.expected is None else f"one-sided ({contrast.expected})"
            by_bootstrap, for_skewness = p_equals(p_bootstrap), p_equals(p_skewed)
            method = f"t({means.freedom}), {sides}; bootstrap {by_bootstrap}; skewness-corrected t {for_skewness}"
    return ContrastResult(
        test=(
            "contrast, two-sample t test of differences"
            if contrast.is_interaction
            else "contrast, two-sample t test"
            if contrast.groups
            else "contrast, paired t test"
        ),
        n=sum(map(len, compared.samples)),
        dropped=len(compared.left_out),
        statistic_name="t",
        statistic=statistic,
        p=p,
        method=method,
        effect_name="ratio" if ratio else "difference",
        effect=effect,
        interval=ends,
        no_interval=why if ends is None else "",
        note=why if ends is None else "",
        contrast=contrast,
        compared=names,
        ratio=ratio,
        p_adjusted=None,
        members=1,
        verdict="not tested",
        equivalent=None,
        p_bootstrap=p_bootstrap,
        p_skewed=p_skewed,
        p_equivalent=p_equal,
        not_excluded=_largest_possible_share(contrast, compared, ratio=ratio),
        higher=None if contrast.groups else int((compared.values[0] > SAME).sum()),
        left_out=compared.left_out,
        sides=tuple(
            _summarize_side(name, values, ratio=ratio) for name, values in zip(names, compared.sides, strict=True)
        ),
        sd=_sample_sd(compared.values[0].tolist()) if contrast.groups is None else None,
        standardised=standardised.effect,
        ordinal=standardised.ordinal,
        bayes_factor=standardised.bayes_factor,
        within_names=within,
        cells=tuple(
            _summarize_side(name, values, ratio=ratio)
            for name, values in zip((within or contrast.within or ()) * 2, compared.cells, strict=False)
        ),
        measure_name=_measure_name(study, contrast),
        block_title=_block_titles(study, contrast)[0],
        standard_error=error,
        freedom=None if error is None or means is None else means.freedom,
        largest=largest,
        scale=_scale_ends(study, contrast),
        fewest=_fewest_for_equivalence(study, contrast, largest, ratio=ratio),
    )


def _fewest_for_equivalence(study: Study, contrast: Contrast, largest: float | None, *, ratio: bool) -> int | None:
    """Return the number of participants that equivalence within the bound requires; None without a bound."""
    if contrast.bound is None:
        return None
    bounds = sum(other.bound is not None for other in study.contrasts)
    return fewest_participants(study.decided.alpha / bounds, bound_as_tested(contrast.bound, ratio=ratio), largest)


def _side_names(study: Study, contrast: Contrast) -> tuple[str, str]:
    """Return the names of the two sides: block titles, unless these are the same."""
    first, second = _block_titles(study, contrast)
    if first != second and contrast.groups is None:
        return first, second
    if contrast.groups is None and (names := _condition_names(study, contrast)):
        return names
    return contrast.words({block.id: block.stimulus.condition for block in study.levels if block.stimulus})


def _condition_names(study: Study, contrast: Contrast) -> tuple[str, str] | None:
    """Return the names of the two conditions within a sentence, as in tables; None for blocks and groups."""
    if contrast.conditions is None:
        return None
    block = next((block for block in study.trial_blocks if block.id == contrast.blocks[0]), None)
    names = {} if block is None else {
        setting.condition: ms(setting.delay_ms or 0.0) if block.kind == "delays" else block.name(setting)
        for setting in block.settings
    }  # fmt: skip
    has_replicates = len({*names.values()}) < len(names)
    first, second = (
        name if has_replicates else name_in_sentence(names.get(name, name)) for name in contrast.conditions
    )
    return first, second


def _block_titles(study: Study, contrast: Contrast) -> tuple[str, str]:
    """Return the titles of the first and the last block of a contrast."""
    titles = {question.where.id: question.where.title for question in study.others.questions}
    titles |= {level.id: level.title for level in study.levels}
    titles |= {block.id: block.title for block in study.trial_blocks}
    first, last = (titles.get(block, block) for block in (contrast.blocks[0], contrast.blocks[-1]))
    return first, last


def _within_names(study: Study, contrast: Contrast) -> tuple[str, str] | None:
    """Return the names of the blocks or conditions of an interaction; None for other hypotheses."""
    return (_condition_names(study, contrast) or _block_titles(study, contrast)) if contrast.is_interaction else None


def _measure_name(study: Study, contrast: Contrast) -> str:
    """Return the measure with the short text of its statement or question; "" if it has none."""
    if (statement := _statement(study, contrast)) is not None:
        return f"agreement with “{statement.short}”"
    asked = _question_or_score(study, contrast, contrast.form or contrast.blocks[0])
    if isinstance(asked, PlacedScore):
        return f"{asked.title} score"
    if asked is None:
        level = next((level for level in study.levels if level.id == contrast.blocks[0]), None)
        if contrast.measure == "pse" and level is not None and level.design.intervals == 1:
            return MEAN_SETTING
        has_pse = contrast.measure == "threshold" and level is not None and level.has_pse
        return "point of subjective equality" if has_pse else ""
    return f"“{asked.short}”" if contrast.form is None else f"“{asked.short}” ({asked.where.title})"


def _statement(study: Study, contrast: Contrast) -> Item | None:
    """Return the statement after trials whose agreement a contrast compares; None for other measures."""
    blocks = [] if contrast.form is not None else [block for block in study.blocks if block.id in contrast.blocks]
    return next((item for block in blocks for item in block.items if item.id == contrast.measure), None)


def bound_as_tested(bound: float, *, ratio: bool) -> float:
    """Return an equivalence bound on the scale of the test."""
    return abs(math.log(bound)) if ratio else bound


def _largest_possible_share(contrast: Contrast, compared: ContrastSamples, *, ratio: bool) -> float | None:
    """Return the upper confidence limit of the proportion of participants who differ by more than the bound."""
    if contrast.bound is None or not compared.smallest:
        return None
    if contrast.groups is not None:
        return clopper_pearson(0, compared.smallest).high
    return people_beyond(compared.values[0], bound_as_tested(contrast.bound, ratio=ratio)).interval.high


def question(contrast: ContrastResult) -> str:
    """Return the hypothesis in words."""
    hypothesis = contrast.hypothesis
    return f"{hypothesis[:1].upper()}{hypothesis[1:]}"


def answer(contrast: ContrastResult) -> str:
    """Return the result as sentences."""
    sentences = [f"Not tested: {contrast.note}." if contrast.p_adjusted is None else _difference_text(contrast)]
    kind = "ratio" if contrast.ratio else "difference"
    if contrast.contrast.bound is not None and _lies_beyond(contrast, contrast.contrast.bound):
        subject = "All differences lie" if contrast.interval is None else "The whole confidence interval lies"
        sentences.append(f"{subject} outside the equivalence bounds (not equivalent).")
    elif contrast.equivalent:
        people = (
            "of people show a difference larger than the bound"
            if contrast.contrast.groups is None
            else "of a group belong to a minority that the sample does not include"
        )
        p = "" if contrast.p_equivalent is None else f", {p_equals(contrast.p_equivalent)}"
        sentences.append(
            f"The mean {kind} lies within the equivalence bounds (equivalent{p}). However, the data do not rule out "
            f"the possibility that up to {100 * (contrast.not_excluded or 0.0):.0f} % {people}."
        )
    elif contrast.equivalent is not None and contrast.is_too_small:
        each = " in each group" if contrast.contrast.groups else ""
        sentences.append(
            f"The sample is too small to show equivalence: at least {contrast.fewest} participants{each} are needed."
        )
    elif contrast.equivalent is not None:
        sentences.append(f"The tests do not show that the mean {kind} lies within the equivalence bounds.")
    if contrast.left_out:
        sentences.append(f"Excluded: {_left_out_text(contrast)}.")
    return " ".join(sentences)


def _lies_beyond(contrast: ContrastResult, bound: float) -> bool:
    """Return whether the whole 95 % interval (or the difference, if all are equal) lies beyond the bound."""
    reach = bound_as_tested(bound, ratio=contrast.ratio)
    if contrast.ratio and contrast.effect is not None:
        ends = contrast.interval
        logarithms = None if ends is None else replace(ends, low=math.log(ends.low), high=math.log(ends.high))
        return is_beyond(replace(contrast, effect=math.log(contrast.effect), interval=logarithms), reach, 0.05)
    return is_beyond(contrast, reach, 0.05)


def _difference_text(contrast: ContrastResult) -> str:
    first, second = map(quoted_title, contrast.compared)
    quantity, expected = number_text.capitalised(with_article(contrast.effect_text)), contrast.contrast.expected
    if contrast.verdict in FOUND:
        side = "higher" if (contrast.effect or 0.0) > (1.0 if contrast.ratio else 0.0) else "lower"
        claim = f"{quantity} was {side} in {first} than in {second}"
    elif expected is None:
        claim = f"{quantity} did not differ significantly between {first} and {second}"
    else:
        claim = f"{quantity} was not significantly {expected} in {first} than in {second}"
    decimals = _matching_decimals(contrast)
    means = listed([mean_text(side, decimals) for side in contrast.sides if side.mean is not None])
    higher = (
        ""
        if contrast.higher is None
        else f" It was higher in {first} for {contrast.higher} of {contrast.n} participants{_ties_text(contrast)}."
    )
    effect = f"mean {'ratio' if contrast.ratio else 'difference'} {number(contrast.effect, decimals)}"
    unadjusted = "unadjusted " * (contrast.members > 1) + "two-sided " * (expected is not None)
    p_kind = "adjusted " * (contrast.members > 1) + "one-sided " * (expected is not None)
    size = "" if contrast.standardised is None else f", {_effect_size_text(contrast.standardised)}"
    return (
        f"{claim} (means {means}; {effect}, {unadjusted}95 % confidence interval {interval(contrast.interval)}{size}, "
        f"{p_kind}{p_equals(contrast.p_adjusted or 0.0)}, n = {contrast.n}).{_adjustment_text(contrast)}"
        f"{higher}{_bayes_text(contrast)}"
    )


def _adjustment_text(contrast: ContrastResult) -> str:
    """Return a sentence with the unadjusted p if only the adjustment raises p above 0.05, otherwise ""."""
    p, adjusted = contrast.largest_p, contrast.p_adjusted
    if contrast.verdict in FOUND or p is None or adjusted is None or not p <= 0.05 < adjusted:
        return ""
    return f" Before the adjustment for {contrast.members} hypotheses, {p_equals(p)}."


def _ties_text(contrast: ContrastResult) -> str:
    """Return a clause that counts participants with equal values on both sides, " and equal for 1", or ""."""
    same = 1.0 if contrast.ratio else 0.0
    ties = sum(math.isclose(value, same, abs_tol=1e-12) for value in contrast.differences.values())
    return f" and equal for {ties}" if ties else ""


def _matching_decimals(contrast: ContrastResult) -> int:
    """Return the fewest decimals (2 or 3) at which the printed means differ by the printed difference, otherwise 2."""
    means, effect = [side.mean for side in contrast.sides if side.mean is not None], contrast.effect
    if len(means) != 2 or effect is None or contrast.ratio or not math.isclose(means[0] - means[1], effect):
        return 2
    for decimals in (2, 3):
        first, second, shown = (
            float(number(value, decimals).replace(number_text.MINUS, "-")) for value in (*means, effect)
        )
        if math.isclose(first - second, shown):
            return decimals
    return 2


def mean_text(side: ContrastSide, decimals: int = 2) -> str:
    """Return the mean of one side with its interval: "0.61 [0.4, 0.82]"."""
    ends = "" if side.low is None or side.high is None else f" [{number(side.low)}, {number(side.high)}]"
    return f"{number(side.mean, decimals)}{ends}"


def _effect_size_text(size: EffectSize | None) -> str:
    return "–" if size is None else f"{size.name} {number(size.value)} {interval(size)}"


def _bayes_text(contrast: ContrastResult) -> str:
    if contrast.bayes_factor is None or contrast.verdict in FOUND:
        return ""
    factor = max(contrast.bayes_factor, 1 / contrast.bayes_factor)
    sides = "with a difference as without one" if contrast.bayes_factor > 1 else "without a difference as with one"
    return (
        f" The data are {significant(factor)} times as likely {sides} (JZS Bayes factor, Cauchy prior with scale "
        f"{number(PRIOR_SCALE, 3)}){', which is weak evidence' * (factor < _SUBSTANTIAL)}."
    )


def t_test_name(contrast: Contrast, *, ratio: bool) -> str:
    """Return the name of a contrast's t test and the values that it uses: logarithms for a ``ratio``."""
    used = ["within-participant differences"] * contrast.is_interaction + ["log-transformed values"] * ratio
    values = f" on {' of '.join(used)}" if used else ""
    return f"two-sample t test{values} with unequal variances" if contrast.groups else f"paired t test{values}"


def _holm_text(contrasts: Sequence[ContrastResult]) -> str:
    return f", Holm-adjusted across {len(contrasts)} hypotheses" if len(contrasts) > 1 else ""


def contrast_methods(results: Results) -> Iterator[str]:
    """Yield the sentences about hypotheses for the methods paragraph."""
    contrasts = results.contrasts
    if not contrasts:
        return
    yield from _tests_used(contrasts)
    reductions = list(_reductions(results))
    reductions_note = f" ({listed(reductions)})" if reductions else ""
    yield (
        f"Each participant contributed one value to each comparison{reductions_note}. In addition to the t test, "
        "we used a bootstrap that includes one hypothetical participant as extreme as the most extreme participant in "
        "the sample (Gaffke 2005), and a t test corrected for skewness (Hall 1992). The reported p value is the "
        f"largest of the three{_holm_text(contrasts)}."
    )
    if any(contrast.contrast.measure == "threshold" for contrast in contrasts):
        yield _WEIGHTED.rstrip()
    if any(contrast.standardised is not None for contrast in contrasts):
        yield _effect_size_notes(contrasts)
        yield _BAYES
    if bounds := [contrast for contrast in contrasts if contrast.contrast.bound is not None]:
        adjusted = f", Holm-adjusted across {number_text.counted(len(bounds), 'bound')}" if len(bounds) > 1 else ""
        yield (
            f"Equivalence was tested with two one-sided t tests and the same bootstrap{adjusted}; both had to show "
            "equivalence. In addition, the sample had to be large enough that it would probably include a member of "
            "any minority that could shift the mean by as much as the bound."
        )
    if exclusions := {
        f"{question(contrast)}: {_left_out_text(contrast)}": None for contrast in contrasts if contrast.left_out
    }:
        yield f"Some participants were excluded from a test because a value was missing ({'; '.join(exclusions)})."


def _reductions(results: Results) -> Iterator[str]:
    """Yield how several answers or estimates of a participant are reduced to one value, for each kind of measure."""
    of_questions = [result for result in results.contrasts if result.contrast.measure not in _STATISTICS]
    repeated = {block.id for block in results.blocks if block.presentations[1] > 1}
    if any(result.largest is not None and repeated & {*result.contrast.blocks} for result in of_questions):
        yield "the median of repeated answers to a statement"
    if any(result.largest is None and _has_repeated_answers(result.contrast, results) for result in of_questions):
        yield "the mean of repeated answers to another question"
    if any(_is_averaged_over_conditions(result.contrast, results) for result in of_questions):
        yield "the mean over the conditions of a block"
    compared = {(block, result.contrast.measure) for result in results.contrasts for block in result.contrast.blocks}
    for level in results.levels:
        for measure, (statistic, _) in _STATISTICS.items():
            standards = {getattr(row, "standard", None) for row in statistic.rows_in(level)}
            if (level.block, measure) in compared and len(standards) > 1:
                yield f"the mean over the standards in {quoted_title(level.title)}"


def _is_averaged_over_conditions(contrast: Contrast, results: Results) -> bool:
    """Return whether blocks or groups are compared in a question that is asked in several conditions of a block."""
    several = {block.id for block in results.trial_blocks if len(block.settings) > 1}
    return contrast.form is None and contrast.conditions is None and not several.isdisjoint(contrast.blocks)


def _has_repeated_answers(contrast: Contrast, results: Results) -> bool:
    """Return whether anyone answered the question of a contrast, or those of its score, several times in one place."""
    asked = [question for question in results.questions if question.where in (contrast.form, *contrast.blocks)]
    return any(
        int(group.numbers["n"]) > int(group.numbers["participants"]) or OF_SESSION in (group.code or "")
        for question in asked
        for group in question.groups
    )


def _tests_used(contrasts: Sequence[ContrastResult]) -> Iterator[str]:
    """Yield the test of each hypothesis."""
    for index, contrast in enumerate(contrasts, start=1):
        test = t_test_name(contrast.contrast, ratio=contrast.ratio)
        sides = "two-sided" if contrast.contrast.expected is None else "one-sided"
        label = f"Hypothesis {index}" if len(contrasts) > 1 else "The hypothesis"
        yield f"{label} ({contrast.hypothesis}) was tested with a {sides} {test}."
    if any(contrast.contrast.groups for contrast in contrasts):
        yield "Comparisons between groups used the degrees of freedom of the smaller group (Hsu 1938)."


def _left_out_text(contrast: ContrastResult) -> str:
    by_reason: dict[str, list[str]] = {}
    for person, reason in contrast.left_out.items():
        by_reason.setdefault(reason, []).append(person)
    return "; ".join(
        f"{', '.join(people[:_MOST_NAMED])}{f' and {len(people) - _MOST_NAMED} more' * (len(people) > _MOST_NAMED)} "
        f"({reason})"
        for reason, people in by_reason.items()
    )


def contrast_section(results: Results) -> Iterator[str]:
    """Yield the report's section on hypotheses; nothing if there are none."""
    contrasts = results.contrasts
    if not contrasts:
        return
    bounds = any(contrast.contrast.bound is not None for contrast in contrasts)
    kinds = sorted({"ratio" if contrast.ratio else "difference" for contrast in contrasts})
    yield heading(2, "Hypotheses")
    yield table_of(
        contrasts,
        ("Comparison", lambda row: _row_text(results, row, row.comparison)),
        ("n", lambda row: str(row.n)),
        ("t", lambda row: number(row.statistic)),
        ("df", lambda row: "–" if row.freedom is None else str(row.freedom)),
        ("t-test p", lambda row: p_value(row.p)),
        ("p", lambda row: p_value(row.largest_p)),
        ("adjusted p", lambda row: p_value(row.p_adjusted)) if len(contrasts) > 1 else None,
        ("equivalence p", lambda row: p_value(row.p_equivalent)) if bounds else None,
        (f"mean {' or '.join(kinds)}", lambda row: number(row.effect)),
        ("SE", lambda row: number(row.standard_error)),
        *ends_of(lambda row: row.interval),
        ("BF₁₀", lambda row: "–" if row.bayes_factor is None else significant(row.bayes_factor)),
        ("Verdict", lambda row: BADGES.get(row.verdict, row.verdict)),
        words=1,
        last=1,
    )
    weighted = any(contrast.contrast.measure == "threshold" for contrast in contrasts)
    yield paragraph(" ".join(_tests_used(contrasts)), "soft")
    yield paragraph(_direction_text(kinds), "soft")
    yield paragraph(
        "The column “t-test p” is from the t test alone. The column “p” is the largest p value from the t test, a "
        "bootstrap that includes one hypothetical participant as extreme as the most extreme participant in the "
        f"sample, and a t test corrected for skewness. The verdict depends on this value{_holm_text(contrasts)}. The "
        f"last two tests do not assume normal distributions, so normality is not tested. "
        f"{_UNADJUSTED * (len(contrasts) > 1)}{_BAYES} {_WEIGHTED * weighted}"
        f"{inclusion_text((contrast.contrast for contrast in contrasts), in_report=True)}",
        "soft",
    )
    if bounds:
        yield paragraph(
            "“Equivalent” means that the sample is large enough and that both two one-sided t tests and the bootstrap "
            "show that the mean difference (or ratio) lies within the stated bounds (Holm-adjusted across the bounds). "
            "The equivalence p value is the largest of their p values, or the probability that the sample includes "
            "nobody of a minority that could shift the mean by the bound, if this is larger.",
            "soft",
        )
    if rows := [contrast for contrast in contrasts if contrast.left_out]:
        yield bullets([f"{question(row)}: excluded {_left_out_text(row)}." for row in rows])
    sizes = [(row, size) for row in contrasts for size in (row.standardised, row.ordinal) if size is not None]
    if sizes:
        yield heading(3, "Effect sizes")
        yield table_of(
            sizes,
            ("Comparison", lambda row: _row_text(results, row[0], row[0].comparison)),
            ("effect size", lambda row: row[1].name),
            ("value", lambda row: number(row[1].value)),
            *ends_of(lambda row: row[1]),
            words=2,
        )
        yield paragraph(_effect_size_notes(contrasts), "soft")
    yield heading(3, "Descriptive statistics")
    yield table_of(
        [described for contrast in contrasts for described in _describe_sides(results, contrast)],
        ("Values", lambda row: row.name),
        ("n", lambda row: str(len(row.values))),
        ("mean", lambda row: number(row.mean)),
        ("median", lambda row: number(float(np.median(row.values)) if row.values else None)),
        ("SD", lambda row: number(row.sd)),
        ("SE", lambda row: number(row.standard_error)),
    )
    logs = " If a ratio is tested, both refer to natural logarithms of the values." * ("ratio" in kinds)
    weights = " if participants are weighted equally" * weighted
    yield paragraph(
        f"SD is the standard deviation across participants. SE is the standard error of the mean, SD/√n{weights}."
        f"{logs}",
        "soft",
    )


def _effect_size_notes(contrasts: Sequence[ContrastResult]) -> str:
    logs = " For ratios, they are calculated from natural logarithms." * any(contrast.ratio for contrast in contrasts)
    return f"{_SIZES}{logs}{_DELTA * any(contrast.ordinal is not None for contrast in contrasts)}"


def _row_text(results: Results, contrast: ContrastResult, sides: str) -> str:
    """Return the name of a row: number of the hypothesis, measure, and the sides compared."""
    positions = (position for position, result in enumerate(results.contrasts, start=1) if result is contrast)
    prefix = f"{next(positions)}. " if len(results.contrasts) > 1 else ""
    return f"{prefix}{number_text.capitalised(contrast.effect_text)}: {sides}"


class _SideDescription(NamedTuple):
    """Descriptive statistics of one side of a hypothesis, or of the differences between its sides."""

    name: str
    values: Sequence[float]
    mean: float | None
    sd: float | None
    standard_error: float | None


def _describe_sides(results: Results, contrast: ContrastResult) -> Iterator[_SideDescription]:
    for side in contrast.sides:
        name = _row_text(results, contrast, side.name)
        yield _SideDescription(
            name=name, values=[*side.values.values()], mean=side.mean, sd=side.sd, standard_error=side.standard_error
        )
    if differences := [*contrast.differences.values()]:
        name = _row_text(results, contrast, contrast.comparison)
        yield _SideDescription(
            name=name, values=differences, mean=contrast.effect, sd=contrast.sd, standard_error=contrast.standard_error
        )


_DIRECTIONS: Final = {"difference": "differences are first minus second", "ratio": "ratios are first divided by second"}


def _direction_text(kinds: Sequence[str]) -> str:
    """Return sentences on the direction of differences and ratios, and on their standard errors."""
    logs = ", or of the mean logarithm for a ratio" * ("ratio" in kinds)
    return (
        f"In the text, figures and tables, {listed([_DIRECTIONS[kind] for kind in kinds])}, in the order of the "
        "hypothesis; effect sizes are positive if the first is higher. SE is the standard error of the mean "
        f"difference{logs}, and CI is the confidence interval of the t test."
    )


def contrast_rows(results: Results) -> Iterator[dict[str, Any]]:
    """Yield the rows of tests.csv."""
    for contrast in results.contrasts:
        ends = contrast.interval
        yield dict.fromkeys(column.name for column in TESTS) | {
            **{name: getattr(contrast, name) for name in ("test", "n", "dropped", "statistic_name")},
            **{name: getattr(contrast, name) for name in ("statistic", "p", "effect_name", "effect", "method")},
            "block": contrast.contrast.blocks[0],
            "question": question(contrast),
            "item": None if contrast.contrast.measure in _STATISTICS else contrast.contrast.measure,
            "p_adjusted": contrast.p_adjusted,
            "low": None if ends is None else ends.low,
            "high": None if ends is None else ends.high,
            "level": None if ends is None else ends.level,
            "interval": contrast.no_interval or (None if ends is None else ends.method),
            "family": "hypotheses",
            "members": contrast.members,
            "correction": HOLM,
            "primary": results.decided.binding,
            "verdict": contrast.verdict,
            "note": contrast.note or None,
            "codes": "",
        }
