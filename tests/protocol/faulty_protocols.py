"""What goes wrong with the small sound protocol: edits of its text and the problems they cause."""

from typing import NamedTuple

from tests.protocol.sound import DECIDED, ORDER, SOUND

MORE_ITEMS = """\
[questionnaires.more]
intro = { en = "How much?", nl = "Hoeveel?" }
scale = "agreement"
[[questionnaires.more.items]]
id = "cold"
text = { en = "Icy.", nl = "IJzig." }
short = { en = "Icy", nl = "IJzig" }

"""


MANY_LIQUIDS = (
    "".join(f"[liquids.extra_{number}]\ndensity_kg_m3 = {900 + number}\n" for number in range(9))
    + "[conditions.crowd]\n"
    + f"liquids = {[f'extra_{number}' for number in range(9)]}\n".replace("'", '"')
)


class Expected(NamedTuple):
    """A problem: text of the line it must point at (None: no line), its place, words of its sentence and hint."""

    at: str | None
    place: str
    words: str


class Case(NamedTuple):
    """Edits (old, new; each old text occurs once) and the problems, all of them, in the order of their lines."""

    name: str
    edits: tuple[tuple[str, str], ...]
    expected: tuple[Expected, ...]

    @property
    def text(self) -> str:
        text = SOUND
        for old, new in self.edits:
            assert text.count(old) == 1, f"{self.name}: {old!r} is there {text.count(old)} times"
            text = text.replace(old, new)
        return text


def case(name: str, old: str, new: str, *expected: tuple[str | None, str, str]) -> Case:
    return Case(name, ((old, new),), tuple(Expected(*one) for one in expected))


LOOK_DIFFERS = ('conditions = ["on_time", "both"]', "blocks.look.conditions", "differ in liquid and in delay")


