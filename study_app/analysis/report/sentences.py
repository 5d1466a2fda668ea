"""The findings, the limits and the methods of a study in sentences."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from study_app import __version__
from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.data.measures import QUARTILES
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.answer_figures import people_a_setting
from study_app.analysis.figures.level_figures import level_words, with_unit
from study_app.analysis.findings import all_findings
from study_app.analysis.levels.results import ExponentFound, LevelsFound, ThresholdFound
from study_app.analysis.results import (
    BlockFound,
    Results,
    counted,
    lead,
    listed,
    missing,
    name,
    number,
    said_of_presentations,
    settings_noun,
    short,
)
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.statistics.thresholds import FEWEST, SETS
from study_app.protocol.trials.stimuli import ANALYSIS_LAPSES

SHIFT: Final = 0.1
"""A prior that shifts a threshold by a larger share of it is named."""
FEW_ANSWERS: Final = 40
"""The fewest answers for which the coverage of the intervals was tested."""
MOST_NAMED: Final = 6


def level_limits(found: LevelsFound) -> Iterator[str]:
    """Yield the limits of a block's thresholds; none where it has no threshold."""
    own, motors = found.own_thresholds, "motors are audible and were not masked: participants may have used their sound"
    if found.own_settings:
        yield from _of_settings(found)
        yield f"{found.title}: {motors}."
    if not own:
        return

    def shifted(one: ThresholdFound) -> bool:
        return one.flat_width is not None and abs(one.flat_width - one.threshold) > SHIFT * abs(one.threshold)

    kinds: tuple[tuple[Callable[[ThresholdFound], bool], str], ...] = (
        (shifted, f"the prior of the width shifts a threshold by more than {100 * SHIFT:.0f} %: too few answers"),
        (lambda one: one.beyond == "above", "a threshold lies above the highest level presented; how far is not known"),
        (lambda one: one.beyond == "below", "a threshold lies below the lowest level presented; how far is not known"),
        (lambda one: not one.fits, "the function does not fit the answers, so that a threshold may be biased"),
        (lambda one: one.drifts, "answers became better or worse over the trials, which one threshold does not show"),
        (lambda one: one.n < FEW_ANSWERS, f"fewer than {FEW_ANSWERS} answers, so that intervals are wide"),
    )
    for applies, words in kinds:
        if some := [one for one in own if applies(one)]:
            yield f"{found.title}: {words} ({_named_people(found, some)})."
    people = len({one.participant for one in own})
    if people < FEWEST:
        yield (
            f"{found.title}: {counted(people, 'participant')}; below {FEWEST} the group has no interval, since "
            "differences between people are not known."
        )
    if found.level_kind == "weber":
        yield _of_device(found)
    yield f"{found.title}: {motors}."


def _of_device(found: LevelsFound) -> str:
    """Return what the device's own dynamics leave open."""
    own = found.device
    if own is None:
        return (
            f"{found.title}: the device's own damping, friction and mass are unknown, since they were not measured; "
            "Weber fractions are of what the motors delivered, and smaller ones of the sum with the device's own."
        )
    where = "" if own.sessions == own.of else f" (measured for {own.sessions} of {own.of} sessions)"
    words = (
        f"{found.title}: the device's own damping of {own.damping_nspm:.2g} N·s/m, friction of {own.friction_n:.2g} N "
        f"and mass of {own.mass_kg:.2g} kg{where} add to what the motors delivered; Weber fractions are of the latter"
    )
    with_device = [
        f"{share:.3g} in place of {one.threshold:.3g} at {one.standard:g} {found.unit}"
        for one in found.thresholds
        if one.participant is None and (share := found.with_device(one)) is not None
    ]
    if not with_device:
        return f"{words}."
    return f"{words}. With the device's damping in the standard, those of the group are {listed(with_device)}."


def _of_settings(found: LevelsFound) -> Iterator[str]:
    """Yield what settings cannot show."""
    yield (
        f"{found.title}: settings depend on how a participant decides that two are equal: their scatter is not a "
        "threshold free of a criterion."
    )
    if few := [one for one in found.own_settings if one.hysteresis is None]:
        words = "settings started near one end alone, so that hysteresis is not known"
        yield f"{found.title}: {words} ({listed([str(one.participant) for one in few[:MOST_NAMED]])})."


def _named_people(found: LevelsFound, some: Sequence[ThresholdFound]) -> str:
    """Return whose thresholds they are: at each standard where there are several, at most `MOST_NAMED` by name."""
    if len(some) > MOST_NAMED:
        return f"{len(some)} of {len(found.own_thresholds)} thresholds"
    several = len({one.standard for one in found.own_thresholds}) > 1
    return listed([f"{one.participant} at {one.standard:g}" if several else str(one.participant) for one in some])


