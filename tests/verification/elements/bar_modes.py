"""Frequencies of a free bar against n c / (2 L).

Row-sum masses of B-splines of degree p lower the frequency of a wave of length 2 pi/k by the share
(p + 1) (k h)^2/24, p >= 2, and (k h)^2/24 for p = 1: the mass of a B-spline is that of p + 1 box
functions one after the other, whose second moment is (p + 1) h^2/12, and the slopes of degree 1 add
the opposite of half of that. On the whole, by Poisson's sum, an endless bar has
    (omega h/c)^2 = 4 sin(t/2)^2 sum over all m of (sin(t/2)/(t/2 + m pi))^(2 p),  t = k h,
which for p >= 2 falls again before t reaches pi.
"""
import numpy as np
from suite import Case

LENGTH, N = 100.0, 20
SPEED = np.sqrt(210000.0 / 7.85e-9)


def symbol(p, t):
    """Frequency times h/c of a wave with t = k h in an endless bar."""
    m = np.arange(-200, 201)[:, None]
    return 2 * np.sin(t / 2) * np.sqrt(((np.sin(t / 2) / (t / 2 + m * np.pi))**(2 * p)).sum(axis=0))


def main():
    case = Case("Bar, free at both ends: frequencies",
                "n c/(2 L); Fourier analysis of the row-sum mass")
    exact = SPEED / (2 * LENGTH)
    errors, spectra = [], []
    t = np.linspace(0.02, np.pi, 100)
    for p in (1, 2, 3, 4):
        sizes = [LENGTH / n for n in (N, 2 * N)]
        row = [case.modes("bar_modes", 2, p=p, n_x=n)[1] / exact - 1 for n in (N, 2 * N)]
        share = (1 if p == 1 else p + 1) * (np.pi / (2 * N))**2 / 24
        case.error(f"error of mode 1 by the theory of lumping, p = {p}, {2 * N} elements",
                   -row[-1], share, 0.01)
        case.rate(f"rate, p = {p}", sizes, row, 1.95, 2.05)
        errors.append((f"p = {p}", "o-", sizes, np.abs(row)))
        # four fibres move alike in the lowest n_x + p modes
        n_modes = 3 * N
        values = case.modes("bar_modes", n_modes + p, p=p, n_x=3 * N)[1:]
        places = np.arange(1, n_modes + p) / n_modes
        inside = np.arange(n_modes - 2)
        theory = np.sort(symbol(p, np.pi * np.arange(1, n_modes) / n_modes))[inside]
        case.deviation(f"modes 1 to {n_modes - 2} of {n_modes} by theory, largest error, p = {p}",
                       np.abs(values[inside] * LENGTH / n_modes * 2 * np.pi / SPEED / theory - 1)
                       .max(), 0.05)
        spectra.append((f"p = {p}", ".", places, values * 2 * LENGTH / SPEED / n_modes))
        spectra.append(("", "k-", t / np.pi, np.sort(symbol(p, t)) / np.pi))
    case.panel("element [mm]", "error of mode 1", errors, "log")
    case.panel("k h / pi, modes in rising order", "omega h / (pi c)", spectra)
    case.finish()


main()
