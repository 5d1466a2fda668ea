"""The results of outlet measurements, as text."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from study_app.evidence.outlets.streams import MOST_ERROR_MS, MOST_RATIO, Ratio, Streamed
from study_app.evidence.outlets.trigger_delays import TriggerDelays
from study_app.outlets.markers import HIGH_S


def stream_text(found: Streamed, ratios: Sequence[Ratio]) -> str:
    """Return the results for the streams of the Lab Streaming Layer."""
    return "\n".join((*_streams(found), *_ratios(ratios))) + "\n"


def trigger_text(found: TriggerDelays) -> str:
    """Return the results for a port."""
    return "\n".join(_triggers(found)) + "\n"


def _streams(found: Streamed) -> Iterator[str]:
    intact = "intact" if found.intact else "NOT intact"
    yield f"streams received by another process for {found.seconds:g} s"
    yield f"  samples of 10 channels: {found.samples_sent} sent, {found.samples_lost} lost, {intact}"
    yield f"  longest gap between their times: {found.worst_gap_ms:.2f} ms"
    yield f"  markers: {found.markers_sent} sent, {found.markers_lost} lost"
    p50_us = _percentile(found.errors_us, 50)
    yield (
        f"  marker's time against the servo's clock: p50 {p50_us:.1f} us, p99 {1e3 * found.error_p99_ms:.1f} us, "
        f"limit {1e3 * MOST_ERROR_MS:g} us"
    )
    arrivals = [_percentile(found.arrivals_ms, share) for share in (50, 99)]
    yield f"  from event to arrival: p50 {arrivals[0]:.2f} ms, p99 {arrivals[1]:.2f} ms"
    yield f"  {'met' if found.met else 'missed'}"


def _ratios(ratios: Sequence[Ratio]) -> Iterator[str]:
    yield "lateness of the servo, with both streams and without, alternating every 0.25 s"
    for one in ratios:
        yield (
            f"  p{one.percentile}: {one.with_us:.0f} us with, {one.without_us:.0f} us without, ratio {one.ratio:.3f} "
            f"({one.low:.3f} to {one.high:.3f}), limit {MOST_RATIO:g}: {one.verdict}"
        )


def _triggers(found: TriggerDelays) -> Iterator[str]:
    yield f"{len(found.written_us)} events, twenty a second, on {found.port}"
    yield f"  from event to the byte being written: {_spread(found.written_us)} us"
    if found.read_us is not None and found.high_ms is not None:
        yield f"  from event to the byte being read by another process: {_spread(found.read_us)} us"
        yield f"  from the code to 0: {_spread(found.high_ms)} ms, nominal {1e3 * HIGH_S:g} ms"
        yield f"  wrong or missing bytes: {found.wrong}"


def _spread(values: NDArray[np.float64]) -> str:
    p50, p99, most = (_percentile(values, share) for share in (50, 99, 100))
    return f"p50 {p50:.3g}, p99 {p99:.3g}, most {most:.3g}"


def _percentile(values: NDArray[np.float64], share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else float("nan")
