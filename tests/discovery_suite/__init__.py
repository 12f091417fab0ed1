"""Measured data with hidden effects, and the score of `cdpr discover` on it.

Nothing here is shared with the product: the equations are derived again, the effects are smoothed
in other ways where that is sensible, and the integrator is another one. Run from `tests/`:

    python -m discovery_suite generate --out DIR [--case NAME ...] [--small]
    python -m discovery_suite score --cdpr PATH --out DIR [--small] [--jobs N]
    python -m discovery_suite experiment --cdpr PATH --out DIR [--case NAME ...]

Modules, in the order in which data flow:

- `parameters`: what the plant is made of, and how an effect changes it
- `plant`: the equations of motion and the integrator
- `control`: the pose controller and its tension distribution
- `trial`: one closed-loop trial, its sensors, and its CSV file
- `strength`: how strongly an effect shows against the noise
- `cases`: the declared suite
- `generate`, `score`: the two commands
- `experiments`: what recordings leave open, planned experiments, and what is found on them
- `moordyn_trial`: a second generator on another project's cable model
"""
