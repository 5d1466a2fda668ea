"""Studies as people write them: every notation of TOML that a protocol can have, with comments everywhere."""

from pathlib import Path
from typing import Final

PROTOCOLS: Final = Path(__file__).parents[3] / "protocols"

GROWN: Final = '''\
# A study that grew.
# Its first comment ends here.

format = 2 # which format

study . name = "grown"   # dotted, with blanks
study."version" = '1.0'  # a literal string

# about languages
study.languages = ["en", "nl"]

# free, at the root

[conditions.water]  # behind a header
liquid = "water"
delay_ms   =   0    # aligned

# --- A ruler ----------------------------------------------------
# right above honey's header
[liquids.honey]
# above a key
density_kg_m3 = 1_420    # behind
drag = { law = "linear", "damping_nspm" = 8 } # inline
# the last line of the section

# free, between blank lines

  [conditions.honey] # indented
  liquid = "honey"
  delay_ms = 50.0
[liquids.water]
density_kg_m3 = 1e3
effects = [ # behind the bracket
    "drag", # the first
    # above the second
    "wake"  # the last, without a comma
    # nothing follows
]
wake.length = 1700
wake.scaling = 1700 # dotted in a table

[liquids.water.body]

[liquids."odd name"]
density_kg_m3 = 900

[scales.agreement]
# Names of the points.
labels.en = [
    "No", 'Yes', # two on a line
    "Both",
]
labels.nl = ["Nee", "Ja", "Allebei"]

[[questionnaires.liquid.items]] # the first item
id = "thick"
text = { en = "Thick?", nl = "Dik?" } # both
# the options
options = [{ id = "a", text = "A" }, { id = "b", text = "B" }]

# belongs to the second item
[[questionnaires.liquid.items]]
id = "cold"
text.en = """
# not a comment
Cold?"""
text.nl = \'\'\'
[not.a.header]
# not a comment either\'\'\'
[questionnaires.liquid.items.show_if] # of the second
item = "thick"
is = [1, [2, 3], { x = 1 }]

[[questionnaires.liquid.items]]
id = "last"

[questionnaires.liquid]
intro = "Rate."

# --- Pages ------
[pages.a]
body = """
One "quoted" line.

Another \\u00e9."""
kind = "break"'''


def texts() -> dict[str, str]:
    """Return every protocol of the repository and the grown study, also with other line ends, by name."""
    protocols = {path.stem: path.read_bytes().decode() for path in sorted(PROTOCOLS.glob("*.toml"))}
    protocols |= {"grown": GROWN, "grown with a last line break": GROWN + "\n"}
    windows = {f"{name}, \\r\\n": protocols[name].replace("\n", "\r\n") for name in ("grown", "demo", "delaydetect")}
    return protocols | windows | {"empty": "", "one comment": "# nothing yet", "one key": "format = 2"}
