"""The findings, the limits and the methods of a study in sentences."""

from collections.abc import Iterator

from study_app import __version__
from study_app.analysis.data.measures import QUARTILES
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.answer_figures import people_a_setting
from study_app.analysis.findings import all_findings
from study_app.analysis.levels.evaluate import level_findings, level_limits, level_methods
from study_app.analysis.results import (
    BlockFound,
    Results,
    counted,
    lead,
    listed,
    missing,
    name,
    said_of_presentations,
    settings_noun,
    short,
)
from study_app.analysis.statistics.outcome import FEW


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
