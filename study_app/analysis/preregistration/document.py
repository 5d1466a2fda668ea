"""The preregistration of a study in Markdown, from its protocol alone."""

from collections.abc import Iterator

from study_app import __version__
from study_app.analysis.power.plan import compares_statements
from study_app.analysis.preregistration.block_questions import analyses, hypotheses
from study_app.analysis.preregistration.commitment import Commitment, commitment, written
from study_app.analysis.results.words import counted
from study_app.analysis.tables.compared_blocks import spoken
from study_app.protocol.checks.expected_precision import expected_of, precision_plan, precision_rows
from study_app.protocol.describe import describe, limit_rows
from study_app.protocol.model import Protocol
from study_app.protocol.table import text_in
from study_app.psychophysics.precision import BETWEEN_PEOPLE


def preregistration(protocol: Protocol, protocol_hash: str, power: str | None = None) -> str:
    """Return the text: hypotheses, design, sample size, exclusions, analysis, the protocol in words.

    Parameters
    ----------
    power : str, optional
        The Markdown that ``liquid-study power`` wrote.
    """
    one = commitment(protocol, protocol_hash)
    study = protocol.study
    language = spoken({"study": {"languages": study.languages}})
    lines = [
        f"# Preregistration: {text_in(study.title, language)}",
        "",
        f"Study {study.name}, version {study.version}; protocol file with SHA-256 `{protocol_hash}`. Written by "
        f"liquid-study {__version__} from this file alone. Register it before the first session.",
        "",
        "## Hypotheses and questions",
        "",
        *(f"- {line}" for line in hypotheses(protocol, language)),
        "",
        "## Design",
        "",
        *(f"- {line}" for line in _design(protocol)),
        "",
        "## Participants",
        "",
        *_participants(protocol, one, power),
        "",
        "## Exclusions",
        "",
        *(f"- {line}" for line in _exclusions(protocol)),
        "",
        "## Analysis",
        "",
        *(f"- {line}" for line in analyses(protocol)),
        "",
        "## The protocol in words",
        "",
        "```text",
        describe(protocol),
        "```",
        "",
        "## Values that the report compares with",
        "",
        written(one),
    ]
    return "\n".join(lines)


def _design(protocol: Protocol) -> Iterator[str]:
    study = protocol.study
    yield (
        "Conditions are known by codes until the key is opened; double-blind: the operator sees no force."
        if study.blinding == "double"
        else "Conditions are known by codes until the key is opened; the operator sees force and wake (single-blind)."
    )
    if protocol.groups:
        shares = ", ".join(f"{name} (share {group.share})" for name, group in protocol.groups.items())
        yield f"Participants are allocated at random, in permuted blocks, to the groups {shares}."
    yield "Orders are drawn for each participant from the session's seed, as described for each block below."
    for block in protocol.main_blocks:
        rows = dict(precision_rows(protocol, block))
        kind = "levels" if block.stimulus is not None else "conditions"
        of_block = f"Block {block.id}: {kind}, see below"
        yield f"{of_block}; expected: {rows['Expected precision']}." if rows else f"{of_block}."


def _participants(protocol: Protocol, one: Commitment, power: str | None) -> Iterator[str]:
    """Yield how many participants there are and why."""
    planned = "Their number is not decided." if one.participants is None else f"{one.participants} are planned."
    wanted = (
        ""
        if one.precision is None
        else f" The aim is a 95 % interval of the group's mean within ±{100 * one.precision:g} %."
    )
    yield planned + wanted
    reasons = []
    for block in protocol.main_blocks:
        plan = precision_plan(protocol, block)
        found = None if plan is None else expected_of(plan)
        if plan is None or found is None or not found.measured:
            continue
        reached = ""
        if one.participants is not None:
            half = 100 * found.of_group(one.participants)
            reached = f" {one.participants} participants give ±{half:.0f} %."
        needed = None if one.precision is None else found.participants_for(one.precision)
        enough = "" if needed is None else f" The aim takes {counted(needed, 'participant')}."
        reasons.append(
            f"- Block {block.id}: from simulated answers, {found.trials} trials{plan.per}, people who differ by a "
            f"factor of {BETWEEN_PEOPLE:g}.{reached}{enough}"
        )
    if reasons:
        yield from ("", *reasons)
    if power is not None:
        yield from ("", *(f"##{line}" if line.startswith("#") else line for line in power.rstrip().splitlines()))
    elif compares_statements(protocol):
        yield ""
        yield (
            f"No power was computed for this text: `liquid-study power {protocol.study.name} --to DIR` computes it, "
            "and `--power DIR` includes it here."
        )


def _exclusions(protocol: Protocol) -> Iterator[str]:
    yield "Sessions that are not completed are left out of every number."
    for block in protocol.main_blocks:
        if block.catch is not None:
            yield (
                f'Rule "catch": a session with more than {100 * block.catch.wrong_most:g} % incorrect answers to the '
                f"catch trials of block {block.id} is excluded; the program applies it when the key is opened."
            )
    limits = "; ".join(f"{what} {value}" for value, what in limit_rows(protocol))
    has_intervals = any(block.design is not None for block in protocol.main_blocks)
    if has_intervals:
        attempts = protocol.limits.attempts
        times = "" if attempts is None else f", up to {attempts} times"
        yield f"A trial of intervals beyond a limit is not asked about and is presented again{times}."
    if any(block.design is None for block in protocol.main_blocks):
        yield f"{'Other trials' if has_intervals else 'Trials'} beyond a limit are counted and reported."
    yield f"Limits: {limits}."
    yield "Any other exclusion is a deviation: the report lists it with its reason and date."
