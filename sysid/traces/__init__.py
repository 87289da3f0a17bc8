"""Trace and TraceSet: the words that every other room speaks.

A **trace** is one experiment: a uniform sample time, named channels with units, float64, frozen. A
**trace set** is a group of traces with a role each. Experiments are never concatenated: a recursion
starts afresh in each of them.
"""

from sysid.traces.channel import Channel
from sysid.traces.trace import Trace
from sysid.traces.trace_set import Role, TraceSet
from sysid.traces.unit_check import check_units

__all__ = ["Channel", "Role", "Trace", "TraceSet", "check_units"]
