{% for line in credits %}
# {{ line }}
{% endfor %}
# Computes the main numbers of report.html again, in base R (4.0 or newer, no packages), from the tables next to this
# file or in the folder that is named, and says where they differ:  Rscript report.R [FOLDER]   (exit code 1 if any
# does, or if there is nothing to compare)
# The exact p of trends and of pairs come from all rearrangements, up to {{ exact }} participants; beyond that, and for
# Friedman's test, the approximate p are compared.

folder <- c(commandArgs(trailingOnly = TRUE), ".")[1]
answers <- read.csv(file.path(folder, "{{ table }}"), colClasses = "character", na.strings = "n/a", encoding = "UTF-8")
answers <- answers[answers$counted == "true", ]
{% if texts %}
answers$response <- suppressWarnings(as.numeric(answers$response))  # answers to other questions may be texts
{% else %}
answers$response <- as.numeric(answers$response)
{% endif %}
differing <- 0
compared <- 0

same <- function(what, reported, computed) {
  ok <- isTRUE(all.equal(reported, computed, tolerance = 1e-6, check.attributes = FALSE))
  compared <<- compared + 1
  if (!ok) differing <<- differing + 1
  cat(sprintf("%-64s report %12.6g   R %12.6g   %s\n", what, reported, computed, if (ok) "" else "DIFFERS"))
}

# Sums of independent whole numbers: chances[i] is that of the sum i - 1.
add <- function(chances, values, each = rep(1 / length(values), length(values))) {
  sums <- numeric(length(chances) + max(values))
  for (place in seq_along(values)) {
    at <- seq_along(chances) + values[place]; sums[at] <- sums[at] + each[place] * chances
  }
  sums
}
at_least <- function(chances, value) sum(chances[(value + 1):length(chances)])
orders <- function(k) if (k == 1) matrix(1) else {
  less <- orders(k - 1)
  do.call(rbind, lapply(seq_len(k), function(place) cbind(place, ifelse(less >= place, less + 1, less))))
}

# One row a participant, one column a setting; a participant's repeated answers count by their median.
# Codes with one name in columns are presentations of one setting.
wide <- function(block, item, codes, columns = codes) {
  rows <- answers[answers$block == block & answers$item == item, ]
  tapply(rows$response, list(rows$participant, factor(rows$code, codes, columns)), median, na.rm = TRUE)
}
whole <- function(table) table[complete.cases(table), , drop = FALSE]

friedman <- function(what, table, chi2, p) {
  found <- suppressWarnings(friedman.test(whole(table)))
  same(paste(what, "Friedman chi2"), chi2, unname(found$statistic))
  same(paste(what, "p by chi2"), p, found$p.value)
}
page <- function(what, table, falling, L, p) {
  x <- whole(table); if (falling) x <- -x
  ranks <- t(apply(x, 1, rank)); n <- nrow(x); k <- ncol(x)
  found <- sum(ranks %*% seq_len(k))
  same(paste(what, "Page's L"), L, found)
  if (n > {{ exact }}) {
    spread <- sum((ranks - (k + 1) / 2)^2) / (k - 1) * k * (k^2 - 1) / 12
    same(paste(what, "p"), p, pnorm((found - n * k * (k + 1)^2 / 4) / sqrt(spread), lower.tail = FALSE))
  } else if (k <= 8) {
    every <- orders(k); chances <- 1
    for (person in seq_len(n)) {
      counts <- table(matrix(2 * ranks[person, ][every], nrow(every)) %*% seq_len(k))
      chances <- add(chances, as.numeric(names(counts)), counts / nrow(every))
    }
    same(paste(what, "exact p"), p, at_least(chances, 2 * found))
  }
}
pair <- function(what, table, first, second, V, p) {
  found <- suppressWarnings(wilcox.test(table[, first], table[, second], paired = TRUE, exact = FALSE, correct = FALSE))
  same(paste(what, "Wilcoxon V"), V, unname(found$statistic))
  d <- table[, first] - table[, second]; d <- d[!is.na(d) & d != 0]; chances <- 1
  if (length(d) > {{ exact }}) return(same(paste(what, "p"), p, found$p.value))
  for (rank in 2 * rank(abs(d))) chances <- add(chances, c(0, rank))
  same(paste(what, "exact p"), p, min(1, 2 * at_least(chances, 2 * max(V, sum(rank(abs(d))) - V))))
}
equivalent <- function(what, table, first, second, bound, p, low, high, level, different) {
  d <- table[, second] - table[, first]; d <- d[!is.na(d)]
  lower <- t.test(d, mu = -bound, alternative = "greater")$p.value
  upper <- t.test(d, mu = bound, alternative = "less")$p.value
  same(paste(what, "equivalence p"), p, max(lower, upper))
  limits <- t.test(d, conf.level = level)$conf.int
  same(paste(what, "interval, low"), low, limits[1])
  same(paste(what, "interval, high"), high, limits[2])
  same(paste(what, "difference p by t"), different, t.test(d)$p.value)
}
# The same, one column a session: medians over the settings that a participant answered in all of these.
by_session <- function(block, item, sessions, codes, columns = codes) {
  rows <- answers[answers$block == block & answers$item == item & !is.na(answers$response), ]
  cells <- tapply(rows$response, list(rows$participant, factor(rows$code, codes, columns),
                                      factor(rows$session, sessions)), median)
  common <- apply(!is.na(cells), c(1, 2), all)
  t(sapply(seq_len(nrow(cells)), function(person)
    apply(matrix(cells[person, common[person, ], ], ncol = length(sessions)), 2, median)))
}
# Sites of a merged study: "level" compares medians over settings, "profile" ranks of settings, or differences of two.
sites <- function(what, table, kind, H, p) {
  x <- whole(table); site <- factor(answers$site[match(rownames(x), answers$participant)])
  y <- if (kind == "level") cbind(apply(x, 1, median)) else if (ncol(x) == 2) cbind(x[, 2] - x[, 1]) else
    t(apply(x, 1, rank))
  if (ncol(y) == 1) {
    found <- kruskal.test(y[, 1], site)
    same(paste(what, "sites,", kind, "H"), H, unname(found$statistic))
    return(same(paste(what, "sites,", kind, "p by chi2"), p, found$p.value))
  }
  y <- sweep(y, 2, colMeans(y)); n <- as.vector(table(site))
  same(paste(what, "sites,", kind, "H"), H, (nrow(y) - 1) * sum(rowsum(y, site)^2 / n) / sum(y^2))
}
threshold_sites <- function(what, thresholds, site, H, p) {
  found <- kruskal.test(thresholds, factor(site))
  same(paste(what, "thresholds by site, H"), H, unname(found$statistic))
  same(paste(what, "thresholds by site, p by chi2"), p, found$p.value)
}
hits <- function(what, block, items, codes, right, hits) {
  ratings <- lapply(items, function(item) wide(block, item, codes))
  people <- Reduce(union, lapply(ratings, rownames)); found <- 0
  for (person in people) for (place in seq_along(codes)) {
    rated <- sapply(ratings, function(table) if (person %in% rownames(table)) table[person, place] else NA)
    if (!anyNA(rated) && sum(rated == max(rated)) == 1)
      found <- found + identical(items[which.max(rated)], right[place])
  }
  same(paste(what, "right names"), hits, found)
}

{{ calls }}

cat(compared, "of {{ numbers }} numbers compared\n")
if (compared == 0) quit(status = 1)
if (differing == 0) cat("every number that R computes is the report's\n") else {
  cat("numbers that differ:", differing, "\n")
  quit(status = 1)
}
