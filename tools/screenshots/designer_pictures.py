"""The study designer in both themes and in the sizes of three screens: forms, measures, a broken study, a new one."""

from pathlib import Path
from typing import Any, Final

from study_app.app.main_controller import MainController
from study_app.designer.document.document import Answers, template, with_answers
from study_app.gui.theme.theme import Theme
from study_app.protocol.load import source_bytes
from tools.screenshots.capture import Camera

SIZES: Final = ((1600, 1000), (1366, 768), (1024, 640))
STUDIES: Final = (
    ("kitchen", "compare-liquids", ("en",)),
    ("thicker", "viscosity-jnd", ("en",)),
    ("forms", "questionnaire-only", ("en", "nl")),
)
SETTLED_MS: Final = 800
FAULTS: Final = (
    ("force_limit_n = 6 ", "force_limit_n = 60 "),
    ('kind = "explore"', 'kind = "explor"'),
    ('liquid = "thick"', 'liquid = "thik"'),
    ('task = "explore"', 'task = "explor"'),
)
SCENES: Final = (
    ("likert", "kitchen", ("blocks", "liquids"), "participant"),
    ("2ifc", "thicker", ("blocks", "viscosity"), "measures"),
    ("questionnaire", "forms", ("questionnaires", "about_you"), "participant"),
    ("problems", "broken", ("conditions", "thick"), "file"),
)
"""Name, study, selected element, view."""


def write_studies(folder: Path) -> None:
    """Write the studies of the pictures: three from templates, and the demo with faults."""
    folder.mkdir(parents=True)
    for name, source, languages in STUDIES:
        study = with_answers(template(source), Answers(languages=languages))
        folder.joinpath(f"{name}.toml").write_text(study.text, encoding="utf-8", newline="\n")
    text = source_bytes("demo").decode()
    for sound, broken in FAULTS:
        text = text.replace(sound, broken)
    folder.joinpath("broken.toml").write_text(text, encoding="utf-8", newline="\n")


def take_designer(camera: Camera, results: Path, theme: Theme) -> None:
    """Take each scene and a new study in each size."""
    main = MainController(results)
    window = main.window
    window.show_theme(theme)
    main.open()
    try:
        window.go("designer")
        designer = camera.until(lambda: main.designer, "the designer")
        place: Any = designer.place
        for scene, study, element, view in SCENES:
            main.open_designer(study)
            designer.editing.select(element)
            place.pane.show_tab(view)
            place.problems.setVisible(scene == "problems")
            _take_sizes(camera, main, f"{scene}-{theme.name}")
        designer.show_new_page("template:compare-liquids")
        _take_sizes(camera, main, f"new-{theme.name}")
    finally:
        window.close()
        main.end()


def _take_sizes(camera: Camera, main: MainController, name: str) -> None:
    designer = main.designer
    assert designer is not None  # noqa: S101 - it was waited for
    for width, height in SIZES:
        main.window.resize(width, height)
        camera.wait(SETTLED_MS)
        camera.until(lambda: not designer.measures.is_waiting, "the simulations")
        camera.take(main.window, f"designer-{name}-{width}")
