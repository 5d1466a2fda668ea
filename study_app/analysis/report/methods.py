"""The methods paragraph of a report: participants, apparatus, design, hypotheses, tests and exclusions."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from pydantic import ValidationError

from study_app import __version__, number_text
from study_app.analysis.contrasts import contrast_methods
from study_app.analysis.data.blocks import Block, PlacedQuestion, name_in_sentence
from study_app.analysis.data.measures import QUARTILES
from study_app.analysis.data.study_tables import DAMAGED, Study, group_assignment, group_counts
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.delays import ContrastsWithControl
from study_app.analysis.findings.statement_tests import DelayTrend, Effects, MeanTests, OverAll
from study_app.analysis.levels.evaluate import level_methods
from study_app.analysis.planned_exclusions import NEED_KEY, proposals, rule_conditions
from study_app.analysis.report.practice_and_breaks import break_sentence, practice_sentences
from study_app.analysis.results import BlockResult, Results, lead_phrase, presentation_sentences
from study_app.analysis.wording import counted, listed, ms, number, significant
from study_app.protocol.blocks import block_titles
from study_app.protocol.model import SPENDINGS
from study_app.protocol.participants import RecordedSessions
from study_app.protocol.quantities import liquid_text
from study_app.protocol.trials import TASK_KINDS
from study_app.protocol.wording import language_name
from study_app.store.unblinding import RULES

_FILTERS: Final = {
    "ewma": "an exponentially weighted moving average of position differences",
    "kalman": "a Kalman filter",
    "raw": "position differences",
}
"""Descriptions of velocity estimators by name; a pooled study may have several."""
_WITHOUT_FORCE: Final = {"mouse", "spacemouse"}
"""Devices without force, listed here because reading results must not load their descriptors."""

_ORDERS: Final = {
    "fixed": "in the same order for all participants",
    "shuffled": "in a random order for each participant",
    "constrained": "in a constrained random order for each participant",
    "williams": "in orders from a Williams design",
    "latin": "in orders from a Latin square",
}
_BLOCK_ORDERS: Final = {
    "fixed": "in the same order for all participants",
    "balanced": "in an order counterbalanced across participants (Williams design)",
    "random": "in a random order for each participant",
}


def methods(study: Study, results: Results) -> str:
    """Return the methods paragraph; each sentence is included only if it applies to the study."""
    return " ".join(sentence for sentence in _all_sentences(study, results) if sentence)


def _all_sentences(study: Study, results: Results) -> Iterator[str]:
    blocks = [block for block in results.blocks if block.n]
    yield _sample_sentence(study)
    yield _session_sentence(study)
    yield _group_sentence(study)
    yield _language_sentence(study)
    yield _sample_size_sentences(study, results)
    yield _exclusion_sentences(study)
    yield _exclusion_rule_sentence(study, results)
    yield _apparatus_sentence(study)
    yield _liquid_sentence(study)
    yield from practice_sentences(study)
    yield from _design_sentences(study, results)
    yield break_sentence(study)
    yield from _delay_sentences(study, results)
    yield from level_methods(study.levels, results.levels)
    yield _missing_trials_sentence(study)
    yield from _form_sentences(study)
    yield from contrast_methods(results)
    if blocks:
        yield from _statement_sentences(study, results, blocks)
    if blocks or results.levels or study.others.questions:
        ran, analysed = (
            f"liquid-study {listed(versions)}" for versions in (study.programs or [__version__], [__version__])
        )
        same = f"The sessions were run and analysed with {ran}."
        yield same if ran == analysed else f"The sessions were run with {ran} and analysed with {analysed}."


def _sample_sentence(study: Study) -> str:
    """Return a sentence on those who took part and, if these differ, on those who were analysed."""
    took_part = study.participants["participant"].nunique()
    people = number_text.capitalised(counted(took_part, "participant"))
    kind = " (SIMULATED, not people)" if study.simulated else ""
    conditions_note = ""
    if study.trial_blocks and study.n:
        is_complete = all(_is_complete(study, block) for block in study.trial_blocks)
        conditions_note = ", each in all conditions" if is_complete else _missing_conditions_phrase(study)
    sites = f" at the sites {listed(study.sites)}" if study.sites else ""
    protocol = f"protocol {study.name}, {version_text(study)}"
    text = f"{people}{kind} took part in “{study.title}” ({protocol}){sites}"
    withdrawn = counted(len(study.withdrawn), "more participant")
    withdrawn_note = f"; {withdrawn} withdrew, and their data were erased" if study.withdrawn else ""
    if took_part == study.n:
        return f"{text}{conditions_note}{withdrawn_note}."
    analysed = f"{counted(study.n, 'participant')} {'was' if study.n == 1 else 'were'}" if study.n else "nobody was"
    reasons = number_text.capitalised(listed(_reasons_for_absence(study)))
    return f"{text}{withdrawn_note}. {reasons}, so {analysed} analysed{conditions_note}."


def _reasons_for_absence(study: Study) -> list[str]:
    """Return clauses on the participants who are not analysed: "two participants were excluded"."""
    rows = study.participants[~study.participants["participant"].isin(study.people)]
    excluded = set(rows.loc[rows["excluded"], "participant"])
    damaged = set(rows.loc[rows["status"] == DAMAGED, "participant"]) - excluded
    unfinished = set(rows["participant"]) - excluded - damaged
    clauses = []
    for people, one, several in (
        (unfinished, "did not complete the session", "did not complete their sessions"),
        (damaged, "has damaged files", "have damaged files"),
        (excluded, "was excluded", "were excluded"),
    ):
        if people:
            clauses.append(f"{counted(len(people), 'participant')} {one if len(people) == 1 else several}")
    return clauses


def _session_sentence(study: Study) -> str:
    """Return a sentence on the number of included sessions per participant; "" if each has one."""
    counts = study.participants.loc[study.participants["counted"], "participant"].value_counts()
    if counts.empty or counts.max() == 1:
        return ""
    minimum, maximum = int(counts.min()), int(counts.max())
    sessions_text = counted(maximum, "session") if minimum == maximum else f"{minimum} to {maximum} sessions"
    return f"Each participant attended {sessions_text}."


def _language_sentence(study: Study) -> str:
    """Return a sentence on the languages of the pages; "" if the study has only one."""
    languages = language_text(study)
    return f"The participants' texts were in {languages}." if languages else ""


def language_text(study: Study) -> str:
    """Return the languages of the participants' pages with counts: "German (n = 5) and English (n = 3)".

    It is "" if the study has only one language.
    """
    if len(study.protocol.get("study", {}).get("languages", ())) < 2:
        return ""
    sessions = study.participants[study.participants["counted"]]
    people = sessions.drop_duplicates(["participant", "language"])["language"].value_counts()
    return listed([f"{language_name(str(code))} (n = {count})" for code, count in people.items()])


def _is_complete(study: Study, block: Block) -> bool:
    """Return whether every included participant was presented with all settings of a block."""
    trials = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
    columns = trials["code"].map(block.columns).groupby(trials["participant"]).nunique()
    return len(columns) == study.n and bool((columns == study.setting_count(block)).all())


def _missing_conditions_phrase(study: Study) -> str:
    """Return a phrase on participants with missing conditions, and whether excluded trials are the cause."""
    incomplete: set[str] = set()
    for block in study.trial_blocks:
        trials = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
        remaining = set(zip(trials["participant"], trials["code"], strict=True))
        excluded = study.excluded_trials(block)
        incomplete |= {
            participant
            for participant, code in zip(excluded["participant"], excluded["code"], strict=True)
            if (participant, code) not in remaining
        }
    if not incomplete:
        return ", but some did not complete all conditions"
    people = counted(len(incomplete), "participant")
    return f"; at least one condition is missing for {people}, because individual trials were excluded"


def _group_sentence(study: Study) -> str:
    """Return a sentence on the assignment to groups and their number; "" without groups."""
    counts, proportions = (
        group_counts(study),
        {name: group["share"] for name, group in study.protocol.get("groups", {}).items()},
    )
    groups = listed([f"{name} (n = {counts.get(name, 0)})" if counts else name for name in proportions])
    match group_assignment(study):
        case "pre-existing":
            return (
                f"Participants were assigned to the groups {groups} by an existing attribute, which was recorded at "
                "the start of the session; the groups were not randomised."
            )
        case "randomised":
            ratio = ":".join(f"{proportion}" for proportion in proportions.values())
            return (
                f"Participants were randomised in permuted blocks to the groups {groups}, with an allocation ratio of "
                f"{ratio}."
            )
    return ""


def _sample_size_sentences(study: Study, results: Results) -> str:
    """Return sentences on the planned sample size, the planned looks, and the current look."""
    decided = results.decided
    if decided.looks:
        levels = listed([significant(level) for level in decided.alphas])
        alpha = significant(decided.planned_alpha or decided.alpha)
        return (
            f"{decided.look_text(len(results.people))} At the planned looks, adjusted p values of up to {levels} are "
            f"significant ({SPENDINGS[decided.spending]} alpha spending with alpha = {alpha}, Lan & DeMets 1983)."
        )
    planned = (study.protocol.get("analysis") or {}).get("participants")
    return "" if planned is None else f"The planned sample size was {counted(planned, 'participant')}."


def _exclusion_sentences(study: Study) -> str:
    """Return sentences on the exclusions, and on whether the key was sealed when they were decided."""
    people, rows = study.people, study.participants
    analysed = replace(study, participants=rows[rows["participant"].isin(people)])
    trials = sum(exclusion.trial is not None and exclusion.participant in people for exclusion in study.exclusions)
    counts = [
        (analysed.left_out, "unfinished session"),
        (analysed.damaged_sessions, "damaged session"),
        (len(analysed.excluded_sessions), "excluded session"),
        (trials, "excluded trial"),
    ]
    parts = [counted(count, noun) for count, noun in counts if count]
    lead = "For the other participants, the" if len(people) < rows["participant"].nunique() else "The"
    sentences = [f"{lead} analysis does not include {listed(parts)}."] if parts else []
    by_rule = Counter(exclusion.rule_or_person for exclusion in study.exclusions)
    sentences += [
        f"{number_text.capitalised(counted(by_rule[rule], 'session'))} "
        f"{'was' if by_rule[rule] == 1 else 'were'} excluded automatically because of {reason}."
        for rule, reason in RULES.items()
        if by_rule[rule]
    ]
    titles_by_limit: dict[float, list[str]] = {}
    for level in study.levels:
        if level.wrong_most is not None:
            titles_by_limit.setdefault(level.wrong_most, []).append(f"“{level.title}”")
    sentences += [
        f"The protocol excludes sessions with more than {100 * most:g} % incorrect answers to the catch trials in "
        f"{listed(titles)}."
        for most, titles in titles_by_limit.items()
    ]
    if study.late:
        sentences.append(
            f"Some decisions about exclusions were made after the key was opened: {late_exclusions(study)}."
        )
    elif study.revealed and any(exclusion.rule_or_person not in RULES for exclusion in study.exclusions):
        sentences.append("All exclusions were decided while the key was sealed.")
    return " ".join(sentences)


def _exclusion_rule_sentence(study: Study, results: Results) -> str:
    """Return a sentence on the planned exclusion rules and the sessions that met them; "" if no rules are planned."""
    conditions = rule_conditions(study)
    if not conditions:
        return ""
    met = len({proposal.what for proposal in proposals(study, results) if proposal.rule in conditions})
    rules = "this rule" if len(conditions) == 1 else "one of these rules"
    is_known = study.revealed or not NEED_KEY & conditions.keys()
    number_met = f"; {counted(met, 'session') if met else 'no session'} met {rules}" if is_known else ""
    return (
        "According to the protocol, a session is considered for exclusion if "
        f"{', or if '.join(conditions.values())}{number_met}."
    )


def late_exclusions(study: Study) -> str:
    """Return a phrase with the numbers of exclusions decided and reversed after the key was opened."""
    decided = sum(exclusion in study.exclusions for exclusion in study.late)
    reversed_count = len(study.late) - decided
    parts = [f"{decided} of {number_text.counted(len(study.exclusions), 'exclusion')}"] if decided else []
    return listed([*parts, *([f"the reversal of {counted(reversed_count, 'exclusion')}"] if reversed_count else [])])


def version_text(study: Study) -> str:
    """Return the protocol versions of the pooled sessions as text."""
    versions = study.versions
    pooled = f"version {versions[0]}" if len(versions) == 1 else f"versions {listed(versions)}, pooled"
    return f"{pooled}, from {study.contents} different files" if study.contents > len(versions) else pooled


def _apparatus_sentence(study: Study) -> str:
    """Return a sentence on devices, forces, ball size and motion, as recorded in receipts."""
    devices = study.participants.loc[study.participants["counted"], "device"].dropna()
    names = sorted({str(name).partition(":")[0] for name in devices} - {"answers-only"})
    device, scene = study.protocol.get("device"), study.protocol.get("scene")
    if not (device and scene and names):
        return ""
    device_text = f"a haptic device ({listed(names)}); forces were computed at {device['rate_hz']:g} Hz and limited to "
    device_text += f"{device['force_limit_n']:g} N"
    if _WITHOUT_FORCE.issuperset(names):
        device_text = f"a device without force feedback ({listed(names)})"
    velocity_note = {None: "", "device": "; its velocity was measured by the device"}.get(
        study.estimator, f"; its velocity was estimated with {_FILTERS.get(study.estimator or '', study.estimator)}"
    )
    return (
        f"Participants used {device_text}. A virtual ball with a diameter of {1000 * scene['body']['diameter_m']:g} "
        f"mm moved {scene['scale']:g} times as far as the hand{velocity_note}."
    )


def _liquid_sentence(study: Study) -> str:
    """Return a sentence on the liquids of the main blocks and their parameters; "" while the key is sealed."""
    settings = [setting for block in study.trial_blocks for setting in block.settings]
    settings += [setting for block in study.levels for setting in (block.reference, *block.settings) if setting]
    settings += [setting for question in study.others.questions for setting in question.where.settings]
    liquid_ids = [
        setting.liquid
        for listed_setting in settings
        for setting in (listed_setting, listed_setting.of)
        if setting is not None and setting.liquid is not None
    ]
    names = [name for liquids in dict.fromkeys(liquid_ids) for name in liquids.split(" + ")]
    descriptions = [f"{name.replace('_', ' ')} ({liquid_text(study.liquids[name])})" for name in dict.fromkeys(names)
             if name in study.liquids]  # fmt: skip
    if not descriptions:
        return ""
    return f"The simulated liquid{'s were' if len(descriptions) > 1 else ' was'} {listed(descriptions)}."


def _design_sentences(study: Study, results: Results) -> Iterator[str]:
    """Yield sentences on the presentation and order of trials in each block, on its task, and on block order."""
    blocks = {block.id: block for block in study.blocks}
    for result in results.blocks:
        yield _presentation_sentence(study, blocks[result.id], result)
        yield from presentation_sentences(result)
    yield from _other_question_sentences(study)
    yield from _unrated_block_sentences(study, results)
    yield from _task_sentences(study)
    if results.trial_blocks:
        opened = "Conditions were identified only by codes until the key was opened."
        yield opened if study.revealed else "Conditions are identified only by codes."
    yield _block_order_sentence(study)


def _other_question_sentences(study: Study) -> Iterator[str]:
    """Yield sentences on other questions in blocks with statements, and on the answers that they depend on."""
    for block in study.blocks:
        kinds = Counter(
            ("also answered" if question.question.required else "could also answer", _condition_of(study, question))
            for question in study.others.questions
            if question.where.id == block.id and not question.where.is_form
        )
        for (verb, condition), count in kinds.items():
            questions = counted(count, "other question")
            yield f"In “{block.title}”, participants {verb} {questions} after each presentation{condition}."


def _condition_of(study: Study, question: PlacedQuestion) -> str:
    """Return a phrase on the earlier answer for which a question is shown, with a leading space; "" for always."""
    rule = question.question.show_if
    if rule is None:
        return ""
    shorts = {item.id: item.short for block in study.blocks if block.id == question.where.id for item in block.items}
    earlier = next(
        (other for other in study.others.questions if (other.where.id, other.id) == (question.where.id, rule.item)),
        None,
    )
    short = shorts.get(rule.item, rule.item) if earlier is None else earlier.short
    levels = {} if earlier is None else earlier.levels
    answers = " or ".join(f"“{levels.get(str(value), value)}”" for value in rule.permitted)
    bounds = [
        f"{bound} {value:g}"
        for bound, value in (("at least", rule.at_least), ("at most", rule.at_most))
        if value is not None
    ]
    return f" if their answer to “{short}” was {answers or listed(bounds)}"


def _unrated_block_sentences(study: Study, results: Results) -> Iterator[str]:
    """Yield sentences on the blocks without statements; those that present one condition alike share a sentence."""
    question_counts = Counter(question.where.id for question in study.others.questions if not question.where.is_form)
    single: dict[str, list[BlockResult]] = {}
    for block, result in zip(study.unrated_blocks, results.unrated_blocks, strict=True):
        table, count = study.protocol["blocks"][block.id], study.setting_count(block)
        questions = question_counts[block.id]
        answered = f"; participants answered {counted(questions, 'question')} after each presentation" * bool(questions)
        repetitions = {1: "once", 2: "twice"}.get(table["repetitions"], f"{table['repetitions']} times")
        trials = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
        in_sessions = " in each session" * bool((trials.groupby("participant")["session"].nunique() > 1).any())
        if count == 1:
            single.setdefault(f"{repetitions}{in_sessions}{{conditions}}{answered}.", []).append(result)
            continue
        settings = _settings_text(study, block, result, "condition")
        repetitions_note = f", {repetitions} each{in_sessions}" * (table["repetitions"] > 1 or bool(in_sessions))
        yield f"In “{result.title}”, {settings} were presented {_ORDERS[table['order']]}{repetitions_note}{answered}."
    for sentence, blocks in single.items():
        titles = listed([f"“{result.title}”" for result in blocks])
        each, respectively = (" each", ", respectively") if len(blocks) > 1 else ("", "")
        conditions = f" ({_single_conditions(blocks)}{respectively})" if study.revealed else ""
        yield f"{titles}{each} presented one condition {sentence.format(conditions=conditions)}"


def _single_conditions(blocks: Sequence[BlockResult]) -> str:
    """Return the conditions of blocks that present one each; with the same liquid, their delays."""
    settings = [result.settings[0] for result in blocks]
    if len({(setting.liquid, setting.link, setting.view) for setting in settings}) > 1 or len(settings) < 2:
        return "; ".join(name_in_sentence(result.names[0]) for result in blocks)
    liquid = (settings[0].liquid or "").replace("_", " ")
    return f"{liquid} with a visual delay of {listed([f'{setting.delay_ms:g}' for setting in settings])} ms"


def _task_sentences(study: Study) -> Iterator[str]:
    """Yield a sentence on each task in the main blocks without a design."""
    titles: dict[str, list[str]] = {}
    for block in study.trial_blocks:
        titles.setdefault(_task_summary(study, block), []).append(f"“{block.title}”")
    for summary, blocks in titles.items():
        where = f" of {listed(blocks)}" if len(titles) > 1 else ""
        if summary:
            yield f"In each trial{where}, participants were asked to {summary}."


def _task_summary(study: Study, block: Block) -> str:
    """Return what participants do in the trials of a block; "" for a task of a plug-in or without its settings."""
    name = study.protocol.get("blocks", {}).get(block.id, {}).get("task")
    task = study.protocol.get("tasks", {}).get(name, {})
    kind = TASK_KINDS.own.get(task.get("kind"))
    try:
        return "" if kind is None else kind.model_validate(task).summary
    except ValidationError:
        return ""


def _presentation_sentence(study: Study, block: Block, result: BlockResult) -> str:
    order = _ORDERS.get(study.protocol.get("blocks", {}).get(result.id, {}).get("order", ""), "")
    noun = (
        {"delays": "visual delay"}.get(result.kind, result.kind.removesuffix("s")) if result.revealed else "condition"
    )
    count, settings_text = study.setting_count(block), _settings_text(study, block, result, noun)
    statements = counted(len(result.items), "statement")
    return (
        f"In “{result.title}”, {settings_text} {'was' if count == 1 else 'were'} "
        f"presented{f' {order}' if order and count > 1 else ''}; participants rated {statements} after each "
        "presentation."
    )


def _settings_text(study: Study, block: Block, result: BlockResult, noun: str) -> str:
    """Return the number of a block's settings and their names: "three visual delays (0, 50 and 100 ms) in water"."""
    names = [f"{delay:g}" for delay in result.delays_ms] or [name_in_sentence(name) for name in result.names]
    unit = " ms" if result.delays_ms else ""
    liquids = (
        sorted({setting.liquid for setting in block.settings if setting.liquid is not None}) if result.delays_ms else []
    )
    liquid = f" in {listed(liquids)}".replace("_", " ") if liquids else ""
    names_text = f" ({listed(names)}{unit})" if result.revealed else ""
    return f"{counted(study.setting_count(block), noun)}{names_text}{liquid}"


