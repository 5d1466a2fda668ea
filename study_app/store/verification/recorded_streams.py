"""Comparison of a recording of the Lab Streaming Layer (XDF, by LabRecorder) with what the sessions sent.

Markers are compared with the journals by their text, which contains the event's time. Lost samples are gaps in the
stream's tick numbers. Clocks are compared by the offsets that the recorder measured.
"""

import gzip
import logging
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StoreError
from study_app.number_text import counted
from study_app.outlets.markers import marker_of
from study_app.outlets.streams import MARKERS, SAMPLES, TICKS
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.merged import read_merged
from study_app.store.verification.verify_session import Finding, Findings

_RESET_S: Final = 1.0
"""Smallest change of an offset between two measurements that means a clock was set rather than drifting [s]."""
_LATE: Final = 1.5
"""Number of periods from which the interval between successive ticks is late."""


def check_recording(file: Path, folder: Path, findings: Findings) -> list[str]:
    """Compare the recording ``file`` with the study in ``folder``; add to ``findings`` and return the measurements.

    Raises
    ------
    StoreError
        The recording cannot be read, or has no stream of this program.
    """
    streams = [(str(next(iter(it["info"].get("name") or ()), "")), it) for it in _read(file)]
    ours = [(name, it) for name, it in streams if name in {MARKERS, SAMPLES}]
    if not ours:
        names = ", ".join(repr(name) for name, _ in streams) or "none"
        raise StoreError(f"{file} does not contain a stream named '{MARKERS}' or '{SAMPLES}'; its streams: {names}")
    merged = read_merged(folder)
    places = [folder] if merged is None else [it for it in map(merged.folder, merged.names) if it.is_dir()]
    sessions = [session for place in places for session in StudyFolder(place).sessions()]
    expected: dict[SessionFolder, list[str]] = {}
    for session in sessions:
        with findings.reading(session.path):
            lines = journal.read(session.journal)
            made = (marker_of(line.event, line.t_s, 0, line.fields()) for line in lines)
            expected[session] = [it.text for it in made if it is not None]
    said = []
    for name, stream in ours:
        try:
            of = (
                _check_markers(file, stream, expected, findings)
                if name == MARKERS
                else _check_samples(file, stream, findings)
            )
            said += [*of, f"clock of '{name}': {_clock_drift(stream)}"]
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            why = f"{type(error).__name__}: {error}"
            raise StoreError(f"{file} contains a damaged stream '{name}' ({why}): restore it from a backup") from error
    markers = [text for name, stream in ours if name == MARKERS for text in _texts(stream)]
    sent = {text for texts in expected.values() for text in texts}
    if any(name == MARKERS for name, _ in ours) and sent.isdisjoint(markers):
        findings.errors += (Finding(file.name, "it does not contain markers from this study's sessions"),)
    return said


_TARGET: Final = '{"event":"target_reached",'
"""Beginning of a reached target's marker, which has no line in the journal while measures are sealed."""


def _read(file: Path) -> list[Any]:
    try:
        import pyxdf  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise StoreError("reading an XDF file needs pyxdf: pip install 'liquid-study[lsl]'") from error
    logging.getLogger("pyxdf").setLevel(logging.CRITICAL)
    if not file.is_file():
        raise StoreError(f"{file} is not a file: specify a recording, for example one made with LabRecorder")
    try:
        with gzip.open(file) if file.suffix in {".gz", ".xdfz"} else file.open("rb") as opened:
            streams, _ = pyxdf.load_xdf(opened, synchronize_clocks=False, dejitter_timestamps=False)
    except Exception as error:
        raise StoreError(f"{file} cannot be read as XDF ({type(error).__name__}: {error})") from error
    return list(streams)


def _check_markers(
    file: Path, stream: Mapping[str, Any], expected: Mapping[SessionFolder, Sequence[str]], findings: Findings
) -> Iterator[str]:
    """Compare markers with the journals: between the first and the last, none may be missing or added."""
    texts = _texts(stream)
    if not texts:  # for example of a program that was killed before its session
        yield "markers: none recorded"
        return
    known = Counter(text for texts in expected.values() for text in texts)
    unknown = sum(text not in known and not text.startswith(_TARGET) for text in texts)
    for session, all_sent in expected.items():
        sent = [text for text in all_sent if known[text] == 1]  # all sessions begin with the same text
        wanted = set(sent)
        at = {text: place for place, text in enumerate(texts) if text in wanted}
        known_numbers = [number for number, text in enumerate(sent) if text in at]
        name = f"{session.path.parent.name}/{session.path.name}"
        if not known_numbers:
            continue
        first, last = known_numbers[0], known_numbers[-1]
        if lost := [text for text in sent[first : last + 1] if text not in at]:
            what = f"{file.name} does not contain {counted(len(lost), 'marker')} recorded in the journal"
            findings.error(session.path, f"{what}; the first: {lost[0]}")
        span = texts[min(at.values()) : max(at.values()) + 1]
        if added := [text for text in span if text not in known and not text.startswith(_TARGET)]:
            what = f"{counted(len(added), 'marker')} not recorded in the journal, starting with {added[0]}"
            why = "either the journal was changed, or another program sent markers"
            findings.error(session.path, f"{file.name} contains {what}: {why}")
            unknown -= len(added)
        if outside := len(sent) - 1 - (last - first):
            when = f"{first} before the recording and {len(sent) - 1 - last} after it"
            findings.warning(
                session.path, f"{outside} of the {len(sent)} markers fall outside the recording {file.name}: {when}"
            )
        counts = f"{len(known_numbers)} of {len(sent)} recorded, {len(lost)} lost"
        yield f"markers from {name}: {counts}; times agree within {_error_ms(session, stream, at):.2g} ms"
    if unknown:
        findings.warnings += (
            Finding(file.name, f"contains {counted(unknown, 'marker')} from outside this study's sessions"),
        )


