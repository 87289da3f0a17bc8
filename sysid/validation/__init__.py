"""Models and traces in, figures of merit out."""

from sysid.validation.evaluate import CaseResult, Evaluation, evaluate, evaluate_case
from sysid.validation.metrics import Figures, figures

__all__ = ["CaseResult", "Evaluation", "Figures", "evaluate", "evaluate_case", "figures"]
