"""Write the instances of the block kernels and the statements that choose between them.

    python3 generate_kernels.py FOLDER [--few]

A kernel is one source, such as solid/ig_solid_kernel.inc. An instance is a module that includes it
with degrees and numbers of points as constants, plain or with weights (rational). Instances are
numbered in the order of the lists below; the general ones, which take any degrees and points as
arguments, follow. FOLDER receives
    <module>_<tag>.F90    the instances,
    <module>_uses.inc, <module>_cases.inc, <module>_rules.inc
                          USE statements, cases of the SELECT CASE, and table of degrees and points,
                          which the module of the dispatch includes,
    kernels.cmake         the names of the instances for CMake.
With --few only the first rule of each list has instances: for builds that look for faults in the
sources, of which all instances are copies, and not for speed.
A file that would not change is left alone, so that nothing is compiled again without need.
"""
import dataclasses
import pathlib
import sys
import textwrap

# Degrees and points along axes 1, 2, 3 of the instances. A new instance is one more entry.
SOLID_RULES = ["222222", "222223", "222224", "222226", "222333"]
SHELL_RULES = ["210216", "220224", "220226", "330336"]   # of mid-surfaces, the first of a strip
CUT_RULES = ["220416", "220414"]   # of shells that an outline cuts, all points along axis 1
STRIP_RULES = ["212212", "212213", "212214", "212216"]   # linear across, with one point there
if sys.argv[2:] == ["--few"]:
    for rules in (SOLID_RULES, SHELL_RULES, CUT_RULES, STRIP_RULES):
        del rules[1:]

# The same of solids, each at the place of the one that serves the whole elements of its patch.
CUT_SOLID_RULES = [rule[:3] + str(int(rule[3])*int(rule[4])) + "1" + rule[5]
                   for rule in SOLID_RULES]

MOST_POINTS = 12   # of an element, worked in one call of a law

# Arguments of calls. Arrays go by their first elements: no descriptor is read twice.
BASIS_1 = ["patch%lanes%values(1, 1, 1, block%b)", "patch%lanes%slopes(1, 1, 1, block%b)"]
BASIS_2 = ["patch%axes(2)%values(1, 1, block%e2)", "patch%axes(2)%slopes(1, 1, block%e2)"]
BASIS_3 = ["patch%axes(3)%values(1, 1, block%e3)", "patch%axes(3)%slopes(1, 1, block%e3)"]
AXIS_1 = [*BASIS_1, "patch%lanes%weights(1, 1, block%b)"]
AXIS_2 = [*BASIS_2, "patch%axes(2)%weights"]
AXIS_3 = [*BASIS_3, "patch%axes(3)%weights"]
STATE = ["patch%stress(1, 1, 1, 1, block%number)", "patch%state(1, 1, 1, 1, block%number)",
         "patch%push(1, 1, 1, min(block%number, size(patch%push, 4)))"]
COUNTS = ["p(1)", "p(2)", "p(3)", "q(1)", "q(2)", "q(3)"]
SHELL_COUNTS = ["p(1)", "p(2)", "q(1)", "q(2)", "q(3)"]
# Only to instances with weights, with context, and those that take the fields of the patch:
RATIONAL = ["patch%rational(1, 1, 1, 1, block%number)"]
REFERENCE = ["patch%has_gradients",
             "patch%reference(1, 1, 1, 1, min(block%number, size(patch%reference, 5)))"]
CONTEXT = [*REFERENCE, "fields%gradients", "fields%place"]
FIELDS = ["patch%n_control", "first", "x", "v"]
SHELL_BASIS = [*BASIS_1, "patch%lanes%bends(1, 1, 1, block%b)",
               "patch%lanes%weights(1, 1, block%b)",
               *BASIS_2, "patch%axes(2)%bends(1, 1, block%e2)", "patch%axes(2)%weights"]
# Points that lie anywhere in their elements, as many as there are along both axes of the sheet.
CUT_COUNTS = ["p(1)", "p(2)", "q(1)*q(2)", "1", "q(3)"]
CUT_SOLID_COUNTS = ["p(1)", "p(2)", "p(3)", *CUT_COUNTS[2:]]
CUT_BASIS = [f"patch%lanes%cut%{name}(1, 1, 1, cut)" for name in
             ("values1", "slopes1", "bends1")] + ["patch%lanes%cut%weights(1, 1, cut)"] \
    + [f"patch%lanes%cut%{name}(1, 1, 1, cut)" for name in ("values2", "slopes2", "bends2")] \
    + ["[1.0_wp]"]
