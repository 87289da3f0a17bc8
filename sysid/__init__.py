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

WORDS = (
    *("data", "load", "fit", "compare", "save", "read_bundle", "search_orders", "Comparison", "Fit", "SystemFit"),
    *("advise", "excite", "frequency_response", "impulse_response", "step", "bode", "poles"),
    *("OrderSearch", "ARX", "ARMAX", "OE", "BJ", "LinearStateSpace", "VectorStateSpace", "TransferFunction"),
    *("NARX", "NeuralStateSpace", "VectorNARX", "VectorNeuralStateSpace", "GreyBox", "VectorGreyBox"),
    *("HammersteinWiener", "WienerHammerstein", "PolynomialNARX"),
    *("Training", "JointTraining", "TransferFunctionTraining", "StateSpaceTraining", "PolynomialTraining"),
    *("StabilityOptions", "Start", "Role"),
)
"""What is imported when it is first used: ``sysid --help`` loads none of it."""

ABOVE = {
    "auto": "sysid.workbench.auto.python",
    "experiment": "sysid.workbench.experiments.python",
    "surrogate": "sysid.workbench.surrogates.python",
}
"""Words that stand on a pipeline, which is above the others, and where each is."""


def __getattr__(name: str) -> Any:
    """A word of the short way, imported now."""
    if name not in (*WORDS, *ABOVE):
        raise AttributeError(f"module 'sysid' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(ABOVE.get(name, "sysid.api")), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *WORDS, *ABOVE})
