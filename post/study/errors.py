"""What a result gets wrong: its distance from reference data, a finer run or known values."""
import numpy as np

from post.compare import Reference, Sheet, shape_distance
from post.results import Results, ResultsError


class Facts:
    """What results are compared by; lengths in the deck's unit, work per width."""

    def __init__(self, line, x0, thickness, strain, work):
        self.line = line              # mid-surface at the end (n, 2)
        self.x0 = x0                  # reference x of the thickness
        self.thickness = thickness
        self.strain = strain          # mean plastic strain of the window
        self.work = work              # external work at the end


def facts_of_data(path, middle):
    """Facts of the files of an independent code."""
    folder, _, name = path.rpartition("/")
    data = Reference(folder or ".", name)
    inside = (data.x0 >= middle[0]) & (data.x0 <= middle[1])
    return Facts(data.middle, data.x0, data.thickness, float(data.eqps[inside].mean()),
                 float(data.work[-1]))


def facts_of_run(path, middle):
    """Facts of a result file."""
    with Results(path) as results:
        sheet = Sheet(results)
        return Facts(sheet.middle_points((-np.inf, np.inf)), sheet.section.start,
                     sheet.section.thickness(sheet.last), sheet.mean_strain(sheet.last, middle),
                     float(sheet.work[-1]))


class Judge:
    """Measures the errors of results against the reference of a study."""

    def __init__(self, reference, reference_result=None):
        self.reference = reference
        self.facts = None
        if reference.data:
            self.facts = facts_of_data(reference.data, reference.middle)
        elif reference_result:
            self.facts = facts_of_run(reference_result, reference.middle)

    def errors(self, path):
        """Values and errors of a result by column name, as far as there is a reference."""
        with Results(path) as results:
            sheet = Sheet(results)
            strain = sheet.mean_strain(sheet.last, self.reference.middle)
            columns = {"control_points": int(np.prod(results.n_elements + results.degrees)),
                       "mean_plastic_strain": strain, "external_work": float(sheet.work[-1]),
                       "penetration_error": 100 * sheet.penetration(),
                       "energy_error": 100 * float(np.abs(results.balance_error()).max())}
            columns |= timings(results)
            if self.facts:
                columns |= self.against_facts(sheet, strain)
            else:
                columns |= self.against_values(sheet, columns)
        return columns

    def against_facts(self, sheet, strain):
        ends, facts = self.reference.ends, self.facts
        x0 = sheet.section.start
        window = (x0[0] + ends, x0[-1] - ends)
        shift, rms, greatest = shape_distance(sheet.middle_points(window), facts.line,
                                              self.reference.shift)
        inside = (x0 >= max(window[0], facts.x0[0])) & (x0 <= min(window[1], facts.x0[-1]))
        thickness = sheet.section.thickness(sheet.last)[inside]
        wrong = thickness - np.interp(x0[inside], facts.x0, facts.thickness)
        return {"shift": shift, "shape_error": rms, "greatest_distance": greatest,
                "least_thickness": float(thickness.min()),
                "thickness_error": float(np.sqrt(np.mean(wrong**2))),
                "mean_plastic_strain_error": per_cent(strain, facts.strain),
                "external_work_error": per_cent(sheet.work[-1], facts.work)}

    def against_values(self, sheet, columns):
        known = self.reference.values
        columns = columns | {"thickness": float(sheet.section.thickness(sheet.last).mean())}
        wrong = {}
        for name in known:
            if name == "shape":
                raise ResultsError("a shape cannot be given as reference.values")
            error = (abs(columns[name] - known[name]) if name == "thickness"
                     else per_cent(columns[name], known[name]))
            wrong[f"{name}_error"] = error
        return wrong


def per_cent(value, expected):
    return 100 * abs(float(value) / expected - 1)


def timings(results):
    """Steps, and each effect's share of the time of all steps [%]."""
    file = results.file
    total = float(file["timings/wall_seconds"][()])
    columns = {"steps": int(file["timings/steps"][()]),
               "elements": int(file["timings/elements"][()]), "stepping_seconds": total}
    shares = {name: 100 * float(group["seconds"][()]) / total
              for name, group in file["timings/effects"].items()}
    shares["other"] = max(0.0, 100 - sum(shares.values()))
    return columns | {f"share_{name}": share for name, share in shares.items()}
