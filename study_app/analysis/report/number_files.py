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
from study_app.analysis.levels.results import ExponentFound, LevelsFound, SensitivityFound, SettingFound, ThresholdFound
from study_app.analysis.planning.preregistration import FILE as PREREGISTRATION
from study_app.analysis.planning.preregistration import deviations
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


LEVEL_FUNCTIONS: Final = """
# Blocks with a design: d' and criterion, means of reversals, random-effects means with Hartung-Knapp intervals,
# exponents of power laws and of Weber's law, and settings of the method of adjustment.

tracks <- read.csv(file.path(folder, "{table}"), colClasses = "character", na.strings = "n/a", encoding = "UTF-8")
for (name in c("standard", "trial", "level_asked")) tracks[[name]] <- as.numeric(tracks[[name]])
judged <- tracks[tracks$analysed == "true" & !is.na(tracks$response), ]
at_standard <- function(rows, block, participant, standard) {{
  rows <- rows[rows$block == block & rows$participant == participant, ]
  if (is.na(standard)) rows[is.na(rows$standard), ] else rows[!is.na(rows$standard) & rows$standard == standard, ]
}}
of_condition <- function(rows, block, participant, condition)
  rows[rows$block == block & rows$participant == participant & rows$track == condition, ]

rate <- function(count, n) (count + 0.5) / (n + 1)
inverse <- function(share, p) if (p <= share(0)) 0 else uniroot(function(d) share(d) - p, c(0, 20), tol = 1e-12)$root
largest <- function(m) function(d)
  integrate(function(x) dnorm(x) * pnorm(x + d)^(m - 1), -9, 9, rel.tol = 1e-10, subdivisions = 1000)$value
odd <- function(d) 2 * integrate(function(z) (pnorm(-z * sqrt(3) + d * sqrt(2 / 3)) +
  pnorm(-z * sqrt(3) - d * sqrt(2 / 3))) * dnorm(z), 0, 9, rel.tol = 1e-10, subdivisions = 1000)$value
like <- function(divisor) function(d)
  pnorm(d / sqrt(2)) * pnorm(d / divisor) + pnorm(-d / sqrt(2)) * pnorm(-d / divisor)
answered <- function(rows, arrangements, answer) {{
  own <- rows[rows$arrangement %in% arrangements, ]
  rate(sum(own$response == answer), nrow(own))
}}
sensitivity <- function(what, rows, design, model, d, bias) {{
  right <- rate(sum(rows$right == "true"), nrow(rows)); criterion <- NULL
  z <- function(high, low) qnorm(high) - qnorm(low)
  signal <- switch(design, "2ifc" = "CS", yesno = "C", samedifferent = c("SC", "CS"), "")
  noise <- switch(design, "2ifc" = "SC", yesno = "S", samedifferent = c("SS", "CC"), "")
  answer <- switch(design, "2ifc" = "first", yesno = "yes", samedifferent = "different", "")
  high <- answered(rows, signal, answer); low <- answered(rows, noise, answer)
  if (design %in% c("2ifc", "yesno")) {{
    found <- z(high, low) / (if (design == "2ifc") sqrt(2) else 1)
    criterion <- -(qnorm(high) + qnorm(low)) / 2
  }} else if (design == "samedifferent" && model == "differencing") {{
    k <- -sqrt(2) * qnorm(low / 2); criterion <- k
    found <- inverse(function(d) pnorm((d - k) / sqrt(2)) + pnorm((-d - k) / sqrt(2)), high)
  }} else if (design == "samedifferent") {{
    p <- pnorm(z(high, low) / 2)
    found <- if (p <= 0.5) 0 else 2 * qnorm(0.5 + 0.5 * sqrt(2 * p - 1))
  }} else found <- inverse(switch(design, "3ifc" = largest(3), "4ifc" = largest(4), oddity = odd,
    abx = if (model == "differencing") like(sqrt(6)) else like(2)), right)
  same(paste(what, "d'"), d, found)
  if (!is.na(bias)) same(paste(what, "criterion"), bias, criterion)
}}
reversals <- function(what, rows, low, high, average, log, reported) {{
  means <- c()
  for (track in split(rows, paste(rows$session, rows$code))) {{
    track <- track[order(track$trial), ]
    kept <- tail(track$level_asked[track$reversal %in% "true"], -2)
    kept <- kept[kept > low & kept < high]
    count <- min(length(kept), average) %/% 2 * 2
    if (count) means <- c(means, mean(if (log) log10(tail(kept, count)) else tail(kept, count)))
  }}
  same(paste(what, "mean of reversals"), reported, if (log) 10^mean(means) else mean(means))
}}
hartung_knapp <- function(what, thresholds, v, log, mean, ends) {{
  y <- if (log) log10(thresholds) else thresholds; n <- length(y)
  level <- function(u) if (log) 10^u else u
  at <- function(between) {{ w <- 1 / (v + between); sum(w * y) / sum(w) }}
  excess <- function(between) sum((y - at(between))^2 / (v + between)) - (n - 1)
  between <- if (n > 1 && excess(0) > 0) uniroot(excess, c(0, n * var(y) + 1e-12), tol = 1e-14)$root else 0
  w <- 1 / (v + between); m <- at(between)
  same(paste(what, "random-effects mean"), mean, level(m))
  if (length(ends)) {{
    half <- qt(0.975, n - 1) * sqrt(sum(w * (y - m)^2) / ((n - 1) * sum(w)))
    same(paste(what, "interval, low"), ends[1], level(m - half))
    same(paste(what, "interval, high"), ends[2], level(m + half))
  }}
}}
exponent <- function(what, standards, jnds, reported) {{
  slope <- unname(coef(lm(log(jnds) ~ log(standards)))[2])
  same(paste(what, "Weber exponent"), reported, slope)
  slope
}}
power_law <- function(what, rows, reported) {{
  rows$answer <- log(as.numeric(rows$response)); rows <- rows[is.finite(rows$answer) & rows$level_asked > 0, ]
  delivered <- ave(as.numeric(rows$level_delivered), rows$level_asked, FUN = function(x) mean(x, na.rm = TRUE))
  levels <- ifelse(is.na(delivered), rows$level_asked, delivered)
  means <- unique(data.frame(level = log(levels), answer = ave(rows$answer, rows$level_asked)))
  slope <- unname(coef(lm(answer ~ level, means))[2])
  same(paste(what, "exponent of the power law"), reported, slope)
  slope
}}
exponents <- function(what, name, slopes, mean, ends) {{
  same(paste(what, name), mean, base::mean(slopes))
  if (length(ends)) {{
    interval <- t.test(slopes)$conf.int
    same(paste0(what, " ", name, ", low"), ends[1], interval[1])
    same(paste0(what, " ", name, ", high"), ends[2], interval[2])
  }}
}}
mean_of_settings <- function(what, u, log, mean_level, ends) {{
  level <- function(u) if (log) 10^u else u
  same(paste(what, "PSE"), mean_level, level(mean(u)))
  if (length(ends)) {{
    half <- qt(0.975, length(u) - 1) * sd(u) / sqrt(length(u))
    same(paste(what, "PSE, low"), ends[1], level(mean(u) - half))
    same(paste(what, "PSE, high"), ends[2], level(mean(u) + half))
  }}
}}
settings <- function(what, rows, log, middle, pse, ends, jnd, error, hysteresis) {{
  in_u <- function(level) if (log) log10(level) else level
  rows <- rows[!is.na(rows$setting), ]
  u <- in_u(as.numeric(rows$setting)); high <- in_u(rows$level_asked) > middle
  mean_of_settings(what, u, log, pse, ends)
  if (!is.na(jnd)) same(paste(what, "JND"), jnd, sd(u))
  if (!is.na(error)) same(paste(what, "constant error"), error, mean(u) - in_u(rows$standard[1]))
  if (!is.na(hysteresis)) same(paste(what, "hysteresis"), hysteresis, mean(u[high]) - mean(u[!high]))
}}

"""


