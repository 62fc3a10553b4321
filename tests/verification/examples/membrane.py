"""An axisymmetric membrane as independent check of input/hemisphere.key: no bending, no thickness.

Line elements of one point in explicit steps; J2 plasticity in plane stress by projection
(J. C. Simo, R. L. Taylor, Int. J. Numer. Meth. Engng 22, 1986); penalty contact of the mid-surface;
Coulomb friction smoothed at 1 % of the punch's speed. It shares no code with igaform.

Usage: membrane.py RESULT.h5 [PICTURE.png]   prints both profiles, and draws them
"""
import os
import sys

import numpy as np

CLAMP, PUNCH, SHOULDER, THICKNESS, DEPTH = 59.18, 50.8, 6.35, 0.85, 28.5   # mm
E, NU, DENSITY, FRICTION = 207000.0, 0.3, 7.85e-9, 0.275
K, EPS_0, N = 589.0, 1e-4, 0.216


def flow_stress(eqps):
    """Stress of the curve and its slope."""
    return K * (EPS_0 + eqps)**N, K * N * (EPS_0 + eqps)**(N - 1)


def projected(plus, minus, gamma):
    """Sum and difference of the stresses after the return; sqrt(2/3) of the equivalent stress."""
    p = plus / (1 + E / (3 * (1 - NU)) * gamma)
    m = minus / (1 + E / (1 + NU) * gamma)
    return p, m, np.maximum(np.sqrt(2 / 3 * (p**2 / 2 + 1.5 * m**2)), 1e-30)


def plane_stress(stress, eqps, strain):
    """Stresses along meridian and hoop after increments of the logarithmic strains."""
    trial = stress + E / (1 - NU**2) * np.array([strain[0] + NU * strain[1],
                                                 strain[1] + NU * strain[0]])
    plus, minus = (trial[0] + trial[1]) / np.sqrt(2), (trial[0] - trial[1]) / np.sqrt(2)
    yields = np.sqrt(plus**2 / 2 + 1.5 * minus**2) > flow_stress(eqps)[0]
    gamma = np.zeros_like(eqps)
    for _ in range(60):
        p, m, size = projected(plus, minus, gamma)
        y, slope = flow_stress(eqps + gamma * np.sqrt(2 / 3) * size)
        residual = np.where(yields, 0.5 * size**2 - y**2 / 3, 0)
        if np.abs(residual).max() < 1e-9 * K**2:
            break
        half = -(p**2 / 3 / (3 * (1 - NU) / E + gamma) + m**2 / ((1 + NU) / E + gamma))
        change = np.sqrt(2 / 3) * (size + gamma * half / size)
        gamma = np.maximum(gamma - residual / (half - 2 / 3 * y * slope * change), 0)
    p, m, size = projected(plus, minus, gamma)
    return np.array([p + m, p - m]) / np.sqrt(2), eqps + gamma * np.sqrt(2 / 3) * size


def touch(x, v, centre, radius, stiffness, smallest):
    """Penalty and friction of a circle on the nodes, v being relative to it."""
    arm = x - np.array(centre)[:, None]
    distance = np.hypot(*arm)
    normal = arm / distance
    pressure = stiffness * np.maximum(radius - distance, 0)
    slip = v - normal * (v * normal).sum(0)
    return pressure * (normal - FRICTION * slip / np.sqrt((slip**2).sum(0) + smallest**2))


def profile(depth=DEPTH, n=60, time=5e-3):
    """Distance from the axis at the start and thickness strain of n elements at a punch depth."""
    nodes = np.linspace(0, CLAMP, n + 1)
    length, middle = np.diff(nodes), 0.5 * (nodes[1:] + nodes[:-1])
    volume = 2 * np.pi * middle * length * THICKNESS
    mass = 0.5 * DENSITY * (np.append(volume, 0) + np.append(0, volume))
    dt = 0.5 * length[0] / np.sqrt(E / (1 - NU**2) / DENSITY)
    stiffness, top, half = 0.1 * mass / dt**2, depth / (0.9 * time), THICKNESS / 2
    x, v = np.array([nodes, np.full(n + 1, half)]), np.zeros((2, n + 1))
    stress, eqps, strain, reached, step = np.zeros((2, n)), np.zeros(n), np.zeros((2, n)), 0.0, 0
    while reached < depth:
        share = step * dt / time
        speed = top * min(share / 0.1, 1, max((1 - share) / 0.1, 0.02))
        reached += speed * dt
        side = np.diff(x)
        now, radius = np.hypot(*side), 0.5 * (x[0, 1:] + x[0, :-1])
        strain_now = np.log(np.array([now / length, radius / middle]))
        stress, eqps = plane_stress(stress, eqps, strain_now - strain)
        strain = strain_now
        force = touch(x, v - [[0], [speed]], (0, reached - PUNCH), PUNCH + half, stiffness,
                      0.01 * top)
        force += (x[0] < CLAMP) * touch(x, v, (CLAMP, THICKNESS + SHOULDER), SHOULDER + half,
                                        stiffness, 0.01 * top)
        along, hoop = volume * stress[0] * side / now**2, 0.5 * volume * stress[1] / radius
        force[:, :-1] += along
        force[:, 1:] -= along
        force[0, :-1] -= hoop
        force[0, 1:] -= hoop
        v += dt * (force / mass - 20 * v / time)
        v[0, 0] = 0
        v[:, -1] = 0
        x = x + dt * v
        step += 1
    return middle, -strain.sum(0)


def columns(results):
    """Distance from the axis at the start and thickness strain at the end, of all columns."""
    radii, strains = [], []
    for patch in results.patches:
        start = patch.field("Points", 0)[0]
        radii.append(np.hypot(start[..., 0], start[..., 1]).ravel())
        thinning = patch.field("thinning", len(results.times) - 1)[0, ..., 0]
        strains.append(np.log1p(-thinning).ravel())
    return np.concatenate(radii), np.concatenate(strains)


def main(path, picture=None):
    sys.path.insert(0, os.path.abspath(os.path.join(os.path.dirname(__file__), *[os.pardir] * 3)))
    from post.results import Results
    from post.style import BLANK, plt, save, tool_colour
    with Results(path) as results:
        radius, strain = columns(results)
        depth = np.abs(results.tool_history("punch", "displacement")).max()
    middle, reference = profile(depth)
    print("from    to  igaform  membrane")
    for low in range(0, 60, 4):
        here, there = [(r >= low) & (r < low + 4) for r in (radius, middle)]
        print(f"{low:4d} {low + 4:5d} {strain[here].mean():8.4f} {reference[there].mean():9.4f}")
    print(f"extreme {strain.min():8.4f} {reference.min():9.4f}, at {radius[strain.argmin()]:.1f} "
          f"and {middle[reference.argmin()]:.1f} mm")
    if picture:
        figure, axis = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
        axis.plot(radius, strain, ".", color=BLANK, markersize=2, label="igaform, all columns")
        axis.plot(middle, reference, color=tool_colour(0), label="axisymmetric membrane")
        axis.set(xlabel="distance from the axis at the start [mm]", ylabel="thickness strain")
        axis.legend()
        save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
