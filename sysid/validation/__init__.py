"""Models and traces in, figures of merit out."""

from typing import TYPE_CHECKING

from sysid.lazy_names import imported_when_asked

if TYPE_CHECKING:
    from sysid.estimation.stability.excursions import Excursions as Excursions
    from sysid.estimation.stability.free_run import Stability as Stability
    from sysid.estimation.stability.free_run import check_stability as check_stability
    from sysid.estimation.stability.sequences import AbstractSequences as AbstractSequences
    from sysid.estimation.stability.sequences import InputSequence as InputSequence
    from sysid.estimation.stability.sequences import TraceSequences as TraceSequences
    from sysid.validation.cascade_evaluation import CascadeEvaluation as CascadeEvaluation
    from sysid.validation.cascade_evaluation import evaluate_cascade as evaluate_cascade
    from sysid.validation.evaluation import CaseResult as CaseResult
    from sysid.validation.evaluation import Evaluation as Evaluation
    from sysid.validation.evaluation import case_results as case_results
    from sysid.validation.evaluation import evaluate as evaluate
    from sysid.validation.evaluation import evaluate_case as evaluate_case
    from sysid.validation.evaluation import evaluate_outputs as evaluate_outputs
    from sysid.validation.intervals import CaseIntervals as CaseIntervals
    from sysid.validation.intervals import Coverage as Coverage
    from sysid.validation.intervals import OutputInterval as OutputInterval
    from sysid.validation.intervals import predict_interval as predict_interval
    from sysid.validation.linearity import Linearity as Linearity
    from sysid.validation.linearity import judge_linearity as judge_linearity
    from sysid.validation.metrics import Figures as Figures
    from sysid.validation.metrics import figures as figures
    from sysid.validation.residuals import ResidualAnalysis as ResidualAnalysis
    from sysid.validation.residuals import analyse_residuals as analyse_residuals

__getattr__, __all__ = imported_when_asked(__file__)
"""The figures of a run are had without what fits models."""
