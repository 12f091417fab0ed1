"""An independent model of the plant, to check the product against.

It shares neither code nor structure with the product: planar vectors are complex numbers, the
accelerations come from a residual that is linear in them, and scipy integrates at 1e-12.
"""
