"""Elastic bodies that nothing damps: long runs, flight, spin."""
import numpy as np
from criteria import elastic_drift, energy_error, finite, momentum_drift
from stability import Mark, Scene

DENSITY, E = 7.85e-9, 210000.0
SHELL = {"element": "SHELL", "side": 1, "height": 0.25}


def ringing(run):
    return [elastic_drift(run, 1e-3), energy_error(run, 5e-3), momentum_drift(run, 1e-11),
            momentum_drift(run, 1e-11, "angular_momentum")]


def hard_ringing(run):
    return [elastic_drift(run, 1e-3), *ringing(run)[1:]]


def flight(run):
    """A block in flight, turning: momenta, and its centre on a straight line."""
    distance = np.linalg.norm(run.blank.mean(axis=0) - run.blank_start.mean(axis=0))
    way = 2.0e5 * np.hypot(1, 0.4) * run.time()[-1]
    return [momentum_drift(run, 1e-12), momentum_drift(run, 1e-12, "angular_momentum"),
            energy_error(run, 1e-3), Mark("way of the centre", abs(distance / way - 1), 3e-3)]


def spinning(run, side=0.5, limit=0.01):
    """Centrifugal stress, exact for nu = 0: the trace of the stress is free of the bar's angle."""
    place = run.at_points["reference_position"].reshape(-1, 3)
    trace = run.at_points["stress"][..., :3].sum(axis=-1).ravel()
    x, y = place[:, 0], place[:, 1]
    exact = DENSITY * 1.0e8 / 2 * ((100 - x**2) + (side**2 - y**2))
    return [Mark("centrifugal stress", np.abs(trace - exact).max() / exact.max(), limit),
            momentum_drift(run, 1e-12, "angular_momentum"),
            Mark("linear momentum over that of one half",
                 np.abs(run.history["momentum"]).max() / (DENSITY * 9 * 5.0e4), 1e-12),
            energy_error(run, 1e-5)]


def spinning_shell(run):
    return spinning(run, side=1.0, limit=0.02)


def soft_volume(run):
    return [elastic_drift(run, 1e-4), energy_error(run, 1e-4), finite(run)]


SCENES = [
    Scene("ringing_block", "block",
          "1e5 increments without any damping: accumulated errors show", ringing,
          {"kick": 500, "end_time": 8.6e-2}, bits={"end_time": 1e-3}),
    Scene("ringing_between_outputs", "block",
          "frames and history samples not due together: alternating increments gain energy",
          ringing, {"kick": 500, "frames": 400, "rows": 110, "end_time": 2e-3}),
    Scene("hard_ringing", "block",
          "rotating strains of 2e-3: a first-order stress update gains energy",
          hard_ringing,
          {"kick": 5000, "length": 10, "n_x": 2, "n_y": 2, "n_z": 2, "end_time": 1e-2},
          bits={"end_time": 1e-3}),
    Scene("tumbling_flight", "block",
          "flight at 215 m/s about no principal axis: forces must rotate with the body", flight,
          {"flight": 2e5, "spin": 1e4, "kick": 0, "end_time": 6.3e-4}),
    Scene("spinning_bar", "spin",
          "1e4 rad/s: the stress is a small difference of large rotations", spinning,
          {"height": 0.9}),
    Scene("spinning_shell", "spin",
          "the same of a thin shell, with a bulk viscosity that shortens the increment",
          spinning_shell, SHELL),
    Scene("nu_0.499", "block", "pressure waves twenty times as fast as shear waves", soft_volume,
          {"nu": 0.499, "kick": 500, "end_time": 1e-4}),
    Scene("nu_0.4999", "block", "the same, seventy times", soft_volume,
          {"nu": 0.4999, "kick": 500, "end_time": 1e-4}),
    Scene("nu_0.4999_bbar", "block", "the same with projected volume strains", soft_volume,
          {"nu": 0.4999, "projection": "BBAR", "kick": 500, "end_time": 1e-4}),
    Scene("ringing_ans", "block", "projected shear in a bar that rotates and bends", soft_volume,
          {"projection": "ANS", "height": 1, "kick": 500, "end_time": 1e-4}),
    Scene("ringing_block_long", "block", "1e6 increments without any damping", ringing,
          {"kick": 500, "end_time": 8.6e-1}, bits={"end_time": 1e-3}, is_long=True),
    Scene("spinning_bar_long", "spin", "100 revolutions of an elastic bar at 1e4 rad/s", spinning,
          {"height": 0.9, "turns": 100}, bits={"turns": 1}, is_long=True),
    Scene("spinning_shell_long", "spin", "1000 revolutions of an elastic shell at 1e4 rad/s",
          spinning_shell, {**SHELL, "turns": 1000}, bits={"turns": 1}, is_long=True),
]
