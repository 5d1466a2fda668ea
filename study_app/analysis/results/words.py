"""How numbers and findings are put into words: nowhere is the lack of evidence called evidence of a lack."""

from collections.abc import Sequence
from typing import Final

from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.statistics.equivalence.tost import UNSEEN, UNSEEN_EQUAL, Equivalence, fewest
from study_app.analysis.statistics.outcome import Interval, Outcome
from study_app.analysis.statistics.paired import Paired
from study_app.analysis.tables.compared_blocks import Block

_SMALL: Final = "no one two three four five six seven eight nine ten eleven twelve"
NUMBERS: Final = tuple(_SMALL.split())

VERDICTS_MEAN: Final = (
    "Shown: adjusted p at most {alpha}. Suggested: the same in a statement that was not decided on before the study, "
    "which is a reason to look again and no finding. Not shown: these data do not settle it; that is not evidence of "
    "sameness. Out of reach: however these answers had been arranged within participants, they could not have shown "
    "it, the other p of the family being what they are: adjusted p depends on those too."
)


def counted(number: int, noun: str) -> str:
    """Return "three statements", "1 statement"."""
    text = NUMBERS[number] if 1 < number < len(NUMBERS) else str(number)
    return f"{text} {noun}" + ("" if number == 1 else "s")


def all_of(number: int, noun: str) -> str:
    """Return "all three statements", "both statements", "the one statement"."""
    if number < 3:
        return f"the one {noun}" if number == 1 else f"both {noun}s"
    return f"all {counted(number, noun)}"


def number(value: float | None, digits: int = 2) -> str:
    """Return a number with so many decimals and a real minus sign, a dash where there is none."""
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return "0" + text[2:] if text.strip("-0.") == "" and text.startswith("-") else text.replace("-", "−")


def p_value(p: float | None) -> str:
    """Return a p as journals print it: .023, < .0001; a dash where there is none."""
    if p is None:
        return "–"
    if p < 0.0001:
        return "< .0001"
    text = f"{p:.4f}" if p < 0.001 else f"{p:.3f}"
    return text.removeprefix("0") if p < 0.9995 else "1"


def p_equals(p: float) -> str:
    """Return a p within a sentence: p = .023, p < .0001."""
    text = p_value(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def interval(ends: Interval | None, digits: int = 2) -> str:
    """Return an interval in brackets; a dash where there is none."""
    return "–" if ends is None else f"[{number(ends.low, digits)}, {number(ends.high, digits)}]"


def percent(share: float) -> str:
    """Return a share in percent, with as many decimals as it takes: 90 %, 99.9 %."""
    return f"{round(100 * share, 6):g} %"


def beyond(tested: Equivalence) -> str:
    """Return how many participants differ by more than the bound, and the interval of their share."""
    if tested.beyond is None:
        return "–"
    ends = tested.beyond.interval
    return f"{tested.beyond.count} of {tested.beyond.n} [{100 * ends.low:.0f}, {100 * ends.high:.0f}] %"


def listed(words: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(words) if len(words) < 3 else f"{', '.join(words[:-1])} and {words[-1]}"


def ms(delay_ms: float) -> str:
    """Return a delay with its unit."""
    return f"{delay_ms:g} ms"


def settings_noun(found: BlockFound | Block) -> str:
    """Return what the settings of a block are called."""
    return found.kind.removesuffix("s") if found.revealed else "setting"


def short(found: BlockFound, item: str) -> str:
    """Return the few words for a statement."""
    return next(one.short for one in found.items if one.id == item)


def name(found: BlockFound, code: str) -> str:
    """Return what a setting is called: a delay by its milliseconds alone, since its block has one liquid."""
    for setting, text in zip(found.settings, found.names, strict=True):
        if setting.code == code:
            return ms(setting.delay_ms or 0.0) if found.delays_ms else text
    raise KeyError(code)


def lead(found: BlockFound) -> str:
    """Return how sentences about a block begin."""
    return f"{found.title} ({settings_noun(found)}s)" if found.revealed else found.title


def statistic(outcome: Outcome) -> str:
    """Return a statistic with its sign."""
    text = {"chi2": "χ²", "sum of chi2": "sum of χ²", "likelihood ratio": "LR"}.get(
        outcome.statistic_name, outcome.statistic_name
    )
    return f"{text} {number(outcome.statistic)}"


def said_of_presentations(found: BlockFound) -> tuple[str, ...]:
    """Return how many presentations an answer stands for, and what became of sessions; empty for one of each."""
    fewest, most = found.presentations
    lines = []
    if found.replicated_ms:
        delays = listed([ms(delay) for delay in found.replicated_ms])
        lines.append(f"Several conditions present {delays}: they are taken as repeated presentations of one delay.")
    if most > 1:
        often = f"{most}" if fewest == most else f"{fewest} to {most}"
        lines.append(
            f"A participant answered each statement {often} times for one {settings_noun(found)}: tests of ranks, of "
            "equivalence and of recognition take the median of these answers; the mixed model and the detection "
            "threshold take every single one."
        )
    if len(found.sessions) > 1:
        lines.append(
            f"The answers are of sessions {listed(list(map(str, found.sessions)))}, which are compared with each other "
            "and are a factor of the mixed model; the other tests pool them."
        )
    return tuple(lines)


def least(alpha: float) -> str:
    """Return how many participants equivalence needs at least."""
    return f"at least {fewest(alpha)} participants ({fewest(alpha, equal=True)} where all differences are equal)"


def enough(alpha: float) -> str:
    """Return how many participants equivalence needs at least, and why."""
    one_in, one_in_equal = (NUMBERS[round(1 / share)] for share in (UNSEEN, UNSEEN_EQUAL))
    return (
        f"{least(alpha)}: more than {percent(alpha)} of smaller samples contain no one from a group of one person in "
        f"{one_in} (one in {one_in_equal})"
    )


def higher(found: BlockFound, outcome: Outcome) -> str:
    """Return which of two settings was rated higher; empty where more are compared."""
    if not isinstance(outcome, Paired) or len(found.names) != 2 or not outcome.effect:
        return ""
    first, second = (name(found, setting.code) for setting in found.settings)
    return f"higher for {first if outcome.effect > 0 else second}, "


def test_name(outcome: Outcome) -> str:
    """Return a test as a sentence names it."""
    return {
        "Friedman": "Friedman's test",
        "Kruskal-Wallis": "the Kruskal–Wallis test",
        "Kruskal-Wallis of differences": "the Kruskal–Wallis test of differences between the two settings",
        "permutation test of rank profiles": "a permutation test of the ranks of the settings",
        "Wilcoxon signed ranks": "Wilcoxon's signed ranks",
        "Page's trend": "Page's test of a trend",
    }.get(outcome.test, outcome.test)


def missing(found: BlockFound) -> tuple[str, ...]:
    """Return what is not there, and why, a sentence for each reason."""
    reasons: dict[str, list[str]] = {}
    for one in found.absent:
        reasons.setdefault(one.why, []).append(one.what)
    return tuple(f"no {listed(what)}: {why}." for why, what in reasons.items())


def signed_difference(tested: Equivalence) -> str:
    """Return the difference of two mean answers with its sign and interval."""
    effect, ends = tested.effect or 0.0, tested.interval
    return f"{'+' if effect > 0 else ''}{number(effect)} {'(no interval)' if ends is None else interval(ends)} points"
