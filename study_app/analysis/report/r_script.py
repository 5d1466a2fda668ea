"""The report's R script: a fixed program after the study's hypotheses, with the data that each of them compares."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib import resources
from typing import Final

from study_app.analysis.data.blocks import Block
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export.table_files import credit_lines
from study_app.analysis.results import ContrastResult, Results

_LEVEL_TABLES: Final = {"exponent": "exponents", "d_prime": "thresholds", "pse": "settings"}
"""The exported table of each measure of levels that weights all participants equally."""


def r_script(study: Study, results: Results) -> str:
    """Return the R script, which reads the exported tables and tests.csv."""
    script = resources.files("study_app.analysis.report").joinpath("templates", "report.R").read_text("utf-8")
    hypotheses = ",".join(f"\n  {_hypothesis_in_r(study, result)}" for result in results.contrasts)
    return (
        "".join(f"# {line}\n" for line in credit_lines(study))
        + f"sealed <- {'FALSE' if study.revealed else 'TRUE'}  # the key\n"
        + f"hypotheses <- list({hypotheses})  # in the order of tests.csv\n{script}"
    )


def _hypothesis_in_r(study: Study, result: ContrastResult) -> str:
    """Return a hypothesis as a list in R: table, measure, blocks and codes of each side, groups and effect size."""
    contrast = result.contrast
    sides = list(zip(contrast.blocks * 2, contrast.conditions or (None, None), strict=False))
    sides = sides[: 1 if contrast.within is None else 2]
    statement_blocks = {
        block.id: block for block in study.blocks if contrast.form is None and contrast.measure in _items(block)
    }
    question_settings = {
        question.where.id: [(setting.condition, setting.code) for setting in question.where.settings]
        for question in study.others.questions
        if question.id == contrast.measure and question.where.id in (contrast.form or contrast.blocks)
    }
    table, codes, skipped = "responses", [""] * len(sides), ""
    if contrast.is_of_levels:
        table = _LEVEL_TABLES.get(contrast.measure, "")
        skipped = "" if table else "thresholds are weighted by their precision"
    elif statement_blocks:
        codes = [_codes_of_statement(statement_blocks[block], condition) for block, condition in sides]
    elif not question_settings:
        skipped = "scores are computed from several answers"
    elif contrast.form is None:
        codes = [
            " ".join(code for of, code in question_settings[block] if condition in (None, of))
            for block, condition in sides
        ]
    fields = {
        "table": json.dumps(table),
        "measure": json.dumps(contrast.measure),
        "form": "NA" if contrast.form is None else json.dumps(contrast.form),
        "repeated": "median" if statement_blocks else "mean",
        "blocks": _vector(block for block, _ in sides),
        "codes": _vector(codes),
        "groups": _vector(contrast.groups or ()),
        "standardised": "NA" if result.standardised is None else repr(result.standardised.value),
        "skipped": json.dumps(skipped),
    }
    return f"list({', '.join(f'{name} = {value}' for name, value in fields.items())})"


def _items(block: Block) -> set[str]:
    return {item.id for item in block.items}


def _codes_of_statement(block: Block, condition: str | None) -> str:
    """Return the codes of a condition, or of all settings, as in tests.csv: "D1+D4 D2" if two have the same delay."""
    columns: dict[int, list[str]] = {}
    for setting in block.settings:
        if condition in (None, setting.condition):
            columns.setdefault(block.columns[setting.code], []).append(setting.code)
    return " ".join("+".join(codes) for _, codes in sorted(columns.items()))


def _vector(texts: Iterable[str]) -> str:
    """Return texts as an R vector."""
    return f"c({', '.join(json.dumps(text, ensure_ascii=False) for text in texts)})"
