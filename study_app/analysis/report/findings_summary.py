"""The findings in a few sentences: what is shown, and what these participants could not show."""

from collections.abc import Iterator

from study_app.analysis.figures.levels.level_figure import level_words, with_unit
from study_app.analysis.findings import all_findings
from study_app.analysis.report.answers.level_limits import level_limits
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.level_results import ExponentFound, LevelsFound, ThresholdFound
from study_app.analysis.results.words import counted, lead, listed, missing, name, number, short
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.tables.study_tables import Study


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
        out = [f"“{short(found, one.item)}”" for one in _decisive(found) if one.verdict == "out of reach"]
        if out:
            lines.append(
                f"{lead(found)}: so few participants, with the ties in their answers and the other p of the family as "
                f"they came out, could not have shown anything in {listed(out)}, even had they all agreed."
            )
        lines += _untested(found)
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


def _decisive(found: BlockFound) -> list[Tested]:
    """Return the tests of statements whose verdicts count."""
    return [one for finding in all_findings() if finding.statements for one in finding.of(found)]


def _untested(found: BlockFound) -> Iterator[str]:
    """Name the statements that gave nothing to test, with the reason."""
    reasons: dict[str, list[str]] = {}
    for one in _decisive(found):
        if one.verdict == "not tested":
            reasons.setdefault(one.outcome.note, []).append(f"“{short(found, one.item)}”")
    for reason, items in reasons.items():
        yield f"{lead(found)}: {listed(items)} could not be tested: {reason}."


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
