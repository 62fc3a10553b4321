"""Pinched cylinder on end diaphragms, radius 300, length 600, thickness 3, E = 3e6, nu = 0.3.

Under opposite unit forces the loaded points move by 1.8248e-5 (T. Belytschko, H. Stolarski, W. K.
Liu, N. Carpenter, J. S.-J. Ong, CMAME 51 (1985) 221-258). The deck moves the point; the force on an
eighth, a quarter of the whole, is twice the elastic energy over the displacement.
"""
from suite import Case

REFERENCE = 1.8248e-5


def main():
    case = Case("Pinched cylinder on diaphragms, radius 100 thicknesses",
                "shell theory, Belytschko et al. (1985)")
    cases = {("NONE", 2): 0.3, ("ANS", 2): 0.42, ("NONE", 3): 0.7}
    meshes = (4, 8)
    if case.is_long:
        cases = {("NONE", 2): 0.6, ("ANS", 2): 0.7, ("NONE", 3): 0.92}
        meshes = (8, 12, 16)
    lines = []
    for (projection, p), low in cases.items():
        shares = []
        for n in meshes:
            run = case.run("pinched_cylinder", p=p, n=n, projection=projection)
            moved = -run.probes["pinch"]["displacement"][-1, 2]
            force = 4 * 2 * run.history["internal_energy"][-1] / moved
            shares.append(moved / force / REFERENCE)
        lines.append((f"{projection}, p = {p}", "o-", meshes, shares))
        case.between(f"compliance by that of shell theory, {projection}, p = {p}, {n} x {n} "
                     "elements", shares[-1], low, 1.03)
    case.panel("elements along a side", "compliance by the reference", lines)
    case.finish()


main()
