"""Every number in files: rows of tests and of motion, all of it as JSON, and a script in R."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from functools import partial
from importlib import metadata
from platform import python_version
from typing import Any, Final

from study_app import __version__
from study_app.analysis.data.blocks import LevelBlock, Setting
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export.table_files import credit_lines, study_head
from study_app.analysis.findings import all_findings
from study_app.analysis.levels.results import ExponentFound, LevelsFound, SettingFound, ThresholdFound
from study_app.analysis.planning.preregistration import FILE as PREREGISTRATION
from study_app.analysis.planning.preregistration import deviations
from study_app.analysis.report.html_page import render
from study_app.analysis.report.test_rows import TESTS, r_number, r_text, r_vector
from study_app.analysis.results import BlockFound, Failure, Failures, Results, name
from study_app.analysis.statistics.trend import EXACT_UP_TO
from study_app.errors import AnalysisError
from study_app.protocol.trials.methods import UpDown
from study_app.store.blinded.unblinding import reveals_of
from study_app.store.checksums import sha256
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import MANIFEST, folders_of
from study_app.store.tables.csv_files import Column, csv_bytes, optional

OF_FORMAT_2: Final = {
    Results: frozenset({"questions", "scores", "levels", "site_thresholds"}),
    LevelsFound: frozenset({"withheld"}),
    Setting: frozenset({"link", "view"}),
}
"""Results that reports of earlier versions do not have; omitted where there are none."""


def plain(value: Any) -> Any:
    """Return a result as JSON's objects, arrays, texts, numbers, true, false and null."""
    if isinstance(value, BlockFound):
        return {name: plain(entry) for name, entry in _entries(value)}
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


class _Code(str):
    """A part of a call that is R already."""

    __slots__ = ()


def _in_r(value: Any) -> str:
    match value:
        case None:
            return "NA"
        case bool():
            return "TRUE" if value else "FALSE"
        case _Code():
            return value
        case str():
            return r_text(value)
        case tuple() | list():
            return f"c({', '.join(map(_in_r, value))})"
        case _:
            return r_number(value)


def _call(function: str, *values: Any, reported: Sequence[Any] = ()) -> tuple[_Code, int]:
    """Return a call, and how many numbers it compares: those of ``reported`` that are known, its last arguments."""
    compared = sum(len(value) if isinstance(value, tuple) else value is not None for value in reported)
    return _Code(f"{function}({', '.join(map(_in_r, (*values, *reported)))})"), compared


def level_lines(study: Study, levels: Sequence[LevelsFound]) -> tuple[list[str], int]:
    """Return the lines of the script, and how many numbers they compare; none while the key is sealed."""
    blocks = {block.id: block for block in study.levels}
    calls = [call for found in levels if found.revealed for call in _level_calls(blocks[found.block], found)]
    if not calls:
        return [], 0
    functions = render("level_functions.R", table=f"study-{study.name}_description-tracks_data.csv")
    return [f"\n{functions}\n\n", *(line for line, _ in calls)], sum(numbers for _, numbers in calls)