def level_lines(study: Study, levels: Sequence[LevelsFound]) -> tuple[list[str], int]:
    """Return the lines of the script, and how many numbers they compare; none while the key is sealed."""
    blocks = {block.id: block for block in study.levels}
    calls = [call for found in levels if found.revealed for call in _level_calls(blocks[found.block], found)]
    if not calls:
        return [], 0
    start = LEVEL_FUNCTIONS.format(table=f"study-{study.name}_description-tracks_data.csv")
    return [start, *(line for line, _ in calls)], sum(numbers for _, numbers in calls)


def _level_calls(block: LevelBlock, found: LevelsFound) -> Iterator[tuple[str, int]]:
    """Yield each call and how many numbers it compares."""
    for one in found.sensitivities:
        if one.participant is not None and one.level is None and one.d_prime is not None:
            yield _sensitivity_call(found, one, one.d_prime)
    log = "TRUE" if found.spacing == "log" else "FALSE"
    yield from _setting_calls(block, found, log)
    for mean in (one for one in found.thresholds if one.participant is None):
        own = [one for one in found.own_thresholds if one.standard == mean.standard]
        for each in own:
            if isinstance(block.method, UpDown) and block.stimulus is not None and each.reversal_mean is not None:
                low, high = block.stimulus.levels
                which = f"{r_text(found.block)}, {r_text(str(each.participant))}, {_r_value(each.standard)}"
                yield (
                    f"reversals({r_text(_what(found, each))}, at_standard(tracks, {which}), {r_number(low)}, "
                    f"{r_number(high)}, {block.method.average}, {log}, {r_number(each.reversal_mean)})",
                    1,
                )
        yield _hartung_knapp(found, mean, own, log)
    yield from _exponent_calls(found)


