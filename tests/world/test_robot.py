import numpy as np
import pytest

from gecar.errors import InputError
from gecar.reality.advise.notes import battery_at_its_end
from gecar.reality.calibrate.constants import FreeConstants, chosen
from gecar.reality.fitting.parameters import free
from gecar.reality.verdict import Interval
from gecar.report.units import quantities
from gecar.world.effects import BY_ID, CATALOGUE, PHYSICS
from gecar.world.robot import Battery, list_robots, load_robot, read_robot, write_robot

EV3 = load_robot("ev3")


def edited(tmp_path, old, new):
    path = tmp_path / "robot.toml"
    write_robot(EV3, path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize("name", ["ev3", 'two\n"lines"', "a bell \x07, a delete \x7f, a \\"])
def test_robot_file_is_read_back_equal(tmp_path, name):
    robot = EV3.with_effects({"backlash": {"angle_deg": 5.6}, "floor_tilt": {"x_rad": 0.01}})
    robot = robot.model_copy(update={"name": name})
    write_robot(robot, tmp_path / "robot.toml")
    assert read_robot(tmp_path / "robot.toml") == robot


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass = 0.75", "mass = -1.0", "body.mass: found -1.0, expected greater than 0"),
        ("mass = 0.75", "mass = nan", "body.mass"),
        ("mass = 0.75", "", "body.mass: found nothing"),
        ("mass = 0.75", "mass = 0.75\nmas = 1", "body.mas: found an unknown field"),
        ("com_ahead = -0.0322", "com_ahead = -0.2", "between the axle and the caster"),
        ('mode = "duty"', 'mode = "torque"', "drive.mode: found 'torque', expected 'duty' or 'speed'"),
        ("[body]", "[body", "not TOML"),
    ],
)
def test_bad_robot_file_is_refused_with_its_field(tmp_path, old, new, said):
    with pytest.raises(InputError) as error:
        read_robot(edited(tmp_path, old, new))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ({"gremlins": {"size": 1.0}}, "one of the catalogue"),
        ({"backlash": {"size": 1.0}}, "expected one of angle_deg"),
        ({"backlash": {"angle_deg": 99.0}}, "expected 0 to 25 deg"),
        ({"backlash": {"angle_deg": float("nan")}}, "expected 0 to 25 deg"),
    ],
)
def test_unknown_effect_or_value_is_refused(effects, said):
    with pytest.raises(InputError, match=said):
        EV3.with_effects(effects)


@pytest.mark.parametrize(
    ("caster", "ahead"), [(-0.05, -0.06), (-0.05, -0.05), (-0.085, 0.01), (0.05, -0.01), (0.05, 0.06)]
)
def test_a_centre_of_mass_that_is_not_between_axle_and_caster_is_refused(tmp_path, caster, ahead):
    shorter = EV3.model_copy(
        update={"body": EV3.body.model_copy(update={"caster_ahead": caster, "com_ahead": 0.5 * caster})}
    )
    effect = {"com_offset": {"ahead_m": ahead}}
    with pytest.raises(InputError, match=r"com_offset.ahead_m = .*, expected .* m"):
        shorter.with_effects(effect)
    write_robot(shorter.model_copy(update={"effects": effect}), tmp_path / "robot.toml")
    with pytest.raises(InputError, match=r"com_offset.ahead_m = .*, expected .* m"):
        read_robot(tmp_path / "robot.toml")
    free_low, free_high = free(shorter, ["com_offset"]).bounds
    standing = [
        free(shorter, ["com_offset"]).coordinates[0].value(float(z)) for z in (free_low[0], free_high[0])
    ]
    assert all(0.0 <= place / caster < 1.0 for place in standing)


MOTOR_ALONE = (
    "name = 'motor'\n[motor]\ntorque_constant = 35.0\nback_emf_constant = 0.0\nresistance = 1.0\ninertia = 95.0\n"
    "coulomb_friction = 0.0\n[battery]\nvoltage = 10.0\n[drive]\nduty_cap = 1.0\n"
)


def test_a_motor_alone_borrows_the_ev3s_body(tmp_path):
    path = tmp_path / "motor.toml"
    path.write_text(MOTOR_ALONE)
    robot = load_robot(path)
    assert (robot.name, robot.motor.inertia, robot.body) == ("motor", 95.0, EV3.body)
    path.write_text(MOTOR_ALONE + "[tyre]\nfriction = 1.0\n")
    with pytest.raises(InputError, match="body: found nothing"):
        load_robot(path)


def test_unknown_robot_is_refused():
    with pytest.raises(InputError, match="'ev4'"):
        load_robot("ev4")


def test_effect_reaches_the_kernel_in_si():
    assert EV3.with_effects({"backlash": {"angle_deg": 180.0 / 32.0}}).physics["backlash"][0] == np.pi / 32.0


def test_every_parameter_is_a_field_once():
    assert len(set(PHYSICS.names)) == len(PHYSICS.names)
    assert len(BY_ID) == len(CATALOGUE) == 44
    for effect in CATALOGUE:
        for parameter in effect.parameters:
            assert parameter.low <= EV3.nominal(parameter) <= parameter.high


def with_battery(**fields):
    return EV3.model_copy(update={"battery": Battery(**(EV3.battery.model_dump() | fields))})


@pytest.mark.parametrize("name", list_robots())
def test_no_fit_leaves_the_voltages_a_robots_battery_can_have(name):
    robot = load_robot(name)
    (scale,) = free(robot, ["supply_voltage"]).coordinates
    volts = [scale.value(z) * robot.battery.voltage for z in (-1e3, 1e3)]
    assert volts == pytest.approx([robot.battery.voltage_low, robot.battery.voltage_high])
    low, high = FreeConstants(robot, chosen(["battery.voltage"])).bounds
    assert robot.battery.voltage + 0.05 * np.r_[low, high] == pytest.approx(volts)


def test_a_battery_that_does_not_say_keeps_the_catalogues_bounds():
    unsaid = with_battery(voltage_low=None, voltage_high=None)
    (scale,) = free(unsaid, ["supply_voltage"]).coordinates
    assert (scale.value(-1e3), scale.value(1e3)) == pytest.approx((0.5, 1.3))


@pytest.mark.parametrize("fields", ["voltage_low = 9.0", "voltage_high = 8.0", "voltage_low = -1.0"])
def test_a_battery_that_cannot_have_its_voltage_is_refused(tmp_path, fields):
    path = tmp_path / "robot.toml"
    path.write_text(MOTOR_ALONE.replace("voltage = 10.0", f"voltage = 8.67\n{fields}"))
    with pytest.raises(InputError, match=r"robot.toml, battery.*found .*expected"):
        load_robot(path)


def test_a_voltage_at_the_batterys_end_is_open_and_said():
    top = EV3.bounds(BY_ID["supply_voltage"].parameters[0])[1]
    (battery,) = quantities("supply_voltage", {"scale": Interval(top, 1.15, top, "-")}, EV3)
    assert str(battery) == "battery 8.67 → 10.50 V (9.97 or more)"
    (note,) = battery_at_its_end(EV3.with_effects({"supply_voltage": {"scale": top}}))
    assert "10.5 V" in note
    assert not battery_at_its_end(EV3.with_effects({"supply_voltage": {"scale": 1.1}}))
    assert not battery_at_its_end(EV3)
