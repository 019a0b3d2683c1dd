"""The scripts of this folder: python3 drawing NAME ARGUMENT...

The package tubule around this folder is not imported, for it needs its compiled part, and pictures do not.
"""

import importlib.util
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent


def import_as(name):
    """The package of this folder under another name than tubule.drawing."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)])
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])


def main():
    sys.path.pop(0)  # this folder, whose modules are not to be found under their bare names
    import_as("tubule_drawing")
    script = sys.argv.pop(1)
    if script != "chart":  # which looks for them when it has read its arguments
        command_line = importlib.import_module("tubule_drawing.command_line")
        command_line.require_libraries("tubule stability --plot" if script == "stability" else f"tubule {script}")
        importlib.import_module("tubule_drawing.style").apply()
    return importlib.import_module(f"tubule_drawing.{script}").main()


if __name__ == "__main__":
    sys.exit(main())
