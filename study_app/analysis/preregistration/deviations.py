"""Where a study left its preregistration, or the number of participants that its protocol plans."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from study_app.analysis.preregistration.commitment import FILE, Commitment, read
from study_app.analysis.report.html_page import bullets, heading, paragraph
from study_app.analysis.results.words import counted, listed
from study_app.analysis.tables.study_tables import Study
from study_app.store.exclusions import named
from study_app.store.sites.merged import DASH, folders_of

SHOWN = 20


@dataclass(frozen=True, slots=True)
class Deviations:
    """What was preregistered, and each point at which the study differs from it, in words.

    ``commitment`` is None where no preregistration is in the study's folder; then only the planned number of
    participants is compared.
    """

    commitment: Commitment | None
    found: tuple[str, ...]


def deviations(study: Study) -> Deviations | None:
    """Return where a study left what was planned; None: nothing was preregistered, nor a number of people planned.

    Raises
    ------
    AnalysisError
        The preregistration cannot be read.
    """
    sites = {prefix.removesuffix(DASH): read(place) for prefix, place in folders_of(study.folder).items()}
    committed = next(filter(None, sites.values()), None)
    planned = (study.protocol.get("analysis") or {}).get("participants")
    if committed is None:
        return None if planned is None else Deviations(None, tuple(_participants(study, planned)))
    return Deviations(
        committed,
        (
            *_sites(sites, committed),
            *_protocol(study, committed),
            *_participants(study, committed.participants),
            *_exclusions(study, committed),
            *_decisions(study),
        ),
    )


def _sites(sites: Mapping[str, Commitment | None], committed: Commitment) -> Iterator[str]:
    """Yield the sites of a merged study that have no preregistration, or another one than the one compared with."""
    for site, own in sites.items():
        if own is None:
            yield f"site {site} has no {FILE}"
        elif own != committed:
            yield f"the preregistration of site {site} is another one than that of the first site, used here"


def _protocol(study: Study, committed: Commitment) -> Iterator[str]:
    if study.name != committed.study:
        yield f"the preregistration is that of another study, {committed.study}"
    rows = study.participants
    other = rows[rows["counted"] & (rows["protocol_hash"] != committed.protocol_hash)]
    if len(other):
        versions = listed(sorted(set(map(str, other["protocol_version"]))))
        who = listed([f"{row.participant}/{row.session}" for row in other.head(SHOWN).itertuples()])
        more = "" if len(other) <= SHOWN else f" and {len(other) - SHOWN} more"
        yield (
            f"{counted(len(other), 'session')} ran under another protocol (version {versions}) than the preregistered "
            f"one (version {committed.version}, SHA-256 {committed.protocol_hash[:12]}…): {who}{more}"
        )


def _participants(study: Study, planned: int | None) -> Iterator[str]:
    if planned is not None and study.n != planned:
        kind = "fewer" if study.n < planned else "more"
        yield f"{kind} participants: {study.n} are analysed, {planned} were planned"


def _exclusions(study: Study, committed: Commitment) -> Iterator[str]:
    other = [one for one in study.exclusions if one.rule_or_person not in committed.rules]
    for one in other[:SHOWN]:
        yield f"an exclusion by no preregistered rule: {named(one)}: {one.reason} ({one.rule_or_person})"
    if len(other) > SHOWN:
        yield f"{len(other) - SHOWN} more exclusions by no preregistered rule, in report.json"


def _decisions(study: Study) -> Iterator[str]:
    if study.decided.changed:
        yield "the decisions about the analysis differ between sessions: all results are exploratory"


def section(study: Study) -> Iterator[str]:
    """Yield the report's section; nothing where nothing was planned."""
    compared = deviations(study)
    if compared is None:
        return
    yield heading(2, "Preregistration")
    if (committed := compared.commitment) is None:
        yield paragraph(
            f"The study's folder has no {FILE}. Compared with the protocol's planned number of participants:"
        )
    else:
        yield paragraph(
            f"Preregistered: {committed.study}, version {committed.version}, protocol with SHA-256 "
            f"{committed.protocol_hash}."
        )
    if compared.found:
        yield paragraph("The study differs from it in:")
        yield bullets(compared.found)
    else:
        yield paragraph(
            "No difference was found in protocol, number of participants, exclusions or decisions."
            if compared.commitment is not None
            else "As many participants as planned."
        )
