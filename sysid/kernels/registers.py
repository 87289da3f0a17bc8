r"""Affine functions of neurons, their products and hyperbolic tangents, eight at a time in vector registers.

The compiler vectorises a loop over neurons by itself, but keeps their sums in memory and checks at every row whether
they overlap with the weights: for the twenty to forty neurons of a member that takes longer than the arithmetic
(measured: 80 ns for 32 neurons of 18 regressors; 34 ns here). And a library's tanh is a call per number, which takes
three quarters of a free run's time. So the vectors are written down, in the compiler's own language, as vectors of
eight doubles, which it maps to whatever registers there are.

For :func:`affine` weights stand in blocks of eight neurons, each block row by row: eight weights for each regressor,
then eight constants.

:func:`tanh` is :math:`\tanh |x| = (1-t)/(1+t)` with :math:`t = e^{-2|x|} = 2^m e^r` and :math:`m` the integer next to
:math:`-2|x|/\ln 2`. Adding a number so large that its last digit is one leaves :math:`m` in the lowest bits, from where
a shift takes it to the exponent. :math:`r` is at most :math:`\ln(2)/2`, where the Taylor polynomial of degree 12 has a
truncation error of 2e-16; it is summed as a tree, since one term after the other would be waited for twelve times. All
of it holds where a caller lets sums be reordered.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

LANES = 8
"""Neurons in a block: the doubles in the widest register there is; on narrower ones the compiler takes several."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(64)
_INTEGERS = ir.VectorType(_INDEX, LANES)
# A product and a sum may become one instruction, as they do in the loops that are left to the compiler.
_FUSED = ("contract",)


def _check(**arrays: Any) -> None:
    """Refuse what is not a contiguous array of doubles: its numbers are read where they would stand."""
    for name, one in arrays.items():
        if not isinstance(one, types.Array) or one.layout != "C" or one.dtype != types.float64:
            raise TypingError(f"{name}: expected a contiguous array of float64, got {one}")


def _data(context: Any, builder: Any, array_type: Any, array: Any) -> Any:
    """Pointer to the first number of a contiguous array."""
    return context.make_array(array_type)(context, builder, array).data


def _vector_at(builder: Any, data: Any, index: Any) -> Any:
    """Pointer to eight numbers from ``index`` on."""
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


def _load(builder: Any, data: Any, index: Any) -> Any:
    """Eight numbers from ``index`` on, which need not stand where a register would like them to."""
    loaded = builder.load(_vector_at(builder, data, index))
    loaded.align = 8
    return loaded


def _store(builder: Any, value: Any, data: Any, index: Any) -> None:
    """Write eight numbers from ``index`` on."""
    builder.store(value, _vector_at(builder, data, index)).align = 8


def _add_product(builder: Any, total: Any, left: Any, right: Any) -> None:
    """Add a product to the sum in ``total``."""
    product = builder.fmul(left, right, flags=_FUSED)
    builder.store(builder.fadd(builder.load(total), product, flags=_FUSED), total)


