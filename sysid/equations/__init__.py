"""Equations as text: parsed into a tree, lowered to programs that the register machine runs; never evaluated."""

from sysid.equations.implicit import MOST_STATES_IMPLICIT as MOST_STATES_IMPLICIT
from sysid.equations.lowered import ROSENBROCK as ROSENBROCK
from sysid.equations.lowered import RUNGE_KUTTA as RUNGE_KUTTA
from sysid.equations.lowered import SOLVERS as SOLVERS
from sysid.equations.lowered import Lowered as Lowered
from sysid.equations.lowered import Net as Net
from sysid.equations.lowered import Terms as Terms
from sysid.equations.lowering import lower as lower
from sysid.equations.system import System as System
