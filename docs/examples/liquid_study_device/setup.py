"""Build the C part: a plain shared library, which Python loads with ctypes."""

from pathlib import Path

from setuptools import Extension, setup

SOURCES = Path("src", "liquid_study_example")

setup(
    ext_modules=[
        Extension(
            "liquid_study_example._device",
            sources=[str(SOURCES / name) for name in ("direct.c", "mailbox.c", "maker.c")],
            depends=[str(path) for path in sorted(SOURCES.glob("*.h"))],
            extra_compile_args=["-std=c11", "-O2", "-Wall", "-Wextra"],
            libraries=["m", "pthread"],  # add your maker's library here
        )
    ]
)
