"""What the cases of the verification suite share: runs, references on a line, the record of errors.

A case is a script `CASE.py IGAFORM DECKS OUT [long]`. It runs decks of the folder DECKS, works out
its reference itself, and leaves OUT/CASE.json for `python -m post verification OUT`.
"""
import json
import os
import subprocess
import sys

import numpy as np
from run_results import Run

LEAST_GAP = 1.08   # of the second frequency over the first: more than errors amount to


class Case:
    """One case: runs decks, collects errors with their limits and the lines of a picture."""

    def __init__(self, title, source):
        self.igaform, self.decks, self.out = sys.argv[1:4]
        self.is_long = "long" in sys.argv[4:]
        self.name = os.path.basename(sys.argv[0]).removesuffix(".py")
        self.record = {"title": title, "source": source, "rows": [], "panels": []}
        self.is_passed = True
        os.makedirs(self.out, exist_ok=True)

    def command(self, deck, settings):
        sets = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        return [self.igaform, os.path.join(self.decks, deck + ".key"), "--threads", "1", *sets]

    def run(self, deck, **settings):
        """Run a deck with parameters of one's own; the open results file."""
        path = os.path.join(self.out, f"{self.name}_{deck}.h5")
        subprocess.run([*self.command(deck, settings), "--quiet", "--out", path], check=True)
        return Run(path)

    def modes(self, deck, count, **settings):
        """The lowest frequencies [1/time] of a deck."""
        text = subprocess.run([*self.command(deck, settings), "--modes", str(count)], check=True,
                              capture_output=True, text=True).stdout
        return np.array([float(line.split()[1]) for line in text.splitlines()[1:]])

    def lowest(self, deck, **settings):
        """The lowest frequency, which must stand alone: where the references say that the mode in
        question is the lowest, no other one can then be taken for it. From degree 3 on, row-sum
        masses give short waves frequencies below those of long ones on coarse meshes."""
        first, second = self.modes(deck, 2, **settings)
        self.between(f"{deck}, {settings}: second over first frequency", second / first,
                     LEAST_GAP, np.inf)
        return first

    def error(self, quantity, measured, reference, limit):
        """The relative error of a number against its reference, and the error that passes."""
        self._add(quantity, f"{measured:.5g}", f"{reference:.5g}", measured / reference - 1, limit)

    def deviation(self, quantity, value, limit):
        """An error that is worked out already, such as a norm over a field."""
        self._add(quantity, "", "", value, limit)

    def between(self, quantity, measured, low, high):
        """A number that must lie in a range."""
        is_good = low <= measured <= high
        self._row(quantity, f"{measured:.4g}", f"{low:.4g} to {high:.4g}", "", "", is_good)

    def rate(self, quantity, sizes, errors, low, high=None):
        """Order of convergence between the two finest meshes, at least `low`."""
        found = order(sizes, errors)
        if high is not None:
            self.between(quantity, found, low, high)
        else:
            self._row(quantity, f"{found:.3g}", f"at least {low:g}", "", "", bool(found >= low))

    def _add(self, quantity, measured, reference, error, limit):
        self._row(quantity, measured, reference, f"{error:.2e}", f"{limit:g}",
                  bool(abs(error) <= limit))

    def _row(self, quantity, measured, reference, error, limit, is_good):
        self.is_passed = self.is_passed and is_good
        self.record["rows"].append({"quantity": quantity, "measured": measured,
                                    "reference": reference, "error": error, "limit": limit})
        print(f"{'good' if is_good else 'FAIL'}  {quantity}: {measured} against {reference}, "
              f"error {error}, limit {limit}")

    def panel(self, x, y, lines, scale="linear"):
        """A panel of the picture: `lines` holds (label, style, x values, y values)."""
        self.record["panels"].append({
            "x": x, "y": y, "scale": scale,
            "lines": [{"label": label, "style": style, "x": np.asarray(xs, float).tolist(),
                       "y": np.asarray(ys, float).tolist()} for label, style, xs, ys in lines]})

    def finish(self):
        """Write the record; ends the script."""
        with open(os.path.join(self.out, self.name + ".json"), "w", encoding="utf-8") as file:
            json.dump(self.record, file, indent=1)
        sys.exit(0 if self.is_passed else 1)


def order(sizes, errors):
    """Order of convergence between the last two of a row of meshes."""
    sizes, errors = np.abs(np.asarray(sizes, float)), np.abs(np.asarray(errors, float))
    return np.log(errors[-1] / errors[-2]) / np.log(sizes[-1] / sizes[-2])


def chebyshev(n, low, high):
    """Places and the matrix of the derivative on n + 1 Chebyshev places of a line (L. N. Trefethen,
    Spectral Methods in MATLAB, SIAM 2000, chapter 6)."""
    x = np.cos(np.pi * np.arange(n + 1) / n)
    c = np.r_[2, np.ones(n - 1), 2] * (-1.0) ** np.arange(n + 1)
    gap = x[:, None] - x[None, :]
    matrix = np.outer(c, 1 / c) / (gap + np.eye(n + 1))
    matrix -= np.diag(matrix.sum(axis=1))
    return low + (high - low) * (x + 1) / 2, matrix * 2 / (high - low)


def pencil_frequencies(stiffness, boundary, n_fields):
    """Frequencies [1/time] of `stiffness u = -omega^2 u` in which the first and the last place of
    each field carry the rows of `boundary` (2 n_fields conditions) in place of an equation."""
    n = stiffness.shape[0] // n_fields
    ends = np.array([[f * n, f * n + n - 1] for f in range(n_fields)]).ravel()
    inside = np.setdiff1d(np.arange(stiffness.shape[0]), ends)
    # the values at the ends follow from those inside
    follow = -np.linalg.solve(boundary[:, ends], boundary[:, inside])
    reduced = stiffness[np.ix_(inside, inside)] + stiffness[np.ix_(inside, ends)] @ follow
    values = -np.linalg.eigvals(reduced)
    values = np.sort(values[(np.abs(values.imag) < 1e-6 * np.abs(values)) & (values.real > 1)].real)
    return np.sqrt(values) / (2 * np.pi)


def lame(young, poisson):
    """Lame's constants."""
    return (young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson)))
