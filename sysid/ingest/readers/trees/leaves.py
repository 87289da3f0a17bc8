"""What a tree of arrays is made of."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.errors import ReaderError
from sysid.ingest.tables.rates import IN_HERTZ, IN_SECONDS
from sysid.units import Reference

_STEPS = {"ts", "dt", "sample_time", "sampletime", "sampling_time", "samplingtime", "sample_period", "sampling_period"}
_STEPS |= {"samplingperiod", "sampleperiod", "sampling_interval", "sample_interval", "wf_increment", "t_s", "delta_t"}
_RATES = {"fs", "f_s", "sample_rate", "samplerate", "sampling_rate", "samplingrate", "sampling_frequency"}
_RATES |= {"sample_frequency", "samplingfrequency", "samplefrequency", "sfreq"}
_IN_UNIT = re.compile(r"(?P<stem>\w+?)[_ ]*[_ (\[.](?P<unit>[a-z]+)[)\]]?")


@dataclass(frozen=True, kw_only=True, eq=False)
class Leaf:
    """An array and what the file says about it.

    Args:
        values: Of one or two dimensions.
        unit: As found in the file.
        reference: As found in the file.
        description: As found in the file.
        names: Names of its columns, where the file says them.
        units: Units of its columns, where the file says one of each.
        step: Sample time in seconds, where the file says one of it alone.
        aside: Why it is no channel unless it is asked for.
        problem: Why it cannot be used.
    """

    values: NDArray[Any]
    unit: str | None = None
    reference: Reference | None = None
    description: str = ""
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    step: float | None = None
    aside: str = ""
    problem: ReaderError | None = None

    @property
    def vector(self) -> bool:
        """Whether it has one dimension."""
        return self.values.ndim == 1


class Whole(dict[str, Any]):
    """A mapping that is a record in itself, such as a saved ``iddata``."""


def refused(problem: ReaderError) -> Leaf:
    """A leaf that is there and cannot be read.

    Args:
        problem: Raised when its column is asked for.

    Returns:
        The leaf.
    """
    return Leaf(values=np.full(1, np.nan), problem=problem)


def leaf_of(value: Any) -> Leaf | None:
    """A value of a tree as a leaf.

    Args:
        value: A leaf, an array, or anything else.

    Returns:
        The leaf, with a matrix of one row or column as a vector; one that is refused for an array of more than two
        dimensions; ``None`` for scalars, empty arrays and whatever is no array.
    """
    leaf = Leaf(values=value) if isinstance(value, np.ndarray) else value
    if not isinstance(leaf, Leaf):
        return None
    if leaf.problem is not None:
        return leaf
    array = leaf.values
    if array.ndim > 2:
        array = array.squeeze()
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim > 2 and array.size and array.dtype.kind in "buif":
        return refused(_too_deep(array.shape))
    if array.size < 2 or array.ndim not in {1, 2} or array.dtype.kind not in "buifcMmUSO":
        return None
    return Leaf(**{**_fields(leaf), "values": array})


def _too_deep(shape: tuple[int, ...]) -> ReaderError:
    return ReaderError(
        f"an array of {len(shape)} dimensions",
        expected="a matrix of samples by channels, or a vector",
        got=" x ".join(map(str, shape)),
        remedy="save a matrix for each record, called run_1, run_2 ...: run_1 = a[0] in Python, "
        "run_1 = a(:,:,1) in MATLAB",
    )


def _fields(leaf: Leaf) -> dict[str, Any]:
    return {name: getattr(leaf, name) for name in Leaf.__dataclass_fields__}


def number_of(value: Any) -> float | None:
    """A value of a tree as one number.

    Args:
        value: A number, an array or a leaf of one number, or anything else.

    Returns:
        The number, or ``None``.
    """
    value = value.values if isinstance(value, Leaf) else value
    array = value if isinstance(value, np.ndarray | np.generic | int | float) else None
    if array is None or np.size(array) != 1 or np.asarray(array).dtype.kind not in "buif":
        return None
    return float(np.asarray(array).reshape(-1)[0])


def step_in(name: str, number: float | None) -> float | None:
    """The sample time that a number of a certain name says.

    Args:
        name: For example ``"Ts"``, ``"fs"``, ``"dt_ms"``, ``"sampling_rate [Hz]"``.
        number: The number.

    Returns:
        Seconds, or ``None`` if the name is not known for one or the number cannot be one.
    """
    if number is None or not (number > 0.0 and np.isfinite(number)):
        return None
    plain = re.sub(r"(?<=[a-z])(Ms|Us|Hz|KHz|Sec)$", r"_\1", name.strip()).casefold()
    match = None if plain in _STEPS | _RATES else _IN_UNIT.fullmatch(plain)
    stem, unit = (match["stem"], match["unit"]) if match else (plain, "")
    if stem in _STEPS and unit in IN_SECONDS:
        return number * IN_SECONDS[unit]
    return 1.0 / (number * IN_HERTZ[unit]) if stem in _RATES and unit in IN_HERTZ else None


def texts_of(value: Any) -> tuple[str, ...]:
    """A value of a tree as texts.

    Args:
        value: A text, a list of texts, or anything else.

    Returns:
        The texts; none for anything else.
    """
    if isinstance(value, str):
        return (value,)
    if isinstance(value, Mapping):
        return ()
    if isinstance(value, list | tuple):
        return tuple(text for item in value for text in texts_of(item))
    return ()
