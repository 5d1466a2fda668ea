# Recomputes the main numbers of the report in base R (4.0 or newer, no packages) and lists those that differ:
#   Rscript report.R [TABLES [TESTS]]   folders of the exported tables and of tests.csv; default: this folder
# The exit code is 1 if any number differs or if there is nothing to compare. Exact p values of trends and of pairs are
# computed from all changes of sign. For Friedman's test, only approximate p values are compared. Monte Carlo p values
# are not compared. For hypotheses, the t test and the effects are compared, but not the bootstrap, the correction for
# skewness, the adjusted p or the intervals of standardised effects.

folders <- c(commandArgs(trailingOnly = TRUE), ".", ".")
folders <- if (length(folders) == 3) folders[c(1, 1)] else folders[1:2]
csv <- function(file) read.csv(file, colClasses = "character", na.strings = "n/a", encoding = "UTF-8")
exported <- function(name) {
  file <- list.files(folders[1], paste0("_description-", name, "_data\\.csv$"), full.names = TRUE)
  if (length(file) == 1) csv(file) else NULL
}
number <- function(texts) suppressWarnings(as.numeric(texts))  # answers to other questions may be text
answers <- exported("responses")
answers <- answers[answers$counted == "true", ]
answers$response <- number(answers$value)
tests <- csv(file.path(folders[2], "tests.csv"))
differing <- compared <- 0

same <- function(what, reported, computed) {
  reported <- number(reported)
  if (is.na(reported)) return(invisible())
  ok <- isTRUE(all.equal(reported, computed, tolerance = 1e-6, check.attributes = FALSE))
  compared <<- compared + 1
  if (!ok) differing <<- differing + 1
  cat(sprintf("%-64s report %12.6g   R %12.6g   %s\n", what, reported, computed, if (ok) "" else "DIFFERS"))
}

# Distribution of a sum of independent whole numbers: chances[i] is the probability that the sum is i - 1.
add <- function(chances, values, each = rep(1 / length(values), length(values))) {
  sums <- numeric(length(chances) + max(values))
  for (place in seq_along(values)) {
    at <- seq_along(chances) + values[place]; sums[at] <- sums[at] + each[place] * chances
  }
  sums
}
at_least <- function(chances, value) sum(chances[(value + 1):length(chances)])

# One row per participant and one column per condition ("L1 L2", or "D1+D4 D2" if two codes have the same delay);
# repeated answers are replaced by their median (or mean). With by_session: one column per session, which contains the
# median over the conditions that the participant answered in all sessions.
wide <- function(block, item, codes, by_session = FALSE, repeated = median) {
  codes <- strsplit(codes, " ")[[1]]
  columns <- rep(codes, lengths(strsplit(codes, "+", fixed = TRUE)))
  names(columns) <- unlist(strsplit(codes, "+", fixed = TRUE))
  rows <- answers[answers$block %in% block & answers$item == item & !is.na(answers$response), ]
  settings <- factor(columns[rows$code], codes)
  if (!by_session) return(tapply(rows$response, list(rows$participant, settings), repeated))
  sessions <- factor(rows$session, unique(sort(answers$session[answers$block == block])))
  cells <- tapply(rows$response, list(rows$participant, settings, sessions), median)
  common <- apply(!is.na(cells), c(1, 2), all)
  t(sapply(seq_len(nrow(cells)), function(person)
    apply(matrix(cells[person, common[person, ], ], ncol = nlevels(sessions)), 2, median)))
}
whole <- function(table) table[complete.cases(table), , drop = FALSE]

