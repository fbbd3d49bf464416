from __future__ import annotations

from hypothesis import HealthCheck, settings

# derandomized: the same robots in every run, so that a failure is one of the code and not of the day
settings.register_profile("dh2sim", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("dh2sim")
