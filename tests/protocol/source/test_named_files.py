"""Which files a study names as its liquids, however the key is written."""

import pytest

from study_app.protocol.source.liquid_files import bundled, unbundled


@pytest.mark.parametrize(
    "text",
    [
        '[liquids.thick]\nfile = "a.toml"\n',
        '[liquids.thick]\nfile="a.toml"\n',
        '[liquids]\nthick.file\t= "a.toml"\n',
        '[liquids]\nthick = { "file" = "a.toml" }\n',
        "[liquids]\nthick = { 'file' = 'a.toml' }\n",
    ],
)
def test_a_liquid_file_is_found_however_its_key_is_written(text: str) -> None:
    study, files = unbundled(bundled(text.encode(), lambda name: f"# {name}"))
    assert (study, files) == (text.encode(), {"a.toml": "# a.toml"})


def test_the_word_in_a_comment_names_no_file() -> None:
    text = b"# This file has no liquid file.\n[liquids.thick]\ndensity_kg_m3 = 1000\n"
    assert bundled(text, lambda _name: "lost") == text
