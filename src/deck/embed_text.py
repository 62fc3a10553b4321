"""Write a text as a Fortran module of one function without arguments, <module>_text.

    python3 embed_text.py TEXT <module>.f90
"""
import pathlib
import re
import sys

text = pathlib.Path(sys.argv[1]).read_text(encoding="ascii")
target = pathlib.Path(sys.argv[2])
name = target.stem
pieces = []
for piece in re.findall(r"[^\\\n]{1,60}|\n|\\", text):   # flang's preprocessor doubles a backslash
    words = piece.replace('"', '""')
    pieces.append(f'"{words}"' if piece not in "\n\\" else f"achar({ord(piece)})")
lines = [f"module {name}", "implicit none", "private", f"public :: {name}_text"]
parts = []
for start in range(0, len(pieces), 200):   # a statement has 255 continuation lines at most
    parts.append(f"part_{start}")
    lines += [f"character(*), parameter :: {parts[-1]} = &",
              "// &\n".join(pieces[start:start + 200])]
lines += ["contains", f"pure function {name}_text() result(text)",
          "character(:), allocatable :: text", "text = " + "// &\n".join(parts),
          f"end function {name}_text", f"end module {name}", ""]
target.write_text("\n".join(lines))