friedman <- function(what, table, row) {
  found <- suppressWarnings(friedman.test(whole(table)))
  same(paste(what, "Friedman chi2"), row$statistic, unname(found$statistic))
  if (startsWith(row$method, "chi-square")) same(paste(what, "p by chi2"), row$p, found$p.value)
}
trend <- function(what, table, row) {
  x <- whole(table); if (grepl("decreasing", row$method)) x <- -x
  k <- ncol(x); scores <- 2 * t(apply(x, 1, rank)) %*% seq_len(k)
  same(paste(what, "Page's L"), row$statistic, sum(scores) / 2)
  if (!startsWith(row$method, "exact")) return(invisible())
  away <- scores - k * (k + 1)^2 / 2; chances <- 1
  for (one in abs(away)[away != 0]) chances <- add(chances, c(0, one))
  up <- sum(away[away > 0]); down <- -sum(away[away < 0])
  both <- grepl("two-sided", row$method)
  same(paste(what, "exact p"), row$p, if (both) min(1, 2 * at_least(chances, max(up, down))) else at_least(chances, up))
}
signed_ranks_p <- function(d) {
  d <- d[d != 0]; chances <- 1
  if (length(d) > 200) return(suppressWarnings(wilcox.test(d, exact = FALSE, correct = FALSE)$p.value))
  ranks <- rank(abs(d))
  for (rank in 2 * ranks) chances <- add(chances, c(0, rank))
  min(1, 2 * at_least(chances, 2 * max(sum(ranks[d > 0]), sum(ranks[d < 0]))))
}
pair <- function(what, d, row) {
  same(paste(what, "Wilcoxon V"), row$statistic, sum(rank(abs(d[d != 0]))[d[d != 0] > 0]))
  same(paste(what, "p"), row$p, signed_ranks_p(d))
}
equivalent <- function(what, d, row) {
  bound <- number(sub(".*bounds ±([0-9.e-]+) .*", "\\1", row$method))
  if (is.na(bound) || !startsWith(row$method, "t(")) return(invisible())
  p <- c(t.test(d, mu = -bound, alternative = "greater")$p.value, t.test(d, mu = bound, alternative = "less")$p.value)
  same(paste(what, "equivalence p"), row$p, max(p))
  limits <- t.test(d, conf.level = number(row$level))$conf.int
  same(paste(what, "interval, low"), row$low, limits[1])
  same(paste(what, "interval, high"), row$high, limits[2])
}
for (place in seq_len(nrow(tests))) {
  row <- tests[place, ]
  if (startsWith(row$test, "contrast") || is.na(row$item) || is.na(row$statistic) && is.na(row$p) || grepl("step-down", row$question)) next
  what <- paste0(row$block, " ", row$item, if (!is.na(row$comparison)) paste0(" (", row$comparison, ")"), ", ",
                 row$question, ":")
  x <- wide(row$block, row$item, row$codes, row$question == "sessions differ")
  d <- if (ncol(x) == 2) x[, 1] - x[, 2]; d <- d[!is.na(d)]
  switch(row$test,
    "Friedman" = if (nrow(whole(x)) > 1) friedman(what, x, row),
    "trend over participants" = trend(what, x, row),
    "Wilcoxon signed ranks" = pair(what, d, row),
    "equivalence, two one-sided t tests" = equivalent(what, d, row))
}
numbers <- sum(!is.na(tests[c("statistic", "p", "low", "high")]))

# Hypotheses: each participant's value on each side, in logarithms for a ratio; then t tests.
groups_of <- function(people) {
  trials <- exported("trials")
  trials$group[match(people, trials$participant)]
}
side <- function(h, place, ratio) {
  if (h$table != "responses") {
    rows <- exported(h$table)
    rows <- rows[rows$block == h$blocks[place] & !is.na(rows[[h$measure]]), ]
    values <- number(rows[[h$measure]])
    return(tapply(if (ratio) log(values) else values, rows$participant, mean))
  }
  if (is.na(h$form)) return(rowMeans(wide(h$blocks[place], h$measure, h$codes[place], repeated = h$repeated)))
  rows <- answers[answers$form %in% h$form & answers$after_block %in% h$blocks[place] & answers$item == h$measure, ]
  tapply(rows$response, rows$participant, mean, na.rm = TRUE)
}
hypothesis <- function(place, row, h) {
  what <- paste0("hypothesis ", place, ", ", h$measure, ":")
  if (h$skipped != "") return(cat(what, "not computed, because", h$skipped, "\n"))
  ratio <- row$effect_name == "ratio"
  values <- side(h, 1, ratio)
  if (length(h$blocks) == 2) {
    second <- side(h, 2, ratio)
    people <- intersect(names(values), names(second))
    values <- values[people] - second[people]
  }
  values <- values[is.finite(values)]
  if (length(h$groups) == 2) {
    groups <- groups_of(names(values))
    x <- values[groups %in% h$groups[1]]; y <- values[groups %in% h$groups[2]]
    mean <- mean(x) - mean(y); error <- sqrt(var(x) / length(x) + var(y) / length(y))
    freedom <- length(x) + length(y) - 2
    sd <- sqrt((sum((x - mean(x))^2) + sum((y - mean(y))^2)) / freedom)
    standardised <- mean / sd * exp(lgamma(freedom / 2) - lgamma((freedom - 1) / 2)) / sqrt(freedom / 2)  # Hedges' g
    freedom <- min(length(x), length(y)) - 1  # variances may be unequal
  } else {
    mean <- mean(values); error <- sd(values) / sqrt(length(values)); freedom <- length(values) - 1
    standardised <- mean / sd(values)  # d_z
  }
  t <- mean / error
  p <- if (grepl("one-sided \\(higher", row$method)) pt(t, freedom, lower.tail = FALSE) else
    if (grepl("one-sided \\(lower", row$method)) pt(t, freedom) else 2 * pt(-abs(t), freedom)
  shown <- if (ratio) exp else identity
  same(paste(what, "t"), row$statistic, t)
  same(paste(what, "p"), row$p, p)
  same(paste(what, row$effect_name), row$effect, shown(mean))
  same(paste(what, "interval, low"), row$low, shown(mean - qt(0.975, freedom) * error))
  same(paste(what, "interval, high"), row$high, shown(mean + qt(0.975, freedom) * error))
  same(paste(what, "standardised effect"), h$standardised, standardised)
}
stated <- tests[startsWith(tests$test, "contrast"), ]
for (place in seq_along(hypotheses)) hypothesis(place, stated[place, ], hypotheses[[place]])
numbers <- numbers + sum(!is.na(stated$effect)) + sum(!is.na(sapply(hypotheses, `[[`, "standardised")))

