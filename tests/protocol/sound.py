"""A small sound protocol, and variants of it."""

from tests.protocol.edited_studies import text_of

SOUND = text_of("sound")
ORDER = 'order = "shuffled"\nrepetitions = 2'
EVERY_ORDER = (
    SOUND.replace(ORDER, 'order = "constrained"\nmax_repeats = 1\nmin_distance = 2\nrepetitions = 3\nBREAKS')
    .replace("BREAKS", 'break_every = 2\nbreak_page = "rest"')
    .replace(
        "[blocks.warm_up]",
        """\
[pages.rest]
kind = "break"
title = { en = "Rest", nl = "Rust" }
body = { en = "Let go.", nl = "Laat los." }

[blocks.warm_up]""",
    )
    .replace('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"')
    .replace('order = "shuffled"\ntask = "reach"', 'order = "williams"\ntask = "reach"')
)
"""The sound protocol with constraints, breaks, assigned rows and items in random order."""
