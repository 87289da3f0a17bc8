"""The look at data first: what is in a record, before anything is fitted to it."""

from sysid.advice.advise import advise
from sysid.advice.bounds import looked_at
from sysid.advice.finding import Advice, Finding, Suggestion, Topic, Verdict
from sysid.advice.who_drives import Guess, guessed

__all__ = ["Advice", "Finding", "Guess", "Suggestion", "Topic", "Verdict", "advise", "guessed", "looked_at"]