CUT_SOLID_BASIS = [item for item in CUT_BASIS if "bends" not in item]
CUT_NODAL_BASIS = [item for item in CUT_SOLID_BASIS if "values" in item or "slopes" in item]
SHELL_RATIONAL = ["points%rational(1, 1, 1, block%number)"]
SHELL_STATE = ["points%metric(1, 1, 1, block%number)", "points%thickness(1, 1, block%number)",
               "points%through(1, 1, 1, block%number)",
               "points%resultant(1, 1, 1, block%number)",
               "is_pressed", "normal_end", "points%normal(1, 1, 1, block%number)", *STATE]


@dataclasses.dataclass
class Kernel:
    module: str          # the instances are modules of this name and their tag
    procedure: str       # the public one of an instance
    title: str           # first line of an instance
    source: str
    defines: list        # besides those of the instance
    uses: list           # module and names
    rules: list
    counts: list         # arguments that stand for the constants of a rule
    arguments: object    # is fixed, is rational -> list of the others
    variants: tuple = ("", "rational")
    groups_rows: bool = False   # the constant `together`, see rows_together

    def instances(self):
        """Tag, rule (None: general) and variant in the order of their numbers."""
        for rule in [*self.rules, None]:
            for variant in self.variants:
                tag = f"p{rule[:3]}_q{rule[3:]}" if rule else "general"
                yield tag + (f"_{variant}" if variant else ""), rule, variant

    def instance(self, tag, rule, variant):
        """Source of one instance."""
        defines = self.defines + ["RATIONAL"]*bool(variant)
        lines = [f"!> {self.title}, instance {tag} (see {self.source}).",
                 f"module {self.module}_{tag}", "  use kinds, only: wp",
                 *[f"  use {name}, only: {what}" for name, what in self.uses],
                 "  implicit none", "  private", "", f"  public :: {self.procedure}",
                 *[f"#define {name}" for name in defines + ["FIXED"]*bool(rule)]]
        if rule:
            constants = [*zip(["p1", "p2", "p3", "q1", "q2", "q3"], rule)]
            if self.groups_rows:
                constants.append(("together", rows_together(*map(int, rule[3:]))))
            lines.append("  integer, parameter :: " + ", ".join(f"{n} = {v}" for n, v in constants))
        return "\n".join([*lines, f'#include "{self.source}"', "",
                          f"end module {self.module}_{tag}", ""])

    def dispatch(self):
        """USE statements and cases of all instances, the last one being the default."""
        uses, cases = "", []
        for tag, rule, variant in self.instances():
            name = self.module.split("_")[1] + "_" + tag      # such as solid_p222_q223
            uses += f"  use {self.module}_{tag}, only: {name} => {self.procedure}\n"
            arguments = self.arguments(bool(rule), bool(variant))
            cases.append(wrapped(f"call {name}(", ([] if rule else self.counts) + arguments, ")"))
        numbers = [f"({number})" for number in range(1, len(cases))] + ["default"]
        return uses, "".join(f"    case {n}\n{case}" for n, case in zip(numbers, cases))


def rows_together(q1, q2, q3):
    """Rows of points whose stress is updated in one call: a law needs less time for each of many
    points, as long as they stay in the first cache."""
    return max(n for n in range(1, q1*q2 + 1) if q1*q2 % n == 0 and (n == 1 or n*q3 <= MOST_POINTS))


def wrapped(head, items, tail):
    """A statement with a list, on continued lines of at most 100 characters."""
    text = head + ", ".join(item.replace(" ", "~") for item in items) + tail
    lines = textwrap.wrap(text, 90, break_long_words=False, break_on_hyphens=False)
    return "      " + " &\n        ".join(lines).replace("~", " ") + "\n"


def solid_arguments(is_fixed, is_rational):
    return force_arguments(is_rational, direct_arguments(is_fixed, is_rational),
                           [*AXIS_1, *AXIS_2])


