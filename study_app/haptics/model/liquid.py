"""What can be felt: regions filled with fluids, and the effects they call for.

SI units, scene frame (x right, y up, z toward the participant). A parameter that no model names is an error. An
effect's table is the model in its descriptor (``haptics.model.effects``); its equation stands in the docstring of its
file in ``haptics.kernels.effects``.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

from pydantic import Discriminator, Field, Tag, create_model, model_validator

from study_app.haptics.model.effect import Effect as EffectDescriptor
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.haptics.model.ranges import DensityKgM3, Extent, Frozen, Metres, ViscosityPaS, later
from study_app.ids import MAX_ID

if TYPE_CHECKING:
    Effect: TypeAlias = str
    Effects: TypeAlias = tuple[str, ...] | Literal["auto"]
else:
    Effect = Literal[tuple(NAMED)]
    Effects = Annotated[
        Annotated[tuple[Effect, ...], Tag("named")] | Annotated[Literal["auto"], Tag("auto")],
        Discriminator(lambda value: "auto" if isinstance(value, str) else "named"),
    ]

MAX_LIQUIDS = 8


class Everywhere(Frozen):
    """The liquid has no border."""

    kind: Literal["everywhere"] = "everywhere"


class Box(Frozen):
    """A box along the axes."""

    kind: Literal["box"] = "box"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="Centre of the box [m].")
    size_m: tuple[Extent, Extent, Extent] = Field(description="Full sizes along x, y, z [m].")


class Cylinder(Frozen):
    """An upright cylinder."""

    kind: Literal["cylinder"] = "cylinder"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="Centre of the cylinder [m].")
    radius_m: Extent = Field(description="Radius [m].")
    height_m: Extent = Field(description="Height [m].")


Region: TypeAlias = Annotated[
    Everywhere | Box | Cylinder, Field(discriminator="kind", description="Where the liquid is, in the scene.")
]


class _Liquid(Frozen):
    """The fields that are no effect's table."""

    id: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=MAX_ID)
    density_kg_m3: DensityKgM3
    viscosity_pa_s: ViscosityPaS | None = None
    region: Region = Everywhere()
    effects: Effects = Field(
        default=("drag",), description='Names of its effects; "auto": chosen by their size (scene.accuracy).'
    )

    @model_validator(mode="after")
    def _effects_have_what_they_need(self) -> Self:
        if self.effects == "auto":
            self._has_no_problem(
                it for it in EFFECTS if it.default is None and getattr(self, it.name, None) is not None
            )
            return self
        if len(set(self.effects)) < len(self.effects):
            raise ValueError(f"an effect is named twice in {list(self.effects)}")
        called_for = [effect for effect in EFFECTS if effect.name in self.effects]
        for effect in called_for:
            if effect.model is not None and getattr(self, effect.name) is None:
                raise ValueError(f'the effect "{effect.name}" is selected, but its table ({effect.missing}) is missing')
            if effect.through and not set(effect.through) & set(self.effects):
                carriers = " or ".join(f'"{name}"' for name in effect.through)
                raise ValueError(f'the effect "{effect.name}" acts through {carriers}: name both')
        for effect in called_for:
            for other in effect.excludes:
                if other in self.effects:
                    raise ValueError(
                        f'"{other}" and "{effect.name}" are two models of the same thing: select one of them'
                    )
        self._has_no_problem(called_for)
        return self

    def _has_no_problem(self, effects: Iterable[EffectDescriptor]) -> None:
        for effect in effects:
            problem = effect.problem(self) if effect.problem is not None else None
            if problem is not None:
                raise ValueError(problem)


_DOC = """A region with a fluid, and the effects it calls for; ``"auto"`` lets ``haptics.model.gate`` choose them.

    The table of an effect that is not called for may stand; it means nothing.
    """

if TYPE_CHECKING:

    class Liquid(_Liquid):
        """A region filled with a fluid; every effect with a table has it as an attribute of the effect's name."""

        def __init__(self, **fields: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...

else:
    Liquid = create_model(
        "Liquid",
        __base__=_Liquid,
        __module__=__name__,
        __doc__=_DOC,
        **{
            effect.name: (
                effect.model if effect.default is not None else effect.model | None,
                effect.default if effect.format == 1 else later(),
            )
            for effect in EFFECTS
            if effect.model is not None
        },
    )
