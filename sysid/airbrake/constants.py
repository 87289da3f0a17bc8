"""From a consist and a variant to the numbers that the kernel works with."""

from __future__ import annotations

import math

import numpy as np

from sysid.airbrake.consist import TEMPERATURE, Consist
from sysid.airbrake.flow import GAS_CONSTANT, HEAT_RATIO, flow_table
from sysid.airbrake.kernel_arrays import Constants
from sysid.airbrake.variant import QuickService, Variant
from sysid.units import STANDARD_ATMOSPHERE_PA

_QUICK_SERVICE = {QuickService.NONE: 0, QuickService.COMMAND: 1, QuickService.LOCAL: 2}


def kernel_constants(consist: Consist, variant: Variant, dt: float) -> Constants:
    """The kernel's constants.

    Args:
        consist: The train.
        variant: The reading of the model.
        dt: Step in s.

    Returns:
        The constants.
    """
    valve, cylinder, atmosphere = consist.valve, consist.cylinder, STANDARD_ATMOSPHERE_PA
    gas_step = GAS_CONSTANT * TEMPERATURE * dt
    pipe_section = consist.pipe.volume / consist.pipe.length
    rate = math.inf if variant.equalising_rate is None else variant.equalising_rate
    return Constants(
        atmosphere=atmosphere,
        running=consist.charged,
        pipe_area=consist.pipe.area,
        feed_area=consist.head.feed_area,
        exhaust_area=consist.head.exhaust_area,
        charge_auxiliary=valve.charge_auxiliary,
        charge_emergency=valve.charge_emergency,
        charge_action=valve.charge_action,
        apply=valve.apply,
        release=valve.release,
        accelerate_service=valve.accelerate_service,
        accelerate_emergency=valve.accelerate_emergency,
        bleed_action=valve.bleed_action,
        quick_service_area=valve.quick_service,
        emergency_vent=valve.emergency_vent,
        apply_drop=valve.apply_drop,
        release_rise=valve.release_rise,
        service_drop=valve.service_drop,
        emergency_drop=valve.emergency_drop,
        lap_band=valve.lap_band,
        command_drop=valve.command_drop,
        empty_pipe=valve.empty_pipe,
        per_pipe=gas_step / consist.pipe.volume,
        per_auxiliary=gas_step / valve.auxiliary_volume,
        per_emergency=gas_step / valve.emergency_volume,
        per_action=gas_step / valve.action_volume,
        gas_step=gas_step,
        cylinder_volume=cylinder.volume,
        contact_volume=cylinder.contact_volume,
        contact_pressure=cylinder.contact_pressure + atmosphere,
        stroke_pressure=cylinder.stroke_pressure + atmosphere,
        from_upstream=variant.charge_from_upstream,
        check_valve=variant.emergency_check_valve,
        quick_service=_QUICK_SERVICE[variant.quick_service],
        quick_service_pressure=variant.quick_service_limit + atmosphere,
        latched_release=variant.latched_release,
        feed_closed_in_lap=variant.feed_closed_in_lap,
        graduating_lap=variant.graduating_lap,
        blowback_after_emergency=variant.blowback_after_emergency,
        release_blocks_application=variant.release_blocks_application,
        piston=variant.piston,
        relay=variant.relay_band is not None,
        relay_band=variant.relay_band or 1.0,
        equalising_step=rate * dt,
        exhaust_as_printed=variant.exhaust_as_printed,
        pipe_momentum=variant.pipe_momentum,
        momentum_step=HEAT_RATIO * dt * pipe_section / consist.pipe.length,
        leak_area=_leak_area(consist, variant),
        speed_gates=variant.speed_gates,
        accelerated_service=variant.accelerated_service,
        accelerated_emergency=variant.accelerated_emergency,
        accelerated_application=variant.accelerated_application,
        graduated_release=variant.graduated_release,
        first_fall=valve.first_fall,
        fall_gain=valve.cylinder_limit / valve.full_fall,
        cylinder_limit=valve.cylinder_limit,
        opening_band=valve.opening_band,
    )


def _leak_area(consist: Consist, variant: Variant) -> float:
    """m2 of a hole through which the charged pipe of one vehicle falls at the variant's rate."""
    kilograms = variant.leakage * consist.pipe.volume / (GAS_CONSTANT * TEMPERATURE)
    ratio = np.array([STANDARD_ATMOSPHERE_PA / consist.charged])
    table = flow_table(laminar_ratio=variant.laminar_ratio)
    return float(kilograms / (table(ratio)[0] / math.sqrt(TEMPERATURE) * consist.charged))
