"""Limits that are expressions: each is a fixed submodel, and the limit its channel."""

from __future__ import annotations

from collections.abc import Mapping as Dict
from collections.abc import Sequence
from dataclasses import replace

from sysid.composite.fixed.equations import bounds_in, fixed_by_equations
from sysid.composite.fixed.expressions import channels_of
from sysid.composite.fixed.member import FixedMember, Standing
from sysid.equations.parser import parse
from sysid.equations.syntax import Delayed, Name, nodes_of
from sysid.equations.system import written_name
from sysid.errors import ConfigError
from sysid.models import Limit
from sysid.models.grey_box.declared import Parameter


def named_limits(
    standing: Sequence[Standing], limits: Dict[str, Limit], parameters: Dict[str, Parameter] | None = None
) -> tuple[tuple[FixedMember, ...], dict[str, Limit]]:
    """Limits by channels alone.

    Args:
        standing: All members and fixed submodels.
        limits: Limits of outputs, each side a number, a channel, or an expression of channels and parameters.
        parameters: What is estimated, by name; those that no limit names are ignored.

    Returns:
        A fixed submodel for each expression, called ``AR low`` or ``AR high``, in the instances of what it limits, with
        the limited channel's unit; and the limits, with these channels in the place of expressions.

    Raises:
        ConfigError: If an expression cannot be read.

    Example:
        >>> from sysid.models import Mapping
        >>> tank = Standing(mapping=Mapping.parse("pump -> level"))
        >>> (bound,), limits = named_limits((tank,), {"level": Limit(low=0, high="max(rim, level[k-1])")})
        >>> str(bound.mapping), bound.equation, limits["level"].high
        ('rim+level -> level high', 'max(rim, level[k-1])', 'level high')
    """
    channels = {one.channel(name, there) for one in standing for there in one.instances
                for name in (*one.mapping.inputs, one.output)}  # fmt: skip
    first = {one.output: one for one in standing}
    more: list[FixedMember] = []
    found = dict(limits)
    for output, limit in limits.items():
        for side in ("low", "high"):
            bound = getattr(limit, side)
            if not isinstance(bound, str) or bound in channels:
                continue
            if not _is_expression(bound) and bound not in (parameters or {}):
                continue
            name, own = f"{output} {side}", first.get(output)
            more += _submodels(name, bound, output, own, parameters or {})
            changed = found[output]
            found[output] = replace(changed, low=name) if side == "low" else replace(changed, high=name)
    return tuple(more), found


def _is_expression(text: str) -> bool:
    """Whether a text is more than the name of a channel."""
    try:
        (equation,) = parse(f"bound = {text}")
    except ConfigError:
        return any(sign in text for sign in "()[],*/<>=")  # wrong as an expression, which is told
    return not isinstance(equation.right, Name)


def _submodels(
    name: str, text: str, output: str, own: Standing | None, parameters: Dict[str, Parameter]
) -> list[FixedMember]:
    """One expression as fixed submodels, in all instances of the output where it is that of the first."""
    equation = f"{written_name(name)} = {text}"
    try:
        (parsed,) = parse(equation)
        read = {one.name for one in nodes_of(parsed.right) if isinstance(one, Name | Delayed)}
        named = tuple(one for one in parameters.values() if one.name in read)
        if named and not channels_of(parsed.right, parameters):  # a fixed submodel stands where what it reads stands
            equation = f"{written_name(name)} = {text} + 0*{written_name(output)}[k-1]"
        low, high = bounds_in(equation, parameters)
        rest = min(max(0.0, low), high)  # nobody reads what it was before
        members = fixed_by_equations(equation, rest=rest, parameters=named)
    except ConfigError as error:
        raise ConfigError(
            error.what, where=f"limits of {output}", expected=error.expected, got=text, remedy=error.remedy
        ) from None
    return [
        replace(
            one,
            bounds=output,
            instances=own.instances if own else one.instances,
            shared=tuple(shared for shared in (own.shared if own else ()) if shared in one.mapping.inputs),
        )
        for one in members
    ]
