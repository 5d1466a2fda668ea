"""The power of a study written out: tables and figures."""

from pathlib import Path

from study_app import figure_style as style
from study_app.analysis.power import power_figure
from study_app.analysis.power.power_curves import Powers
from study_app.analysis.power.power_tables import power_csv, power_markdown
from study_app.store.output_files import write_files


def write(found: Powers, to: Path) -> tuple[Path, ...]:
    """Write tables (CSV, Markdown) and a figure a block (PNG, SVG, PDF) into ``to``; return the files.

    Raises
    ------
    AnalysisError
        ``to`` cannot be written; nothing was.
    """
    files = {"power.md": power_markdown(found).encode(), "power.csv": power_csv(found)}
    for block in found.plan.blocks:
        title = f"{found.plan.name}: power of {block.title}"
        for form in style.FORMATS:
            drawn = power_figure.draw(found, block, style.fonts_for(form)).figure
            files[f"power-{block.id}.{form}"] = style.file_bytes(drawn, form, title)
    return write_files(Path(to), files)
