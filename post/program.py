"""Where the program is that decks are run with."""
import os
import shutil

PROJECT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BUILT = os.path.join(PROJECT, "build", "native", "bin", "igaform")
PROGRAM = BUILT if os.path.exists(BUILT) else shutil.which("igaform") or BUILT
