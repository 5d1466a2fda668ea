"""Stories of whole studies, by keys, clicks and steps; after each act all parts of the window must agree."""

from collections.abc import Callable
from functools import partial

import pytest
from PySide6.QtCore import Qt

from study_app.designer.document.steps import RetypeFile
from study_app.designer.document.study import read_study
from study_app.gui.widgets.cards import Chip
from tests.designer.support.designer import DEMO
from tests.designer.support.story import Story

pytestmark = pytest.mark.slow


def new_study(story: Story) -> None:
    """A new study has the answers, is a copy, or gets a free name; Tab and arrow keys move through the page."""
    designer, page = story.designer, story.designer.place.new_page
    ask, questions = designer.controller.show_new_page, page.card.questions
    story.act("ask", ask)
    story.act(
        "adaptive", next(button for button in page.buttons if button.choice.source == "template:viscosity-jnd").click
    )
    assert [chip.word for chip in page.card.details.findChildren(Chip)] == ["recovered"]
    languages = [f"Language {name}" for name in ("English", "Dutch", "German", "French", "Arabic")]
    for at in ("Short name of the new study", *languages, "Standards", "Trials per standard"):
        story.play("Tab")
        story.expect(at=at)
    story.act("title", questions.title.setFocus)
    story.play("'Which liquid is thicker?' Tab 'thicker'")
    story.act("standards", lambda: next(iter(questions.template_fields.values())).setText("4, 8"))
    for code in ("en", "nl", "en"):
        story.act(f"language {code}", questions.languages[code].click)
    story.act("make", page.make.click)
    story.expect("Draft kept HH:MM", kept="not saved", undo="")
    study = designer.value("study")
    assert (study["name"], study["title"]) == ("thicker", {"en": "Which liquid is thicker?"})
    assert designer.value("stimuli", "damping", "standards") == (4, 8)
    for name in ("rek2024", "kitchen", "My study"):
        story.act("ask", ask)
        story.act(f"name {name}", partial(page.name.setText, name))
        story.act("make", page.make.click)
        assert page.refusal.isVisible()
        free = page.refusal.text().split('"')[-2]
        story.act("free", partial(page.name.setText, free))
        story.act("make", page.make.click)
        assert designer.value("study", "name") == free != name
        story.expect("Draft kept HH:MM", kept="not saved")
    story.act("copy", lambda: ask("kitchen"))
    story.play("Return")
    story.expect(kept="not saved", at="Study outline")
    assert designer.value("blocks") == read_study(story.text.encode(), designer.file.parent).document["blocks"]
    story.play("ctrl+s")
    story.expect(kept="saved")
    story.act("copy again", lambda: ask("kitchen"))
    story.play("'Cold tea'")
    assert page.name.placeholderText().startswith("cold")
    story.act("of the demo", lambda: ask("demo"))
    reached_by_tab = [button.focusPolicy() == Qt.FocusPolicy.StrongFocus for button in page.buttons]
    assert reached_by_tab == [button.isChecked() for button in page.buttons]
    story.act("to the chosen card", next(button for button in page.buttons if button.isChecked()).setFocus)
    story.expect(at="Copy of A first look")
    story.play("Up Up Up")
    story.expect(at="Template Compare liquids")
    story.act("of a file", page.file.click)
    story.act("make", page.make.click)
    story.expect(kept="not saved")
    story.has('title = "A first look"')