def findings(results: Results) -> tuple[str, ...]:
    """Return what was found, a sentence each."""
    of_statements = (
        line
        for found in results.blocks
        if found.n
        for finding in all_findings()
        for line in finding(found, results).sentences()
    )
    return (*of_statements, *of_levels(results))


def of_levels(results: Results) -> tuple[str, ...]:
    """Return what was found in blocks of levels, a sentence each."""
    return tuple(line for found in results.levels for line in level_findings(found))


def none_found(results: Results) -> str:
    """Return why there are no findings."""
    if results.blocks:
        return "No answers count yet: there are no findings."
    return "No statements were asked after trials, so nothing was tested; the answers are in the sections below."


def limits(study: Study, results: Results) -> tuple[str, ...]:
    """Return what cannot be shown, a sentence each."""
    lines = list(_in_general(study, results))
    for found in results.blocks:
        if not found.n:
            lines.append(f"{lead(found)}: no answers count yet, so that nothing can be said.")
            continue
        lines += [f"{lead(found)}: {sentence}" for sentence in missing(found)]
        decisive = [one for finding in all_findings() if finding.statements for one in finding.of(found)]
        out = [f"“{short(found, one.item)}”" for one in decisive if one.verdict == "out of reach"]
        if out:
            lines.append(
                f"{lead(found)}: so few participants, with the ties in their answers and the other p of the family as "
                f"they came out, could not have shown anything in {listed(out)}, even had they all agreed."
            )
        untested: dict[str, list[str]] = {}
        for one in decisive:
            if one.verdict == "not tested":
                untested.setdefault(one.outcome.note, []).append(f"“{short(found, one.item)}”")
        lines += [f"{lead(found)}: {listed(items)} could not be tested: {why}." for why, items in untested.items()]
        lines += _mixed_up(found, results)
        lines += [sentence for finding in all_findings() for sentence in finding(found, results).limits()]
    lines += [sentence for found in results.levels for sentence in level_limits(found)]
    return tuple(lines)


def _in_general(study: Study, results: Results) -> Iterator[str]:
    decided = results.decided
    if not study.revealed:
        yield (
            "The key is sealed: settings are codes, and only counts and comparisons without an order are shown. Who "
            "decides by them to go on or to stop makes chance findings likelier."
        )
        if study.sites:
            yield (
                "Each site has a key of its own: until the keys of all sites are open, the code of a setting begins "
                "with its site, and settings of different sites cannot be compared."
            )
    if study.simulated:
        yield "These participants were SIMULATED: nothing here is evidence about people."
    if study.pilot:
        yield "These are pilot sessions: nothing here belongs in the results of the study."
    if not decided.made:
        yield (
            "The protocol decided nothing about the analysis beforehand (it has no table [analysis]): everything "
            "found is exploratory, and a reason to look again."
        )
    elif decided.changed:
        yield (
            "Not all sessions were run under the same decisions about the analysis: everything found is exploratory; "
            "the first session's decisions are used."
        )
    if study.n == 1:
        yield "One participant: all results concern this person alone, and do not generalise to others."
    if study.n < FEW and results.blocks:
        people = counted(study.n, "participant")
        yield (
            f"{people[:1].upper()}{people[1:]}: below {FEW} no bootstrap interval and no mixed model is given, since "
            "they do not hold there. An effect that is not shown here may well exist."
        )


def _mixed_up(found: BlockFound, results: Results) -> Iterator[str]:
    """Name the settings that everybody met at the same place, where more than one order was to be expected."""
    counts = results.orders.get(found.id)
    if counts is None or counts.orders < 2 or len(counts.codes) < 2:
        return
    for place, line in enumerate(counts.positions, start=1):
        for code, count in zip(counts.codes, line, strict=True):
            if count == counts.orders:
                yield (
                    f"{lead(found)}: {name(found, code)} came at place {place} for everybody, so that what it did "
                    "cannot be distinguished from the effect of that place."
                )