def _setting_calls(block: LevelBlock, found: LevelsFound, log: str) -> Iterator[tuple[str, int]]:
    """Yield the calls about levels that participants set: of each participant, and of all at a standard."""
    if block.stimulus is None:
        return
    middle = sum(block.stimulus.domain) / 2
    for one in found.settings:
        ends = _r_ends(one)
        numbers = 1 if one.low is None else 3
        if one.participant is None:
            own = [each.pse for each in found.own_settings if each.standard == one.standard]
            values = ", ".join(r_number(block.stimulus.coordinate(pse)) for pse in own)
            yield (
                f"mean_of_settings({r_text(_what(found, one))}, c({values}), {log}, {r_number(one.pse)}, {ends})",
                numbers,
            )
            continue
        which = f"{r_text(found.block)}, {r_text(one.participant)}, {_r_value(one.standard)}"
        others = (one.jnd, one.constant_error, one.hysteresis)
        yield (
            f"settings({r_text(_what(found, one))}, at_standard(judged, {which}), {log}, {r_number(middle)}, "
            f"{r_number(one.pse)}, {ends}, {', '.join(map(_r_value, others))})",
            numbers + sum(value is not None for value in others),
        )


def _r_ends(one: ExponentFound | SettingFound | ThresholdFound) -> str:
    return "c()" if one.low is None or one.high is None else f"c({r_number(one.low)}, {r_number(one.high)})"


def _sensitivity_call(found: LevelsFound, one: SensitivityFound, d_prime: float) -> tuple[str, int]:
    rows, where = "at_standard", _r_value(one.standard)
    if one.comparison is not None:
        rows, where = "of_condition", r_text(one.comparison)
    which = f"{rows}(judged, {r_text(found.block)}, {r_text(str(one.participant))}, {where})"
    return (
        f"sensitivity({r_text(_what(found, one))}, {which}, {r_text(found.design)}, {r_text(one.model or '')}, "
        f"{r_number(d_prime)}, {_r_value(one.criterion)})",
        1 if one.criterion is None else 2,
    )


