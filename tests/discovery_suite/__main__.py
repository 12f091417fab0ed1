"""`python -m discovery_suite generate|score|list`: see the package's own text."""

import argparse
import sys

from . import generate, suite


def main(argv=None):
    """Run the command line; returns the exit code (0 done, 2 wrong use)."""
    parser = argparse.ArgumentParser(prog="discovery_suite", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("generate", help="write cases as CSV files with their truth")
    listing = commands.add_parser("list", help="print the names of the cases")
    for sub in (make, listing):
        sub.add_argument("--case", nargs="+", metavar="NAME", help="only these cases")
        sub.add_argument("--small", action="store_true", help="the small subset")
    make.add_argument("--out", required=True, metavar="DIR")
    make.add_argument("--jobs", type=int, metavar="N", help="processes (default: all cores)")
    args = parser.parse_args(argv)
    try:
        cases = suite.select(args.case, args.small)
    except ValueError as error:
        print(f"discovery_suite: {error}", file=sys.stderr)
        return 2
    if args.command == "list":
        for case in cases:
            print(f"{case.name:28s} {case.group}")
    else:
        generate.write_cases(cases, args.out, args.jobs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