# Blocks with levels: d' and criterion, exponents, and settings in the method of adjustment.
judged <- exported("tracks")
judged <- judged[judged$analysed == "true" & !is.na(judged$response), ]
of <- function(row) {  # the trials to which a row of an exported table refers
  rows <- judged[judged$block == row$block & judged$participant == row$participant, ]
  if (!is.null(row$condition) && !is.na(row$condition)) return(rows[rows$track == row$condition, ])
  if (is.null(row$standard)) rows else if (is.na(row$standard)) rows[is.na(rows$standard), ] else
    rows[rows$standard %in% row$standard, ]
}
about <- function(row) paste0(row$block, ", ", row$participant, if (!is.null(row$standard) && !is.na(row$standard))
  paste(" at", row$standard), if (!is.null(row$condition) && !is.na(row$condition)) paste(" with", row$condition), ":")
sensitivity <- function(row) {
  rows <- of(row); given <- judged$response[judged$block == row$block]
  design <- if (any(given == "yes")) "yes" else if (any(given == "different")) "different" else
    if (any(given == "first") && all(nchar(rows$arrangement) == 2)) "first" else return(invisible())
  rate <- function(arrangements) {
    own <- rows[rows$arrangement %in% arrangements, ]
    (sum(own$response == design) + 0.5) / (nrow(own) + 1)
  }
  high <- rate(switch(design, yes = "C", first = "CS", c("SC", "CS")))
  low <- rate(switch(design, yes = "S", first = "SC", c("SS", "CC")))
  criterion <- -(qnorm(high) + qnorm(low)) / 2
  d <- (qnorm(high) - qnorm(low)) / (if (design == "first") sqrt(2) else 1)
  if (design == "different" && row$d_prime_model %in% "differencing") {
    criterion <- -sqrt(2) * qnorm(low / 2)
    k <- -sqrt(2) * qnorm(min(low, high) / 2)
    share <- function(d) pnorm((d - k) / sqrt(2)) + pnorm((-d - k) / sqrt(2)) - max(low, high)
    d <- if (high == low) 0 else sign(high - low) * uniroot(share, c(0, 20), tol = 1e-12)$root
  } else if (design == "different") {
    d <- sign(d) * 2 * qnorm(0.5 + 0.5 * sqrt(2 * pnorm(abs(d) / 2) - 1))
  }
  same(paste(about(row), "d'"), row$d_prime, d)
  same(paste(about(row), "criterion"), row$criterion, criterion)
}
power_law <- function(row) {
  rows <- of(row); asked <- number(rows$level_asked); answer <- log(number(rows$response))
  delivered <- ave(number(rows$level_delivered), asked, FUN = function(x) mean(x, na.rm = TRUE))
  kept <- which(is.finite(answer) & asked > 0)
  level <- log(ifelse(is.na(delivered), asked, delivered))[kept]
  means <- tapply(answer[kept], level, mean)
  same(paste(about(row), "exponent"), row$exponent, unname(coef(lm(means ~ sort(unique(level))))[2]))
}
settings <- function(row) {
  rows <- of(row); rows <- rows[!is.na(rows$setting), ]
  at <- number(rows$setting); start <- number(rows$level_asked)
  log <- all(at > 0) && isTRUE(all.equal(number(row$pse), 10^mean(log10(at))))  # otherwise levels are spaced evenly
  u <- if (log) log10(at) else at; level <- function(u) if (log) 10^u else u
  high <- (if (log) log10(start) else start) > mean(range(if (log) log10(start) else start))
  half <- qt(0.975, length(u) - 1) * sd(u) / sqrt(length(u))
  standard <- number(row$standard)
  computed <- c(pse = level(mean(u)), low = level(mean(u) - half), high = level(mean(u) + half), jnd = sd(u),
                constant_error = mean(u) - if (log) log10(standard) else standard,
                hysteresis = mean(u[high]) - mean(u[!high]))
  for (name in names(computed)) same(paste(about(row), name), row[[name]], computed[[name]])
}
each <- function(table, compare) for (place in seq_len(NROW(table))) compare(table[place, ])
thresholds <- exported("thresholds"); exponents <- exported("exponents"); adjusted <- exported("settings")
each(thresholds[!is.na(thresholds$d_prime), ], sensitivity)
each(exponents, power_law)
each(adjusted, settings)
numbers <- numbers + sum(!is.na(thresholds[c("d_prime", "criterion")])) + NROW(exponents) +
  sum(!is.na(adjusted[c("pse", "low", "high", "jnd", "constant_error", "hysteresis")]))

cat(compared, "of", numbers, "numbers compared\n")
if (compared == 0) {
  cat("nothing to compare:", if (sealed)
    "the key was sealed, so conditions are not compared; run liquid-study unblind, then write these files again\n"
  else "no test, hypothesis, threshold or setting has a number that R computes\n")
  quit(status = 1)
}
if (differing == 0) cat("all numbers that R computed agree with the report\n") else {
  cat("numbers that differ:", differing, "\n")
  quit(status = 1)
}
