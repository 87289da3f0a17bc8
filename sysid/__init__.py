"""The system-identification workbench: reference traces in, frozen surrogates of known accuracy out.

What follows is the short way, in the words of the command line; each word is explained in :mod:`sysid.api`:

    traces = sysid.load("mine.csv")
    fit = sysid.fit(traces, "u -> y", sysid.ARX(na=2, nb=(2,), nk=(1,)))
    print(sysid.compare(traces, fit))
    sysid.save(fit, traces, "bundle")

The rooms of the house, each with its public names: :mod:`sysid.ingest`, :mod:`sysid.models`, :mod:`sysid.estimation`,
:mod:`sysid.validation`, :mod:`sysid.export`, :mod:`sysid.reporting`, :mod:`sysid.workbench`.
"""

from typing import Any

__version__ = "0.2.0"

ABOVE = {
    "auto": "sysid.workbench.auto.python",
    "experiment": "sysid.workbench.experiments.python",
    "surrogate": "sysid.workbench.surrogates.python",
}
"""Words that stand on a pipeline, which is above the others, and where each is."""


def __getattr__(name: str) -> Any:
    """A word of the short way or a room, imported now: ``sysid --help`` loads none of it."""
    from importlib import import_module
    from importlib.util import find_spec

    api = import_module("sysid.api")
    if name in (*api.__all__, *ABOVE):
        return getattr(import_module(ABOVE[name]) if name in ABOVE else api, name)
    if name.startswith("_") or find_spec(f"sysid.{name}") is None:
        raise AttributeError(f"module 'sysid' has no attribute {name!r}")
    return import_module(f"sysid.{name}")


def __dir__() -> list[str]:
    from importlib import import_module

    return sorted({*globals(), *import_module("sysid.api").__all__, *ABOVE})