def level_findings(found: LevelsFound) -> Iterator[str]:
    """Yield the findings of a block with n and interval; none while the key is sealed."""
    for one in found.thresholds:
        if one.participant is None:
            where = "" if one.standard is None else f", standard {with_unit(found, one.standard)}"
            percent = "" if found.guess_rate is None else f" at {50 * (1 + found.guess_rate):.3g} % {found.counts}"
            if one.compared is not None:
                percent += f", {one.compared:.3g} at {found.compared_percent:g} %"
            yield (
                f"{found.title}{where}: threshold {one.threshold:.3g}{percent} ({level_words(found)}; "
                f"{_interval(one, 3)}; {counted(one.n, 'participant')})."
            )
    for exponent in found.exponents:
        if exponent.participant is None:
            meaning = "; 1 is Weber’s law, 0 a constant JND" if found.thresholds else f" over {found.quantity}"
            yield (
                f"{found.title}: {found.exponent_name} {number(exponent.exponent)} ({_interval(exponent)}; "
                f"{counted(exponent.n, 'participant')}){meaning}."
            )
    if (found.thresholds or found.exponents) and found.published:
        yield f"{found.title}: published values: {'; '.join(one.in_words() for one in found.published)}."


def _interval(one: ThresholdFound | ExponentFound, digits: int | None = None) -> str:
    if one.low is None or one.high is None:
        return "no interval"
    low, high = (number(end) if digits is None else f"{end:.{digits}g}" for end in (one.low, one.high))
    return f"95 % interval {low} to {high}"


FAMILIES: Final = {"weibull": "Weibull", "normal": "cumulative normal", "logistic": "logistic"}
LEVELS: Final = {"weber": "Weber fractions", "difference": "differences", "value": "values"}


def level_methods(blocks: Sequence[LevelBlock], levels: Sequence[LevelsFound]) -> Iterator[str]:
    """Yield the sentences about blocks whose key is open and that have answers."""
    by_id = {block.id: block for block in blocks}
    opened = [found for found in levels if found.revealed and (found.answers or found.settings)]
    for found in opened:
        yield from _of_block(by_id[found.block], found)
    if any(found.thresholds for found in opened):
        yield (
            "Thresholds are posterior medians over a grid with equal-tailed 95 % intervals, from all counted answers "
            "at the levels delivered to the hand. The deviance was compared with that of "
            f"{SETS} simulated sets of answers, and drift is the correlation of trial number and deviance residual "
            "(Wichmann & Hill 2001). Group means are random-effects means with the between-person variance of Paule "
            f"and Mandel (1982) and, from {FEWEST} participants on, the interval of Hartung and Knapp (2001)."
        )
    if any(found.exponents and found.summary == "geometric mean" for found in opened):
        yield (
            "The exponent of magnitude estimation (Stevens 1957) is the slope of the mean ln answer at each level on "
            "ln level, by least squares for each participant; the group’s is the mean with Student’s 95 % interval."
        )
    if any(found.exponents and found.thresholds for found in opened):
        yield (
            "The Weber exponent is the slope of ln JND on ln standard, by least squares for each participant; the "
            "group’s is the mean with Student’s 95 % interval."
        )
    if any(found.settings for found in opened):
        yield (
            "The point of subjective equality is the mean of a participant’s settings, the just-noticeable difference "
            "their standard deviation, the constant error the difference of mean and standard, and the hysteresis that "
            "of settings that started high and low, all of the logarithm of the level where levels are spaced so "
            "(Gescheider 1997). Group values are means over participants with Student’s 95 % interval."
        )
    if any(one.d_prime is not None for found in opened for one in found.sensitivities):
        yield (
            "Sensitivity is d′ from rates with the log-linear correction (Hautus 1995), by the model of each design "
            "(Macmillan & Creelman 2005)."
        )


def _of_block(block: LevelBlock, found: LevelsFound) -> Iterator[str]:
    stimulus = block.stimulus
    if stimulus is None:
        yield f"In “{found.title}” conditions were compared by {block.design.paper_name}."
        return
    held = {one.standard for one in found.answers} | {one.standard for one in found.settings}
    standards = sorted(one for one in held if one is not None)
    against = f" of {listed([f'{one:g}' for one in standards])} {found.unit}".rstrip() if standards else ""
    kind = LEVELS[stimulus.level_kind]
    low, high = stimulus.levels
    if found.settings:
        to = against.replace(" of ", " to the standard ", 1) if block.design.intervals > 1 else ""
        yield (
            f"In “{found.title}” participants set {found.quantity}{to} by {block.design.paper_name}, within {kind} "
            f"from {low:g} to {high:g}, starting alternately near either end."
        )
        return
    chosen = "" if block.method is None else f"; levels were chosen by {block.method.paper_name}"
    yield (
        f"In “{found.title}” {found.quantity} was judged by {block.design.paper_name}, at {kind}{against} from {low:g} "
        f"to {high:g}{chosen}."
    )
    if found.thresholds and block.assumed is not None:
        median, factor = block.assumed.width_prior
        family, log = FAMILIES[block.assumed.family], stimulus.spacing == "log"
        yield (
            f"A {family} function of the {'logarithm of the ' if log else ''}level was fitted, with a "
            f"flat prior on the threshold, a log-normal one on the width (median {median:.3g} "
            f"{'decades' if log else 'units of the level'}, factor {factor:.3g}) and lapse rates up to "
            f"{100 * max(ANALYSIS_LAPSES):.0f} %."
        )


