"""What a model is: structure, parameters, scaling, initial state; free run and prediction."""

from sysid.models.arx import ARX, ARXModel
from sysid.models.base import AbstractModel, AbstractStructure
from sysid.models.form import AbstractForm
from sysid.models.history import History, Start, StartKind
from sysid.models.ladder import Domain
from sysid.models.lags import Lags
from sysid.models.mapping import Mapping
from sysid.models.narx import NARX, NARXModel
from sysid.models.recursion import Recursion, parameter_count
from sysid.models.scaling import Scaling
from sysid.models.state_space import StateSpace
from sysid.models.store import model_from_dict, structure_from_dict
from sysid.models.transfer_function import TransferFunction, TransferFunctionModel

__all__ = [
    "ARX",
    "NARX",
    "ARXModel",
    "AbstractForm",
    "AbstractModel",
    "AbstractStructure",
    "Domain",
    "History",
    "Lags",
    "Mapping",
    "NARXModel",
    "Recursion",
    "Scaling",
    "Start",
    "StartKind",
    "StateSpace",
    "TransferFunction",
    "TransferFunctionModel",
    "model_from_dict",
    "parameter_count",
    "structure_from_dict",
]
