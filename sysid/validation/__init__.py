"""Models and traces in, figures of merit out."""

from sysid.validation.evaluate import CaseResult, Evaluation, evaluate, evaluate_case
from sysid.validation.intervals import CaseIntervals, Coverage, OutputInterval, predict_interval
from sysid.validation.linearity import Linearity, judge_linearity
from sysid.validation.metrics import Figures, figures
from sysid.validation.residuals import ResidualAnalysis, analyse_residuals

__all__ = [
    "CaseIntervals",
    "CaseResult",
    "Coverage",
    "Evaluation",
    "Figures",
    "Linearity",
    "OutputInterval",
    "ResidualAnalysis",
    "analyse_residuals",
    "evaluate",
    "evaluate_case",
    "figures",
    "judge_linearity",
    "predict_interval",
]
