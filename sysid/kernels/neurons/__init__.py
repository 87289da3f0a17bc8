"""Kinds of neurons: one file a kind, and the table of them."""

from sysid.kernels.neurons.neuron import Neuron
from sysid.kernels.neurons.table import NEURONS, code_of

__all__ = ["NEURONS", "Neuron", "code_of"]
