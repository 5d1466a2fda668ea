"""The paragraph for a paper: what was done, so that it could be done again."""

from collections.abc import Iterator

from study_app import __version__
from study_app.analysis.figures.captions import people_a_setting
from study_app.analysis.findings import all_findings
from study_app.analysis.report.answers.level_methods import level_methods
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.words import counted, listed, said_of_presentations, settings_noun
from study_app.analysis.tables.measures import QUARTILES
from study_app.analysis.tables.study_tables import Study


def methods(study: Study, results: Results) -> str:
    """Return the methods paragraph."""
    return " ".join(sentence for sentence in _sentences(study, results) if sentence)


def _sentences(study: Study, results: Results) -> Iterator[str]:
    blocks = [found for found in results.blocks if found.n]
    yield _sample(study)
    yield from level_methods(study.levels, results.levels)
    if not blocks:
        if results.levels:
            yield _program()
        return
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
    yield _program()


def _program() -> str:
    return f"Sessions and analysis: liquid-study {__version__}."


def _sample(study: Study) -> str:
    people = counted(study.n, "participant")
    kind = " (SIMULATED, no people)" if study.simulated else ""
    out = study.left_out + len(study.excluded_sessions)
    gone = f"; {counted(out, 'further session')} {'was' if out == 1 else 'were'} left out" if out else ""
    return (
        f"{people[:1].upper()}{people[1:]}{kind} took part in “{study.title}” (protocol {study.name}, "
        f"{version_words(study)}){gone}{_under(study)}."
    )


def version_words(study: Study) -> str:
    """Return the versions of the protocol whose sessions are pooled."""
    versions = study.versions
    return f"version {versions[0]}" if len(versions) == 1 else f"versions {listed(versions)}, pooled"


def _under(study: Study) -> str:
    if not study.blocks:
        return ""
    if all(set(people_a_setting(study, block).values()) == {study.n} for block in study.blocks):
        return ", each under all settings"
    return ", some of them under fewer than all settings, single trials being left out"


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
