"""A small sound protocol, and variants of it."""

SOUND = """\
format = 1
sequence = ["hello", "warm_up", "feel", "look"]

[study]
name = "small"
title = { en = "Small", nl = "Klein" }
version = "1.0"
languages = ["en", "nl"]

[device]
rate_hz = 1000
force_limit_n = 8
workspace_mm = [100, 60, 60]

[scene]
scale = 10

[liquids.thin]
density_kg_m3 = 1000
effects = ["drag", "wake"]
wake = { length = 100, scaling = 200, exponent = 0.5 }

[liquids.thick]
density_kg_m3 = 1400

[liquids.other]
density_kg_m3 = 1200

[conditions.is_thin]
liquid = "thin"

[conditions.is_thick]
liquid = "thick"

[conditions.on_time]
liquids = ["thin","thick"]

[conditions.both]
liquids = ["thin", "thick"]
delay_ms = 120

[conditions.apart]
liquid = "other"

[tasks.explore]
kind = "explore"
min_s = 3
max_s = 9
instruction = { en = "Move.", nl = "Beweeg." }

[tasks.reach]
kind = "reach"
targets_mm = [
    [-30, 0, 0],
    [30, 0, 0],
]
radius_mm = 6
dwell_s = 0.5
count = 4
timeout_s = 60
instruction = { en = "Reach.", nl = "Reik." }

[scales.agreement]
labels.en = ["a", "b", "c", "d", "e", "f", "g"]
labels.nl = ["h", "i", "j", "k", "l", "m", "n"]

[questionnaires.short]
intro = { en = "How much?", nl = "Hoeveel?" }
scale = "agreement"

[[questionnaires.short.items]]
id = "warm"
text = { en = "It is warm.", nl = "Het is warm." }
short = { en = "Warm", nl = "Warm" }

[[questionnaires.short.items]]
id = "cold"
text = { en = "It is cold.", nl = "Het is koud." }
short = { en = "Cold", nl = "Koud" }

[pages.hello]
kind = "consent"
title = { en = "Hello", nl = "Hallo" }
[pages.hello.body]
en = "Read this."
nl = "Lees dit."

[blocks.warm_up]
phase = "practice"
title = { en = "Practice", nl = "Oefenen" }
setting_label = { en = "Practice", nl = "Oefenen" }
conditions = ["apart"]
task = "explore"

[blocks.feel]
part = 1
title = { en = "Feeling", nl = "Voelen" }
setting_label = { en = "Liquid", nl = "Vloeistof" }
code_prefix = "L"
conditions = ["is_thin", "is_thick"]
order = "shuffled"
repetitions = 2
task = "explore"
questionnaire = "short"

[blocks.look]
part = 2
title = { en = "Looking", nl = "Kijken" }
setting_label = { en = "Delay", nl = "Vertraging" }
code_prefix = "D"
conditions = ["on_time", "both"]
order = "shuffled"
task = "reach"
questionnaire = "short"
"""


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


DECIDED = """\
[analysis]
names = ["warm", "cold"]
rising = ["warm"]
noticed = "cold"

"""
