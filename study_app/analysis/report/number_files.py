"""Every number in files: a row a test, a row a measure of motion, and all of it as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from functools import partial
from importlib import metadata
from platform import python_version
from typing import Any, Final

from study_app import __version__
from study_app.analysis.designs.verdicts import ALONE, HOLM
from study_app.analysis.export.codebook import head
from study_app.analysis.findings.block_results import BlockFound, Results, plain
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.section_failures import Failure, Failures
from study_app.analysis.findings.words import name
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.tables.study import Study
from study_app.store.blinded import blinding
from study_app.store.checksums import sha256
from study_app.store.folders import StudyFolder
from study_app.store.tables.columns import Column
from study_app.store.tables.csv_files import csv_bytes

FORMAT: Final = 1
LIBRARIES: Final = ("numpy", "scipy", "pandas", "matplotlib", "pyarrow")

TESTS: Final = (
    Column("block", "text", "Id of the block."),
    Column("question", "text", "What is asked."),
    Column("item", "text", "Id of the statement; n/a where the test is over several.", may_miss=True),
    Column("comparison", "text", "Which settings, where not all.", may_miss=True),
    Column("test", "text", "The test."),
    Column("n", "integer", "Participants used.", minimum=0),
    Column("dropped", "integer", "Participants not used, for missing answers.", minimum=0),
    Column("statistic_name", "text", "What the statistic is."),
    Column("statistic", "number", "The statistic.", may_miss=True),
    Column("p", "number", "p, not corrected.", minimum=0, maximum=1, may_miss=True),
    Column("p_adjusted", "number", "p, corrected within the family.", minimum=0, maximum=1, may_miss=True),
    Column("smallest_p", "number", "The smallest p that could have come out.", minimum=0, maximum=1, may_miss=True),
    Column("family", "text", "What is corrected together.", may_miss=True),
    Column("members", "integer", "Tests in the family.", minimum=1, may_miss=True),
    Column("correction", "text", "How p is corrected.", may_miss=True),
    Column("primary", "flag", "true where it was decided on before the study.", may_miss=True),
    Column("verdict", "text", "What may be said.", may_miss=True),
    Column("effect_name", "text", "What the effect is."),
    Column("effect", "number", "The effect.", may_miss=True),
    Column("low", "number", "Lower end of the effect's interval.", may_miss=True),
    Column("high", "number", "Upper end of the effect's interval.", may_miss=True),
    Column("level", "number", "Confidence of the interval.", may_miss=True),
    Column("interval", "text", "How the interval was made, or why there is none.", may_miss=True),
    Column("method", "text", "How p was found."),
    Column("note", "text", "What must be said with it.", may_miss=True),
)
MOTION: Final = (
    Column("block", "text", "Id of the block."),
    Column("code", "text", "Code of the setting."),
    Column("setting", "text", "What the setting is."),
    Column("measure", "text", "The measure, its unit at the end."),
    Column("n", "integer", "Participants with the measure.", minimum=0),
    Column("median", "number", "Median over participants.", may_miss=True),
    Column("q1", "number", "Lower quartile over participants.", may_miss=True),
    Column("q3", "number", "Upper quartile over participants.", may_miss=True),
    Column("trials", "integer", "Trials that count under the setting.", minimum=0),
    Column("judged", "integer", "Of these: those of which it is known whether they kept to the limits.", minimum=0),
    Column("valid", "integer", "Of these: those that kept to the protocol's limits of timing.", minimum=0),
)


def tests(results: Results) -> list[dict[str, Any]]:
    """Return a row for every test."""
    return [row for found in results.blocks for row in _tests(found)]


def tests_csv(results: Results) -> bytes:
    """Return a table with a row for every test."""
    return csv_bytes(TESTS, tests(results))


def motion_csv(results: Results) -> bytes:
    """Return a table with a row for every measure of motion and force under every setting."""
    moved = () if results.performance is None else results.performance.moved
    blocks = {found.id: found for found in results.blocks}
    kept = {(one.block, one.code): one for one in results.delivered}
    return csv_bytes(
        MOTION,
        [
            {
                **plain(one),
                "setting": name(blocks[one.block], one.code),
                **{field: getattr(kept[one.block, one.code], field) for field in ("trials", "judged", "valid")},
            }
            for one in moved
        ],
    )


def _tests(found: BlockFound) -> Iterator[dict[str, Any]]:
    if found.overall is not None:
        yield _row(found, "settings differ, all statements", found.overall) | _alone(found, "all statements at once")
    for question, tests in (
        ("settings differ", found.omnibus),
        ("answers follow the delay", found.trends),
        ("sessions differ", found.by_session),
        ("settings differ, mixed model", found.mixed),
        ("settings differ, incomplete participants too", found.incomplete),
    ):
        for one in tests:
            yield _judged(found, question, one)
    for pair in found.pairs:
        compared = f"{name(found, pair.first)} − {name(found, pair.second)}"
        yield _judged(found, "two settings differ", pair.tested) | {"comparison": compared}
    if found.named is not None:
        row = _row(found, "liquids are recognised", found.named.found) | _alone(found, "recognition")
        yield row | {"verdict": found.named.verdict}
    for lowest in found.lowest:
        for step in lowest.steps.steps:
            row = _row(found, "answers follow the delay, stepping down", step.page)
            row |= _alone(found, f"stepping down within {lowest.item}") | {"members": len(lowest.steps.steps)}
            row |= {"correction": "none: fixed order, ends at the first that fails"}
            yield row | {"item": lowest.item, "comparison": f"up to {step.longest_ms:g} ms"}
    for against in found.against:
        row = _row(found, "a delay is equivalent", against.found) | {"item": against.item}
        compared = f"{against.delay_ms:g} ms − {against.control_ms:g} ms"
        row |= _alone(found, f"{against.item} at {against.delay_ms:g} ms")
        yield row | {"comparison": compared, "verdict": against.verdict}
        yield _differs(found, against) | {"item": against.item, "comparison": compared, "verdict": against.verdict}
    if found.threshold is not None:
        yield _row(found, "a delay is noticed", found.threshold)


def _differs(found: BlockFound, against: ContrastWithControl) -> dict[str, Any]:
    """Return the row of the same comparison asked the other way: whether the delay differs at all."""
    outcome = against.found
    by = "the larger p of a t test and of exact signed ranks, two-sided"
    return _row(found, "a delay differs", outcome) | {
        "test": "difference, paired",
        "statistic": outcome.t,
        "p": outcome.p_difference,
        "method": "t test, two-sided" if outcome.p_different_ranks is None else by,
        "p_adjusted": against.p_adjusted,
        "smallest_p": None if outcome.p_different_ranks is None else 0.5 ** (outcome.n - 1),
        "family": f"{found.id}: each delay against the shortest",
        "members": against.members,
        "correction": HOLM,
        "note": None if outcome.t is not None else outcome.note,
    }


def _alone(found: BlockFound, what: str) -> dict[str, Any]:
    """Return the family of a test that is corrected for no other."""
    return {"family": f"{found.id}: {what}", "members": 1, "correction": ALONE}


def _judged(found: BlockFound, question: str, one: Tested) -> dict[str, Any]:
    return _row(found, question, one.outcome) | {
        "item": one.item,
        "family": one.family,
        "members": one.members,
        "correction": one.correction,
        "p_adjusted": one.p_adjusted,
        "primary": one.primary,
        "verdict": one.verdict,
    }


def _row(found: BlockFound, question: str, outcome: Outcome) -> dict[str, Any]:
    interval = outcome.interval
    blank = {column.name: None for column in TESTS}
    return blank | {
        "block": found.id,
        "question": question,
        **{
            field: getattr(outcome, field)
            for field in (
                *("test", "n", "dropped", "statistic_name", "statistic", "p", "smallest_p", "method"),
                *("effect_name", "effect"),
            )
        },
        "low": None if interval is None else interval.low,
        "high": None if interval is None else interval.high,
        "level": None if interval is None else interval.level,
        "interval": outcome.no_interval or None if interval is None else interval.method,
        "note": outcome.note or None,
    }


def document(study: Study, results: Results, texts: Mapping[str, Any], failures: Failures) -> bytes:
    """Return everything as JSON; ``texts`` are the findings in words. A part that fails is null."""
    parts: dict[str, Callable[[], Any]] = {
        "versions": versions,
        "study": lambda: {
            **head(study),
            "blinded": not study.revealed,
            "key_opened": list(blinding.reveals(study.folder)),
        },
        "sessions": lambda: sessions(study),
        "exclusions": lambda: [asdict(one) for one in study.exclusions],
        "doubts": lambda: [{"file": _within(study, doubt.path), "what": doubt.what} for doubt in study.doubts],
        "files": lambda: files(study),
        **{what: partial(plain, text) for what, text in texts.items()},
        "results": lambda: plain(results),
    }
    held = {name: failures.attempt(f"report.json, {name}", make) for name, make in parts.items()}
    content = {
        "format": FORMAT,
        "program": f"liquid-study {__version__}",
        "failures": [{**asdict(one), "why": one.why} for one in failures.found],
        **{name: None if isinstance(part, Failure) else part for name, part in held.items()},
    }
    return f"{json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)}\n".encode()


def versions() -> dict[str, str]:
    """Return the versions of what computed the results."""
    return {
        "liquid-study": __version__,
        "python": python_version(),
        **{library: metadata.version(library) for library in LIBRARIES},
    }


def sessions(study: Study) -> list[dict[str, Any]]:
    """Return of every session what made it what it was: its seed, its protocol's hash, the program's version."""
    columns = ["participant", "session", "status", "counted", "seed", "protocol_hash", "key_hash", "version", "device"]
    rows = study.participants[columns].astype(object).where(study.participants[columns].notna(), None)
    return [{str(key): plain(value) for key, value in row.items()} for row in rows.to_dict("records")]


def files(study: Study) -> dict[str, str]:
    """Return the SHA-256 of every file that the numbers come from; recordings are in their session's checksums."""
    place = StudyFolder(study.folder)
    found = [place.exclusions, place.key, place.reveals]
    for session in place.sessions():
        tables = [session.table(study.name, name) for name in ("responses", "trials")]
        found += [session.receipt, session.journal, session.checksums, *tables]
    return {_within(study, path): sha256(path) for path in found if path.is_file()}


def _within(study: Study, path: Any) -> str:
    return str(path.relative_to(study.folder).as_posix())
