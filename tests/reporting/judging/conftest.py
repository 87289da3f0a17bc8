"""What a judge of leaking buckets found."""

from __future__ import annotations

from typing import Any

import pytest


def leakage() -> dict[str, Any]:
    """Two subjects in two scenes, one of which could not be run with the second."""
    curve = {"time": [0.0, 1.0, 2.0], "value": [5.0, 4.0, 3.0]}
    return {
        "schema_version": 2,
        "title": "Leakage",
        "method": "The same bucket with the reference valve and with each model.",
        "reference_name": "reference valve",
        "scenes": ["slow", "fast"],
        "headline_scenes": ["fast"],
        "quantities": {
            "level_mse": {"name": "level mse", "unit": "cm²", "meaning": "Mean square difference of the level."},
            "lost_percent": {"name": "lost water", "unit": "%", "meaning": "Relative."},
            "lost_l": {"name": "lost water", "unit": "l", "meaning": "Until it is empty."},
            "empty": {"name": "empty", "unit": "at the end"},
            "level": {"name": "level", "unit": "cm"},
        },
        "error": "level_mse",
        "limited": ["lost_percent"],
        "limit": 1.0,
        "reference": {
            scene: {"measures": {"lost_l": 10.0, "empty": True}, "signals": {"level": curve}}
            for scene in ("slow", "fast")
        },
        "subjects": {
            "good": {
                scene: {
                    "differences": {"level_mse": mse, "lost_percent": lost},
                    "measures": {"lost_l": 10.0 + lost / 10.0, "empty": True},
                    "signals": {"level": curve},
                }
                for scene, mse, lost in (("slow", 0.5, 0.25), ("fast", 1.5, -0.75))
            },
            "poor": {
                "slow": {"differences": {"level_mse": 9.0, "lost_percent": 20.0}, "measures": {"lost_l": 12.0}},
                "fast": {"refused": "it does not know such a flow"},
            },
        },
        "sensitivity": [
            {
                "kind": "bias",
                "meaning": "a bias of the valve",
                "unit": "cm",
                "steps": [
                    {"size": 0.1, "error": 0.01, "differences": {"lost_percent": 0.1}},
                    {"size": 1.0, "error": 1.0, "differences": {"lost_percent": 4.0}},
                ],
                "tolerances": [{"quantity": "lost_percent", "reached": "crossed", "error": 0.25}],
            }
        ],
    }


@pytest.fixture
def found() -> dict[str, Any]:
    """As a judge gives it."""
    return leakage()
