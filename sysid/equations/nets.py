"""Networks within equations: what may be asked of one, and its operations."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sysid.equations.functions import OWN
from sysid.equations.graph import NORM, WEIGHT, Graph
from sysid.equations.lowered import Net
from sysid.equations.syntax import Call, Node, equation_error
from sysid.errors import ConfigError
from sysid.kernels import register_machine as machine

MOST_NEURONS = 200
MOST_WEIGHTS = 5_000


def asked(node: Call, text: str, number: Callable[[Node, str], float]) -> tuple[int, float | None]:
    """How many neurons a network has, and its scale.

    Args:
        node: The call.
        text: All equations, to show where something is wrong.
        number: What an option is, by what it is called.

    Returns:
        Neurons and scale; ``None`` where no scale is given.

    Raises:
        ConfigError: With line and column, of what cannot be.
    """
    options = dict(node.options)
    if not node.arguments or set(options) - {"neurons", "scale"} or "neurons" not in options:
        raise equation_error(
            "a network takes what it sees, and neurons",
            text,
            node.at,
            expected=f"{OWN['net'].says}, and a scale where one is known",
            remedy="write for example net(x, u, neurons=5)",
        )
    neurons = number(options["neurons"], "neurons")
    if neurons != round(neurons) or not 1 <= neurons <= MOST_NEURONS:
        raise equation_error(
            "not a number of neurons",
            text,
            node.at,
            expected=f"a whole number from 1 to {MOST_NEURONS}",
            remedy="write for example neurons=5",
        )
    return int(neurons), number(options["scale"], "a scale") if "scale" in options else None


def check_weights(net: Net) -> None:
    """Refuse a network whose weights, with those before, are too many."""
    if net.stop > MOST_WEIGHTS:
        raise ConfigError(
            "the networks have too many weights",
            where="equations",
            expected=f"at most {MOST_WEIGHTS:,}",
            got=net.stop,
            remedy="use fewer neurons",
        )


def layer(graph: Graph, net: Net, arguments: Sequence[int]) -> int:
    """A network as operations.

    Args:
        graph: Where they go.
        net: The network.
        arguments: The values that it sees.

    Returns:
        The value that it gives.
    """

    def weight(place: int) -> int:
        return graph.leaf(WEIGHT, place)

    def norm(place: int) -> int:
        return graph.leaf(NORM, net.norm + place)

    scaled = [
        graph.apply(machine.MUL, graph.apply(machine.SUB, value, norm(2 * i)), norm(2 * i + 1))
        for i, value in enumerate(arguments)
    ]
    total = weight(net.linear.stop - 1)
    for i, value in enumerate(scaled):
        total = graph.apply(machine.FMA, weight(net.linear.start + i), value, total)
    for j in range(net.neurons):
        row = net.first + j * (net.arguments + 1)
        inside = weight(row + net.arguments)
        for i, value in enumerate(scaled):
            inside = graph.apply(machine.FMA, weight(row + i), value, inside)
        total = graph.apply(machine.FMA, weight(net.readout.start + j), graph.apply(machine.TANH, inside), total)
    return graph.apply(machine.MUL, norm(2 * net.arguments), total)
