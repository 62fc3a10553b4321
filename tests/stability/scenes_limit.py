"""The edge of the stable step, scaled masses, and runs that must end with a reason."""
from criteria import (elastic_drift, energy_error, finite, momentum_drift, penetration,
                      refused, stopped, stopped_at_once)
from stability import Mark, Scene


def at_the_edge(run):
    return [elastic_drift(run, 0.02), energy_error(run, 0.05), momentum_drift(run, 1e-11),
            finite(run)]


def scaled(run, plain):
    """A hundred times the mass at a tenth of the speed moves as the real one: m v^2 is the same."""
    h = run.history
    work = h["external_work"][-1] / plain.history["external_work"][-1]
    return [energy_error(run, 1e-3), penetration(run, 1, 0.01),
            Mark("work against that of the real mass", abs(work - 1), 1e-3), finite(run)]


def thickness_scaled(run, plain):
    work = run.history["external_work"][-1] / plain.history["external_work"][-1]
    return [energy_error(run, 1e-3), Mark("work against that of the real mass", abs(work - 1),
                                          0.02), finite(run)]


# Rows apart enough for steps between them to be close to the largest.
LIMIT = {"kick": 50, "end_time": 1e-3, "rows": 20}
SCENES = [
    Scene("step_1.0", "block", "the largest increment that the assembled limit allows", at_the_edge,
          LIMIT | {"safety": 1.0}),
    Scene("step_1.05", "block", "5 % above the limit: detected", stopped,
          LIMIT | {"safety": 1.05}, ends=(2, "energy balance lost", "by element (2, 1, 1)",
                                          "  1. time increments above the stable one")),
    Scene("plastic_step_1.05", "spin", "the same while most of the bar flows plastically and the "
          "energy balance holds: detected", stopped,
          {"omega": 5e4, "sigma_0": 500, "hardening": 5000, "n_x": 8, "side": 1, "turns": 3,
           "safety": 1.05},
          ends=(2, "change sign", "kinetic energy",
                "  1. time increments above the stable one")),
    Scene("perfect_plasticity_step_1.25", "pull", "the same where nothing but the yield stress "
          "resists", stopped, {"law": "PERFECT", "constants": "250", "strain": 0.1, "rate": 300,
                               "safety": 1.25},
          ends=(2, "change sign", "kinetic energy",
                "  1. time increments above the stable one")),
    Scene("scaled_step_1.0", "block", "the same limit with masses raised for a ten times larger "
          "increment", at_the_edge,
          LIMIT | {"safety": 1.0, "target_step": 1.07e-5, "end_time": 1e-2}),
    Scene("scaled_step_1.05", "block", "5 % above the limit of scaled masses: detected", stopped,
          LIMIT | {"safety": 1.05, "target_step": 1.07e-5, "end_time": 1e-2},
          ends=(2, "time increments above the stable one", "igaform: error")),
    Scene("mass_times_100", "bend", "inertia a hundred times the real one", scaled,
          {"speed": 300, "depth": 1, "target_step": 8e-7},
          others=[{"target_step": 8e-8, "speed": 3000}], bits={"depth": 0.2}),
    Scene("thickness_mass_times_100", "bend", "masses through the thickness a hundredfold",
          thickness_scaled, {"speed": 4000, "depth": 1, "factor": 100},
          others=[{"factor": 1}], bits={"depth": 0.2}),
    Scene("crushed", "pull", "inverted elements: named, state saved", stopped,
          {"strain": -1.2, "rate": -50000},
          ends=(2, "inverted element",
                "in element (1, 1, 1), point (1, 1, 1)", "at (-0.001", ", 0.71", "  3. ",
                "verified state")),
    Scene("user_law_fails", "user_law", "a user's law returns NaN: element and point named",
          stopped, user="fails_beyond.f",
          ends=(2, "in element 8, point 3",
                "in element (8, 1, 1), point (3, 1, 1)", "  1. the user's subroutine")),
    Scene("number_overflows", "floor", "a number beyond the range of the machine", refused,
          {"E": "1e400"}, ends=(1, "too large")),
    Scene("stiffness_overflows", "floor", "numbers within the range, products beyond it", refused,
          {"E": "1e306"}, ends=(1, "time increment")),
    Scene("speed_overflows", "floor", "a velocity whose square is infinite", stopped_at_once,
          {"down": "1e200"}, ends=(2, "igaform: error", "  1. a speed of 1e200")),
    Scene("speed_absurd", "floor", "a finite velocity that makes lengths overflow",
          stopped_at_once, {"down": "1e160"},
          ends=(2, "igaform: error", "  1. a speed of 1e160")),
]
