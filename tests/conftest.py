"""Settings that all tests share."""

from hypothesis import settings

# Seeds are fixed, so that a failure is the same everywhere; machines that are busy are not slow code.
settings.register_profile("sysid", derandomize=True, deadline=None)
settings.load_profile("sysid")