def context_force_arguments(is_fixed, is_rational):
    return force_arguments(is_rational, direct_arguments(is_fixed, is_rational),
                           [*AXIS_1, *AXIS_2], [*REFERENCE, "given", "context"])


def direct_arguments(is_fixed, is_rational):
    return ["is_direct", *FIELDS, *["w"]*is_rational] if is_fixed else []


def cut_solid_arguments(_, is_rational):
    return force_arguments(is_rational, [], CUT_SOLID_BASIS)


def force_arguments(is_rational, direct, basis, context=()):
    return ["law", "dt", "on", "viscous", *direct, "u", *basis, *AXIS_3,
            *RATIONAL*is_rational, *context, *STATE,
            "f", "sums", "ok"]


def strain_arguments(_, is_rational, context=(), basis=(*AXIS_1, *AXIS_2)):
    return ["has_end", "has_jacobian", "has_tangents", "u", *basis, *AXIS_3,
            *RATIONAL*is_rational, *context,
            "fields%dstrain", "fields%spin", "fields%volume", "fields%end_volume",
            "fields%jacobian", "fields%tangents", "fields%sums"]


def context_arguments(is_fixed, is_rational):
    return strain_arguments(is_fixed, is_rational, CONTEXT)


def cut_context_arguments(is_fixed, is_rational):
    return strain_arguments(is_fixed, is_rational, CONTEXT, CUT_SOLID_BASIS)


def nodal_arguments(_, is_rational, basis=(*BASIS_1, *BASIS_2)):
    return ["has_jacobian", "has_plane", "u", *basis, *BASIS_3, *RATIONAL*is_rational,
            "fields%jacobian", "fields%weighted", "fields%plane", "f"]


def cut_nodal_arguments(is_fixed, is_rational):
    return nodal_arguments(is_fixed, is_rational, CUT_NODAL_BASIS)


def strip_arguments(*_):
    return ["law", "dt", "patch%viscosity%is_active", "viscous", "plane",
            "patch%lanes%first(1, block%b)", "patch%lanes%is_contiguous(block%b)",
            "patch%axes(3)%first(block%e3)", "patch%n_control", "x", "v",
            *AXIS_1, *AXIS_3, *STATE, "motion", "lower", "upper", "side", "sums", "ok"]


def shell_arguments(_, is_rational, basis=SHELL_BASIS):
    return ["law", "dt", "n_viscous", "viscous", "u", *basis,
            "patch%axes(3)%abscissae", "patch%axes(3)%weights",
            *SHELL_RATIONAL*is_rational, *SHELL_STATE, "f", "sums", "ok"]


def metric_arguments(_, is_rational, basis=SHELL_BASIS):
    return ["u", *[item for item in basis if "weights" not in item and item != "[1.0_wp]"],
            *SHELL_RATIONAL*is_rational, "metric"]


def cut_arguments(is_fixed, is_rational):
    return shell_arguments(is_fixed, is_rational, CUT_BASIS)


def cut_metric_arguments(is_fixed, is_rational):
    return metric_arguments(is_fixed, is_rational, CUT_BASIS)


