"""What a model is: structure, parameters, scaling, initial state; free run and prediction."""

from sysid.models.arx import ARX, ARXModel
from sysid.models.base import AbstractModel, AbstractStructure
from sysid.models.history import History, Start, StartKind
from sysid.models.lags import Lags
from sysid.models.mapping import Mapping
from sysid.models.narx import NARX, NARXModel
from sysid.models.recursion import Recursion, parameter_count
from sysid.models.scaling import Scaling
from sysid.models.store import model_from_dict, structure_from_dict

__all__ = [
    "ARX",
    "NARX",
    "ARXModel",
    "AbstractModel",
    "AbstractStructure",
    "History",
    "Lags",
    "Mapping",
    "NARXModel",
    "Recursion",
    "Scaling",
    "Start",
    "StartKind",
    "model_from_dict",
    "parameter_count",
    "structure_from_dict",
]
