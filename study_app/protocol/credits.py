"""Who made a study, under which licence its data are shared, and how it is cited: for exports."""

from pydantic import Field

from study_app.protocol.table import Table
from study_app.protocol.texts import Printable


class Credits(Table):
    """Names, licence and citation that an export to share states."""

    authors: tuple[Printable, ...] = Field(default=(), max_length=200, description="Names of the authors, in order.")
    license: Printable | None = Field(
        default=None, description="Licence of the data: an SPDX identifier such as CC-BY-4.0, or an address."
    )
    citation: Printable | None = Field(default=None, description="How to cite the data or the paper.")
    funder: Printable | None = Field(default=None, description="Who paid for the study.")
    url: Printable | None = Field(default=None, description="Address of the study, such as its preregistration.")