def _block_order_sentence(study: Study) -> str:
    """Return a sentence on the order of the main blocks, by group if it differs; "" for a single block."""
    titles = {block.id: block.title for block in study.trial_blocks}
    titles |= {level.id: level.title for level in study.levels if level.phase == "main"}
    if len(titles) < 2:
        return ""
    order = study.protocol.get("study", {}).get("block_order", "fixed")
    groups = study.protocol.get("groups", {})
    orders = {
        group: [titles[step] for step in table.get("sequence", ()) if step in titles] for group, table in groups.items()
    }
    if order == "fixed" and len({tuple(order) for order in orders.values()}) > 1:
        by_group = [
            f"{listed([f'“{title}”' for title in order])} in the group {group}" for group, order in orders.items()
        ]
        return f"The order of the blocks was {'; '.join(by_group)}."
    return f"The blocks were presented {_BLOCK_ORDERS[order]}."


def _delay_sentences(study: Study, results: Results) -> Iterator[str]:
    """Yield a sentence on requested and achieved delays for each unblinded block of delays."""
    for block in results.trial_blocks:
        rows = [
            delivered
            for delivered in results.delivered
            if delivered.block == block.id and delivered.delay_ms is not None
        ]
        if not (block.n or block in results.unrated_blocks) or not block.delays_ms or not rows:
            continue
        known = [row for row in rows if row.achieved_ms is not None]
        if not known:
            yield f"The achieved delays in “{block.title}” were not measured."
            continue
        pairs = [f"{number(delivered.achieved_ms, 1)} ms ({ms(delivered.delay_ms or 0.0)})" for delivered in known]
        yield (
            f"The mean achieved delays in “{block.title}” (requested delays in parentheses) were {listed(pairs)}, "
            "measured with the program's clock and excluding display latency."
        )


