"""One concealed robot as plain numbers, the form compiled code takes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmarks.concealed.robot import Concealed

# A few millihenry are usual for brushed motors of this size; with 5.5 ohm the current follows within 0.9 ms.
INDUCTANCE = 0.0049  # H
# Gears begin to slide after a small fraction of a degree (Armstrong-Helouvry, Control of Machines with Friction, 1991).
PRESLIDING = 0.001  # rad


class Numbers(NamedTuple):
    """SI units; left before right; whatever is not concealed is 0, or infinite where it is a limit."""

    mass: float
    yaw_inertia: float
    com_ahead: float
    com_height: float
    caster: float
    half_track: float
    radius_left: float
    radius_right: float
    torque_constant: float
    back_emf: float
    resistance: float
    inductance: float
    shaft_inertia: float
    supply: float
    drain: float
    inner_resistance: float
    coulomb: float
    viscous: float
    static: float
    stribeck: float
    friction_ratio: float
    presliding: float
    direction_gain: float
    play: float
    loosening_left: float
    loosening_right: float
    ripple: float
    ripple_cycles: float
    ripple_left: float
    ripple_right: float
    speed_limit: float
    heat: float
    heat_time: float
    heat_side: float
    coasting: float
    current_limit: float
    tooth: float
    tooth_width: float
    tooth_side: float
    tooth_phase: float
    band: float
    band_side: float
    grip: float
    patch_x: float
    patch_y: float
    patch_radius: float
    patch_grip: float
    dust: float
    dust_way: float
    hop: float
    hop_speed: float
    hop_side: float
    creep: float
    caster_friction: float
    rolling: float
    tilt_x: float
    tilt_y: float
    wave: float
    wave_length: float
    wave_x: float
    wave_y: float
    off_centre: float
    off_left: float
    off_right: float
    oval: float
    oval_left: float
    oval_right: float
    ridge: float
    ridge_x: float
    ridge_angle: float
    tether: float
    tether_x: float
    tether_y: float
    magnet: float
    magnet_x: float
    magnet_y: float
    magnet_core: float
    air_drag: float
    pile: float
    pile_way: float
    yaw_pull: float
    swivel: float
    swivel_trail: float
    axle_rub: float
    strip: float
    strip_x: float
    strip_width: float
    strip_angle: float
    toe: float
    toe_side: float
    trailer: float
    trailer_length: float
    twist: float
    keeper: float
    keeper_most: float
    nominal_supply: float
    gear_loss: float
    gear_loss_side: float
    grease: float
    grease_rest: float
    grease_shear: float
    grease_side: float
    frame_rub: float
    frame_rub_way: float
    frame_rub_side: float
    hair: float
    hair_way: float
    sag: float
    sag_time: float
    holding: float
    grooves: float
    grooves_way: float
    hum: float
    hum_speed: float
    hum_width: float
    hum_side: float
    scrub: float
    fuse: float
    fuse_current: float
    fuse_time: float
    loose: float
    loose_half: float
    loose_arm: float
    fan: float
    fan_x: float
    fan_y: float
    fan_period: float
    fan_phase: float
    rocking: float
    rocking_x: float
    rocking_way: float
    rocking_play: float
    patches: float
    patches_size: float
    patches_pattern: float
    cut_current: float
    cut_bears: float
    cut_rests: float
    clutch_left: float
    clutch_right: float
    pulses: float
    pulses_period: float
    pulses_on: float
    pulses_gone: float
    fin: float
    fin_way: float
    nap: float
    nap_way: float
    overrun: float
    sync: float
    brush: float
    brush_ahead: float
    brush_left: float
    curl: float
    curl_width: float
    leak: float
    leak_time: float
    leak_side: float
    turret: float
    turret_period: float
    turret_phase: float


def numbers(concealed: Concealed) -> Numbers:
    """Flatten a robot.

    Parameters
    ----------
    concealed
        What differs from the nominal robot.

    Returns
    -------
    Numbers
    """
    base, half = concealed.base, concealed.radius_difference / 2.0
    radius = base.wheel_radius * concealed.radius_scale
    patch = concealed.patch or (0.0, 0.0, 0.0, 0.0)
    waves = concealed.waves or (0.0, 1.0, 0.0, 0.0)
    off_centre, oval = concealed.off_centre or (0.0, 0.0, 0.0), concealed.oval or (0.0, 0.0, 0.0)
    ridge, tether = concealed.bump or (0.0, 0.0, 0.0), concealed.tether or (0.0, 0.0, 0.0)
    magnet = concealed.magnet or (0.0, 0.0, 1.0, 0.0)
    heat, tooth = concealed.heat or (0.0, 1.0, 0), concealed.tooth or (0.0, 0.0, 0, 0.0)
    band, dust, hop = (
        concealed.rubber_band or (0.0, 0),
        concealed.dust or (0.0, 1.0),
        concealed.hop or (0.0, 0.0, 0),
    )
    loosening = [0.0, 0.0]
    if concealed.loosening is not None:
        loosening[concealed.loosening[1]] = concealed.loosening[0]
    pile, swivel = concealed.pile or (0.0, 0.0), concealed.swivel or (0.0, 1.0)
    strip, toe = concealed.strip or (0.0, 0.0, 0.0, 0.0), concealed.toe or (0.0, 0)
    trailer, keeper = concealed.trailer or (0.0, 1.0), concealed.keeper or (0.0, 0.0)
    gear_loss, grease = concealed.gear_loss or (0.0, 0), concealed.grease or (0.0, 1.0, 1.0, 0)
    frame_rub, hair = concealed.frame_rub or (0.0, 1.0, 0), concealed.hair or (0.0, 1.0)
    sag, grooves = concealed.slow_sag or (0.0, 1.0), concealed.grooves or (0.0, 0.0)
    hum, fuse = concealed.hum or (0.0, 0.0, 1.0, 0), concealed.fuse or (0.0, 1.0, 1.0)
    loose, fan = concealed.loose_cell or (0.0, 1.0, 1.0), concealed.fan or (0.0, 0.0, 0.0, 1.0, 0.0)
    rocking, patches = concealed.rocking or (0.0, 0.0, 0.0, 0.0), concealed.patches or (0.0, 1.0, 0.0)
    clutches = [math.inf, math.inf]
    if concealed.clutch is not None:
        clutches[concealed.clutch[1]] = concealed.clutch[0]
    cut_out, fin = concealed.cut_out or (math.inf, 0.0, 0.0), concealed.fin or (0.0, 0.0)
    nap, pulses = concealed.nap or (0.0, 0.0), concealed.pulses or (0.0, 1.0, 0.0, 0.0)
    brush, curl = concealed.brush or (0.0, 0.0, 0.0), concealed.curl or (0.0, 1.0)
    leak, turret = concealed.leak or (0.0, 1.0, 0), concealed.turret or (0.0, 1.0, 0.0)
    fields = {
        "mass": base.mass,
        "yaw_inertia": base.yaw_inertia * concealed.yaw_inertia_scale,
        "com_ahead": concealed.com_ahead,
        "com_height": concealed.com_height,
        "caster": base.caster_ahead,
        "half_track": base.track_width * concealed.track_scale / 2.0,
        "radius_left": radius * (1.0 - half),
        "radius_right": radius * (1.0 + half),
        "torque_constant": base.torque_constant,
        "back_emf": base.back_emf_constant,
        "resistance": base.resistance,
        "inductance": INDUCTANCE * concealed.inductance_scale,
        "shaft_inertia": base.shaft_inertia * concealed.inertia_scale,
        "supply": base.supply * concealed.supply_scale,
        "drain": concealed.battery_drain,
        "inner_resistance": concealed.battery_resistance,
        "coulomb": concealed.coulomb_friction,
        "viscous": concealed.viscous_friction,
        "static": concealed.static_friction,
        "stribeck": concealed.stribeck_speed,
        "friction_ratio": concealed.friction_ratio,
        "presliding": PRESLIDING * concealed.presliding_scale,
        "direction_gain": concealed.direction_gain,
        "play": math.radians(concealed.backlash_deg),
        "loosening_left": loosening[0],
        "loosening_right": loosening[1],
        "ripple": concealed.ripple_torque,
        "ripple_cycles": concealed.ripple_cycles,
        "ripple_left": concealed.ripple_phases[0],
        "ripple_right": concealed.ripple_phases[1],
        "speed_limit": concealed.speed_limit,
        "heat": heat[0],
        "heat_time": heat[1],
        "heat_side": heat[2],
        "coasting": concealed.coasting,
        "current_limit": concealed.current_limit,
        "tooth": tooth[0],
        "tooth_width": tooth[1],
        "tooth_side": tooth[2],
        "tooth_phase": tooth[3],
        "band": band[0],
        "band_side": band[1],
        "grip": concealed.tyre_friction,
        "patch_x": patch[0],
        "patch_y": patch[1],
        "patch_radius": patch[2],
        "patch_grip": patch[3],
        "dust": dust[0],
        "dust_way": dust[1],
        "hop": hop[0],
        "hop_speed": hop[1],
        "hop_side": hop[2],
        "creep": concealed.creep_scale,
        "caster_friction": concealed.caster_friction,
        "rolling": concealed.rolling_resistance,
        "tilt_x": concealed.tilt[0],
        "tilt_y": concealed.tilt[1],
        "wave": waves[0],
        "wave_length": waves[1],
        "wave_x": waves[2],
        "wave_y": waves[3],
        "off_centre": off_centre[0],
        "off_left": off_centre[1],
        "off_right": off_centre[2],
        "oval": oval[0],
        "oval_left": oval[1],
        "oval_right": oval[2],
        "ridge": ridge[0],
        "ridge_x": ridge[1],
        "ridge_angle": ridge[2],
        "tether": tether[2],
        "tether_x": tether[0],
        "tether_y": tether[1],
        "magnet": magnet[3],
        "magnet_x": magnet[0],
        "magnet_y": magnet[1],
        "magnet_core": magnet[2],
        "air_drag": concealed.air_drag,
        "pile": pile[0],
        "pile_way": pile[1],
        "yaw_pull": concealed.yaw_pull,
        "swivel": swivel[0],
        "swivel_trail": swivel[1],
        "axle_rub": concealed.axle_rub,
        "strip": strip[0],
        "strip_x": strip[1],
        "strip_width": strip[2],
        "strip_angle": strip[3],
        "toe": toe[0],
        "toe_side": toe[1],
        "trailer": trailer[0],
        "trailer_length": trailer[1],
        "twist": concealed.twist,
        "keeper": keeper[0],
        "keeper_most": keeper[1],
        "nominal_supply": base.supply,
        "gear_loss": gear_loss[0],
        "gear_loss_side": gear_loss[1],
        "grease": grease[0],
        "grease_rest": grease[1],
        "grease_shear": grease[2],
        "grease_side": grease[3],
        "frame_rub": frame_rub[0],
        "frame_rub_way": frame_rub[1],
        "frame_rub_side": frame_rub[2],
        "hair": hair[0],
        "hair_way": hair[1],
        "sag": sag[0],
        "sag_time": sag[1],
        "holding": concealed.holding,
        "grooves": grooves[0],
        "grooves_way": grooves[1],
        "hum": hum[0],
        "hum_speed": hum[1],
        "hum_width": hum[2],
        "hum_side": hum[3],
        "scrub": concealed.scrub,
        "fuse": fuse[0],
        "fuse_current": fuse[1],
        "fuse_time": fuse[2],
        "loose": loose[0],
        "loose_half": loose[1],
        # Acceleration to the loose side per difference of the wheels' squared speeds, by the robot's file.
        "loose_arm": loose[2] * base.wheel_radius**2 / base.track_width / 2.0,
        "fan": fan[2],
        "fan_x": fan[0],
        "fan_y": fan[1],
        "fan_period": fan[3],
        "fan_phase": fan[4],
        "rocking": rocking[0],
        "rocking_x": rocking[1],
        "rocking_way": rocking[2],
        "rocking_play": rocking[3],
        "patches": patches[0],
        "patches_size": patches[1],
        "patches_pattern": patches[2],
        "cut_current": cut_out[0],
        "cut_bears": cut_out[1],
        "cut_rests": cut_out[2],
        "clutch_left": clutches[0],
        "clutch_right": clutches[1],
        "pulses": pulses[0],
        "pulses_period": pulses[1],
        "pulses_on": pulses[2],
        "pulses_gone": pulses[3],
        "fin": fin[0],
        "fin_way": fin[1],
        "nap": nap[0],
        "nap_way": nap[1],
        "overrun": concealed.overrun,
        "sync": concealed.motor_sync,
        "brush": brush[0],
        "brush_ahead": brush[1],
        "brush_left": brush[2],
        "curl": curl[0],
        "curl_width": curl[1],
        "leak": leak[0],
        "leak_time": leak[1],
        "leak_side": leak[2],
        "turret": turret[0],
        "turret_period": turret[1],
        "turret_phase": turret[2],
    }
    return Numbers(**{name: float(number) for name, number in fields.items()})


def gusts(concealed: Concealed) -> npt.NDArray[np.float64]:
    """Give the gusts as rows of start, length [s] and force x, y [N]."""
    return np.array(concealed.gusts, dtype=np.float64).reshape(-1, 4)