def _hartung_knapp(
    found: LevelsFound, mean: ThresholdFound, own: Sequence[ThresholdFound], log: str
) -> tuple[str, int]:
    thresholds = ", ".join(r_number(one.threshold) for one in own)
    variances = ", ".join(r_number(one.variance or 0.0) for one in own)
    ends = _r_ends(mean)
    return (
        f"hartung_knapp({r_text(_what(found, mean))}, c({thresholds}), c({variances}), {log}, "
        f"{r_number(mean.threshold)}, {ends})",
        1 if mean.low is None else 3,
    )


def _exponent_calls(found: LevelsFound) -> Iterator[tuple[str, int]]:
    """Yield the group's call, in which those of the participants are arguments."""
    group = next((one for one in found.exponents if one.participant is None), None)
    if group is None:
        return
    slopes = []
    for one in found.exponents:
        if one.participant is None:
            continue
        if not found.thresholds:
            which = f"{r_text(found.block)}, {r_text(one.participant)}, NA"
            what = r_text(f"{found.block}, {one.participant}")
            slopes.append(f"  power_law({what}, at_standard(judged, {which}), {r_number(one.exponent)})")
            continue
        own = [each for each in found.own_thresholds if each.participant == one.participant]
        own = [each for each in own if (each.standard or 0.0) > 0 and each.threshold > 0]
        standards = ", ".join(_r_value(each.standard) for each in own)
        levels = ", ".join(r_number(each.threshold) for each in own)
        jnds = f"c({levels})" + (f" * c({standards})" if found.level_kind == "weber" else "")
        what = r_text(f"{found.block}, {one.participant}")
        slopes.append(f"  exponent({what}, c({standards}), {jnds}, {r_number(one.exponent)})")
    ends = _r_ends(group)
    lines = ",\n".join(slopes)
    yield (
        f"exponents({r_text(f'{found.block}, group')}, {r_text(found.exponent_name)}, c(\n{lines}), "
        f"{r_number(group.exponent)}, {ends})",
        len(slopes) + (1 if group.low is None else 3),
    )


def _what(found: LevelsFound, one: ThresholdFound | SensitivityFound | SettingFound) -> str:
    where = f" at {one.standard:g}" if one.standard is not None else ""
    if isinstance(one, SensitivityFound) and one.comparison is not None:
        where = f" with {one.comparison}"
    return f"{found.block}, {one.participant or 'group'}{where}"


def _r_value(value: float | None) -> str:
    return "NA" if value is None else r_number(value)


