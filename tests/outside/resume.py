"""Continue a serialised run in a process of its own: `resume.py FMU-FOLDER STATE TIME OUT`.

FMU-FOLDER is an unpacked FMU; OUT gets every real variable as raw doubles.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from outside.fmu import Fmu, Instance

STEPS = (0.013, 0.1, 0.37, 0.02, 0.5)
NEW_FORCE = 9500.0


def go_on(instance: Instance):
    """Steps of several sizes and a changed input, the same in every process."""
    for k, size in enumerate(STEPS):
        if k == 2:
            instance.set({"winch_force[2]": NEW_FORCE})
        instance.step(size)


def main(folder: str, state: str, time: str, out: str):
    with Fmu(Path(folder)).instance("resumed", start=False) as instance:
        instance.restore(Path(state).read_bytes())
        instance.time = float.fromhex(time)
        go_on(instance)
        Path(out).write_bytes(instance.snapshot().tobytes())


if __name__ == "__main__":
    main(*sys.argv[1:])