def _missing_trials_sentence(study: Study) -> str:
    """Return a sentence on undelivered interval trials in the included sessions."""
    known = [
        missing for missing in study.participants.loc[study.participants["counted"], "missing"] if missing is not None
    ]
    asked, count = sum(missing.asked for missing in known), sum(missing.count for missing in known)
    if not study.levels or not asked:
        return ""
    if not count and study.intervals.loc[study.intervals["counted"], "valid"].isna().all():
        return "Whether interval trials met the limits for valid trials was not measured."
    if not count:
        return "All interval trials in the main blocks met the limits for valid trials."
    lost = f"{count} of {number_text.counted(asked, 'main trial')} {'was' if count == 1 else 'were'} lost"
    return f"{lost} because no presentation met the limits for valid trials."


def _form_sentences(study: Study) -> Iterator[str]:
    """Yield a sentence on each form, with its number of questions and its position in the session."""
    places = (question.where for question in study.others.questions if question.where.is_form)
    forms = Counter((where.id, where.title) for where in places)
    for (form, title), questions in forms.items():
        recorded = RecordedSessions.model_validate(study.protocol)
        sessions = list(recorded.every_session())
        times = list(dict.fromkeys(_form_times_phrase(study, steps, form) for steps in sessions if form in steps))
        note = ", depending on the group or session" if len(times) > 1 else ""
        if not note and not all(form in steps for steps in sessions):
            note = _sessions_phrase(recorded, form)
        elif not note and any((recorded.session_count(group) or 1) > 1 for group in recorded.groups or (None,)):
            note = " of each session"
        yield (
            f"Participants completed the questionnaire “{title}” ({counted(questions, 'question')}) "
            f"{' or '.join(times)}{note}."
        )