def _texts(stream: Mapping[str, Any]) -> list[str]:
    return [row[0] for row in stream["time_series"]]


def _error_ms(session: SessionFolder, stream: Mapping[str, Any], at: Mapping[str, int]) -> float:
    """Return the largest deviation of marker stamps from journal times, minus the median of each start [ms]."""
    parts: list[list[float]] = [[]]
    for line in journal.read(session.journal):
        marker = marker_of(line.event, line.t_s, 0, line.fields())
        if line.event == "session_resumed":
            parts.append([])
        if marker is not None and marker.text in at:
            parts[-1].append(float(stream["time_stamps"][at[marker.text]]) - line.t_s)
    return max(1e3 * float(np.abs(np.array(part) - np.median(part)).max()) for part in parts if part)


def _check_samples(file: Path, stream: Mapping[str, Any], findings: Findings) -> Iterator[str]:
    """Count lost and late samples of a stream."""
    stamps_s = np.asarray(stream["time_stamps"], float)
    labels = [channel["label"][0] for channel in stream["info"]["desc"][0]["channels"][0]["channel"]]
    if "tick" not in labels:
        yield f"samples: {len(stamps_s)} recorded without tick numbers, so lost samples cannot be detected"
        return
    if len(stamps_s) == 0:
        yield "samples: none recorded"
        return
    ticks = np.asarray(stream["time_series"])[:, labels.index("tick")].astype(np.int64)
    steps, intervals_s = np.diff(ticks) % TICKS, np.diff(stamps_s)
    gaps = (steps > 1) & (steps < TICKS // 2)  # a larger gap is a restart of the servo
    lost = int((steps[gaps] - 1).sum())
    if lost:
        first_s = stamps_s[int(np.argmax(gaps))] - stamps_s[0]
        loss = f"{counted(lost, 'sample')} lost in {counted(int(gaps.sum()), 'gap')}"
        findings.errors += (Finding(file.name, f"{loss}; the first after {first_s:.3f} s"),)
    late_s = intervals_s[(steps == 1) & (intervals_s > _LATE / float(stream["info"]["nominal_srate"][0]))]
    worst = f", at most {1e3 * late_s.max():.3g} ms between two ticks" if len(late_s) else ""
    yield f"samples: {len(stamps_s)} recorded, {lost} lost, {len(late_s)} late{worst}"


def _clock_drift(stream: Mapping[str, Any]) -> str:
    """Return a text about the drift of a stream's clock against the recorder's, from offsets between two resets."""
    times_s, values_s = (np.asarray(stream.get(name, ()), float) for name in ("clock_times", "clock_values"))
    if len(times_s) < 2:
        return f"{counted(len(times_s), 'offset')} measured, too few to estimate the drift"
    resets = np.flatnonzero((np.diff(times_s) < 0) | (np.abs(np.diff(values_s)) > _RESET_S)) + 1
    parts = zip(np.split(times_s, resets), np.split(values_s, resets), strict=True)
    said = []
    for t_s, v_s in parts:
        slope, residual_s = _fit_line(t_s, v_s)
        if math.isfinite(slope):
            span = f"over {np.ptp(t_s):.0f} s, with offsets within {1e3 * residual_s:.2g} ms of a straight line"
            said.append(f"drift {1e6 * slope:+.2g} ppm {span}")
    return "; ".join([counted(len(resets), "reset"), *said])


def _fit_line(t_s: NDArray[np.float64], v_s: NDArray[np.float64]) -> tuple[float, float]:
    """Return slope and largest residual of a line through offsets; the slope is NaN for fewer than three."""
    if len(t_s) < 3 or np.ptp(t_s) == 0:
        return math.nan, math.nan
    slope, start_s = np.polyfit(t_s - t_s[0], v_s, 1)
    return float(slope), float(np.abs(v_s - start_s - slope * (t_s - t_s[0])).max())