def _level_calls(block: LevelBlock, found: LevelsFound) -> Iterator[tuple[str, int]]:
    """Yield each call and how many numbers it compares."""
    log, stimulus = bool(found.spacing == "log"), block.stimulus
    about: tuple[Any, ...]

    def rows(table: str, one: Any) -> _Code:
        return _call("at_standard", _Code(table), found.block, one.participant, one.standard)[0]

    for sensed in found.sensitivities:
        if sensed.participant is not None and sensed.level is None and sensed.d_prime is not None:
            judged = rows("judged", sensed)
            if (condition := sensed.comparison) is not None:
                judged, _ = _call("of_condition", _Code("judged"), found.block, sensed.participant, condition)
            about = _what(found, sensed, condition), judged, found.design, sensed.model or ""
            yield _call("sensitivity", *about, reported=(sensed.d_prime, sensed.criterion))
    for one in found.settings:
        if stimulus is None:
            continue
        reported = (one.pse, _ends(one))
        if one.participant is None:
            own = [stimulus.coordinate(each.pse) for each in found.own_settings if each.standard == one.standard]
            yield _call("mean_of_settings", _what(found, one), own, log, reported=reported)
        else:
            about = _what(found, one), rows("judged", one), log, sum(stimulus.domain) / 2
            yield _call("settings", *about, reported=(*reported, one.jnd, one.constant_error, one.hysteresis))
    for mean in (one for one in found.thresholds if one.participant is None):
        of_standard = [one for one in found.own_thresholds if one.standard == mean.standard]
        for each in of_standard:
            if isinstance(block.method, UpDown) and stimulus is not None and each.reversal_mean is not None:
                chosen = (*stimulus.levels, _Code(block.method.average), log)
                about = _what(found, each), rows("tracks", each)
                yield _call("reversals", *about, *chosen, reported=(each.reversal_mean,))
        thresholds = [one.threshold for one in of_standard]
        variances = [one.variance or 0.0 for one in of_standard]
        yield _call(
            "hartung_knapp", _what(found, mean), thresholds, variances, log, reported=(mean.threshold, _ends(mean))
        )
    for group in (one for one in found.exponents if one.participant is None):
        slopes = [_slope(found, one) for one in found.exponents if one.participant is not None]
        lines = _Code("c(\n" + ",\n".join(f"  {line}" for line in slopes) + ")")
        about = f"{found.block}, group", found.exponent_name, lines
        call, compared = _call("exponents", *about, reported=(group.exponent, _ends(group)))
        yield call, len(slopes) + compared


def _slope(found: LevelsFound, one: ExponentFound) -> str:
    """Return the call of a participant's exponent, an argument of the group's."""
    what = f"{found.block}, {one.participant}"
    if not found.thresholds:
        rows, _ = _call("at_standard", _Code("judged"), found.block, one.participant, None)
        return _call("power_law", what, rows, one.exponent)[0]
    own = [each for each in found.own_thresholds if each.participant == one.participant]
    own = [each for each in own if (each.standard or 0.0) > 0 and each.threshold > 0]
    standards = _in_r([each.standard for each in own])
    jnds = _in_r([each.threshold for each in own]) + (f" * {standards}" if found.level_kind == "weber" else "")
    return _call("exponent", what, _Code(standards), _Code(jnds), one.exponent)[0]


def _what(found: LevelsFound, one: Any, condition: str | None = None) -> str:
    where = f" at {one.standard:g}" if one.standard is not None else ""
    return f"{found.block}, {one.participant or 'group'}{where if condition is None else f' with {condition}'}"


def _ends(one: ExponentFound | SettingFound | ThresholdFound) -> tuple[float, ...]:
    return () if one.low is None or one.high is None else (one.low, one.high)


def r_script(study: Study, results: Results) -> str:
    """Return the script."""
    calls = [line for found in results.blocks if found.n for line in _block_calls(found, results)]
    of_levels, compared = level_lines(study, results.levels)
    of_sites = list(_site_calls(results))
    script = render(
        "report.R",
        credits=list(credit_lines(study)),
        exact=EXACT_UP_TO,
        table=f"study-{study.name}_description-responses_data.csv",
        texts=study.protocol_format > 1,
        calls="\n".join([*calls, *of_levels, *of_sites]),
        numbers=_count_of_numbers(results) + compared + 2 * len(of_sites),
    )
    return f"{script}\n"


def _count_of_numbers(results: Results) -> int:
    """Return how many statistics, p and ends of intervals the report's tests have."""
    return sum(row[name] is not None for row in tests(results) for name in ("statistic", "p", "low", "high"))


def _site_calls(results: Results) -> Iterator[str]:
    """Yield the calls that compare thresholds between sites."""
    for one in results.site_thresholds:
        if one.outcome.statistic is not None and one.outcome.p_chi2 is not None:
            what = one.block if one.standard is None else f"{one.block} at {one.standard:g}"
            numbers = (one.outcome.statistic, one.outcome.p_chi2)
            yield _call("threshold_sites", what, one.thresholds, one.of_sites, *numbers)[0]


def _block_calls(found: BlockFound, results: Results) -> Iterator[str]:
    codes = r_vector([setting.code for setting in found.settings])
    if found.replicated_ms:
        by_delay = {setting.delay_ms: setting.code for setting in found.settings}
        codes += f", {r_vector([by_delay[setting.delay_ms] for setting in found.settings])}"
    for finding in all_findings():
        yield from finding(found, results).calls(codes)
