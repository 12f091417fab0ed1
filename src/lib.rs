//! Dynamics of a planar cable-driven parallel robot with elastic cables.