LAW = ("block_law", "block_law_t")
ROTATION = ("tensor_rotation", "rotate_by_spin, turn_to_end")
POINTS = ("point_kinematics", "end_volume_of, point_tangents")
KERNELS = [
    Kernel("ig_solid", "block_forces", "Block force kernel", "ig_solid_kernel.inc", [],
           [LAW, ROTATION], SOLID_RULES, COUNTS, solid_arguments, groups_rows=True),
    Kernel("ig_cut", "block_forces", "Block force kernel of cut solids", "ig_solid_kernel.inc",
           ["SCATTERED"], [LAW, ROTATION], CUT_SOLID_RULES, CUT_SOLID_COUNTS, cut_solid_arguments,
           groups_rows=True),
    Kernel("ig_strain", "block_strain", "Kinematics of projected elements", "ig_solid_kernel.inc",
           ["PROJECTED", "STRAIN"], [POINTS], SOLID_RULES, COUNTS, strain_arguments),
    Kernel("ig_context", "block_strain", "Kinematics for laws with context", "ig_solid_kernel.inc",
           ["PROJECTED", "STRAIN", "CONTEXT"],
           [POINTS], SOLID_RULES, COUNTS, context_arguments),
    Kernel("ig_contextforce", "block_forces", "Block force kernel for laws with context",
           "ig_solid_kernel.inc", ["CONTEXT"],
           [LAW, ROTATION, ("point_context", "point_context_t"), ("solid_patch", "point_number")],
           SOLID_RULES, COUNTS, context_force_arguments),
    Kernel("ig_nodal", "block_nodal", "Nodal forces of projected elements", "ig_solid_kernel.inc",
           ["PROJECTED", "NODAL"], [], SOLID_RULES, COUNTS, nodal_arguments),
    # Of solids that an outline cuts, whose law asks for the context: few elements, any rule.
    Kernel("ig_cutcontext", "block_strain", "Kinematics of cut solids for laws with context",
           "ig_solid_kernel.inc", ["SCATTERED", "PROJECTED", "STRAIN", "CONTEXT"],
           [POINTS], [], CUT_SOLID_COUNTS,
           cut_context_arguments),
    Kernel("ig_cutnodal", "block_nodal", "Nodal forces of cut solids for laws with context",
           "ig_solid_kernel.inc", ["SCATTERED", "PROJECTED", "NODAL"], [], [], CUT_SOLID_COUNTS,
           cut_nodal_arguments),
    Kernel("plane_strain", "block_forces", "Block force kernel of plane strain",
           "plane_strain_kernel.inc", [],
           [LAW, ("solid_patch", "plane_strain_t"), ("tensor_rotation", "far_turn")],
           STRIP_RULES, ["p(1)", "p(3)", "q(1)", "q(3)"], strip_arguments, ("",)),
    Kernel("kl_shell", "block_forces", "Block force kernel of shells", "shell_kernel.inc", [],
           [LAW, ("plane_stress", "areal_modulus, thinning_ratio")],
           SHELL_RULES, SHELL_COUNTS, shell_arguments),
    Kernel("kl_metric", "block_metric", "Fundamental forms of shells", "shell_kernel.inc",
           ["METRIC"], [], SHELL_RULES, SHELL_COUNTS, metric_arguments),
    Kernel("kl_cut", "block_forces", "Block force kernel of cut shells", "shell_kernel.inc",
           ["SCATTERED"], [LAW, ("plane_stress", "areal_modulus, thinning_ratio")],
           CUT_RULES, CUT_COUNTS, cut_arguments),
    Kernel("kl_cutmetric", "block_metric", "Fundamental forms of cut shells", "shell_kernel.inc",
           ["SCATTERED", "METRIC"], [], CUT_RULES, CUT_COUNTS, cut_metric_arguments),
]


def rule_table(rules, places, name="tuned_rules"):
    """Declaration of the degrees and points of the instances, a column each."""
    shape = f"{len(places)}, {len(rules)}"
    return wrapped(f"integer, parameter :: {name}({shape}) = reshape([ ",
                   [rule[place] for rule in rules for place in places], f"], [{shape}])")


def write(path, text):
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def main(folder):
    names = []
    for kernel in KERNELS:
        for tag, rule, variant in kernel.instances():
            names.append(f"{kernel.module}_{tag}.F90")
            write(folder/names[-1], kernel.instance(tag, rule, variant))
        uses, cases = kernel.dispatch()
        write(folder/f"{kernel.module}_uses.inc", uses)
        write(folder/f"{kernel.module}_cases.inc", cases)
    rows = ", ".join(str(rows_together(*map(int, rule[3:]))) for rule in SOLID_RULES)
    write(folder/"ig_solid_rules.inc", rule_table(SOLID_RULES, range(6))
          + f"      integer, parameter :: tuned_rows({len(SOLID_RULES)}) = [{rows}]\n")
    write(folder/"plane_strain_rules.inc", rule_table(STRIP_RULES, [0, 2, 3, 5]))
    write(folder/"shell_rules.inc", rule_table(SHELL_RULES, range(6))
          + rule_table(CUT_RULES, range(6), "cut_rules"))
    write(folder/"kernels.cmake", "set(kernels " + " ".join(names) + ")\n"
          "set(rules " + " ".join(SOLID_RULES + SHELL_RULES + STRIP_RULES) + ")\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
