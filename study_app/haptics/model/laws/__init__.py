"""Laws of drag and of flow: published formulas, without a scene."""
