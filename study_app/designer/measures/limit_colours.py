"""The colours of the limits, the same on the axis of the levels and in every plot."""

from study_app.designer.measures.number_cards import Limit
from study_app.gui.theme.theme import Theme


def limit_colour(theme: Theme, limit: Limit) -> str:
    """Return the colour of the force limit ("norm") or of the slope limit."""
    return theme.bad if limit == "slope" else theme.warn
