"""What every structure can do: what is chosen before a fit, orders and sizes, without a number that was estimated."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Self, cast

from sysid.errors import ConfigError
from sysid.models.channels.history import Start
from sysid.models.channels.mapping import Mapping
from sysid.models.orders.lags import Lagged, per_input, whole
from sysid.models.orders.typed_fields import Switches


class AbstractStructure(Switches):
    """What is chosen before a fit: orders, delays, neurons. Frozen, keyword-only, free of data."""

    kind: str
    """Name in files and on the screen, such as ``"NARX"``."""

    @property
    @abstractmethod
    def label(self) -> str:
        """Short text an engineer recognises, such as ``NARX 4/4/20``."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The fields as JSON values, with ``kind``."""

    several_outputs: bool = False
    """Whether one model has all outputs of a mapping; where it is false, each output gets a model of its own."""

    acts_at_once: bool = False
    """Whether inputs may act within their sample without being asked to: no field of it says so."""

    learns_curves: bool = False
    """Whether what an input does at each of its levels is learnt from records alone, and no equation says it."""

    per_input: tuple[str, ...] = ()
    """Fields that hold one number per input, or one for all of them."""

    @property
    def learns_start(self) -> bool:
        """Whether it says itself where a record begins, fitted or given, so that its start need not be at rest."""
        return False

    @property
    def names_records(self) -> bool:
        """Whether a fit depends on what its records are called."""
        return False

    def lagged(self, n_inputs: int) -> Lagged | None:
        """What its one-step map is made of, where that is a function of lagged samples.

        Args:
            n_inputs: Inputs of the mapping.

        Returns:
            The parts; ``None`` for a structure with hidden states.
        """
        del n_inputs
        return None

    def resized(self, neurons: int) -> AbstractStructure | None:
        """The same structure with another number of neurons.

        Args:
            neurons: How many.

        Returns:
            The other one; ``None`` where neurons are not what makes it larger.
        """
        del neurons
        return None

    def for_outputs(self, n_outputs: int) -> AbstractStructure:
        """What is fitted where this structure is asked for with so many outputs.

        Args:
            n_outputs: Outputs of the mapping.

        Returns:
            The structure; of some that are for one output, the one that several outputs share.
        """
        del n_outputs
        return self

    def for_inputs(self, n_inputs: int) -> Self:
        """What is fitted where this structure is asked for with so many inputs.

        Args:
            n_inputs: Inputs of the mapping.

        Returns:
            The structure; one number of a field that has one for each input stands for all of them.

        Raises:
            ConfigError: If a field has neither one entry nor one per input.
        """
        self.check_inputs(n_inputs)
        given = {name: getattr(self, name) for name in self.per_input}
        short = {name: one * n_inputs for name, one in given.items() if _is_one(one) and n_inputs > 1}
        return cast("Self", replace(cast("Any", self), **short)) if short else self

    def _listed(self, *names: str) -> None:
        """Bring fields that hold one number per input into their form; a number beside lists stands for all inputs."""
        listed = {name: per_input(getattr(self, name)) for name in names}
        n = max(map(len, listed.values()), default=0)
        for name, given in listed.items():
            object.__setattr__(self, name, given * n if whole(getattr(self, name)) else given)

    def mappings(self, mapping: Mapping) -> tuple[Mapping, ...]:
        """What its models map, of a mapping of any number of outputs.

        Args:
            mapping: Which channels go in, which come out.

        Returns:
            The mapping where one model has all outputs, else one an output.
        """
        return (mapping,) if self.several_outputs else mapping.each

    def check_records(self, fitted: Sequence[str], run: Sequence[str], start: Start) -> None:
        """Refuse records that its models could not be run over; of most structures there are none.

        Args:
            fitted: Names of the estimation traces.
            run: Names of the traces that are run afterwards.
            start: How their free runs begin.

        Raises:
            ConfigError: If parameters differ by case, one of them is of none that is fitted, and its start shows no
                sample of it.
        """
        del fitted, run, start

    def check_mapping(self, mapping: Mapping) -> None:
        """Refuse channels that the structure is not for.

        Args:
            mapping: Which channels go in, which come out.

        Raises:
            ConfigError: If a field does not have one entry per channel, or the structure does not know one.
        """
        self.check_inputs(len(mapping.inputs))
        self.check_outputs(len(mapping.outputs))

    def check_outputs(self, n_outputs: int) -> None:
        """Refuse a number of outputs that a structure of several is not for.

        Args:
            n_outputs: Outputs of the mapping.

        Raises:
            ConfigError: If a field does not have one entry per output.
        """
        del n_outputs

    def check_inputs(self, n_inputs: int) -> None:
        """Refuse a number of inputs that the structure is not for.

        Args:
            n_inputs: Inputs of the mapping.

        Raises:
            ConfigError: If a field has neither one entry, for all inputs, nor one per input.
        """
        for name in self.per_input:
            given = getattr(self, name)
            if given is not None and len(given) != n_inputs and not (n_inputs and len(given) == 1):
                raise ConfigError(
                    "the orders do not match the inputs",
                    where=name,
                    expected=f"{n_inputs} values of {name}, one for each input, or one for all"
                    if n_inputs
                    else "an input",
                    got=f"{len(given)} values" if n_inputs else f"{name} for a mapping without input",
                    remedy=f"give one {name} for each input of the mapping, or one for all" if n_inputs else _WITHOUT,
                )


_WITHOUT = "name an input; of records without one an AR model is ARX with nb: [] and nk: []"


def _is_one(given: object) -> bool:
    """Whether a field says one number, whatever it stands for."""
    return isinstance(given, tuple) and len(given) == 1
