"""Several models as one system: fitted each alone, chosen together, trained through each other, proven as a whole.

Declare the members and how they are wired (:class:`Composite`), say how they are trained (:class:`TrainingPlan`), and
call :func:`train`; or call its stages one by one: :func:`fit_member`, :func:`choose_together`, :func:`retrain`,
:func:`train_round`, :func:`learn_actively`. :func:`run_monte_carlo` puts the whole to a Monte Carlo test.

Nothing here knows a run folder, a screen or a tracker: a :class:`Keeper` is given from outside.
"""

from sysid.composite.active_learning import ActiveLearned, Assessment, learn_actively, sequence_errors
from sysid.composite.candidates import Candidate, Candidates, fit_candidates
from sysid.composite.committee import committee
from sysid.composite.composite import Composite, Member
from sysid.composite.doubt_figures import DoubtFigures, doubt_figures, doubt_threshold
from sysid.composite.doubting import Doubt, Doubting, Perturbation, doubting
from sysid.composite.fixed_equations import equation_of, fixed_by_equations
from sysid.composite.fixed_member import FixedMember, Standing
from sysid.composite.fixed_members import fixed_model, with_fixed
from sysid.composite.keeper import Keeper, MakeAll, Task
from sysid.composite.limit_check import LimitCheck, check_limits
from sysid.composite.limits_held import Holding, holding
from sysid.composite.members import assembled, dealt, own_traces, simulated_inputs, whole_score
from sysid.composite.monte_carlo import MonteCarlo, run_monte_carlo
from sysid.composite.perturbed import perturbed
from sysid.composite.plan import ActiveLearning, OneStep, Retraining, RoundPlan, TrainingPlan
from sysid.composite.rehearsal import rehearse
from sysid.composite.round import JointRound, TrainedRound, train_round
from sysid.composite.stages import Choice, choose_together, fit_member, model_of, one_step_of, reading_more, retrain
from sysid.composite.training import Retrained, TrainedComposite, train
from sysid.composite.training_data import TrainingData
from sysid.composite.warm_start import started_from

__all__ = [
    "ActiveLearned",
    "ActiveLearning",
    "Assessment",
    "Candidate",
    "Candidates",
    "Choice",
    "Composite",
    "Doubt",
    "DoubtFigures",
    "Doubting",
    "FixedMember",
    "Holding",
    "JointRound",
    "Keeper",
    "LimitCheck",
    "MakeAll",
    "Member",
    "MonteCarlo",
    "OneStep",
    "Perturbation",
    "Retrained",
    "Retraining",
    "RoundPlan",
    "Standing",
    "Task",
    "TrainedComposite",
    "TrainedRound",
    "TrainingData",
    "TrainingPlan",
    "assembled",
    "check_limits",
    "choose_together",
    "committee",
    "dealt",
    "doubt_figures",
    "doubt_threshold",
    "doubting",
    "equation_of",
    "fit_candidates",
    "fit_member",
    "fixed_by_equations",
    "fixed_model",
    "holding",
    "learn_actively",
    "model_of",
    "one_step_of",
    "own_traces",
    "perturbed",
    "reading_more",
    "rehearse",
    "retrain",
    "run_monte_carlo",
    "sequence_errors",
    "simulated_inputs",
    "started_from",
    "train",
    "train_round",
    "whole_score",
    "with_fixed",
]
