"""Models and traces in, figures of merit out."""

from sysid.estimation.stability.free_run import Stability, check_stability
from sysid.estimation.stability.sequences import AbstractSequences, Excursions, InputSequence, TraceSequences
from sysid.validation.evaluate import CaseResult, Evaluation, case_results, evaluate, evaluate_case, evaluate_outputs
from sysid.validation.evaluate_cascade import CascadeEvaluation, evaluate_cascade
from sysid.validation.intervals import CaseIntervals, Coverage, OutputInterval, predict_interval
from sysid.validation.linearity import Linearity, judge_linearity
from sysid.validation.metrics import Figures, figures
from sysid.validation.residuals import ResidualAnalysis, analyse_residuals

__all__ = [
    "AbstractSequences",
    "CascadeEvaluation",
    "CaseIntervals",
    "CaseResult",
    "Coverage",
    "Evaluation",
    "Excursions",
    "Figures",
    "InputSequence",
    "Linearity",
    "OutputInterval",
    "ResidualAnalysis",
    "Stability",
    "TraceSequences",
    "analyse_residuals",
    "case_results",
    "check_stability",
    "evaluate",
    "evaluate_cascade",
    "evaluate_case",
    "evaluate_outputs",
    "figures",
    "judge_linearity",
    "predict_interval",
]
