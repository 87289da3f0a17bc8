"""Affine functions and products of neurons, eight at a time, with their sums held in vector registers.

The compiler vectorises a loop over neurons by itself, but keeps their sums in memory and checks at every row whether
they overlap with the weights: for the twenty to forty neurons of a member that takes longer than the arithmetic
(measured: 80 ns for 32 neurons of 18 regressors; 34 ns here). So the vectors are written down: :func:`affine` and
:func:`dot` are given to the compiler in its own language, as vectors of eight doubles, which it maps to whatever
registers there are.

Weights stand in blocks of eight neurons, each block row by row: eight weights for each regressor, then eight constants.
"""

from __future__ import annotations

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


def _add_product(builder: Any, total: Any, left: Any, right: Any) -> None:
    """Add a product to the sum in ``total``."""
    product = builder.fmul(left, right, flags=_FUSED)
    builder.store(builder.fadd(builder.load(total), product, flags=_FUSED), total)


def _lanes(*indices: int) -> Any:
    """Which lanes a shuffle takes."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(indices)), list(indices))


@intrinsic
def affine(_context: Any, weights: Any, first: Any, n_x: Any, x: Any, out: Any, to: Any, blocks: Any) -> Any:
    """Write the affine functions of ``x`` of some blocks of neurons; indices are not checked.

    Args:
        _context: Numba's.
        weights: Flat, laid out as the head of the module says.
        first: Where the first block begins.
        n_x: Number of regressors.
        x: Regressors, shape ``(n_x,)`` or longer.
        out: Written from ``to`` on.
        to: Where the first neuron stands.
        blocks: Blocks of eight neurons.
    """
    _check(weights=weights, x=x, out=out)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        w = _data(context, builder, signature.args[0], arguments[0])
        regressors = _data(context, builder, signature.args[3], arguments[3])
        result = _data(context, builder, signature.args[4], arguments[4])
        start, rows, to_first, count = arguments[1], arguments[2], arguments[5], arguments[6]
        lanes, none = ir.Constant(_INDEX, LANES), ir.Constant(_VECTOR, ir.Undefined)
        constants = builder.mul(rows, lanes)
        total = cgutils.alloca_once(builder, _VECTOR)
        with cgutils.for_range(builder, count) as block:
            own = builder.add(start, builder.mul(block.index, builder.add(constants, lanes)))
            builder.store(_load(builder, w, builder.add(own, constants)), total)
            with cgutils.for_range(builder, rows) as row:
                one = builder.load(builder.gep(regressors, [row.index]))
                one = builder.insert_element(none, one, ir.Constant(ir.IntType(32), 0))
                everywhere = builder.shuffle_vector(one, none, _lanes(*[0] * LANES))
                column = _load(builder, w, builder.add(own, builder.mul(row.index, lanes)))
                _add_product(builder, total, column, everywhere)
            place = _vector_at(builder, result, builder.add(to_first, builder.mul(block.index, lanes)))
            builder.store(builder.load(total), place).align = 8
        return context.get_dummy_value()

    return types.void(weights, first, n_x, x, out, to, blocks), generate


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