START: Final = """\
# Computes the main numbers of report.html again, in base R (4.0 or newer, no packages), from the tables next to this
# file or in the folder that is named, and says where they differ:  Rscript report.R [FOLDER]   (exit code 1 if any
# does, or if there is nothing to compare)
# The exact p of trends and of pairs come from all rearrangements, up to {exact} participants; beyond that, and for
# Friedman's test, the approximate p are compared.

folder <- c(commandArgs(trailingOnly = TRUE), ".")[1]
answers <- read.csv(file.path(folder, "{table}"), colClasses = "character", na.strings = "n/a", encoding = "UTF-8")
answers <- answers[answers$counted == "true", ]
answers$response <- {numeric}
differing <- 0
compared <- 0

same <- function(what, reported, computed) {{
  ok <- isTRUE(all.equal(reported, computed, tolerance = 1e-6, check.attributes = FALSE))
  compared <<- compared + 1
  if (!ok) differing <<- differing + 1
  cat(sprintf("%-64s report %12.6g   R %12.6g   %s\\n", what, reported, computed, if (ok) "" else "DIFFERS"))
}}

# Sums of independent whole numbers: chances[i] is that of the sum i - 1.
add <- function(chances, values, each = rep(1 / length(values), length(values))) {{
  sums <- numeric(length(chances) + max(values))
  for (place in seq_along(values)) {{
    at <- seq_along(chances) + values[place]; sums[at] <- sums[at] + each[place] * chances
  }}
  sums
}}
at_least <- function(chances, value) sum(chances[(value + 1):length(chances)])
orders <- function(k) if (k == 1) matrix(1) else {{
  less <- orders(k - 1)
  do.call(rbind, lapply(seq_len(k), function(place) cbind(place, ifelse(less >= place, less + 1, less))))
}}

# One row a participant, one column a setting; a participant's repeated answers count by their median.
# Codes with one name in columns are presentations of one setting.
wide <- function(block, item, codes, columns = codes) {{
  rows <- answers[answers$block == block & answers$item == item, ]
  tapply(rows$response, list(rows$participant, factor(rows$code, codes, columns)), median, na.rm = TRUE)
}}
whole <- function(table) table[complete.cases(table), , drop = FALSE]

friedman <- function(what, table, chi2, p) {{
  found <- suppressWarnings(friedman.test(whole(table)))
  same(paste(what, "Friedman chi2"), chi2, unname(found$statistic))
  same(paste(what, "p by chi2"), p, found$p.value)
}}
page <- function(what, table, falling, L, p) {{
  x <- whole(table); if (falling) x <- -x
  ranks <- t(apply(x, 1, rank)); n <- nrow(x); k <- ncol(x)
  found <- sum(ranks %*% seq_len(k))
  same(paste(what, "Page's L"), L, found)
  if (n > {exact}) {{
    spread <- sum((ranks - (k + 1) / 2)^2) / (k - 1) * k * (k^2 - 1) / 12
    same(paste(what, "p"), p, pnorm((found - n * k * (k + 1)^2 / 4) / sqrt(spread), lower.tail = FALSE))
  }} else if (k <= 8) {{
    every <- orders(k); chances <- 1
    for (person in seq_len(n)) {{
      counts <- table(matrix(2 * ranks[person, ][every], nrow(every)) %*% seq_len(k))
      chances <- add(chances, as.numeric(names(counts)), counts / nrow(every))
    }}
    same(paste(what, "exact p"), p, at_least(chances, 2 * found))
  }}
}}
pair <- function(what, table, first, second, V, p) {{
  found <- suppressWarnings(wilcox.test(table[, first], table[, second], paired = TRUE, exact = FALSE, correct = FALSE))
  same(paste(what, "Wilcoxon V"), V, unname(found$statistic))
  d <- table[, first] - table[, second]; d <- d[!is.na(d) & d != 0]; chances <- 1
  if (length(d) > {exact}) return(same(paste(what, "p"), p, found$p.value))
  for (rank in 2 * rank(abs(d))) chances <- add(chances, c(0, rank))
  same(paste(what, "exact p"), p, min(1, 2 * at_least(chances, 2 * max(V, sum(rank(abs(d))) - V))))
}}
equivalent <- function(what, table, first, second, bound, p, low, high, level, different) {{
  d <- table[, second] - table[, first]; d <- d[!is.na(d)]
  lower <- t.test(d, mu = -bound, alternative = "greater")$p.value
  upper <- t.test(d, mu = bound, alternative = "less")$p.value
  same(paste(what, "equivalence p"), p, max(lower, upper))
  limits <- t.test(d, conf.level = level)$conf.int
  same(paste(what, "interval, low"), low, limits[1])
  same(paste(what, "interval, high"), high, limits[2])
  same(paste(what, "difference p by t"), different, t.test(d)$p.value)
}}
# The same, one column a session: medians over the settings that a participant answered in all of these.
by_session <- function(block, item, sessions, codes, columns = codes) {{
  rows <- answers[answers$block == block & answers$item == item & !is.na(answers$response), ]
  cells <- tapply(rows$response, list(rows$participant, factor(rows$code, codes, columns),
                                      factor(rows$session, sessions)), median)
  common <- apply(!is.na(cells), c(1, 2), all)
  t(sapply(seq_len(nrow(cells)), function(person)
    apply(matrix(cells[person, common[person, ], ], ncol = length(sessions)), 2, median)))
}}
# Sites of a merged study: "level" compares medians over settings, "profile" ranks of settings, or differences of two.
sites <- function(what, table, kind, H, p) {{
  x <- whole(table); site <- factor(answers$site[match(rownames(x), answers$participant)])
  y <- if (kind == "level") cbind(apply(x, 1, median)) else if (ncol(x) == 2) cbind(x[, 2] - x[, 1]) else
    t(apply(x, 1, rank))
  if (ncol(y) == 1) {{
    found <- kruskal.test(y[, 1], site)
    same(paste(what, "sites,", kind, "H"), H, unname(found$statistic))
    return(same(paste(what, "sites,", kind, "p by chi2"), p, found$p.value))
  }}
  y <- sweep(y, 2, colMeans(y)); n <- as.vector(table(site))
  same(paste(what, "sites,", kind, "H"), H, (nrow(y) - 1) * sum(rowsum(y, site)^2 / n) / sum(y^2))
}}
threshold_sites <- function(what, thresholds, site, H, p) {{
  found <- kruskal.test(thresholds, factor(site))
  same(paste(what, "thresholds by site, H"), H, unname(found$statistic))
  same(paste(what, "thresholds by site, p by chi2"), p, found$p.value)
}}
hits <- function(what, block, items, codes, right, hits) {{
  ratings <- lapply(items, function(item) wide(block, item, codes))
  people <- Reduce(union, lapply(ratings, rownames)); found <- 0
  for (person in people) for (place in seq_along(codes)) {{
    rated <- sapply(ratings, function(table) if (person %in% rownames(table)) table[person, place] else NA)
    if (!anyNA(rated) && sum(rated == max(rated)) == 1)
      found <- found + identical(items[which.max(rated)], right[place])
  }}
  same(paste(what, "right names"), hits, found)
}}

"""

