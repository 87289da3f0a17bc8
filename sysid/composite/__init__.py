"""Several models as one system: fitted each alone, chosen together, trained through each other, proven as a whole.

Declare the members and how they are wired (:class:`Composite`), say how they are trained (:class:`TrainingPlan`), and
call :func:`train`; or call its stages one by one: :func:`fit_member`, :func:`choose_together`, :func:`retrain`,
:func:`train_round`, :func:`learn_actively`. :func:`run_monte_carlo` puts the whole to a Monte Carlo test.

Nothing here knows a run folder, a screen or a tracker: a :class:`Keeper` is given from outside.
"""

from sysid.composite.active_learning import ActiveLearned as ActiveLearned
from sysid.composite.active_learning import Assessment as Assessment
from sysid.composite.active_learning import learn_actively as learn_actively
from sysid.composite.active_learning import sequence_errors as sequence_errors
from sysid.composite.candidates import Candidate as Candidate
from sysid.composite.candidates import Candidates as Candidates
from sysid.composite.candidates import fit_candidates as fit_candidates
from sysid.composite.composite import Composite as Composite
from sysid.composite.composite import Member as Member
from sysid.composite.doubt.committee import committee as committee
from sysid.composite.doubt.doubting import Doubt as Doubt
from sysid.composite.doubt.doubting import Doubting as Doubting
from sysid.composite.doubt.doubting import Perturbation as Perturbation
from sysid.composite.doubt.doubting import doubting as doubting
from sysid.composite.doubt.figures import DoubtFigures as DoubtFigures
from sysid.composite.doubt.figures import doubt_figures as doubt_figures
from sysid.composite.doubt.figures import doubt_threshold as doubt_threshold
from sysid.composite.doubt.monte_carlo import MonteCarlo as MonteCarlo
from sysid.composite.doubt.monte_carlo import run_monte_carlo as run_monte_carlo
from sysid.composite.doubt.perturbed import perturbed as perturbed
from sysid.composite.fixed.equations import equation_of as equation_of
from sysid.composite.fixed.equations import fixed_by_equations as fixed_by_equations
from sysid.composite.fixed.member import FixedMember as FixedMember
from sysid.composite.fixed.member import Standing as Standing
from sysid.composite.fixed_members import fixed_model as fixed_model
from sysid.composite.fixed_members import with_fixed as with_fixed
from sysid.composite.keeper import Keeper as Keeper
from sysid.composite.keeper import MakeAll as MakeAll
from sysid.composite.keeper import Task as Task
from sysid.composite.limit_check import LimitCheck as LimitCheck
from sysid.composite.limit_check import check_limits as check_limits
from sysid.composite.limits_held import Holding as Holding
from sysid.composite.limits_held import holding as holding
from sysid.composite.members import assembled as assembled
from sysid.composite.members import dealt as dealt
from sysid.composite.members import own_traces as own_traces
from sysid.composite.members import simulated_inputs as simulated_inputs
from sysid.composite.members import whole_score as whole_score
from sysid.composite.plan import ActiveLearning as ActiveLearning
from sysid.composite.plan import OneStep as OneStep
from sysid.composite.plan import Retraining as Retraining
from sysid.composite.plan import RoundPlan as RoundPlan
from sysid.composite.plan import TrainingPlan as TrainingPlan
from sysid.composite.rounds.rehearsal import rehearse as rehearse
from sysid.composite.rounds.round import JointRound as JointRound
from sysid.composite.rounds.round import TrainedRound as TrainedRound
from sysid.composite.rounds.round import train_round as train_round
from sysid.composite.stages import Choice as Choice
from sysid.composite.stages import choose_together as choose_together
from sysid.composite.stages import fit_member as fit_member
from sysid.composite.stages import model_of as model_of
from sysid.composite.stages import one_step_of as one_step_of
from sysid.composite.stages import reading_more as reading_more
from sysid.composite.stages import retrain as retrain
from sysid.composite.training import Retrained as Retrained
from sysid.composite.training import TrainedComposite as TrainedComposite
from sysid.composite.training import train as train
from sysid.composite.training_data import TrainingData as TrainingData
from sysid.composite.warm_start import started_from as started_from
