"""What a model is: structure, parameters, scaling, initial state; free run and prediction."""

from sysid.models.arx import ARX, ARXModel
from sysid.models.base import AbstractModel
from sysid.models.beginning import Beginning, beginning
from sysid.models.block_oriented import HammersteinWiener, WienerHammerstein
from sysid.models.built_model import BuiltModel
from sysid.models.cascade import Cascade
from sysid.models.cascade_batch import simulate_family
from sysid.models.cascade_program import Limit
from sysid.models.cascade_run import Activity, CascadeRun
from sysid.models.declared import InitialState, Parameter
from sysid.models.ends import Ends
from sysid.models.equation_form import EquationForm
from sysid.models.form import AbstractForm
from sysid.models.grey_box import GreyBox, VectorGreyBox
from sysid.models.grey_box_model import EquationModel, GreyBoxModel, VectorGreyBoxModel
from sysid.models.history import History, Start, StartKind, StartLike
from sysid.models.innovations import Innovations
from sysid.models.interpolation import Interpolation
from sysid.models.lags import Lagged, Lags
from sysid.models.linear_state_space import (
    LinearStateSpace,
    LinearStateSpaceModel,
    VectorStateSpace,
    VectorStateSpaceModel,
)
from sysid.models.mapping import Mapping
from sysid.models.narx import NARX, NARXModel
from sysid.models.neural_ensemble import NeuralEnsemble
from sysid.models.neural_form import NeuralForm
from sysid.models.neural_state_space import (
    NeuralStateSpace,
    NeuralStateSpaceModel,
    VectorNeuralStateSpace,
    VectorNeuralStateSpaceModel,
)
from sysid.models.orthonormal_basis import Domain
from sysid.models.polynomial import PolynomialModel
from sysid.models.polynomial_narx import PolynomialNARX
from sysid.models.polynomial_orders import ARMAX, BJ, OE
from sysid.models.recursion import Recursion, parameter_count
from sysid.models.scaling import Scaling, VectorScaling
from sysid.models.several_outputs import SeveralOutputs
from sysid.models.state_space import StateSpace
from sysid.models.store import cascade_from_dict, model_from_dict, structure_from_dict
from sysid.models.structure import AbstractStructure
from sysid.models.transfer_function import TransferFunction, TransferFunctionModel
from sysid.models.vector_narx import VectorNARX, VectorNARXModel
from sysid.models.vector_recursion import VectorRecursion
from sysid.models.wiring import Member, Wiring

__all__ = [
    "ARMAX",
    "ARX",
    "BJ",
    "NARX",
    "OE",
    "ARXModel",
    "AbstractForm",
    "AbstractModel",
    "AbstractStructure",
    "Activity",
    "Beginning",
    "BuiltModel",
    "Cascade",
    "CascadeRun",
    "Domain",
    "Ends",
    "EquationForm",
    "EquationModel",
    "GreyBox",
    "GreyBoxModel",
    "HammersteinWiener",
    "History",
    "InitialState",
    "Innovations",
    "Interpolation",
    "Lagged",
    "Lags",
    "Limit",
    "LinearStateSpace",
    "LinearStateSpaceModel",
    "Mapping",
    "Member",
    "NARXModel",
    "NeuralEnsemble",
    "NeuralForm",
    "NeuralStateSpace",
    "NeuralStateSpaceModel",
    "Parameter",
    "PolynomialModel",
    "PolynomialNARX",
    "Recursion",
    "Scaling",
    "SeveralOutputs",
    "Start",
    "StartKind",
    "StartLike",
    "StateSpace",
    "TransferFunction",
    "TransferFunctionModel",
    "VectorGreyBox",
    "VectorGreyBoxModel",
    "VectorNARX",
    "VectorNARXModel",
    "VectorNeuralStateSpace",
    "VectorNeuralStateSpaceModel",
    "VectorRecursion",
    "VectorScaling",
    "VectorStateSpace",
    "VectorStateSpaceModel",
    "WienerHammerstein",
    "Wiring",
    "beginning",
    "cascade_from_dict",
    "model_from_dict",
    "parameter_count",
    "simulate_family",
    "structure_from_dict",
]
