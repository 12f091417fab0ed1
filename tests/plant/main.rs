//! The plant and its simulation, seen from outside.

mod any_cables;
mod cable_motion;
mod catalogue;
mod dry_friction;
mod effects;
mod energy;
mod failures;
mod hysteresis;
mod kinematics;
mod long_run;
mod machine;
mod onset;
mod presliding;
mod pulley;
mod random;
mod residual;
mod saving;
mod sensors;
mod slack;
mod steps;
mod symmetry;
mod winches;
mod work;