def hypotheses(story: Story) -> None:
    """A hypothesis is a sentence with choices; a bound that is not a number is refused."""
    designer, contrasts = story.designer, ("analysis", "contrasts")
    line = lambda: designer.field(*contrasts).lines[0]  # noqa: E731
    story.ask(RetypeFile(DEMO.replace("[limits]", "[analysis]\nparticipants = 11\n\n[limits]")))
    for words in ("counterbalance", "block order"):
        story.play(f"ctrl+f '{words}' Return")
        story.expect(selected="sequence", at="Fixed")
    story.act("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    story.has('block_order = "balanced"')

    def stated(measure: str, conditions: str, **more: object) -> None:
        blocks = ("liquids",) if conditions == "thin thick" else ("delays",)
        hypothesis = {"measure": measure, "blocks": blocks, "conditions": tuple(conditions.split())}
        assert designer.value(*contrasts) == (hypothesis | more,)

    def offered(*compared: str) -> None:
        """Check the second items that are offered for the first one."""
        assert [line().second.itemText(at) for at in range(line().second.count())] == [*compared]

    story.press("Add a hypothesis")
    stated("feels_liquid", "thin thick")
    story.press("Add a hypothesis")
    first, second = designer.value(*contrasts)
    assert (second["measure"], second["conditions"]) != (first["measure"], first["conditions"])
    story.play("ctrl+z")
    story.choose(line().relation, "is higher than")
    stated("feels_liquid", "thin thick", expected="higher")
    offered("Thick in Liquids")
    story.choose(line().first, "Late in Delays")
    stated("harder", "late prompt", expected="higher")
    offered("Prompt in Delays")
    story.choose(line().measure, "Comfortable")
    stated("comfortable", "late prompt", expected="higher")
    story.choose(line().relation, "is equal to")
    stated("comfortable", "late prompt", bound=0.5)
    for typed in ("0.25", "x", "2,500"):
        story.act(f"bound {typed}", lambda typed=typed: designer.fill(line().bound, typed))
        stated("comfortable", "late prompt", bound=0.25)
    story.choose(line().relation, "is different from")
    stated("comfortable", "late prompt")
    story.play("@blocks.delays")
    story.act("away", line().away.click)
    story.expect(undo="Remove Hypotheses")
    assert not designer.value(*contrasts)
    thin = 'measure = "like_honey", blocks = ["liquids"], conditions = ["thin", "thick"], expected = "higher"'
    written = DEMO.replace("[limits]", f"[analysis]\ncontrasts = [{{ {thin} }}]\n\n[limits]")
    fewer = written.replace('["thin", "thick"]\n', '["thin"]\n').replace('["prompt", "late"]', '["prompt"]')
    for text, box, words in (
        (fewer, "relation", "is lower than"),
        (written.replace('id = "harder"', 'id = "like_honey"'), "first", "Late"),
    ):
        story.ask(RetypeFile(text))
        story.play("@sequence")
        story.choose(getattr(line(), box), words)
        is_lower = box == "relation"
        stated("like_honey", "thin thick" if is_lower else "late prompt", expected="lower" if is_lower else "higher")
    own = 'sequence = ["welcome", "liquids", "reaching", "delays", "thanks"]\n'
    groups = f"[groups.a]\n{own}[groups.b]\n{own}[limits]"
    story.ask(RetypeFile(DEMO.replace(own, "", 1).replace("[limits]", groups)))
    story.play("ctrl+f 'order of blocks' Return")
    story.expect(selected="blocks.liquids")
    story.press("Add a hypothesis")
    story.choose(line().first, "Interaction: A, Prompt in Delays − Late in Delays")
    pair = {"blocks": ("delays",), "groups": ("a", "b"), "conditions": ("prompt", "late")}
    offered("Interaction: B, Prompt in Delays − Late in Delays")
    assert designer.value(*contrasts) == ({"measure": "harder", **pair},)
    story.choose(line().relation, "is higher than")
    assert designer.value(*contrasts) == ({"measure": "harder", "expected": "higher", **pair},)
    assert [line().first.currentText(), line().second.currentText()] == [
        f"Interaction: {group}, Prompt in Delays − Late in Delays" for group in ("A", "B")
    ]
    story.ask(RetypeFile(designer.text.replace('title = "Delays"', 'title = "Liquids"')))
    story.play("@questionnaires.liquid")
    times = [entry.text().partition("\t")[0] for entry in designer.place.form.head.asks.actions()]
    assert times.count("After Liquids (liquids)") == times.count("After Liquids (delays)") == 1
    story.play("ctrl+f 'order of blocks' Return")
    every = [line().first.itemText(at) for at in range(line().first.count())]
    assert "Interaction: A, Prompt in Liquids (delays) − Late in Liquids (delays)" in every
    assert len(set(every)) == len(every)
    for before, after in (
        ('conditions = ["thin", "thick"]', ""),
        ('phase = "main" ', "phase = {} "),
        ('sequence = ["w', 'sequence = 5 # ["w'),
    ):
        story.ask(RetypeFile(DEMO.replace(before, after, 1)))
        story.play("@blocks.liquids @blocks.delays")
        assert designer.study.faults
    for written in ("3", "[3]", "[{ blocks = 4, measure = 5, expected = 6, bound = 'x' }]"):
        story.ask(RetypeFile(DEMO.replace("[limits]", f"[analysis]\ncontrasts = {written}\n\n[limits]")))
        story.play("@sequence")
        assert designer.study.faults


def two_conditions(story: Story) -> None:
    """The steps of docs/two-conditions.md make a study without problems."""
    designer, head = story.designer, story.designer.place.form.head
    story.act("begin", lambda: designer.controller.begin_study("template:viscosity-jnd", "thicker"))
    story.play("@blocks.viscosity @conditions.damper")
    story.act("no ball", designer.form_row("conditions", "damper", "ball").remove.click)
    story.act("series", lambda: designer.click_on(head.series))
    card = designer.place.prompt
    story.choose(card.number, "Visual delay")
    for typed in ("5000", "x", "60"):
        story.act(f"values {typed}", lambda typed=typed: card.values.setText(typed))
        assert card.make.isEnabled() == (typed == "60")
    story.act("make", card.make.click)
    story.expect("Damper 60", selected="conditions.damper_60", undo="Make 1 condition of Damper")
    story.play("@stimuli.damping")
    story.act("copy", head.copy.click)
    story.choose(designer.field("stimuli", "damping_2", "condition").list, "damper_60")
    story.play("@blocks.viscosity")
    story.act("copy", head.copy.click)
    story.choose(designer.field("blocks", "viscosity_2", "stimulus").list, "damping_2")
    story.play(":blocks.viscosity_2.title ctrl+a 'Viscosity, late' Return @sequence")
    story.act("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    story.press("Add a hypothesis")
    story.play("Insert 'nasa' Return")
    story.act(
        "ask", next(action for action in head.asks.actions() if action.text().startswith("After each block")).trigger
    )
    assert designer.study.faults == ()
    assert designer.study.protocol.study.block_order == "balanced"
    story.play("@sequence")
    line = designer.field("analysis", "contrasts").lines[0]
    story.choose(line.measure, next(words for _, words in line.measures if words.startswith("Raw score (")))
    (hypothesis,) = designer.study.protocol.analysis.contrasts
    assert (hypothesis.form, hypothesis.measure, hypothesis.expected) == ("nasa_tlx", "raw", None)


@pytest.mark.parametrize("tell", [new_study, hypotheses, two_conditions])
def test_each_act_of_a_story_leaves_the_window_consistent(
    tell_story: Callable[..., None], tell: Callable[[Story], None]
) -> None:
    tell_story(tell)
