"""Every number in files: rows of tests and of motion, all of it as JSON, and a script in R."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass
from functools import partial
from importlib import metadata, resources
from platform import python_version
from typing import Any, Final

from study_app import __version__
from study_app.analysis.data.blocks import Setting
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export.table_files import credit_lines, study_head
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import TESTS
from study_app.analysis.levels.evaluate import level_entries
from study_app.analysis.planning.preregistration import FILE as PREREGISTRATION
from study_app.analysis.planning.preregistration import deviations
from study_app.analysis.results import BlockFound, Failure, Failures, LevelsFound, Results, name
from study_app.errors import AnalysisError
from study_app.store.blinded.unblinding import reveals_of
from study_app.store.checksums import sha256
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import MANIFEST, folders_of
from study_app.store.tables.csv_files import Column, csv_bytes, optional

OF_FORMAT_2: Final = {
    Results: frozenset({"questions", "scores", "levels", "site_thresholds"}),
    Setting: frozenset({"link", "view"}),
}
"""Results that reports of earlier versions do not have; omitted where there are none."""


def plain(value: Any) -> Any:
    """Return a result as JSON's objects, arrays, texts, numbers, true, false and null."""
    if isinstance(value, BlockFound):
        return {name: plain(entry) for name, entry in _entries(value)}
    if isinstance(value, LevelsFound):
        entries = {field.name: getattr(value, field.name) for field in fields(value) if field.name != "statistics"}
        return plain(entries | level_entries(value))
    if is_dataclass(value) and not isinstance(value, type):
        held = {field.name: getattr(value, field.name) for field in fields(value)}
        omitted = OF_FORMAT_2.get(type(value), frozenset())
        return {name: plain(entry) for name, entry in held.items() if entry or name not in omitted}
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if hasattr(value, "item"):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        raise AnalysisError(f"a result is {value}: this is a fault of the program, please report it")
    return value


def _entries(found: BlockFound) -> Iterator[tuple[str, Any]]:
    """Yield a block's fields, the findings about settings in their midst and those about sessions last."""
    tested = [finding for finding in all_findings() if finding.what]
    for field in fields(found):
        if field.name != "findings":
            yield field.name, getattr(found, field.name)
            continue
        for finding in tested:
            if finding.about == "settings":
                yield from finding.entries(found).items()
    for finding in tested:
        if finding.about == "sessions":
            yield from finding.entries(found).items()


FORMAT: Final = 1
LIBRARIES: Final = ("numpy", "scipy", "pandas", "matplotlib", "pyarrow")

MOTION: Final = (
    Column("block", "text", "Id of the block."),
    Column("code", "text", "Code of the setting."),
    Column("setting", "text", "What the setting is."),
    Column("measure", "text", "The measure, its unit at the end."),
    Column("n", "integer", "Participants with the measure.", minimum=0),
    optional("median", "number", "Median over participants."),
    optional("q1", "number", "Lower quartile over participants."),
    optional("q3", "number", "Upper quartile over participants."),
    Column("trials", "integer", "Trials that count under the setting.", minimum=0),
    Column("judged", "integer", "Of these: those of which it is known whether they kept to the limits.", minimum=0),
    Column("valid", "integer", "Of these: those that kept to the protocol's limits of timing.", minimum=0),
)


def tests(results: Results) -> list[dict[str, Any]]:
    """Return a row for every test."""
    in_order = sorted(all_findings(), key=lambda finding: finding.row_place)
    return [row for found in results.blocks for finding in in_order for row in finding(found, results).rows()]


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


def document(study: Study, results: Results, texts: Mapping[str, Any], failures: Failures) -> bytes:
    """Return everything as JSON; ``texts`` are the findings in words. A part that fails is null."""
    parts: dict[str, Callable[[], Any]] = {
        "versions": versions,
        "study": lambda: {
            **study_head(study),
            "blinded": not study.revealed,
            "key_opened": list(reveals_of(study.folder)),
        },
        "sessions": lambda: sessions(study),
        "exclusions": lambda: [asdict(one) for one in study.exclusions],
        "doubts": lambda: [{"file": _path_in_study(study, doubt.path), "what": doubt.what} for doubt in study.doubts],
        "files": lambda: files(study),
        **{what: partial(plain, text) for what, text in texts.items()},
        "results": lambda: plain(results),
    }
    if any((place / PREREGISTRATION).exists() for place in folders_of(study.folder).values()):
        parts["preregistration"] = lambda: plain(deviations(study))
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
    found = [study.folder / MANIFEST]
    for place in map(StudyFolder, folders_of(study.folder).values()):
        found += [place.exclusions, place.key, place.reveals, place.path / PREREGISTRATION]
        for session in place.sessions():
            tables = [session.table(study.name, name) for name in ("responses", "trials")]
            found += [session.receipt, session.journal, session.checksums, *tables]
    return {_path_in_study(study, path): sha256(path) for path in found if path.is_file()}


def _path_in_study(study: Study, path: Any) -> str:
    return str(path.relative_to(study.folder).as_posix())


def r_script(study: Study) -> str:
    """Return the script, which reads the exported tables and tests.csv."""
    script = resources.files("study_app.analysis.report").joinpath("templates", "report.R").read_text("utf-8")
    return "".join(f"# {line}\n" for line in credit_lines(study)) + script
