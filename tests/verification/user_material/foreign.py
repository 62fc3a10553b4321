"""Sources written for another compiler, other languages, and libraries of all kinds."""
import subprocess

from common import FILES, STEEL, deck, same, user

HEAD = "      EMOD=PROPS(1)"


def law_with(*lines):
    """The elastic law with some lines before its first statement."""
    law = (FILES / "linear_fixed.for").read_text()
    assert HEAD in law
    return law.replace(HEAD, "".join(f"      {line}\n" for line in lines) + HEAD, 1)


def sources_for_ifort_are_accepted(bench):
    elastic = bench.values(deck(f"*ELASTIC\n{STEEL}"))

    def gives_the_same(name, text, *words):
        path = bench.folder / name
        path.write_text(text)
        same(bench.values(deck(user(STEEL)), path), elastic)
        bench.says(*words)

    gives_the_same("kinds.for", law_with("X=SIGN(1.0,PROPS(1))*ATAN2(1.0,PROPS(2))",
                                         "IF (X.LE.0.0) CALL XIT"), "real kinds")
    # .EQV. would bind less than .AND. and end the run.
    gives_the_same("logicals.for", law_with(
        "K=1", "IF ((K.EQ.2).EQ..TRUE..AND.K==1 .NE. .FALSE.) CALL XIT",
        "IF ((K.EQ.1) .EQ. .FALSE. .OR. (K.EQ.1) .NE. .TRUE.) CALL XIT",
        "PRINT *, ' .EQ. .TRUE.'").replace(".AND.K==1 .NE. .FALSE.", ".AND.(K==1) .NE. .FALSE."),
        "comparisons with .TRUE.", " .EQ. .TRUE.")
    (bench.folder / "part.inc").write_text("      K=3\n")
    law = law_with("X=1", "IF (K.NE.3) CALL XIT").replace(
        "      X=1\n", '#INCLUDE "part.inc"\n#IFDEF NOWHERE\n      CALL XIT\n#ENDIF\n')
    gives_the_same("capitals.for", law, "preprocessor")
    law = law_with("K=GETPID()", "IF (K.LE.0) CALL XIT")
    place = law.upper().index("      INCLUDE")
    gives_the_same("ifport.for", law[:place] + "      USE IFPORT\n" + law[place:],
                   "USE of a module")


def causes_are_named(bench):
    for name, text, words in (
            ("logicals.for", law_with("LOGICAL A,B", "IF (A.EQ.B) CALL XIT"),
             ("logicals.for:", ".EQV.", "The cause")),
            ("arrays.for", law_with("K=SMALOCALINTARRAYCREATE(1,2)"),
             ("SMALOCALINTARRAYCREATE", "not provided", "SAVE arrays")),
            ("nowhere.for", law_with("X=1").replace("      X=1\n", '#include "no.inc"\n'),
             ("no.inc", "no.inc")),
            ("law.doc", "text", ("law.doc", ".cpp"))):
        path = bench.folder / name
        path.write_text(text)
        bench.run(deck(user(STEEL)), path, code=1, options=["--check"])
        bench.says(*words)
    test = "*MATERIAL TEST, NAME=r, MATERIAL=steel, TYPE=R VALUES, INCREMENTS=4\n"
    bench.run(deck(user(STEEL, 1), body="") + test, FILES / "linear_fixed.for", code=1,
              command=["material"])
    bench.says("EQPS or PEEQ")
    bench.run(deck(f"*ELASTIC\n{STEEL}", body="") + test, code=1, command=["material"])
    bench.says("*PLASTIC")


def languages_and_libraries(bench):
    """C++ sources, archives, and shared libraries with a version behind their names."""
    elastic = bench.values(deck(f"*ELASTIC\n{STEEL}"))
    caller = bench.folder / "caller.for"
    caller.write_text(law_with("CALL KCOUNT(K)", "IF (K.NE.4) CALL XIT"))
    part = bench.folder / "count.cpp"
    part.write_text('#include <aba_for_c.h>\n#include <vector>\n'
                    'extern "C" void FOR_NAME(kcount, KCOUNT)(int *n)\n'
                    '{ std::vector<int> v(4, 1); *n = 0; for (int i : v) *n += i; }\n')
    same(bench.values(deck(user(STEEL)), caller, part), elastic)

    def build(*words):
        subprocess.run(words, cwd=bench.folder, check=True, timeout=60)

    (bench.folder / "ABA_PARAM.INC").write_text("      IMPLICIT REAL*8(A-H,O-Z)\n")
    (bench.folder / "law.for").write_text((FILES / "linear_fixed.for").read_text())
    build("gfortran", "-w", "-std=legacy", "-ffixed-line-length-132", "-fPIC", "-c", "law.for")
    build("ar", "rc", "law.a", "law.o")
    build("gfortran", "-shared", "law.o", "-o", "liblaw.so.1.2")
    for name in ("law.a", "law.o", "liblaw.so.1.2"):
        same(bench.values(deck(user(STEEL)), name), elastic)