def _lanes(*indices: int) -> Any:
    """Which lanes a shuffle takes."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(indices)), list(indices))


_TAYLOR = tuple(1.0 / math.factorial(n) for n in range(13))
_INTEGER = 1.5 * 2.0**52
"""A double so large that its last binary digit is one, with room for a sign."""
_BEYOND = 20.0
"""From here on tanh is 1 in double precision."""


def _intrinsic(builder: Any, name: str, *arguments: Any) -> Any:
    """An operation on vectors that the compiler knows by name."""
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(arguments))
    return builder.call(builder.module.declare_intrinsic(f"llvm.{name}.v{LANES}f64", fnty=kind), arguments)


def _exponential(builder: Any, y: Any) -> Any:
    """The exponential of eight numbers between -2 ``_BEYOND`` and 0."""

    def constant(value: float) -> Any:
        return ir.Constant(_VECTOR, [value] * LANES)

    def add(a: Any, b: Any) -> Any:
        return builder.fadd(a, b, flags=_FUSED)

    def multiply(a: Any, b: Any) -> Any:
        return builder.fmul(a, b, flags=_FUSED)

    m = _intrinsic(builder, "rint", multiply(y, constant(1.0 / math.log(2.0))))
    r = add(y, multiply(m, constant(-math.log(2.0))))
    powers, terms = r, [constant(value) for value in _TAYLOR]
    while len(terms) > 1:
        pairs = [add(low, multiply(high, powers)) for low, high in zip(terms[::2], terms[1::2], strict=False)]
        terms, powers = pairs + terms[2 * len(pairs) :], multiply(powers, powers)
    exponent = builder.bitcast(add(m, constant(_INTEGER)), _INTEGERS)
    exponent = builder.shl(exponent, ir.Constant(_INTEGERS, [52] * LANES))
    exponent = builder.add(exponent, ir.Constant(_INTEGERS, [1023 << 52] * LANES))
    return multiply(terms[0], builder.bitcast(exponent, _VECTOR))


def _tanh(builder: Any, x: Any) -> Any:
    """The hyperbolic tangents of eight numbers."""
    one, beyond = ir.Constant(_VECTOR, [1.0] * LANES), ir.Constant(_VECTOR, [_BEYOND] * LANES)
    size = _intrinsic(builder, "fabs", x)
    # What is not a number is not larger, and stays.
    size = builder.select(builder.fcmp_ordered(">", size, beyond), beyond, size)
    t = _exponential(builder, builder.fmul(size, ir.Constant(_VECTOR, [-2.0] * LANES)))
    quotient = builder.fdiv(builder.fsub(one, t), builder.fadd(one, t))
    return _intrinsic(builder, "copysign", quotient, x)


@intrinsic
def tanh(_context: Any, a: Any, first: Any, n: Any) -> Any:
    """Replace some numbers by their hyperbolic tangents, to the last digit but one; indices are not checked.

    Args:
        _context: Numba's.
        a: Flat; what is not a number stays so.
        first: Where the numbers begin.
        n: How many; those beyond a multiple of eight are gathered one by one.
    """
    _check(a=a)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = _data(context, builder, signature.args[0], arguments[0])
        lanes = ir.Constant(_INDEX, LANES)
        with cgutils.for_range(builder, builder.udiv(arguments[2], lanes)) as block:
            at = builder.add(arguments[1], builder.mul(block.index, lanes))
            _store(builder, _tanh(builder, _load(builder, data, at)), data, at)
        rest = builder.urem(arguments[2], lanes)
        with builder.if_then(builder.icmp_unsigned(">", rest, ir.Constant(_INDEX, 0)), likely=False):
            at = builder.sub(builder.add(arguments[1], arguments[2]), rest)
            gathered = cgutils.alloca_once_value(builder, ir.Constant(_VECTOR, [0.0] * LANES))
            with cgutils.for_range(builder, rest) as lane:
                one = builder.load(builder.gep(data, [builder.add(at, lane.index)]))
                builder.store(builder.insert_element(builder.load(gathered), one, lane.index), gathered)
            found = _tanh(builder, builder.load(gathered))
            with cgutils.for_range(builder, rest) as lane:
                one = builder.extract_element(found, lane.index)
                builder.store(one, builder.gep(data, [builder.add(at, lane.index)]))
        return context.get_dummy_value()

    return types.void(a, first, n), generate


_AT_ONCE = (4, 2, 1)
"""Blocks whose sums are formed side by side: a sum waits four cycles for each of its products."""


@intrinsic
def affine(
    _context: Any, weights: Any, first: Any, n_x: Any, x: Any, x_first: Any,
    h: Any, h_first: Any, h_blocks: Any, g: Any, g_first: Any, g_blocks: Any,
) -> Any:  # fmt: skip
    """Write the affine functions of ``x`` of some blocks of neurons and of some of gates; indices are not checked.

    Args:
        _context: Numba's.
        weights: Flat, laid out as the head of the module says, neurons before gates.
        first: Where the first block begins.
        n_x: Number of regressors.
        x: Flat.
        x_first: Where the regressors begin.
        h: The neurons' are written from ``h_first`` on.
        h_first: Where the first neuron stands.
        h_blocks: Blocks of eight neurons.
        g: The gates' are written from ``g_first`` on.
        g_first: Where the first gate stands.
        g_blocks: Blocks of eight gates.
    """
    _check(weights=weights, x=x, h=h, g=g)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = signature.args
        w, regressors, neurons, gates = (_data(context, builder, kinds[i], arguments[i]) for i in (0, 3, 5, 8))
        start, rows, x_at, h_at, h_count, g_at, g_count = (arguments[i] for i in (1, 2, 4, 6, 7, 9, 10))
        lanes = ir.Constant(_INDEX, LANES)
        constants = builder.mul(rows, lanes)
        length = builder.add(constants, lanes)

        def place(block: Any) -> Any:
            """Where the sums of a block are written."""
            to_h = builder.gep(neurons, [builder.add(h_at, builder.mul(block, lanes))])
            beyond = builder.mul(builder.sub(block, h_count), lanes)
            to_g = builder.gep(gates, [builder.add(g_at, beyond)])
            return builder.select(builder.icmp_unsigned("<", block, h_count), to_h, to_g)

        def sum_up(block: Any, some: int) -> None:
            """Write the sums of so many blocks from ``block`` on."""
            blocks = [builder.add(block, ir.Constant(_INDEX, i)) for i in range(some)]
            owns = [builder.add(start, builder.mul(one, length)) for one in blocks]
            totals = [cgutils.alloca_once(builder, _VECTOR) for _ in blocks]
            for own, total in zip(owns, totals, strict=True):
                builder.store(_load(builder, w, builder.add(own, constants)), total)
            with cgutils.for_range(builder, rows) as row:
                everywhere = _spread(builder, builder.load(builder.gep(regressors, [builder.add(x_at, row.index)])))
                along = builder.mul(row.index, lanes)
                for own, total in zip(owns, totals, strict=True):
                    _add_product(builder, total, _load(builder, w, builder.add(own, along)), everywhere)
            for one, total in zip(blocks, totals, strict=True):
                _store(builder, builder.load(total), place(one), ir.Constant(_INDEX, 0))

        _by_numbers(builder, builder.add(h_count, g_count), sum_up)
        return context.get_dummy_value()

    return types.void(weights, first, n_x, x, x_first, h, h_first, h_blocks, g, g_first, g_blocks), generate


def _spread(builder: Any, one: Any) -> Any:
    """A number in all lanes."""
    none = ir.Constant(_VECTOR, ir.Undefined)
    lane = builder.insert_element(none, one, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(lane, none, _lanes(*[0] * LANES))


def _by_numbers(builder: Any, count: Any, work: Callable[[Any, int], None]) -> None:
    """Go through some blocks, as many of them at once as there are left."""
    done = ir.Constant(_INDEX, 0)
    for some in _AT_ONCE:
        size = ir.Constant(_INDEX, some)
        turns = builder.udiv(builder.sub(count, done), size)
        with cgutils.for_range(builder, turns) as turn:
            work(builder.add(done, builder.mul(turn.index, size)), some)
        done = builder.add(done, builder.mul(turns, size))


@intrinsic
def dot(_context: Any, left: Any, left_first: Any, right: Any, right_first: Any, blocks: Any) -> Any:
    """The sum of the products of two stretches of numbers, some blocks of eight long; indices are not checked.

    Args:
        _context: Numba's.
        left: Flat.
        left_first: Where its stretch begins.
        right: Flat.
        right_first: Where its stretch begins.
        blocks: Blocks of eight numbers.

    Returns:
        The sum.
    """
    _check(left=left, right=right)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        a = _data(context, builder, signature.args[0], arguments[0])
        b = _data(context, builder, signature.args[2], arguments[2])
        total = cgutils.alloca_once_value(builder, ir.Constant(_VECTOR, [0.0] * LANES))
        with cgutils.for_range(builder, arguments[4]) as block:
            along = builder.mul(block.index, ir.Constant(_INDEX, LANES))
            one = _load(builder, a, builder.add(arguments[1], along))
            _add_product(builder, total, one, _load(builder, b, builder.add(arguments[3], along)))
        summed, wide = builder.load(total), LANES
        while wide > 1:
            wide //= 2
            low = builder.shuffle_vector(summed, summed, _lanes(*range(wide)))
            high = builder.shuffle_vector(summed, summed, _lanes(*range(wide, 2 * wide)))
            summed = builder.fadd(low, high)
        return builder.extract_element(summed, ir.Constant(ir.IntType(32), 0))

    return types.float64(left, left_first, right, right_first, blocks), generate
