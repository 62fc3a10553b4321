"""A rigid cylinder pressed into an elastic half plane against Hertz: half-width of the contact
b^2 = 4 F R (1 - nu^2)/(pi E), pressure 2 F/(pi b) sqrt(1 - (x/b)^2), and the stress below it after
McEwen (K. L. Johnson, Contact Mechanics, Cambridge 1985, sec. 4.2).
"""
import numpy as np
from suite import Case

E, NU, R = 2100.0, 0.3, 20.0


def below(x, z, half_width, peak):
    """Stress across the surface at depth z."""
    a = half_width**2 - x**2 + z**2
    root = np.sqrt(a**2 + 4 * x**2 * z**2)
    m2, n2 = (root + a) / 2, (root - a) / 2
    return -peak * np.sqrt(m2) / half_width * (1 - (z**2 + n2) / (m2 + n2))


def main():
    case = Case("Rigid cylinder on an elastic half plane", "Hertz; McEwen")
    lines = []
    for n in (14, 28) if case.is_long else (14,):
        run = case.run("hertz", n=n)
        late = run.time() > 1.0e-3
        force = 2 * run.tools["roll"]["force"][late, 1].mean()
        half_width = np.sqrt(4 * force * R * (1 - NU**2) / (np.pi * E))
        peak = 2 * force / (np.pi * half_width)
        x, y = run.at_points["reference_position"].reshape(-1, 3)[:, :2].T
        stress = run.at_points["stress"].reshape(-1, 6)[:, 1]
        near = (x < 2 * half_width) & (-y < 2 * half_width)
        exact = below(x, -y, half_width, peak)
        case.deviation(f"stress within 2 b, rms by the peak, {n} x {n} elements",
                       np.sqrt(np.mean((stress - exact)[near]**2)) / peak, 0.03)
        axis = near & (x < x.min() + 1e-9)
        top = np.argmax(np.where(axis, y, -np.inf))
        case.error(f"stress at the highest point of the axis, {n} x {n} elements", stress[top],
                   exact[top], 0.03)
        row = (y > y.max() - 1e-9) & (x < 2.5 * half_width)
        order = np.argsort(x[row])
        lines.append((f"{n} x {n} elements", "o", x[row][order] / half_width,
                      -stress[row][order] / peak))
    place = np.linspace(0, 2, 200)
    lines.append(("Hertz", "k-", place, np.sqrt(np.maximum(1 - place**2, 0))))
    case.panel("x/b", "pressure below the surface over its peak", lines)
    case.finish()


main()
