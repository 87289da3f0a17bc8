"""Models and traces in, figures of merit out."""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.estimation.stability.excursions import Excursions
    from sysid.estimation.stability.free_run import Stability, check_stability
    from sysid.estimation.stability.sequences import AbstractSequences, InputSequence, TraceSequences
    from sysid.validation.cascade_evaluation import CascadeEvaluation, evaluate_cascade
    from sysid.validation.evaluation import (
        CaseResult,
        Evaluation,
        case_results,
        evaluate,
        evaluate_case,
        evaluate_outputs,
    )
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

_WHERE = {
    "sysid.estimation.stability.excursions": ("Excursions",),
    "sysid.estimation.stability.free_run": ("Stability", "check_stability"),
    "sysid.estimation.stability.sequences": ("AbstractSequences", "InputSequence", "TraceSequences"),
    "sysid.validation.evaluation": (
        "CaseResult",
        "Evaluation",
        "case_results",
        "evaluate",
        "evaluate_case",
        "evaluate_outputs",
    ),
    "sysid.validation.cascade_evaluation": ("CascadeEvaluation", "evaluate_cascade"),
    "sysid.validation.intervals": ("CaseIntervals", "Coverage", "OutputInterval", "predict_interval"),
    "sysid.validation.linearity": ("Linearity", "judge_linearity"),
    "sysid.validation.metrics": ("Figures", "figures"),
    "sysid.validation.residuals": ("ResidualAnalysis", "analyse_residuals"),
}
"""Where each name is defined: the figures of a run are had without what fits models."""

__getattr__ = imported_when_asked(_WHERE)
