"""The part of the script in R about blocks with a design: d′ and criterion, reversal means, group means, settings."""

from collections.abc import Iterator, Sequence
from typing import Final

from study_app.analysis.report.r_syntax import r_number, r_text
from study_app.analysis.results.level_results import (
    ExponentFound,
    LevelsFound,
    SensitivityFound,
    SettingFound,
    ThresholdFound,
)
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.study_tables import Study
from study_app.protocol.trials.methods import UpDown

START: Final = """
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
    calls = [call for found in levels if found.revealed for call in _calls(blocks[found.block], found)]
    if not calls:
        return [], 0
    start = START.format(table=f"study-{study.name}_description-tracks_data.csv")
    return [start, *(line for line, _ in calls)], sum(numbers for _, numbers in calls)


def _calls(block: LevelBlock, found: LevelsFound) -> Iterator[tuple[str, int]]:
    """Yield each call and how many numbers it compares."""
    for one in found.sensitivities:
        if one.participant is not None and one.level is None and one.d_prime is not None:
            yield _sensitivity(found, one, one.d_prime)
    log = "TRUE" if found.spacing == "log" else "FALSE"
    yield from _settings(block, found, log)
    for mean in (one for one in found.thresholds if one.participant is None):
        own = [one for one in found.own_thresholds if one.standard == mean.standard]
        for each in own:
            if isinstance(block.method, UpDown) and block.stimulus is not None and each.reversal_mean is not None:
                low, high = block.stimulus.levels
                which = f"{r_text(found.block)}, {r_text(str(each.participant))}, {_number(each.standard)}"
                yield (
                    f"reversals({r_text(_what(found, each))}, at_standard(tracks, {which}), {r_number(low)}, "
                    f"{r_number(high)}, {block.method.average}, {log}, {r_number(each.reversal_mean)})",
                    1,
                )
        yield _hartung_knapp(found, mean, own, log)
    yield from _exponents(found)


def _settings(block: LevelBlock, found: LevelsFound, log: str) -> Iterator[tuple[str, int]]:
    """Yield the calls about levels that participants set: of each participant, and of all at a standard."""
    if block.stimulus is None:
        return
    middle = sum(block.stimulus.domain) / 2
    for one in found.settings:
        ends = _ends(one)
        numbers = 1 if one.low is None else 3
        if one.participant is None:
            own = [each.pse for each in found.own_settings if each.standard == one.standard]
            values = ", ".join(r_number(block.stimulus.coordinate(pse)) for pse in own)
            yield (
                f"mean_of_settings({r_text(_what(found, one))}, c({values}), {log}, {r_number(one.pse)}, {ends})",
                numbers,
            )
            continue
        which = f"{r_text(found.block)}, {r_text(one.participant)}, {_number(one.standard)}"
        others = (one.jnd, one.constant_error, one.hysteresis)
        yield (
            f"settings({r_text(_what(found, one))}, at_standard(judged, {which}), {log}, {r_number(middle)}, "
            f"{r_number(one.pse)}, {ends}, {', '.join(map(_number, others))})",
            numbers + sum(value is not None for value in others),
        )


def _ends(one: ExponentFound | SettingFound | ThresholdFound) -> str:
    return "c()" if one.low is None or one.high is None else f"c({r_number(one.low)}, {r_number(one.high)})"


def _sensitivity(found: LevelsFound, one: SensitivityFound, d_prime: float) -> tuple[str, int]:
    rows, where = "at_standard", _number(one.standard)
    if one.comparison is not None:
        rows, where = "of_condition", r_text(one.comparison)
    which = f"{rows}(judged, {r_text(found.block)}, {r_text(str(one.participant))}, {where})"
    return (
        f"sensitivity({r_text(_what(found, one))}, {which}, {r_text(found.design)}, {r_text(one.model or '')}, "
        f"{r_number(d_prime)}, {_number(one.criterion)})",
        1 if one.criterion is None else 2,
    )


def _hartung_knapp(
    found: LevelsFound, mean: ThresholdFound, own: Sequence[ThresholdFound], log: str
) -> tuple[str, int]:
    thresholds = ", ".join(r_number(one.threshold) for one in own)
    variances = ", ".join(r_number(one.variance or 0.0) for one in own)
    ends = _ends(mean)
    return (
        f"hartung_knapp({r_text(_what(found, mean))}, c({thresholds}), c({variances}), {log}, "
        f"{r_number(mean.threshold)}, {ends})",
        1 if mean.low is None else 3,
    )


def _exponents(found: LevelsFound) -> Iterator[tuple[str, int]]:
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
        standards = ", ".join(_number(each.standard) for each in own)
        levels = ", ".join(r_number(each.threshold) for each in own)
        jnds = f"c({levels})" + (f" * c({standards})" if found.level_kind == "weber" else "")
        what = r_text(f"{found.block}, {one.participant}")
        slopes.append(f"  exponent({what}, c({standards}), {jnds}, {r_number(one.exponent)})")
    ends = _ends(group)
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


def _number(value: float | None) -> str:
    return "NA" if value is None else r_number(value)
