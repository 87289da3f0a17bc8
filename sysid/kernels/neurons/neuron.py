"""What a kind of neuron is: its function, compiled and in every language that a model is written in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FAR = 1e6
"""A sum that no bounded neuron makes as much of."""


class Graph(Protocol):
    """What of an ONNX graph under construction a neuron needs."""

    def add(self, operator: str, inputs: list[str], output: str) -> str:
        """Add a node with one output, whose name it gives back."""

    def numbers(self, name: str, values: float) -> str:
        """Add a constant of the graph's number type, whose name it gives back."""


@dataclass(frozen=True, kw_only=True)
class Neuron:
    """A kind of neuron: what it makes of the weighted sum ``x`` of what it reads.

    The compiled pair of a kind, ``values`` and ``with_slopes``, is called by its code in
    ``sysid/kernels/neurons/table.py``: a compiled loop cannot look anything up.

    Args:
        name: The word for it in ``activation``.
        description: What it is good for, as a phrase.
        value: The function in numpy, elementwise.
        slope: Its derivative in numpy, elementwise.
        c: The function as a C expression of ``x``, a ``real``; numbers as ``R(1.0)``, functions of ``tgmath`` not at
            all: the file may be compiled for float.
        onnx: Adds the function's nodes to a graph, from the name of the sums and the name of what comes out.
        torch: Makes a torch module of the function that can be scripted.
        jax: Gives the function in ``jax.numpy``, elementwise.
        matlab: The function as a MATLAB expression of ``x``, elementwise.
        st: The function as an expression of Structured Text (IEC 61131-3) of ``{x}``; ``{tanh}`` is a function's name.
    """

    name: str
    description: str
    value: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    slope: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    c: str
    onnx: Callable[[Graph, str, str], str]
    torch: Callable[[], Any]
    jax: Callable[[], Callable[[Any], Any]]
    matlab: str
    st: str

    @property
    def bounded(self) -> bool:
        """Whether what comes out stays below some number, however large the sum is."""
        return bool(np.abs(self.value(np.array([-FAR, FAR]))).max() < FAR)
