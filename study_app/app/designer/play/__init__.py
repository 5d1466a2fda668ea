"""Playing the study that is edited, from a step on."""
