"""How often the 95 % intervals of transfer functions hold the true parameters, over many records.

Run with ``python -m tests.benchmarks coverage``: 500 records of each domain and noise, six parameters each. The tests
count four of each.
"""

from __future__ import annotations

from sysid.models import Domain
from tests.estimation.linear.test_transfer_function import share_held

RECORDS = 500


def main() -> None:
    """Print the share for each domain and noise."""
    for domain in Domain:
        for decibel in (20.0, 40.0):
            share = share_held(domain, decibel, range(RECORDS))
            print(f"{domain.value}, {decibel:.0f} dB: {100.0 * share:.1f} % of {6 * RECORDS}")


if __name__ == "__main__":
    main()