def methods(study: Study, results: Results) -> str:
    """Return the methods paragraph."""
    return " ".join(sentence for sentence in _sentences(study, results) if sentence)


def _sentences(study: Study, results: Results) -> Iterator[str]:
    blocks = [found for found in results.blocks if found.n]
    yield _sample(study)
    yield from level_methods(study.levels, results.levels)
    if blocks:
        yield from _of_statements(study, results, blocks)
    if blocks or results.levels:
        yield f"Sessions and analysis: liquid-study {__version__}."


def _of_statements(study: Study, results: Results, blocks: list[BlockFound]) -> Iterator[str]:
    yield _presented(study, results)
    quartiles = QUARTILES.replace(" (", ", ").rstrip(")")
    yield (
        f"Answers were given on scales of seven points and are taken as ordinal: medians, quartiles ({quartiles}), "
        "never means, except in the test of equivalence, which concerns the mean difference."
    )
    for found in blocks:
        yield from said_of_presentations(found)
        for finding in all_findings():
            yield from finding(found, results).methods()
    yield from _common(results, blocks)


def _sample(study: Study) -> str:
    people = counted(study.n, "participant")
    kind = " (SIMULATED, no people)" if study.simulated else ""
    out = study.left_out + len(study.excluded_sessions)
    gone = f"; {counted(out, 'further session')} {'was' if out == 1 else 'were'} left out" if out else ""
    under = ""
    if study.blocks:
        whole = all(set(people_a_setting(study, block).values()) == {study.n} for block in study.blocks)
        some = ", some of them under fewer than all settings, single trials being left out"
        under = ", each under all settings" if whole else some
    return (
        f"{people[:1].upper()}{people[1:]}{kind} took part in “{study.title}” (protocol {study.name}, "
        f"{version_words(study)}){gone}{under}."
    )


def version_words(study: Study) -> str:
    """Return the versions of the protocol whose sessions are pooled."""
    versions = study.versions
    return f"version {versions[0]}" if len(versions) == 1 else f"versions {listed(versions)}, pooled"


def _presented(study: Study, results: Results) -> str:
    parts = []
    for found in results.blocks:
        noun = settings_noun(found)
        order = study.protocol.get("blocks", {}).get(found.id, {}).get("order", "")
        words = {
            "fixed": "in one order for all",
            "shuffled": "in an order drawn for each participant",
            "constrained": "in a constrained order drawn for each participant",
            "williams": "in the orders of a Williams design",
            "latin": "in the orders of a Latin square",
        }.get(order, "")
        delays = f" ({listed([f'{delay:g}' for delay in found.delays_ms])} ms)" if found.delays_ms else ""
        asked = f", each followed by {counted(len(found.items), 'statement')}"
        parts.append(f"{counted(len(found.settings), noun)}{delays} {words}".strip() + asked)
    blind = (
        "they were known only by codes until the key was opened" if study.revealed else "they are known only by codes"
    )
    return f"The study presented {'; '.join(parts)}; {blind}."


def _common(results: Results, blocks: list[BlockFound]) -> Iterator[str]:
    decided = results.decided
    if decided.binding:
        which = "all statements were primary" if not decided.primary else f"primary: {', '.join(decided.primary)}"
        yield (
            f"These decisions were made before the first session: alpha = {decided.alpha:g}, {which}. "
            "Different questions are not corrected for each other."
        )
    elif decided.made:
        yield (
            "The decisions about the analysis changed between sessions, so all results are exploratory; the "
            f"decisions of the first session were used (alpha = {decided.alpha:g})."
        )
    else:
        yield f"No decisions were made beforehand: all results are exploratory, with alpha = {decided.alpha:g}."
    for finding in all_findings():
        yield from finding.common_methods(blocks)
    measured = results.performance
    if measured is not None and measured.recorded:
        yield (
            "Movement times run from the lighting of a target to the entry that was held, from recordings at the rate "
            "of the servo, the first reach of each trial left out."
        )
