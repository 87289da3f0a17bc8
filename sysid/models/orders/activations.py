"""Which kinds of neurons a network may have."""

from __future__ import annotations

from typing import Annotated

from sysid.errors import ConfigError, shortened
from sysid.kernels.neurons import NEURONS
from sysid.models.orders.ranges import Among

PLAIN = "tanh"
"""The kind of a network that does not say."""


Activation = Annotated[str, Among(choices=tuple(NEURONS))]
"""The field of a structure; a sweep that is told no kinds tries all."""


def check_activation(name: object) -> None:
    """Refuse a kind of neuron that there is not.

    Args:
        name: The word for it.

    Raises:
        ConfigError: If no kind is called so.
    """
    if not isinstance(name, str) or name not in NEURONS:
        raise ConfigError(
            "unknown activation",
            where="activation",
            expected=" or ".join(NEURONS),
            got=shortened(name),
            remedy=f"write for example activation: {PLAIN}",
        )
