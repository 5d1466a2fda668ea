"""Reports of evidence on results that a person can compute with; `reports.txt`, changed by hand, has the numbers."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from study_app.evidence.outlets.streams import Ratio, Streamed, streams_evidence
from study_app.evidence.outlets.triggers import TriggerDelays, triggers_evidence
from study_app.evidence.report_rates.simulation import Rate, report_rates_evidence
from study_app.evidence.stability import stability_report
from study_app.evidence.stability.damping_limits import DELAYS
from study_app.evidence.stability.force_delay import force_delay_evidence
from study_app.evidence.stability.stability_cases import FALCON, Case
from study_app.evidence.stability.stability_report import (
    LOOPS,
    Fidelity,
    Swept,
    _JudgedGroup,
    stability_evidence,
    verdict_text,
)
from study_app.evidence.stability.velocity import Row, velocity_evidence
from study_app.evidence.stability.verdict import Verdict
from study_app.evidence.stability.withheld_force import Withheld, withheld_force_evidence
from study_app.evidence.table import Evidence
from study_app.evidence.thresholds import known_values
from study_app.evidence.timing import delays
from study_app.evidence.timing.delays import Delayed, Shown, delays_evidence
from study_app.evidence.timing.measurement import LoopTiming, Timed
from study_app.evidence.timing.report import draw, timing_evidence
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.haptics.runtime.grants import Grant
from study_app.protocol.warnings import Entry

STEPS = np.arange(11)
"""Percentiles of 0 to 10 are a tenth of their number."""


def shown_frames(
    load: Any, delay_ms: float, *errors_ms: float, screen: str = "100 Hz", painted_ms: Any = (0, 10, 20, 30, 40)
) -> Shown:
    """Return five frames with errors, by default one in each refresh of 10 ms."""
    painted_ns = np.array([round(1e6 * ms) for ms in painted_ms])
    sample_ns = painted_ns - np.array([round(1e6 * (delay_ms + ms)) for ms in errors_ms])
    return Shown(screen, "the swap", load, 100.0, delay_ms / 1e3, painted_ns, sample_ns)


DELAYED = Delayed(
    "a computer", 7, (640, 480),
    (
        shown_frames("none", 50, 2, 4, 6, 8, 20, painted_ms=(0, 10, 40, 50, 60)),
        shown_frames("none", 0, 1, 2, 3, 4, 5),
        shown_frames("gui", 0, 3, 3, 3, 3, 3),
        shown_frames("gui", 50, -1, 0, 1, 2, 3, painted_ms=(0, 20, 40, 60, 80)),
    ),
)  # fmt: skip


def loop(kind: Any, level: Any, factor: float, *, busy: bool = True, overruns: int = 0, worst: int = 10) -> LoopTiming:
    """Return a loop that is 0, 10 … 90, 10 ``worst`` µs late times a factor, with ticks of 0, 0.4 … 4 µs times it."""
    late_ns, busy_ns = np.int64(1e4 * factor * np.array([*STEPS[:-1], worst])), np.int64(400 * factor * STEPS)
    return LoopTiming(kind, Grant(level, f"how {level}"), late_ns, busy_ns if busy else busy_ns[:0], overruns)


TIMED = Timed(
    machine="a computer", load="gui", seconds=3.0, spin_us=25.0, spun_share=0.125, frames_hz=59.6,
    loops=(
        loop("servo", "normal", 1.2, overruns=1, worst=15), loop("bare", "normal", 1, busy=False),
        loop("thread", "normal", 30, overruns=2), loop("qt", "normal", 2000),
        loop("servo", "real-time", 3), loop("bare", "real-time", 0.5, busy=False), loop("thread", "real-time", 0.6),
    ),
    notes=("priority: real", "a note"),
)  # fmt: skip

STREAMED = Streamed(
    seconds=4, samples_sent=4000, samples_lost=3, intact=False, worst_gap_ms=2.5, markers_sent=80, markers_lost=2,
    errors_us=100.0 * STEPS, arrivals_ms=STEPS / 2,
)  # fmt: skip
RATIOS = (
    Ratio(percentile=50, with_us=60, without_us=50, ratio=1.2, low=1.125, high=1.25),
    Ratio(percentile=99, with_us=208, without_us=200, ratio=1.04, low=1.01, high=1.08),
)
TRIGGERS = TriggerDelays(port="serial:X", written_us=20.0 * STEPS, read_us=30.0 * STEPS, high_ms=10.0 + STEPS, wrong=2)


def verdict(*reasons: str, safe: bool = True, acted: dict[str, float] | None = None, **case: Any) -> Verdict:
    """Return a verdict whose energy balance falls to -3 mJ, of 1 mJ permitted."""
    return Verdict(
        case=Case(**case), safe=safe, reasons=reasons, balance_j=-0.003, permitted_j=-0.001, swing_mps=0.025,
        fast_n=0.75, played_n=0.5, acted=tuple((acted or {}).get(name, 0.0) for name in LIMITER_NAMES),
    )  # fmt: skip


ACTED = {LIMITER_NAMES[0]: 0.25, LIMITER_NAMES[2]: 0.5}
OFF = (
    verdict("energy", "limit", safe=False), verdict("noise", safe=False), verdict("oscillation", safe=False),
    verdict(safe=False, rate_hz=500.0, delay=4),
)  # fmt: skip
ON = (
    verdict(acted=ACTED),
    verdict("noise", acted={LIMITER_NAMES[0]: 0.05}),
    verdict(),
    verdict("energy", liquid="tar"),
)
SWEPT = Swept(
    off=OFF, on=ON, took_s=12.4,
    others=(_JudgedGroup("late forces", (
        replace(verdict("noise"), fast_n=2.0, played_n=1.9), replace(verdict(), balance_j=-0.0005),
        replace(verdict("not finite"), balance_j=math.nan),
    )),),
)  # fmt: skip
FIDELITIES = tuple(
    Fidelity(liquid, rate_hz, delay, 0.01 * (k + 1) * (4 if liquid == "honey" else 1), 2.0, 0.001 * k)
    for liquid in ("water", "honey")
    for k, (rate_hz, delay) in enumerate(LOOPS)
)
ENTRIES = (
    Entry("water", "ewma", "firm", 20, 75.4, 30.5), Entry("water", "ewma", "firm", 0, 99.6, 1.5),
    Entry("honey", "kalman", "light", 0, 88.0, 12.0),
)  # fmt: skip
ROWS = (
    Row("noise", (1.5, 123.4, 3.25), 2.0), Row("damping", (50.0, 51.0, 52.0), 53.0, least=True),
    Row("damping", (54.0, 51.0, 52.0), 53.0, least=True, bound=12.34), Row("shown", (7.0, 8.0, 9.0)),
)  # fmt: skip


def withheld_shares(liquid: str, estimator: str, mode: str, *percents: float, most: float = 0.2) -> Withheld:
    """Return the shares of seven strokes, and after four shakes: 1, 0.2 … in their seconds, times the shake."""
    after = tuple(tuple(shake * share / 100 for share in (1.0, most, 0.1, 0.05)) for shake in (1, 2, 3, 1))
    return Withheld(liquid, estimator, mode, tuple(percent / 100 for percent in percents), after)


WITHHELD = (
    withheld_shares("water", "ewma", "position imposed", 0, 1, 2, 3, 5, 4, 0.5, most=0.1),
    withheld_shares("physical_tar", "ewma", "position imposed", 10, 20, 30, 40, 50, 60, 70, most=0.9),
    withheld_shares("physical_honey", "kalman", "handle held", 1, 2, 3, 4, 7.5, 6, 5, most=0.1),
    withheld_shares("water", "kalman", "hand shaken", 9, 9, 9, 9, 9, 9, 9),
)
RATES = tuple(
    Rate(cell=cell, participants=n, what=what, limit=limit, hits=hits, studies=studies)
    for cell, n, what, limit, hits, studies in (
        ("b", 12, "a difference", "at most 5 %", 20, 1000), ("a", 24, "a number", "counted", 3, 12),
        ("a", 5, "a number", "none", 1, 10), ("b", 5, "a difference", "at most 5 %", 1, 10),
    )
)  # fmt: skip
KNOWN = (
    known_values.Verdict("jnd", "coverage", "94 %", "at least 93 %", holds=True),
    known_values.Verdict("jnd", "mean error", "+7 %", "within ±5 %", holds=False),
)


def reports() -> Iterator[tuple[str, Evidence]]:
    """Yield each report with its name."""
    yield "delays", delays_evidence(DELAYED)
    yield "timing", timing_evidence(TIMED)
    yield "streams", streams_evidence(STREAMED, RATIOS)
    whole = replace(STREAMED, samples_lost=0, markers_lost=0, intact=True)
    yield "streams, whole", streams_evidence(whole, RATIOS[1:])
    yield "streams, nothing", streams_evidence(replace(whole, errors_us=STEPS[:0], arrivals_ms=STEPS[:0]), ())
    yield "triggers", triggers_evidence(TRIGGERS)
    yield "triggers, a port", triggers_evidence(replace(TRIGGERS, read_us=None, wrong=0))
    yield "stability", stability_evidence(SWEPT, FIDELITIES, "5")
    yield (
        "stability, groups",
        stability_evidence(replace(SWEPT, off=(), on=(), others=(_JudgedGroup("calm", (verdict(),)),)), (), "6"),
    )
    yield "force delay", force_delay_evidence(ENTRIES, "late.csv")
    yield "velocity", velocity_evidence(ROWS)
    yield "velocity, met", velocity_evidence((ROWS[0], *ROWS[2:]))
    yield "withheld", withheld_force_evidence(WITHHELD)
    yield "withheld, beyond", withheld_force_evidence((withheld_shares("water", "ewma", "handle held", *[5.1] * 7),))
    yield "rates", report_rates_evidence(RATES, "# Rates")
    yield "known values", known_values.known_values_evidence(KNOWN, "# Values")
    yield "known values, met", known_values.known_values_evidence(KNOWN[:1], "# Values")


def lines() -> Iterator[str]:
    """Yield the lines of every report, with names in place of repeated texts and the usual case."""
    for name, evidence in reports():
        ends = f"missed: {evidence.missed}, undecided: {evidence.undecided}, closing: {evidence.closing}"
        yield from (f"== {name}", ends, *evidence.text.splitlines())
        for file, content in evidence.files.items():
            yield f"-- {file}"
            shortened = content.replace(evidence.text, "(what is printed)\n").replace(str(Case()), "(the usual case)")
            yield from shortened.splitlines()
    yield "== verdicts in words"
    yield from map(verdict_text, (OFF[0], ON[0], ON[2], verdict("not finite"), verdict("noise", plant=FALCON)))


def test_reports() -> None:
    expected = Path(__file__).with_name("reports.txt").read_text(encoding="utf-8").splitlines()
    differing = [pair for pair in zip_longest(lines(), expected) if pair[0] != pair[1]]
    assert differing[:3] == []  # pytest would take minutes to compare the long lines of both lists


@pytest.mark.parametrize(
    ("spin_us", "notes"), [(0.0, []), (0.75, ["spinning for 0.75 µs before each deadline used 3.1% of one core"])]
)
def test_a_spin_before_deadlines_is_reported_however_short(spin_us: float, notes: list[str]) -> None:
    report = timing_evidence(replace(TIMED, spin_us=spin_us, spun_share=0.031)).text
    assert [line for line in report.splitlines() if "spinning" in line] == notes


def marks(axes: Axes, marker: str) -> list[tuple[float, float]]:
    """Return the places of a kind of mark."""
    return [pytest.approx(xy) for line in axes.lines if line.get_marker() == marker for xy in line.get_xydata()]


def test_the_figure_of_delays_has_each_mean_and_its_99th_percentile() -> None:
    """The axis ends at 1.5 frames, 15 ms; loads are 0.34 apart."""
    (axes,) = delays.draw(DELAYED).axes
    assert marks(axes, "o") == [(-0.17, 3), (0.83, 8)]
    assert marks(axes, "^") == [(0.17, 3), (1.17, 1)]
    ends_ms = [
        line.get_ydata()[1] for line in axes.lines if len(set(line.get_xdata())) == 1 and len(line.get_xdata()) == 2
    ]
    assert ends_ms == pytest.approx([4.96, 15, 3, 2.96])
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0", "50"]
    assert {text.get_text(): text.xy[1] for text in axes.texts} == {"20": 15, "½ frame": 5, "1 frame": 10}
    assert (axes.get_ylim(), axes.get_title(loc="left")) == ((0, 15), "100 Hz, the swap")


def test_the_figure_of_lateness_has_a_panel_for_each_class_with_shares_of_ticks() -> None:
    normal, real_time = draw(TIMED).axes
    assert [axes.get_title(loc="left") for axes in (normal, real_time)] == [
        "Normal priority",
        "Real-time priority (how real-time)",
    ]
    for axes, late_us in ((normal, (172.8, 99, 2970, 198000)), (real_time, (297, 49.5, 59.4))):
        assert [marks(axes, marker)[0] for marker in "os^D"[: len(late_us)]] == [(us, 0.6 / 11) for us in late_us]
        shares = [patch.get_data().values for patch in axes.patches]
        assert [sum(values[values > 0.05]) for values in shares] == pytest.approx([1] * len(late_us))
        assert axes.get_xlim() == pytest.approx((1, 1e6))


def test_the_map_of_stability_has_measured_proved_and_permitted_dampings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, passive in (("boundary_nspm", False), ("passive_nspm", True)):

        def measured(
            first: Any, period_s: float, delay: int, *, friction_nspm: float = 0.5, own: bool = passive
        ) -> float:
            return 1e3 * period_s * (delay + 1) * (first / 100 if own else friction_nspm)

        monkeypatch.setattr(stability_report, name, measured)
    monkeypatch.setattr(stability_report, "slope_limit", lambda period_s, delay: 1e4 * period_s + delay)
    boundary, limits, shares = stability_report.draw_map(OFF).axes
    frictions = (0.1, 0.3, 1, 3, 10)
    for line, marker, delay in zip(boundary.lines[::2], "osD^", (0, 1, 2, 4), strict=True):
        assert (line.get_label(), line.get_marker()) == (str(delay), marker)
        assert list(line.get_ydata()) == pytest.approx([(delay + 1) * friction for friction in frictions])
    assert list(boundary.lines[3].get_ydata()) == pytest.approx([0.02 * friction for friction in frictions])
    bars = [line for line in limits.lines if line.get_marker() == "None"]
    assert sorted(
        {round(line.get_ydata()[0] % 10, 3) for line in bars if line.get_xdata()[0] < 1 < line.get_xdata()[1]}
    ) == [1, 2, 4]
    assert [text.get_text() for text in shares.get_xticklabels()] == ["1", "2"]
    assert [text.get_text() for text in shares.texts if text.get_text() != "0%"] == ["67%"]
    assert [text.get_position() for text in shares.texts if text.get_text() == "67%"] == [(0, DELAYS.index(1))]
