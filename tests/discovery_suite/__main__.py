"""`python -m discovery_suite generate|measure|score|experiment|cost|list`: see the package text."""

import argparse
import json
import sys
from functools import partial
from pathlib import Path

from . import cost, experiments, generate, score, suite

BESIDE = {
    "field": "the cases whose recordings have imperfections",
    "chance": "short recordings of them with nothing hidden, for the test against chance",
}


def main(argv=None):
    """Run the command line; returns the exit code (0 done, 1 a run failed, 2 wrong use)."""
    parser = argparse.ArgumentParser(prog="discovery_suite", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("generate", help="write cases as CSV files with their truth")
    listing = commands.add_parser("list", help="print the names of the cases")
    measure = commands.add_parser(
        "measure", help="print how far the data prefer the truth to nothing and to its rivals"
    )
    scoring = commands.add_parser("score", help="run a cdpr binary on cases and print the score")
    scoring.add_argument("--cdpr", required=True, metavar="PATH", help="the binary")
    scoring.add_argument("--out", required=True, metavar="DIR")
    scoring.add_argument("--data", metavar="DIR", help="generated cases (default: DIR/data)")
    scoring.add_argument("--jobs", type=int, default=1, metavar="N", help="runs at once")
    scoring.add_argument("--timeout", type=float, default=600.0, metavar="S", help="for one run")
    for sub in (make, measure):
        sub.add_argument("--jobs", type=int, metavar="N", help="processes (default: all cores)")
    for sub in (make, listing, measure, scoring):
        sub.add_argument("--case", nargs="+", metavar="NAME", help="only these cases")
        sub.add_argument(
            "--small", action="store_true", help="the small subset, in recordings of 60 s"
        )
        for name, words in BESIDE.items():
            sub.add_argument(
                f"--{name}", action="store_const", dest="beside", const=name, help=words
            )
        sub.add_argument(
            "--redraw", type=int, default=0, metavar="N", help="other paths, wind and noise"
        )
    make.add_argument("--out", required=True, metavar="DIR")
    trying = commands.add_parser(
        "experiment", help="plan experiments for what is left open, drive them, and discover again"
    )
    trying.add_argument("--cdpr", required=True, metavar="PATH", help="the binary")
    trying.add_argument("--out", required=True, metavar="DIR")
    trying.add_argument("--case", nargs="+", metavar="NAME", help="only these")
    costing = commands.add_parser("cost", help="print what searches cost, by length of the trials")
    costing.add_argument("--cdpr", required=True, metavar="PATH", help="the binary")
    costing.add_argument("--out", required=True, metavar="DIR")
    costing.add_argument("--case", nargs="+", metavar="NAME", default=cost.CASES)
    costing.add_argument("--duration", nargs="+", type=float, metavar="S", default=cost.DURATIONS)
    args = parser.parse_args(argv)
    if args.command == "experiment":
        return _experiment(args)
    try:
        if args.command == "cost":
            return _cost(args)
        cases = suite.select(args.case, args.small, args.redraw, args.beside)
    except ValueError as error:
        print(f"discovery_suite: {error}", file=sys.stderr)
        return 2
    if args.command == "list":
        for case in cases:
            print(f"{case.name:28s} {case.group}")
    elif args.command == "score":
        options = {"data": args.data, "jobs": args.jobs, "timeout": args.timeout}
        table, rows = score.score_cases(cases, args.cdpr, args.out, **options)
        print(score.markdown(table, rows), end="")
        return 1 if table["failed"] else 0
    elif args.command == "measure":
        generate.each_case(generate.measure_case, cases, args.jobs)
    else:
        generate.each_case(partial(generate.write_case, folder=args.out), cases, args.jobs)
    return 0


def _cost(args):
    for case in suite.select(args.case):
        lasting = [cost.lasting(case, duration) for duration in sorted(args.duration)]
        costs = [cost.measure(each, args.cdpr, args.out) for each in lasting]
        print(cost.markdown(costs), flush=True)
    return 0


def _experiment(args):
    known = {item.case.name: item for item in experiments.EXPERIMENTS}
    unknown = sorted(set(args.case or ()) - set(known))
    if unknown:
        print(f"discovery_suite: unknown experiment {unknown[0]!r}", file=sys.stderr)
        return 2
    rows = []
    for name in args.case or known:
        row = experiments.run(known[name], args.cdpr, args.out)
        (Path(args.out) / name / "row.json").write_text(json.dumps(row, indent=1) + "\n")
        print(experiments.markdown([row]).splitlines()[-1], flush=True)
        rows.append(row)
    return 0


if __name__ == "__main__":
    sys.exit(main())