CASES = (
    # keys
    case("unknown key", "rate_hz = 1000", "rate = 1000", ("rate = 1000", "device.rate", 'did you mean "rate_hz"?')),
    case(
        "unknown key of a block",
        'order = "shuffled"\nrepetitions',
        'ordre = "shuffled"\nrepetitions',
        ("ordre", "blocks.feel.ordre", 'unknown key (did you mean "order"?)'),
    ),
    case(
        "unknown key of an item",
        'short = { en = "Cold", nl = "Koud" }',
        'short = { en = "Cold", nl = "Koud" }\nrequierd = true',
        ("requierd", "questionnaires.short.items.2.requierd", 'did you mean "required"?'),
    ),
    case(
        "unknown key of one kind of task",
        "dwell_s = 0.5",
        "dwel_s = 0.5",
        ("[tasks.reach]", "tasks.reach.dwell_s", "is missing"),
        ("dwel_s", "tasks.reach.dwel_s", 'did you mean "dwell_s"?'),
    ),
    case(
        "key of another kind of task",
        "min_s = 3",
        "dwell_s = 3",
        ("[tasks.explore]", "tasks.explore.min_s", "is missing"),
        ("dwell_s = 3", "tasks.explore.dwell_s", "unknown key (known: instruction, kind, max_s, min_s)"),
    ),
    case(
        "unknown key in an inline table",
        "exponent = 0.5 }",
        "exponnent = 0.5 }",
        ("wake = {", "liquids.thin.wake.exponnent", 'did you mean "exponent"?'),
    ),
    case("unknown table", "[scene]", "[scenery]", ("[scenery]", "scenery", 'did you mean "scene"?')),
    case("missing key", 'version = "1.0"\n', "", ("[study]", "study.version", "is missing")),
    case("missing format", "format = 1\n", "", (None, "format", "is missing")),
    case("later format", "format = 1", "format = 3", ("format", "format", "is 3, this program reads formats 1 to 2")),
    case("wrong format", "format = 1", "format = 0", ("format", "format", "0 is not 1")),
    # values
    case("text for a number", "rate_hz = 1000", 'rate_hz = "fast"', ("fast", "device.rate_hz", 'a number, not "fast"')),
    case("number for a text", 'version = "1.0"', "version = 1.0", ("version", "study.version", "a string, not 1")),
    case("truth for a number", "scale = 10", "scale = true", ("scale = true", "scene.scale", "a number, not true")),
    case("fraction of a count", "count = 4", "count = 4.5", ("count = 4.5", "tasks.reach.count", "a whole number")),
    case("not a number", "scale = 10", "scale = nan", ("scale = nan", "scene.scale", "a finite number")),
    case("table for a list", 'sequence = ["hello", "warm_up", "feel", "look"]', "sequence = {}",
         ("sequence", "sequence", "must be an array, not a table")),
    case("value for a table", "wake = { length = 100, scaling = 200, exponent = 0.5 }", "wake = 3",
         ("wake = 3", "liquids.thin.wake", "must be a table, not 3")),
    case("force limit", "force_limit_n = 8", "force_limit_n = 9",
         ("force_limit_n", "device.force_limit_n", "is 9, must be at most 8")),
    case("no force", "force_limit_n = 8", "force_limit_n = 0",
         ("force_limit_n", "device.force_limit_n", "is 0, must be at least 0.1")),
    case("density", "density_kg_m3 = 1400", "density_kg_m3 = -1",
         ("density_kg_m3 = -1", "liquids.thick.density_kg_m3", "is -1, must be at least 0.01 (hydrogen has")),
    case("word not permitted", 'order = "shuffled"\nrepetitions', 'order = "shufled"\nrepetitions',
         ("shufled", "blocks.feel.order", '"williams" or "latin" (did you mean "shuffled"?)')),
    case("unknown kind of task", 'kind = "explore"', 'kind = "wander"',
         ('kind = "wander"', "tasks.explore.kind", '"wander" is not one of "explore", "reach"')),
    case("task without kind", 'kind = "explore"\n', "", ("[tasks.explore]", "tasks.explore.kind", "is missing")),
    case("unknown effect", 'effects = ["drag", "wake"]', 'effects = ["drag", "wave"]',
         ("effects", "liquids.thin.effects.2", 'did you mean "wake"?')),
    case("name of the study", 'name = "small"', 'name = "a_small"',
         ("a_small", "study.name", "small letters and digits, a letter first, no underscore")),
    case("long name of the study", 'name = "small"', f'name = "{"a" * 41}"',
         ("name = \"aaa", "study.name", "is longer than 40 characters")),
    case("list for tables", "[scales.agreement]", "[[scales]]",
         ("[[scales]]", "scales", "must be a table, not an array"),
         ('scale = "agreement"', "questionnaires.short.scale", 'there is no scale "agreement"')),
    case("name of a table", "[conditions.is_thick]", "[conditions.isThick]",
         ("[conditions.isThick]", "conditions.isThick", "small letters, digits and underscores"),
         ("is_thick", "blocks.feel.conditions.2", 'there is no condition "is_thick"')),
    case("too few labels", 'labels.nl = ["h", "i", "j", "k", "l", "m", "n"]', 'labels.nl = ["h", "i"]',
         ("labels.nl", "scales.agreement.labels.nl", "has 2 entries, needs at least 7")),
    case("too many labels", 'labels.nl = ["h",', 'labels.nl = ["h", "z",',
         ("labels.nl", "scales.agreement.labels.nl", "has 8 entries, more than 7")),
    case("flat target", "    [-30, 0, 0],\n", "    [-30, 0],\n",
         ("[-30, 0]", "tasks.reach.targets_mm.1.3", "entry 3 is missing")),
    case("single target", "    [-30, 0, 0],\n", "", ("targets_mm", "tasks.reach.targets_mm", "has 1 entries, needs")),
    case("empty text", 'en = "Read this."', 'en = "  "', ("[pages.hello.body]", "pages.hello.body", "text is empty")),
    case("text of the wrong type", 'title = { en = "Small", nl = "Klein" }', "title = 3",
         ("title = 3", "study.title", "one string per language")),
    # what one table can tell
    case("wake outruns the body", "length = 100", "length = 300",
         ("wake = {", "liquids.thin.wake", "length 300 exceeds scaling 200")),
    case("wake called for but missing", "wake = { length = 100, scaling = 200, exponent = 0.5 }\n", "",
         ("[liquids.thin]", "liquids.thin", 'the effect "wake" is selected')),
    case("least after most", "min_s = 3", "min_s = 30",
         ("min_s = 30", "tasks.explore.min_s", "min_s = 30 is more than max_s = 9")),
    case("two ends of a task", "count = 4", "count = 4\nduration_s = 20",
         ("count = 4", "tasks.reach.count", "either count or duration_s")),
    case("no end of a task", "count = 4\n", "", ("[tasks.reach]", "tasks.reach.count", "either count or duration_s")),
    case("longer than the timeout", "count = 4", "duration_s = 70",
         ("duration_s", "tasks.reach.duration_s", "70 is longer than timeout_s = 60")),
    case("targets on each other", "[30, 0, 0]", "[-24, 0, 0]",
         ("targets_mm", "tasks.reach.targets_mm", "target 1 and the next are 6 mm apart and overlap")),
    case("liquid and liquids", "delay_ms = 120", 'liquid = "thin"',
         ('liquid = "thin"\n\n[conditions.apart]', "conditions.both.liquid", "either liquid or liquids")),
    case("no workspace", "[100, 60, 60]", "[100, 60, 0]",
         ("workspace_mm", "device.workspace_mm", "from 10 to 1000 mm")),
    case("main block without codes", 'code_prefix = "L"\n', "",
         ("[blocks.feel]", "blocks.feel.code_prefix", "a main block needs a code_prefix")),
    case("main block without part", "part = 1\n", "",
         ("[blocks.feel]", "blocks.feel.part", "a main block needs a part")),
    case("practice with codes", 'phase = "practice"', 'phase = "practice"\ncode_prefix = "P"',
         ('code_prefix = "P"', "blocks.warm_up.code_prefix", "a practice block is not blinded")),
    case("practice in two conditions", 'conditions = ["apart"]', 'conditions = ["apart", "both"]',
         ('"apart", "both"', "blocks.warm_up.conditions", "has one condition, this one 2")),
    # orders and breaks
    case("constraint nowhere", ORDER, 'order = "constrained"\nrepetitions = 2',
         ('order = "constrained"', "blocks.feel.order", '"constrained" needs max_repeats, min_distance or both')),
    case("nothing to constrain", ORDER, 'order = "constrained"\nmax_repeats = 1',
         ("[blocks.feel]", "blocks.feel.repetitions", 'is 1: every condition comes once and none can come again')),
    case("constraint of no order", ORDER, 'order = "constrained"\nmin_distance = 3\nrepetitions = 2',
         ("min_distance = 3", "blocks.feel.min_distance", "is 3, but with 2 conditions only 1 to 2 is possible")),
    case("constraint of one condition",
         'conditions = ["apart"]', 'conditions = ["apart"]\norder = "constrained"\nmax_repeats = 2\nrepetitions = 5',
         ("max_repeats = 2", "blocks.warm_up.max_repeats",
          "is 2, but with one condition 5 times only 5 or more is possible")),
    case("no such distance", ORDER, 'order = "constrained"\nmin_distance = 0\nrepetitions = 2',
         ("min_distance = 0", "blocks.feel.min_distance", "is 0, must be at least 1")),
    case("constraint of another order", ORDER, ORDER + "\nmax_repeats = 2",
         ("max_repeats = 2", "blocks.feel.max_repeats", 'belongs to order = "constrained", this is "shuffled"')),
    case("breaks without page", ORDER, ORDER + "\nbreak_every = 2",
         ("[blocks.feel]", "blocks.feel.break_page", "is missing: break_every and break_page need each other")),
    case("page without breaks", ORDER, ORDER + '\nbreak_page = "hello"',
         ("[blocks.feel]", "blocks.feel.break_every", "is missing: break_every and break_page need each other")),
    case("no break would come", ORDER, ORDER + '\nbreak_every = 4\nbreak_page = "hello"',
         ("break_every = 4", "blocks.feel.break_every", "is 4, and the block has 4 trials: no break would come")),
    case("unknown page of breaks", ORDER, ORDER + '\nbreak_every = 2\nbreak_page = "hallo"',
         ("break_page", "blocks.feel.break_page", 'there is no page "hallo" (did you mean "hello"?)')),
    case("break on another kind of page", ORDER, ORDER + '\nbreak_every = 2\nbreak_page = "hello"',
         ("break_page", "blocks.feel.break_page",
          'page "hello" is of kind "consent" (a break needs a page with kind = "break")')),
    # names
    case("unknown liquid", 'liquid = "thick"', 'liquid = "thik"',
         ("thik", "conditions.is_thick.liquid", 'no liquid "thik" (did you mean "thick"?)')),
    case("unknown liquid in a list", '["thin", "thick"]', '["thin", "tick"]',
         ("tick", "conditions.both.liquids.2", 'no liquid "tick"'),
         LOOK_DIFFERS),
    case("unknown condition", 'conditions = ["on_time", "both"]', 'conditions = ["is_thin", "booth"]',
         ("booth", "blocks.look.conditions.2", 'no condition "booth" (did you mean "both"?)')),
    case("unknown task", 'task = "reach"', 'task = "search"', ("search", "blocks.look.task", 'no task "search"')),
    case("unknown questionnaire", 'task = "reach"\nquestionnaire = "short"', 'task = "reach"\nquestionnaire = "shirt"',
         ("shirt", "blocks.look.questionnaire", 'did you mean "short"?')),
    case("unknown scale", 'scale = "agreement"', 'scale = "likert"',
         ("likert", "questionnaires.short.scale", 'no scale "likert" (known: agreement)')),
    case("unknown step", '"feel", "look"]', '"feel", "loop", "look"]',
         ("sequence", "sequence.4", 'no page or block "loop" (did you mean "look"?)')),
    case("block left out", '"feel", "look"]', '"feel"]', ("[blocks.look]", "blocks.look", "comes nowhere in sequence")),
    case("page left out", '["hello", ', "[", ("[pages.hello]", "pages.hello", "comes nowhere in sequence")),
    case("block twice", '"feel", "look"]', '"feel", "look", "feel"]',
         ("sequence", "sequence.5", 'block "feel" comes twice')),
    case("condition twice", '["is_thin", "is_thick"]', '["is_thin", "is_thin"]',
         ('"is_thin", "is_thin"', "blocks.feel.conditions.2", '"is_thin" is listed twice')),
    case("liquid twice", '["thin", "thick"]', '["thin", "thin"]',
         ('liquids = ["thin", "thin"]', "conditions.both.liquids.2", "twice"),
         LOOK_DIFFERS),
    case("item twice", 'id = "cold"', 'id = "warm"',
         ('id = "warm"\ntext = { en = "It is cold', "questionnaires.short.items.2.id", 'a second item "warm"')),
    case("item without id", 'id = "cold"\n', "",
         ('[[questionnaires.short.items]]\ntext', "questionnaires.short.items.2.id", "is missing")),
    case("item with two texts", "[pages.hello]", MORE_ITEMS + "[pages.hello]",
         ('id = "cold"\ntext = { en = "Icy', "questionnaires.more.items.1.id", 'item "cold" has another text')),
    case("page named like a block", "[pages.hello.body]", "[pages.feel]\nkind = 3\n[pages.hello.body]",
         ("[pages.feel]", "pages.feel.title", "is missing"),
         ("[pages.feel]", "pages.feel.body", "is missing"),
         ("kind = 3", "pages.feel.kind", '3 is not "consent"'),
         ("[blocks.feel]", "blocks.feel", "a page has this name too")),
    # languages
    case("no languages", 'languages = ["en", "nl"]', "languages = []",
         ("languages", "study.languages", "has 0 entries, needs at least 1")),
    case("language twice", 'languages = ["en", "nl"]', 'languages = ["en", "nl", "nl"]',
         ("languages", "study.languages.3", '"nl" is listed twice')),
    case("text in one language", 'short = { en = "Cold", nl = "Koud" }', 'short = "Cold"',
         ('short = "Cold"', "questionnaires.short.items.2.short", 'write { en = "…", nl = "…" }')),
    case("text not translated", ', nl = "Beweeg." }', " }",
         ('instruction = { en = "Move." }', "tasks.explore.instruction", 'is missing in Dutch')),
    case("labels not translated", 'labels.nl = ["h", "i", "j", "k", "l", "m", "n"]\n', "",
         ("labels.en", "scales.agreement.labels", 'is missing in Dutch')),
    case("text in a language too many", 'nl = "Lees dit."', 'nl = "Lees dit."\nde = "Lies das."',
         ("Lies das", "pages.hello.body.de", "not a language of the study")),
    case("language that is no code", 'nl = "Lees dit."', 'nl = "Lees dit."\nDutch = "Lees dit."',
         ("Dutch", "pages.hello.body.Dutch", "not a language of the study")),
    # between tables
    case("too many liquids", "[conditions.is_thin]", MANY_LIQUIDS + "[conditions.is_thin]",
         ('liquids = ["extra_0"', "conditions.crowd.liquids", "has 9 liquids")),
    case("target outside", "[30, 0, 0]", "[46, 0, 0]",
         ("[46, 0, 0]", "tasks.reach.targets_mm.2", "x = 46 mm with radius 6 mm leaves the tank")),
    case("codes of two blocks", 'code_prefix = "D"', 'code_prefix = "L"',
         ('code_prefix = "L"\nconditions = ["on_time", "both"]', "blocks.look.code_prefix",
          'block "feel" has the prefix "L" too')),
    case("liquid and delay vary", 'conditions = ["on_time", "both"]', 'conditions = ["is_thin", "both"]',
         ('conditions = ["is_thin", "both"]', "blocks.look.conditions", "differ in liquid and in delay")),
    case("delays that compare liquids", 'code_prefix = "D"', 'compares = "liquids"\ncode_prefix = "D"',
         ("compares", "blocks.look.compares", 'is "liquids", and its conditions differ in delays')),
    case("liquids that compare delays", 'code_prefix = "L"', 'compares = "delays"\ncode_prefix = "L"',
         ("compares", "blocks.feel.compares", 'is "delays", and its conditions differ in liquids')),
    case("practice that compares", 'conditions = ["apart"]', 'compares = "liquids"\nconditions = ["apart"]',
         ("compares", "blocks.warm_up.compares", "a practice block compares nothing")),
    case("part left out", "part = 2", "part = 3", ("part = 3", "blocks.look.part", "is 3, must be 1 or 2")),
    case("first part", "part = 1", "part = 2",
         ('part = 2\ntitle = { en = "Feeling"', "blocks.feel.part", "is 2, must be 1")),
    # what was decided about the analysis
    case("unknown item of the analysis", "[pages.hello]", DECIDED.replace('rising = ["warm"]', 'rising = ["worm"]') +
         "[pages.hello]", ("rising", "analysis.rising.1", 'there is no item "worm" (did you mean "warm"?)')),
    case("unknown item of noticing", "[pages.hello]", DECIDED.replace('noticed = "cold"', 'noticed = "late"') +
         "[pages.hello]", ("noticed", "analysis.noticed", 'there is no item "late"')),
    case("item that rises and falls", "[pages.hello]", DECIDED.replace("noticed", 'falling = ["warm"]\nnoticed') +
         "[pages.hello]", ("rising", "analysis.rising.1", '"warm" is expected to fall too')),
    case("item decided twice", "[pages.hello]", DECIDED.replace('["warm"]', '["warm", "warm"]') + "[pages.hello]",
         ("rising", "analysis.rising.2", '"warm" is listed twice')),
    case("label of no name", "delay_ms = 120", 'delay_ms = 120\nlabel = "cold"',
         ('label = "cold"', "conditions.both.label", '"cold" is not among analysis.names')),
    case("bound of nothing", "[pages.hello]", DECIDED.replace("names", "equivalence_bound = 0\nnames") +
         "[pages.hello]", ("equivalence_bound", "analysis.equivalence_bound", "is 0, must be at least 0.05")),
    # several at once
    Case(
        "all at once",
        (
            ("rate_hz = 1000", "rate_hz = 10"),
            ("density_kg_m3 = 1400", 'density_kg_m3 = "heavy"'),
            ("[30, 0, 0]", "[30, 40, 0]"),
            ("id = \"cold\"", "id = \"Cold\""),
            ('title = { en = "Hello", nl = "Hallo" }', 'title = { en = "Hello" }'),
            ('order = "shuffled"\nrepetitions = 2\ntask = "explore"', 'order = 3\nrepetitions = 2\ntask = "exlore"'),
        ),
        (
            Expected("rate_hz", "device.rate_hz", "is 10, must be at least 250"),
            Expected("heavy", "liquids.thick.density_kg_m3", "must be a number"),
            Expected("Cold\"\ntext", "questionnaires.short.items.2.id", '"Cold" is not permitted'),
            Expected('title = { en = "Hello" }', "pages.hello.title", 'is missing in Dutch'),
            Expected("order = 3", "blocks.feel.order", "3 is not"),
            Expected("exlore", "blocks.feel.task", 'did you mean "explore"?'),
        ),
    ),
)  # fmt: skip


BROKEN = (
    ("unclosed string", SOUND.replace('"small"', '"small'), 5, "column"),
    ("key twice", SOUND.replace("scale = 10", "scale = 10\nscale = 11"), 17, "column 11: Cannot overwrite a value"),
    ("table twice", SOUND.replace("[liquids.other]", "[liquids.thick]"), 26, "column"),
    ("no value", SOUND.replace("scale = 10", "scale ="), 16, "column 8: Invalid value"),
    ("cut off", SOUND.rstrip() + "\nlast = [1,", SOUND.count("\n") + 1, "column"),
)
