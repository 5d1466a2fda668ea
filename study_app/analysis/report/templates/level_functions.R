# Blocks with a design: d' and criterion, means of reversals, random-effects means with Hartung-Knapp intervals,
# exponents of power laws and of Weber's law, and settings of the method of adjustment.

tracks <- read.csv(file.path(folder, "{{ table }}"), colClasses = "character", na.strings = "n/a", encoding = "UTF-8")
for (name in c("standard", "trial", "level_asked")) tracks[[name]] <- as.numeric(tracks[[name]])
judged <- tracks[tracks$analysed == "true" & !is.na(tracks$response), ]
at_standard <- function(rows, block, participant, standard) {
  rows <- rows[rows$block == block & rows$participant == participant, ]
  if (is.na(standard)) rows[is.na(rows$standard), ] else rows[!is.na(rows$standard) & rows$standard == standard, ]
}
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
answered <- function(rows, arrangements, answer) {
  own <- rows[rows$arrangement %in% arrangements, ]
  rate(sum(own$response == answer), nrow(own))
}
sensitivity <- function(what, rows, design, model, d, bias) {
  right <- rate(sum(rows$right == "true"), nrow(rows)); criterion <- NULL
  z <- function(high, low) qnorm(high) - qnorm(low)
  signal <- switch(design, "2ifc" = "CS", yesno = "C", samedifferent = c("SC", "CS"), "")
  noise <- switch(design, "2ifc" = "SC", yesno = "S", samedifferent = c("SS", "CC"), "")
  answer <- switch(design, "2ifc" = "first", yesno = "yes", samedifferent = "different", "")
  high <- answered(rows, signal, answer); low <- answered(rows, noise, answer)
  if (design %in% c("2ifc", "yesno")) {
    found <- z(high, low) / (if (design == "2ifc") sqrt(2) else 1)
    criterion <- -(qnorm(high) + qnorm(low)) / 2
  } else if (design == "samedifferent" && model == "differencing") {
    k <- -sqrt(2) * qnorm(low / 2); criterion <- k
    found <- inverse(function(d) pnorm((d - k) / sqrt(2)) + pnorm((-d - k) / sqrt(2)), high)
  } else if (design == "samedifferent") {
    p <- pnorm(z(high, low) / 2)
    found <- if (p <= 0.5) 0 else 2 * qnorm(0.5 + 0.5 * sqrt(2 * p - 1))
  } else found <- inverse(switch(design, "3ifc" = largest(3), "4ifc" = largest(4), oddity = odd,
    abx = if (model == "differencing") like(sqrt(6)) else like(2)), right)
  same(paste(what, "d'"), d, found)
  if (!is.na(bias)) same(paste(what, "criterion"), bias, criterion)
}
reversals <- function(what, rows, low, high, average, log, reported) {
  means <- c()
  for (track in split(rows, paste(rows$session, rows$code))) {
    track <- track[order(track$trial), ]
    kept <- tail(track$level_asked[track$reversal %in% "true"], -2)
    kept <- kept[kept > low & kept < high]
    count <- min(length(kept), average) %/% 2 * 2
    if (count) means <- c(means, mean(if (log) log10(tail(kept, count)) else tail(kept, count)))
  }
  same(paste(what, "mean of reversals"), reported, if (log) 10^mean(means) else mean(means))
}
hartung_knapp <- function(what, thresholds, v, log, mean, ends) {
  y <- if (log) log10(thresholds) else thresholds; n <- length(y)
  level <- function(u) if (log) 10^u else u
  at <- function(between) { w <- 1 / (v + between); sum(w * y) / sum(w) }
  excess <- function(between) sum((y - at(between))^2 / (v + between)) - (n - 1)
  between <- if (n > 1 && excess(0) > 0) uniroot(excess, c(0, n * var(y) + 1e-12), tol = 1e-14)$root else 0
  w <- 1 / (v + between); m <- at(between)
  same(paste(what, "random-effects mean"), mean, level(m))
  if (length(ends)) {
    half <- qt(0.975, n - 1) * sqrt(sum(w * (y - m)^2) / ((n - 1) * sum(w)))
    same(paste(what, "interval, low"), ends[1], level(m - half))
    same(paste(what, "interval, high"), ends[2], level(m + half))
  }
}
exponent <- function(what, standards, jnds, reported) {
  slope <- unname(coef(lm(log(jnds) ~ log(standards)))[2])
  same(paste(what, "Weber exponent"), reported, slope)
  slope
}
power_law <- function(what, rows, reported) {
  rows$answer <- log(as.numeric(rows$response)); rows <- rows[is.finite(rows$answer) & rows$level_asked > 0, ]
  delivered <- ave(as.numeric(rows$level_delivered), rows$level_asked, FUN = function(x) mean(x, na.rm = TRUE))
  levels <- ifelse(is.na(delivered), rows$level_asked, delivered)
  means <- unique(data.frame(level = log(levels), answer = ave(rows$answer, rows$level_asked)))
  slope <- unname(coef(lm(answer ~ level, means))[2])
  same(paste(what, "exponent of the power law"), reported, slope)
  slope
}
exponents <- function(what, name, slopes, mean, ends) {
  same(paste(what, name), mean, base::mean(slopes))
  if (length(ends)) {
    interval <- t.test(slopes)$conf.int
    same(paste0(what, " ", name, ", low"), ends[1], interval[1])
    same(paste0(what, " ", name, ", high"), ends[2], interval[2])
  }
}
mean_of_settings <- function(what, u, log, mean_level, ends) {
  level <- function(u) if (log) 10^u else u
  same(paste(what, "PSE"), mean_level, level(mean(u)))
  if (length(ends)) {
    half <- qt(0.975, length(u) - 1) * sd(u) / sqrt(length(u))
    same(paste(what, "PSE, low"), ends[1], level(mean(u) - half))
    same(paste(what, "PSE, high"), ends[2], level(mean(u) + half))
  }
}
settings <- function(what, rows, log, middle, pse, ends, jnd, error, hysteresis) {
  in_u <- function(level) if (log) log10(level) else level
  rows <- rows[!is.na(rows$setting), ]
  u <- in_u(as.numeric(rows$setting)); high <- in_u(rows$level_asked) > middle
  mean_of_settings(what, u, log, pse, ends)
  if (!is.na(jnd)) same(paste(what, "JND"), jnd, sd(u))
  if (!is.na(error)) same(paste(what, "constant error"), error, mean(u) - in_u(rows$standard[1]))
  if (!is.na(hysteresis)) same(paste(what, "hysteresis"), hysteresis, mean(u[high]) - mean(u[!high]))
}
