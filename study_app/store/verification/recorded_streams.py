"""Comparison of a Lab Streaming Layer recording (XDF, by LabRecorder) with the markers and samples of the sessions.

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

_MIN_RESET_S: Final = 1.0
"""Smallest change of an offset between two measurements that counts as a reset of a clock, not as drift [s]."""
_LATE_PERIODS: Final = 1.5
"""Longest interval between successive ticks that is not late [periods]."""


def check_recording(file: Path, folder: Path, findings: Findings) -> list[str]:
    """Compare the recording ``file`` with the study in ``folder``; add to ``findings`` and return the measurements.

    Raises
    ------
    StoreError
        The recording cannot be read, or has no stream of this program.
    """
    streams = [(str(next(iter(stream["info"].get("name") or ()), "")), stream) for stream in _read_streams(file)]
    own_streams = [(name, stream) for name, stream in streams if name in {MARKERS, SAMPLES}]
    if not own_streams:
        names = ", ".join(repr(name) for name, _ in streams) or "none"
        raise StoreError(f"{file} does not contain a stream named '{MARKERS}' or '{SAMPLES}'; its streams: {names}")
    merged = read_merged(folder)
    site_folders = [folder] if merged is None else [*filter(Path.is_dir, map(merged.folder, merged.names))]
    sessions = [session for site_folder in site_folders for session in StudyFolder(site_folder).sessions()]
    expected: dict[SessionFolder, list[str]] = {}
    for session in sessions:
        with findings.reading(session.path):
            lines = journal.read(session.journal)
            journalled = (marker_of(line.event, line.t_s, 0, line.fields()) for line in lines)
            expected[session] = [marker.text for marker in journalled if marker is not None]
    report = []
    for name, stream in own_streams:
        try:
            stream_report = (
                _check_markers(file, stream, expected, findings)
                if name == MARKERS
                else _check_samples(file, stream, findings)
            )
            report += [*stream_report, f"clock of '{name}': {_clock_drift(stream)}"]
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            reason = f"{type(error).__name__}: {error}"
            raise StoreError(
                f"{file} contains a damaged stream '{name}' ({reason}): restore it from a backup"
            ) from error
    markers = [text for name, stream in own_streams if name == MARKERS for text in _texts(stream)]
    sent = {text for texts in expected.values() for text in texts}
    if any(name == MARKERS for name, _ in own_streams) and sent.isdisjoint(markers):
        findings.errors += (Finding(file.name, "it does not contain markers from this study's sessions"),)
    return report


_TARGET_MARKER: Final = '{"event":"target_reached",'
"""Beginning of the marker of a reached target, for which the journal has no line while measures are sealed."""


def _read_streams(file: Path) -> list[Any]:
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
    if not texts:  # for example if the program was killed before its session
        yield "markers: none recorded"
        return
    known = Counter(text for texts in expected.values() for text in texts)
    unknown = sum(text not in known and not text.startswith(_TARGET_MARKER) for text in texts)
    for session, all_sent in expected.items():
        sent = [text for text in all_sent if known[text] == 1]  # all sessions begin with the same text
        unique = set(sent)
        indices = {text: index for index, text in enumerate(texts) if text in unique}
        known_numbers = [number for number, text in enumerate(sent) if text in indices]
        name = f"{session.path.parent.name}/{session.path.name}"
        if not known_numbers:
            continue
        first, last = known_numbers[0], known_numbers[-1]
        if lost := [text for text in sent[first : last + 1] if text not in indices]:
            message = f"{file.name} does not contain {counted(len(lost), 'marker')} recorded in the journal"
            findings.error(session.path, f"{message}; the first: {lost[0]}")
        span = texts[min(indices.values()) : max(indices.values()) + 1]
        if added := [text for text in span if text not in known and not text.startswith(_TARGET_MARKER)]:
            message = f"{counted(len(added), 'marker')} not recorded in the journal, starting with {added[0]}"
            reason = "either the journal was changed, or another program sent markers"
            findings.error(session.path, f"{file.name} contains {message}: {reason}")
            unknown -= len(added)
        if outside_count := len(sent) - 1 - (last - first):
            where = f"{first} before the recording and {len(sent) - 1 - last} after it"
            findings.warning(
                session.path,
                f"{outside_count} of the {len(sent)} markers fall outside the recording {file.name}: {where}",
            )
        counts = f"{len(known_numbers)} of {len(sent)} recorded, {len(lost)} lost"
        yield f"markers from {name}: {counts}; times agree within {_max_time_error_ms(session, stream, indices):.2g} ms"
    if unknown:
        findings.warnings += (
            Finding(file.name, f"contains {counted(unknown, 'marker')} from outside this study's sessions"),
        )


def _texts(stream: Mapping[str, Any]) -> list[str]:
    return [row[0] for row in stream["time_series"]]


def _max_time_error_ms(session: SessionFolder, stream: Mapping[str, Any], indices: Mapping[str, int]) -> float:
    """Return the largest deviation of marker stamps from journal times [ms].

    The median deviation since each start of the program, the offset between the clocks, is subtracted.
    """
    segments: list[list[float]] = [[]]
    for line in journal.read(session.journal):
        marker = marker_of(line.event, line.t_s, 0, line.fields())
        if line.event == "session_resumed":
            segments.append([])
        if marker is not None and marker.text in indices:
            segments[-1].append(float(stream["time_stamps"][indices[marker.text]]) - line.t_s)
    return max(1e3 * float(np.abs(np.array(segment) - np.median(segment)).max()) for segment in segments if segment)


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
    late_s = intervals_s[(steps == 1) & (intervals_s > _LATE_PERIODS / float(stream["info"]["nominal_srate"][0]))]
    worst = f", at most {1e3 * late_s.max():.3g} ms between two ticks" if len(late_s) else ""
    yield f"samples: {len(stamps_s)} recorded, {lost} lost, {len(late_s)} late{worst}"


def _clock_drift(stream: Mapping[str, Any]) -> str:
    """Return a text on the drift of a stream's clock against the recorder's, fitted between resets of a clock."""
    times_s, values_s = (np.asarray(stream.get(name, ()), float) for name in ("clock_times", "clock_values"))
    if len(times_s) < 2:
        return f"{counted(len(times_s), 'offset')} measured, too few to estimate the drift"
    resets = np.flatnonzero((np.diff(times_s) < 0) | (np.abs(np.diff(values_s)) > _MIN_RESET_S)) + 1
    segments = zip(np.split(times_s, resets), np.split(values_s, resets), strict=True)
    texts = []
    for t_s, v_s in segments:
        slope, residual_s = _fit_line(t_s, v_s)
        if math.isfinite(slope):
            span = f"over {np.ptp(t_s):.0f} s, with offsets within {1e3 * residual_s:.2g} ms of a straight line"
            texts.append(f"drift {1e6 * slope:+.2g} ppm {span}")
    return "; ".join([counted(len(resets), "reset"), *texts])


def _fit_line(t_s: NDArray[np.float64], v_s: NDArray[np.float64]) -> tuple[float, float]:
    """Return slope and largest residual of a line through offsets; the slope is NaN for fewer than three."""
    if len(t_s) < 3 or np.ptp(t_s) == 0:
        return math.nan, math.nan
    slope, start_s = np.polyfit(t_s - t_s[0], v_s, 1)
    return float(slope), float(np.abs(v_s - start_s - slope * (t_s - t_s[0])).max())