def _sessions_phrase(recorded: RecordedSessions, form: str) -> str:
    """Return a phrase on the sessions or groups in which a form is asked: ", in session 1"."""
    sessions = {group: range(1, (recorded.session_count(group) or 1) + 1) for group in recorded.groups or (None,)}
    asked_in = {
        group: [number for number in numbers if form in recorded.session_steps(group, number)]
        for group, numbers in sessions.items()
    }
    groups = [str(group) for group, numbers in asked_in.items() if numbers]
    if len(groups) < len(sessions) and all(len(asked_in[group]) in (0, len(sessions[group])) for group in sessions):
        return f", in the group{'s' * (len(groups) > 1)} {listed(groups)}"
    first, *others = asked_in.values()
    if all(numbers == first for numbers in others):
        return f", in session{'s' * (len(first) > 1)} {listed(list(map(str, first)))}"
    return ", in some groups or sessions"


def _form_times_phrase(study: Study, steps: tuple[str, ...], form: str) -> str:
    """Return a phrase on the times at which a form is completed in a session with these steps."""
    titles, sessions = block_titles(study.protocol), RecordedSessions.model_validate(study.protocol)
    blocks = [step for step in steps if step in titles]
    main = {block for block in blocks if sessions.blocks[block].phase == "main"}
    uses = list(sessions.blocks_before(form, steps))
    if len(uses) > 1 and set(uses) == main:
        return "after each main block"
    times = [
        "before the first block"
        if block is None
        else "after the last block"
        if block == blocks[-1]
        else "between the blocks"
        if block in sessions.exchanged_blocks
        else f"after “{titles[block]}”"
        for block in uses
    ]
    return listed(list(dict.fromkeys(times)))


