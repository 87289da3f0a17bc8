"""Models and traces in, figures of merit out."""

from sysid.validation.evaluate import CaseResult, Evaluation, evaluate, evaluate_case
from sysid.validation.linearity import Linearity, judge_linearity
from sysid.validation.metrics import Figures, figures
from sysid.validation.residuals import ResidualAnalysis, analyse_residuals

__all__ = [
    "CaseResult",
    "Evaluation",
    "Figures",
    "Linearity",
    "ResidualAnalysis",
    "analyse_residuals",
    "evaluate",
    "evaluate_case",
    "figures",
    "judge_linearity",
]
