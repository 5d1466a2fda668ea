"""Results folders read into tables: what was asked, sessions and trials, and measures of them."""

from study_app.analysis.data.blocks import Block, Decided, LevelBlock
from study_app.analysis.data.measures import Array
from study_app.analysis.data.study_tables import load_study
from study_app.protocol.model import Spending

__all__ = ["Array", "Block", "Decided", "LevelBlock", "Spending", "load_study"]