def _statement_sentences(study: Study, results: Results, blocks: list[BlockResult]) -> Iterator[str]:
    quartiles = QUARTILES.replace(" (", ", ").rstrip(")")
    yield (
        "Statements were rated on seven-point scales. Answers were treated as ordinal and summarised by medians "
        f"and quartiles ({quartiles})."
    )
    yield from _mean_sentences(results, blocks)
    for block in blocks:
        of_findings = [sentence for finding in all_findings() for sentence in finding(block, results).methods()]
        if of_findings and len(blocks) > 1:
            yield f"{lead_phrase(block)}:"
        yield from of_findings
    yield from _common_sentences(results, blocks)


def _mean_sentences(results: Results, blocks: list[BlockResult]) -> Iterator[str]:
    """Yield sentences on the means shown, and on the tests that use them."""
    if any(Effects.value_in(block) for block in blocks):
        yield "Mean differences from the first condition are shown with 95 % confidence intervals (Student's t)."
    tested = [
        (
            "the hypotheses",
            any(contrast.contrast.blocks[0] in {block.id for block in blocks} for contrast in results.contrasts),
        ),
        ("the equivalence tests", any(ContrastsWithControl.value_in(block) for block in blocks)),
        ("the trend tests", results.decided.trends == "slopes" and any(DelayTrend.value_in(block) for block in blocks)),
        ("the exploratory tests of means", any(MeanTests.tested(block) for block in blocks)),
    ]
    uses = [test for test, applies in tested if applies]
    yield f"Means were used for {listed(uses)}." if uses else "Means were not tested."


