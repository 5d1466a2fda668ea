"""Results folders read into tables: what was asked, sessions and trials, and measures of them."""

from study_app.analysis.data.blocks import Block, Decided, LevelBlock, Spending
from study_app.analysis.data.measures import Array
from study_app.analysis.data.study_tables import load_study

__all__ = ["Array", "Block", "Decided", "LevelBlock", "Spending", "load_study"]
