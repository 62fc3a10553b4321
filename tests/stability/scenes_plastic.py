"""Plastic flow: flat and steep curves, large increments, reversals, rotation."""
import numpy as np
from criteria import energy_error, finite, momentum_drift, yield_excess
from stability import Mark, Scene


def line(sigma_0, slope):
    """Flow stress against plastic strain."""
    return lambda eqps: sigma_0 + slope * eqps


def pulled(sigma_0, slope, strain, limit=0.01):
    """A bar that stretches evenly to the strain: plastic strain is that less the elastic one."""
    plastic = (abs(np.log1p(strain)) - sigma_0 / 210000) / (1 + slope / 210000)

    def check(run):
        eqps = run.at_points["eqps"].ravel()
        return [yield_excess(run, line(sigma_0, slope), 1e-9),
                Mark("plastic strain", np.abs(eqps / plastic - 1).max(), limit),
                energy_error(run, 1e-4), finite(run)]
    return check


def far(run):
    """Pulled to a plastic strain of 50 %, the elastic part on top."""
    return [Mark("plastic strain too small", 0.5 / run.at_points["eqps"].min(), 1),
            *pulled(250, 0.21, 0.66)(run)]


def reversed_often(run):
    """Fifty ways of 0.5 %: each but the first takes the elastic strain back and forth."""
    eqps = run.at_points["eqps"].ravel()
    path = 50 * np.log1p(0.005) - (2 * 50 - 1) * 253 / 210000
    return [Mark("steps of a way against 100", abs(run.history["step"][-1] / 50 / 100 - 1), 0.05),
            yield_excess(run, line(250, 50), 1e-9),
            Mark("mean plastic strain of all ways", abs(eqps.mean() / path - 1), 0.01),
            Mark("spread of the plastic strain", np.ptp(eqps) / path, 1e-9),
            energy_error(run, 1e-4)]


def large_steps(flow):
    """Stretched so fast that each step adds 5 % of plastic strain."""
    def check(run):
        each = run.at_points["eqps"].min() / run.history["step"][-1]
        return [yield_excess(run, flow, 1e-9),
                Mark("plastic strain of a step too small", 0.05 / each, 1),
                energy_error(run, 0.05), finite(run)]
    return check


def sharp_sheet(run):
    """Stretched in plane strain by 5 % in each increment: the stress is on Hosford's surface."""
    eqps = run.at_points["eqps"].ravel()
    one, two = run.at_points["stress"].reshape(-1, 6).T[:2]
    scale = np.abs(one).max()
    hosford = scale * (0.5 * ((one / scale)**40 + (two / scale)**40
                              + ((one - two) / scale)**40))**(1 / 40)
    return [Mark("stress off the yield surface",
                 np.abs(hosford / line(250, 1000)(eqps) - 1).max(), 1e-9),
            Mark("plastic strain of a step too small", 0.05 * run.history["step"][-1] / eqps.min(),
                 1), energy_error(run, 0.05), finite(run)]


def two_surfaces(run):
    """Fifty ways of 2 % with two surfaces: the stress stays inside the bounding surface."""
    eqps = run.at_points["eqps"].ravel()
    return [yield_excess(run, lambda p: 168 + (190 + 9) * (1 - np.exp(-12 * p)), 1e-9),
            Mark("plastic strain too small", 0.9 / eqps.min(), 1),
            Mark("spread of the plastic strain", np.ptp(eqps) / eqps.max(), 1e-9),
            energy_error(run, 0.05), finite(run)]


def voce(eqps):
    return 250 + 250 * (1 - np.exp(-20 * eqps))


def turning(run):
    """Once it has yielded the bar turns rigidly: no more plastic work."""
    work = run.history["plastic_work"]
    return [Mark("plastic work of the last half", abs(work[-1] - work[len(work) // 2])
                 / work[-1], 1e-3),
            Mark("plastic strain too small", 0.01 / run.at_points["eqps"].max(), 1),
            yield_excess(run, line(500, 5000), 1e-9),
            momentum_drift(run, 1e-12, "angular_momentum"), energy_error(run, 1e-4)]


TURNING = {"omega": 5e4, "sigma_0": 500, "hardening": 5000, "n_x": 8, "side": 1}
TWO_SURFACES = {"law": "YOSHIDA UEMORI", "constants": "124, 168, 500, 12, 9, 0.5, 190",
                "strain": 0.02, "ways": 50}
LARGE = {"p": 1, "n_x": 1, "rate": 8e5, "strain": 0.7, "b1": 0, "rows": 10}
SCENES = [
    Scene("perfect_plasticity", "pull", "no hardening keeps the strain uniform",
          pulled(250, 0, -0.2, 0.05),
          {"law": "PERFECT", "constants": "250", "strain": -0.2, "rate": -300}),
    Scene("steep_hardening", "pull", "a slope of Young's modulus: plastic increments as large "
          "as elastic ones",
          pulled(250, 210000, 0.05),
          {"constants": "250, 210000", "strain": 0.05, "rate": 500}),
    Scene("near_zero_hardening", "pull", "a slope of 1e-6 Young's moduli to 50 % plastic strain",
          far, {"constants": "250, 0.21", "strain": 0.66, "rate": 2000, "p": 1, "n_x": 1}),
    Scene("five_percent_a_step", "pull", "plastic strain of 5 % in each increment",
          large_steps(line(250, 1000)), LARGE),
    Scene("curved_hardening", "pull",
          "curved hardening in three increments of 6 %: a hard start for Newton's method",
          large_steps(voce), LARGE | {"law": "VOCE", "constants": "250, 250, 20", "strain": 0.21,
                                      "rows": 3}),
    Scene("sharp_yield_surface", "pull", "plastic strain of 5 % in each increment at an edge of "
          "Yld2000 with the exponent 40",
          large_steps(line(250, 1000)), LARGE | {"potential": "corners.inc"}),
    *[Scene(f"sharp_sheet_{name}", "sheet", "plastic strain of 5 % in each increment of a shell at "
            f"an edge of {title} with the exponent 40", sharp_sheet, {"potential": f"{file}.inc"})
      for name, title, file in (("barlat", "Barlat 1989", "corners_barlat"),
                                ("bbc", "BBC2005", "corners_bbc"), ("yld", "Yld2000", "corners"))],
    Scene("two_surfaces_reversed", "pull", "fifty reversals of the two surfaces of Yoshida and "
          "Uemori in solids", two_surfaces,
          TWO_SURFACES | {"p": 1, "n_x": 1, "rate": 2e4}),
    Scene("two_surfaces_reversed_sheet", "sheet",
          "the same in a shell, half a per cent in each increment", two_surfaces,
          TWO_SURFACES | {"rate": 3e5}),
    Scene("reversal_every_100_steps", "pull", "return mapping from either side of the yield "
          "surface",
          reversed_often, {"constants": "250, 50", "rate": 500, "strain": 0.005, "ways": 50,
                         "p": 1, "n_x": 1}),
    Scene("turning_while_plastic", "spin",
          "10 revolutions at the yield stress: an error of the rotation causes plastic flow",
          turning, TURNING | {"turns": 10}, bits={"turns": 1}),
    Scene("turning_while_plastic_long", "spin", "100 revolutions at the yield stress", turning,
          TURNING | {"turns": 100}, bits={"turns": 1}, is_long=True),
]
