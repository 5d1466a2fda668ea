"""Rates as a table for people (Markdown) and one for programs (CSV)."""

from __future__ import annotations

from collections.abc import Sequence

from study_app.store.tables.csv_files import csv_text_of
from study_app.validation.report_rates.rates import Rate


def markdown(rates: Sequence[Rate]) -> str:
    """Return the rates, each with its Wilson interval and whether its limit holds."""
    lines = ["| studies | n | what happened | share | 95 % interval | of | limit | holds |", "|---" * 8 + "|"]
    for rate in sorted(rates, key=lambda one: (one.cell, one.what, one.participants)):
        low, high = (f"{100 * end:.1f}" for end in rate.interval)
        lines.append(
            f"| {rate.cell} | {rate.participants} | {rate.what} | {100 * rate.share:.1f} % | {low} to {high} % | "
            f"{rate.studies} | {rate.limit} | {rate.holds} |"
        )
    return "\n".join(lines) + "\n"


def table(rates: Sequence[Rate]) -> bytes:
    """Return the rates as CSV, a row each."""
    rows: list[list[object]] = [
        ["studies", "participants", "what", "limit", "hits", "of", "share", "low", "high", "holds"]
    ]
    for one in rates:
        share = (f"{number:.6f}" for number in (one.share, *one.interval))
        rows.append([one.cell, one.participants, one.what, one.limit, one.hits, one.studies, *share, one.holds])
    return csv_text_of(rows).encode()