def _common_sentences(results: Results, blocks: list[BlockResult]) -> Iterator[str]:
    decided = results.decided
    gated = [block for block in blocks if (overall := OverAll.value_in(block)) is not None and overall.p is not None]
    if gated:
        holm = f", Holm-adjusted across {counted(len(gated), 'block')}" if len(gated) > 1 else ""
        yield (
            "A statement's adjusted p value is never smaller than the p value of the test over all statements in its "
            f"block{holm}."
        )
    if decided.binding:
        primary_text = listed([f"“{item}”" for item in decided.primary]) if decided.primary else "all statements"
        yield (
            f"Alpha ({decided.alpha_text()}) and the primary statements ({primary_text}) were specified before the "
            "first session."
        )
    elif decided.changed:
        yield (
            "The decisions about the analysis changed between sessions, so all results are exploratory; the decisions "
            f"from the first session were used (alpha = {decided.alpha_text()})."
        )
    elif not decided.made:
        yield f"The analysis was not specified beforehand, so all results are exploratory (alpha = {decided.alpha:g})."
    for finding in all_findings():
        yield from finding.common_methods(blocks)
    if incomplete := sorted({person for block in blocks for people in block.incomplete.values() for person in people}):
        verb = "was" if len(incomplete) == 1 else "were"
        yield (
            f"Missing answers were not imputed; {number_text.counted(len(incomplete), 'participant')} with a missing "
            f"answer to a statement {verb} excluded from that statement's tests over all conditions, and from "
            "comparisons of two conditions that involve the missing answer."
        )
    measured = results.performance
    if measured is not None and measured.recorded:
        yield (
            "Movement times were measured from recordings at the servo rate, from the moment a target lit up until the "
            "hand entered it for the last time; the first reach in each trial was excluded."
        )
