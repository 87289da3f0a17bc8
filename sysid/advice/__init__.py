"""The look at data first: what is in a record, before anything is fitted to it."""

from sysid.advice.advise import advise
from sysid.advice.bounds import looked_at
from sysid.advice.finding import Advice, Finding, Suggestion, Topic, Verdict

__all__ = ["Advice", "Finding", "Suggestion", "Topic", "Verdict", "advise", "looked_at"]
