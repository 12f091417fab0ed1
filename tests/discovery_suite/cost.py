"""What a search costs: processor time and memory against the length of the recordings."""

import os
import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path

from .generate import write_case

# One where nothing is missing, one effect, and three.
CASES = ("null_00", "linear_drag", "drag_coulomb_mass")
DURATIONS = (50.0, 100.0, 200.0)  # s, of each trial


@dataclass(frozen=True)
class Cost:
    """What one search took."""

    case: str
    samples: int  # of all trials together
    processor: float  # s, of all cores together
    elapsed: float  # s
    memory: float  # bytes, the most at any time


def lasting(case, duration):
    """A case whose trials last so long (s)."""
    train = tuple(settings.but(duration=duration) for settings in case.train)
    holdout = case.holdout.but(duration=duration)
    return replace(case, name=f"{case.name}_{duration:g}", train=train, holdout=holdout)


def measure(case, binary, folder):
    """The cost of a search in a case, which is written into `folder`."""
    write_case(case, folder)
    data = Path(folder) / case.name
    files = [*sorted(data.glob("train*.csv")), data / "holdout.csv"]
    command = [str(binary), "discover", "--data", *map(str, files[:-1])]
    command += ["--holdout", str(files[-1]), "--model", str(data / "model.toml")]
    command += ["--out", str(data / "out")]
    start = time.monotonic()
    with (data / "discover.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{data}: cdpr discover gave {process.returncode}, see discover.log")
    return Cost(
        case=case.name,
        samples=sum(len(file.read_text(encoding="utf-8").splitlines()) - 1 for file in files),
        processor=usage.ru_utime + usage.ru_stime,
        elapsed=time.monotonic() - start,
        memory=1024.0 * usage.ru_maxrss,
    )


def markdown(costs):
    """The costs of one case, the shortest first; ratios are to that one, of a sample."""
    first = costs[0]
    lines = [
        "| case | samples | processor time (s) | elapsed (s) | µs a sample | ratio | memory (MB) "
        "| kB a sample | ratio |",
        "| --- " * 9 + "|",
    ]
    for cost in costs:
        time_ratio = cost.processor / cost.samples / (first.processor / first.samples)
        memory_ratio = cost.memory / cost.samples / (first.memory / first.samples)
        lines.append(
            f"| {cost.case} | {cost.samples} | {cost.processor:.1f} | {cost.elapsed:.1f} "
            f"| {1e6 * cost.processor / cost.samples:.0f} | {time_ratio:.2f} "
            f"| {cost.memory / 1e6:.0f} | {cost.memory / 1e3 / cost.samples:.1f} "
            f"| {memory_ratio:.2f} |"
        )
    return "\n".join(lines) + "\n"