NUMBERS: Final = "as.numeric(answers$response)"
TEXTS: Final = "suppressWarnings(as.numeric(answers$response))  # answers to other questions may be texts"

END: Final = """
cat(compared, "of {numbers} numbers compared\\n")
if (compared == 0) quit(status = 1)
if (differing == 0) cat("every number that R computes is the report's\\n") else {{
  cat("numbers that differ:", differing, "\\n")
  quit(status = 1)
}}
"""


def r_script(study: Study, results: Results) -> str:
    """Return the script."""
    table = f"study-{study.name}_description-responses_data.csv"
    calls = [line for found in results.blocks if found.n for line in _block_calls(found, results)]
    of_levels, compared = level_lines(study, results.levels)
    start = START.format(table=table, exact=EXACT_UP_TO, numeric=TEXTS if study.protocol_format > 1 else NUMBERS)
    of_sites = list(_site_calls(results))
    compared += 2 * len(of_sites)
    stated = "".join(f"# {line}\n" for line in credit_lines(study))
    return (
        stated
        + start
        + "\n".join([*calls, *of_levels, *of_sites])
        + "\n"
        + END.format(numbers=_count_of_numbers(results) + compared)
    )


def _count_of_numbers(results: Results) -> int:
    """Return how many statistics, p and ends of intervals the report's tests have."""
    return sum(row[name] is not None for row in tests(results) for name in ("statistic", "p", "low", "high"))


def _site_calls(results: Results) -> Iterator[str]:
    """Yield the calls that compare thresholds between sites."""
    for one in results.site_thresholds:
        if one.outcome.statistic is not None and one.outcome.p_chi2 is not None:
            what = one.block if one.standard is None else f"{one.block} at {one.standard:g}"
            values = f"c({', '.join(map(r_number, one.thresholds))}), {r_vector(one.of_sites)}"
            ends = f"{r_number(one.outcome.statistic)}, {r_number(one.outcome.p_chi2)}"
            yield f"threshold_sites({r_text(what)}, {values}, {ends})"


def _block_calls(found: BlockFound, results: Results) -> Iterator[str]:
    codes = r_vector([setting.code for setting in found.settings])
    if found.replicated_ms:
        by_delay = {setting.delay_ms: setting.code for setting in found.settings}
        codes += f", {r_vector([by_delay[setting.delay_ms] for setting in found.settings])}"
    for finding in all_findings():
        yield from finding(found, results).calls(codes)
