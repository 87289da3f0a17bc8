"""Kinds of structures as a search tries them: one row a kind, what comes first and what stands next to a good one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

from sysid.estimation.estimators import estimator_of
from sysid.models import (
    ARX,
    NARX,
    AbstractStructure,
    HammersteinWiener,
    LinearStateSpace,
    NeuralStateSpace,
    PolynomialNARX,
    TransferFunction,
    VectorARX,
    VectorGreyBox,
    VectorNARX,
    WienerHammerstein,
)
from sysid.models.blocks.curves import NONE
from sysid.models.orders.output_limits import FOUND
from sysid.workbench.auto.look import Looked

CURVE = "piecewise 6"
"""A learnt curve that can be any."""
LINEAR_ORDERS = range(1, 5)
FURTHER_ORDERS = ((5, 6), (8, 10), (12, 14), (16, 18), (20,))
"""States of linear models beyond those, round by round: tried as long as the last round gained."""
FEWEST_STATES, MOST_STATES = 2, 6
"""Of a network that is tried first: what a curve hides from a linear model may have a state of its own; and from how
many on a smaller one is tried before it."""
BLOCK_STATES = 6
"""Of a block at most; a linear model has more."""
MANY_STATES = 4
"""Of a linear model, from which on two blocks are tried before networks, if more are shown or needed."""
LEAST_BLOCK, LARGEST_BLOCK = 3, 4
"""States of two blocks that are tried first where they lead, by how many the record shows."""
BLOCK_LATE = 3
"""Samples of dead time that a filter of few states may look like."""
CORNERS = (4, 8, 12)
"""Of a curve between two blocks whose corners are round, the least first."""
FROM_THERE = {"starts": 1, "shooting": "growing", "max_iterations": 100}
"""Training of equations whose numbers to begin with were found in the record."""
ONE_STEP = {"pretraining": 2000, "pretraining_iterations": 100}
"""Training that begins one step ahead, at a small part of its price."""
REGULARISATIONS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0)
"""Fixed weights of the size of the parameters; the evidence finds its own where none is given."""


@dataclass(frozen=True, kw_only=True)
class Try:
    """One thing to try.

    Args:
        structure: What is fitted.
        training: Options of its training; empty for its defaults.
    """

    structure: AbstractStructure
    training: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Family:
    """A kind of structure in the search.

    Args:
        kind: As results name it.
        linear: Whether it is tried in the first round.
        first: What of it is tried unasked.
        leads: Whether it is tried before other kinds, where there may not be time for all.
        waits: Whether it is tried after all other kinds where it does not lead, as it takes several times as long.
        around: What stands next to one of it, the most promising first; nothing for what is tried in full at once.
        larger: Rounds of it that are tried as long as the one before gained.
        in_motion: What of it is tried before all else where runs do not begin at rest: what learns where it begins, or
            remembers one sample alone.
        at_ends: What of it is tried before all else where outputs stand at ends: what is held there.
        adds_up: What of it is tried before all else where outputs add up what inputs bring.
        at_events: What of it is tried before all else where outputs jump at events.
        at_once: What of it is tried before all else where outputs follow from inputs at the same time alone.
        held: What of it is tried, one by one, before networks where something is known to hold an output.
    """

    kind: str
    linear: bool
    first: Callable[[Looked], Sequence[Try]]
    leads: Callable[[Looked], bool] = lambda _: False
    waits: bool = False
    around: Callable[[Try, Looked], Sequence[Try]] = lambda _, __: ()
    larger: Callable[[Looked], Sequence[Sequence[Try]]] = lambda _: ()
    in_motion: Callable[[Looked], Sequence[Try]] = lambda _: ()
    at_ends: Callable[[Looked], Sequence[Try]] = lambda _: ()
    adds_up: Callable[[Looked], Sequence[Try]] = lambda _: ()
    at_events: Callable[[Looked], Sequence[Try]] = lambda _: ()
    at_once: Callable[[Looked], Sequence[Try]] = lambda _: ()
    held: Callable[[Looked], Sequence[Try]] = lambda _: ()


def _arx(looked: Looked) -> list[Try]:
    return [Try(structure=one) for one in looked.orders]


def _vector_arx(looked: Looked) -> list[Try]:
    """Of several outputs the orders of one, each reading the past of all, and their share where all have the states."""
    n, found = looked.n_outputs, []
    for one in looked.orders if n > 1 else ():
        for k in (n, 1):
            nb = tuple(-(-count // k) for count in one.nb)
            found.append(VectorARX(na=((-(-one.na // k),),), nb=(nb,), nk=(one.nk,)))
    return [Try(structure=one) for one in dict.fromkeys(found)]


def _shortest_arx(looked: Looked) -> list[Try]:
    """One past output is known at the beginning, where that before it is not."""
    m = looked.n_inputs
    return [Try(structure=ARX(na=1, nb=(1,) * m, nk=(looked.delay,) * m))]


def _state_space(states: int, looked: Looked) -> Try:
    return Try(structure=LinearStateSpace(states=states, noise=False, feedthrough=looked.delay == 0))


def _state_spaces(looked: Looked) -> list[Try]:
    return [_state_space(n, looked) for n in LINEAR_ORDERS]


def _larger_state_spaces(looked: Looked) -> list[list[Try]]:
    return [[_state_space(n, looked) for n in some] for some in FURTHER_ORDERS]


def _transfer_functions(looked: Looked) -> list[Try]:
    m = looked.n_inputs
    orders = [n for n in LINEAR_ORDERS[:2] if m]
    return [
        Try(structure=TransferFunction(poles=(n,) * m, zeros=(n - 1,) * m, delays=(looked.delay,) * m)) for n in orders
    ]


def _neural(looked: Looked) -> list[Try]:
    if looked.exact:
        return _neural_exact(looked)
    if looked.integrators:
        return _neural_sums(looked)
    n = min(max(looked.states, FEWEST_STATES), MOST_STATES)
    sizes = ((n, 8, None), (n, 8, 0.03), (max(n - 1, FEWEST_STATES), 8, 0.1), (n, 4, 1e-3), (n + 1, 8, 0.03))
    found = [
        Try(structure=NeuralStateSpace(states=n, neurons=k), training={} if r is None else {"regularisation": r})
        for n, k, r in sizes
    ]
    if looked.needed > MOST_STATES:
        found.insert(0, Try(structure=NeuralStateSpace(states=looked.needed, neurons=8)))
    if looked.never_negative:
        signless = NeuralStateSpace(states=3, neurons=4, output="absolute")
        found.append(Try(structure=signless, training={"regularisation": 1e-2}))
    return found


def _neural_exact(looked: Looked) -> list[Try]:
    """Of records without noise: as many states as the past shows clearly, where errors of a linear model hide some.

    A motor's winding warms a thousand times slower than it turns, and what is not linear in either hid the third state
    from linear models. They may be no worse for a sum that is none either: what adds up is one among others.
    """
    n, sums = min(max(looked.states, looked.clear, FEWEST_STATES), MOST_STATES), looked.integrators
    found = [NeuralStateSpace(states=a, neurons=k) for a, k in ((n, 8), (n, 16), (n + 1, 12))]
    if sums:
        found.insert(1, NeuralStateSpace(states=max(n, sums + 1), neurons=8, integrators=sums, integrators_seen=True))
    return [Try(structure=one) for one in found]


def _neural_sums(looked: Looked) -> list[Try]:
    """Few neurons where they do not see what adds up; more where they do, as for what depends on the place."""
    sizes = ((1, 0, None, False), (1, 1, 1e-3, False), (1, 2, 1e-3, False), (1, 4, 1.0, True), (1, 8, 1.0, True))
    sums = looked.integrators
    return [
        Try(
            structure=NeuralStateSpace(states=sums + n, neurons=k, integrators=sums, integrators_seen=seen),
            training={} if r is None else {"regularisation": r},
        )
        for n, k, r, seen in sizes
    ]


def _neural_in_motion(looked: Looked) -> list[Try]:
    """Those with a state for each output first: a short search comes to no others, and fewer cannot tell two apart."""
    if looked.exact and looked.clear > FEWEST_STATES:
        return _neural_exact(looked)[:2]
    sizes = sorted(((1, 4), (2, 8), (3, 8), (2, 0), (3, 0)), key=lambda size: size[0] < min(looked.n_outputs, 3))
    return [Try(structure=NeuralStateSpace(states=n, neurons=k)) for n, k in sizes]


def _around_neural(one: Try, looked: Looked) -> list[Try]:
    network = cast("NeuralStateSpace", one.structure)
    wider = {"neurons": round(1.6 * network.neurons) + 1}
    narrower = {"neurons": max(1, round(0.6 * network.neurons))}
    moves: list[dict[str, Any]] = [{"states": network.states + 1}, wider]
    if network.neurons:
        # A curve in a linear plant acts in one direction; on the output too, where the block behind it answers at once.
        few = network.directions
        moves.append({"directions": 1, "output_neurons": network.neurons} if few is None else {"directions": few + 1})
    if network.integrators:
        moves.insert(0, {"integrators_seen": not network.integrators_seen})
    elif looked.never_negative:
        moves.insert(0, {"output": "absolute" if network.output == "plain" else "plain"})
    moves += [{"states": network.states - 1}] if network.states > 1 + network.integrators else []
    moves += [{"activation": "cubic" if network.activation == "tanh" else "tanh"}, narrower]
    return _changed(one, moves) if looked.exact else _moved(one, moves)


def _narx(looked: Looked) -> list[Try]:
    return [_narx_of(looked.lags, neurons, looked) for neurons in (4, 10)]


def _narx_at_once(looked: Looked) -> list[Try]:
    """Curves without memory: more inputs have more corners."""
    least = 8 + 4 * looked.n_inputs
    sizes = (least, 2 * least) if looked.static else ()
    return [Try(structure=NARX(input_delays="0:0", output_delays=[], neurons=n)) for n in sizes]


def _narx_at_ends(looked: Looked) -> list[Try]:
    """What is held where the output stands in the records; of several outputs where each does.

    Friction and stops switch within a sample, which a start that is trained one step ahead finds. At a stop past
    outputs do not show what goes on behind it, a pump that runs down: past inputs do, over as long as that takes.
    """
    found: list[Try] = []
    if not looked.all_end:
        return found
    for lags, own, neurons in ((3, 3, 8), (5, 3, 14), (12, 1, 12)):
        first = min(looked.delay, 1)
        inputs = f"{first}:{first + lags - 1}"
        network = NARX(input_delays=inputs, output_delays=own, neurons=neurons, limits=FOUND)
        found.append(Try(structure=network, training=ONE_STEP))
    return found


def _vector_at_ends(looked: Looked) -> list[Try]:
    """Of several outputs one network: a speed reads that the position beside it stands at its stop."""
    first = min(looked.delay, 1)
    sizes = ((3, 2, 12), (6, 2, 16)) if looked.n_outputs > 1 else ()
    return [
        Try(
            structure=VectorNARX(
                input_delays=f"{first}:{first + lags - 1}", output_delays=own, neurons=neurons, limits=FOUND
            )
        )
        for lags, own, neurons in sizes
    ]


def _narx_of(lags: int, neurons: int, looked: Looked) -> Try:
    inputs = f"{looked.delay}:{looked.delay + lags - 1}" if looked.n_inputs else []
    return Try(structure=NARX(input_delays=inputs, output_delays=lags, neurons=neurons))


def _around_narx(one: Try, _: Looked) -> list[Try]:
    network = cast("NARX", one.structure)
    shortest = min(len(lags) for lags in (*network.input_delays, network.output_delays) if lags)
    moves: list[dict[str, Any]] = [
        {"neurons": round(1.6 * network.neurons) + 1},
        {"gated": not network.gated},
        *([_lags(network, more) for more in (1, -1) if shortest + more >= 1]),
        {"neurons": max(1, round(0.6 * network.neurons))},
    ]
    return _moved(one, moves)


def _lags(network: NARX, more: int) -> dict[str, Any]:
    inputs, output = (
        [list(range(lags[0], lags[0] + len(lags) + more)) if lags else [] for lags in some]
        for some in (network.input_delays, (network.output_delays,))
    )
    return {"input_delays": inputs, "output_delays": output[0]}


def _blocks(looked: Looked) -> list[Try]:
    curves = [{"input": CURVE}, {"output": CURVE}] if looked.n_inputs else []
    return [Try(structure=HammersteinWiener(states=2, delays=looked.delay, **curve)) for curve in curves]


def _around_blocks(one: Try, _: Looked) -> list[Try]:
    blocks = cast("HammersteinWiener", one.structure)
    before = any(curve.kind != NONE for curve in blocks.input)
    other = {"output": CURVE if blocks.output.kind == NONE else NONE} if before else {"input": CURVE}
    sizes = [{"states": n} for n in (blocks.states + 1, blocks.states - 1) if 1 <= n <= BLOCK_STATES]
    return _changed(one, [*sizes[:1], other, *sizes[1:]])


def _two_blocks(looked: Looked) -> list[Try]:
    """A curve between two blocks; what looks like a dead time of few samples is left to the first of them."""
    delays, each = max(looked.delay - BLOCK_LATE, 0), min(max(-(-looked.shown // 2), LEAST_BLOCK), LARGEST_BLOCK)
    sizes = (each,) if _has_many_states(looked) else (2, 3)
    return [
        Try(structure=WienerHammerstein(first=n, second=n, curve=f"rounded {CORNERS[0]}", delays=delays))
        for n in sizes
        if looked.n_inputs
    ]


def _has_many_states(looked: Looked) -> bool:
    """Whether a linear model has more states than small networks: these then say little, and blocks have them."""
    return looked.states >= MANY_STATES and looked.needed > MANY_STATES


def _around_two_blocks(one: Try, _: Looked) -> list[Try]:
    """What is bent between the samples, too; more corners; blocks of more states and of fewer."""
    blocks = cast("WienerHammerstein", one.structure)
    corners = blocks.curve.size
    more, fewer = ([n for n in CORNERS if n > corners], [n for n in CORNERS if n < corners][::-1])
    moves: list[dict[str, Any]] = [{"between": 1 - blocks.between}] if blocks.between <= 1 else []
    moves += [{"curve": f"rounded {n}"} for n in more[:1]]
    for by in (1, -1):
        sizes = [(blocks.first + by, blocks.second + by), (blocks.first + by, blocks.second)]
        sizes += [(blocks.first, blocks.second + by)]
        moves += [{"first": a, "second": b} for a, b in sizes if min(a, b) >= 1 and max(a, b) <= BLOCK_STATES]
    moves += [{"curve": f"rounded {n}"} for n in fewer[:1]]
    return _changed(one, moves)


def _polynomials(looked: Looked) -> list[Try]:
    lags = min(looked.lags, 4)
    delays = f"{looked.delay}:{looked.delay + lags - 1}" if looked.n_inputs else []
    return [Try(structure=PolynomialNARX(input_delays=delays, output_delays=lags, degree=d)) for d in (2, 3)]


def _moved(one: Try, moves: Sequence[Mapping[str, Any]]) -> list[Try]:
    """The structure with some of its fields changed; then other regularisations of the structure itself."""
    moved = _changed(one, moves)
    weights = [replace(one, training={**one.training, "regularisation": r}) for r in _regularisations(one)]
    return [moved[0], *weights[:1], *moved[1:3], *weights[1:], *moved[3:]]


def _changed(one: Try, moves: Sequence[Mapping[str, Any]]) -> list[Try]:
    fields = one.structure.to_dict()
    kind = type(one.structure)
    return [
        Try(structure=kind(**{k: v for k, v in {**fields, **move}.items() if k != "kind"}), training=one.training)
        for move in moves
    ]


def _regularisations(one: Try) -> list[float]:
    now = one.training.get("regularisation")
    if now is None:
        return [0.1, 1e-3]
    place = REGULARISATIONS.index(now)
    return [REGULARISATIONS[i] for i in (place + 1, place - 1) if 0 <= i < len(REGULARISATIONS)]


def suggested(looked: Looked, *, linear: bool) -> list[Try]:
    """What a look at the data suggests, before anything else.

    Args:
        looked: What was found.
        linear: Linear structures, or the others.

    Returns:
        What to try.
    """
    found = [one for one in looked.suggested if estimator_of(one).linear is linear]
    return [Try(structure=one) for one in found]


FAMILIES = (
    Family(kind=ARX.kind, linear=True, first=_arx, in_motion=_shortest_arx),
    Family(kind=VectorARX.kind, linear=True, first=_vector_arx),
    Family(kind=TransferFunction.kind, linear=True, first=_transfer_functions),
    Family(kind=LinearStateSpace.kind, linear=True, first=_state_spaces, larger=_larger_state_spaces),
    Family(
        kind=NeuralStateSpace.kind,
        linear=False,
        first=_neural,
        around=_around_neural,
        in_motion=_neural_in_motion,
        adds_up=lambda looked: [] if looked.exact else _neural_sums(looked),
    ),
    Family(
        kind=WienerHammerstein.kind,
        linear=False,
        first=_two_blocks,
        around=_around_two_blocks,
        leads=_has_many_states,
        waits=True,
    ),
    Family(
        kind=NARX.kind,
        linear=False,
        first=_narx,
        around=_around_narx,
        in_motion=lambda looked: [_narx_of(1, 10, looked)],
        at_ends=_narx_at_ends,
        at_once=_narx_at_once,
    ),
    Family(kind=VectorNARX.kind, linear=False, first=lambda _: [], at_ends=_vector_at_ends),
    Family(
        kind=VectorGreyBox.kind,
        linear=False,
        first=lambda _: [],
        at_events=lambda looked: [] if looked.resets is None else [Try(structure=looked.resets)],
        held=lambda looked: [Try(structure=one, training=FROM_THERE) for one in looked.mechanism],
    ),
    Family(kind=HammersteinWiener.kind, linear=False, first=_blocks, around=_around_blocks),
    Family(kind=PolynomialNARX.kind, linear=False, first=_polynomials),
)
"""All of them, in the order in which they are tried."""
