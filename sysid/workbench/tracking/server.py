"""A tracking server: whether it answers, which is asked before MLflow asks it again and again."""

from __future__ import annotations

import urllib.error
import urllib.request

from sysid.errors import ConfigError

PATIENCE_S = 10.0
"""Seconds that a server may take to say that it is there."""


def answers(address: str, patience_s: float = PATIENCE_S) -> str:
    """Why a server does not answer.

    Args:
        address: Its address.
        patience_s: Seconds to wait for it.

    Returns:
        The reason; empty where it answers, whatever it says.
    """
    try:
        with urllib.request.urlopen(f"{address.rstrip('/')}/health", timeout=patience_s):  # noqa: S310 - ours or given
            return ""
    except urllib.error.HTTPError:
        return ""  # it is there: what it refuses, or what it is, MLflow will say
    except urllib.error.URLError as error:
        return str(error.reason)
    except (OSError, ValueError) as error:
        return str(error)


def check_server(uri: str) -> None:
    """Refuse a tracking server that is down: MLflow would ask it again for minutes, each time it is told something.

    Args:
        uri: The tracking URI.

    Raises:
        ConfigError: If nobody answers there.
    """
    reason = answers(uri)
    if reason:
        raise ConfigError(
            "the tracking server does not answer",
            where=uri,
            expected=f"an answer within {PATIENCE_S:.0f} s",
            got=reason,
            remedy="start it, or correct MLFLOW_TRACKING_URI; results are in runs/, and sysid run tracks them again",
        )
