"""Results folders read into tables: what was asked, sessions and trials, and measures of them."""

from study_app.analysis.data.blocks import Block, Decided, LevelBlock
from study_app.analysis.data.measures import Array
from study_app.analysis.data.study_tables import load_study
from study_app.protocol.model import SPENDINGS

__all__ = ["SPENDINGS", "Array", "Block", "Decided", "LevelBlock", "load_study"]
