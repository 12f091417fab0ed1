//! Dynamics of a planar cable-driven parallel robot with elastic cables.
//!
//! The robot is a platform with three degrees of freedom on two to twelve cables; by default the 4RPR manipulator after the
//! Large Adaptive Reflector, on four crossed cables of 900 m. Data flows one way: [`parameters`] and [`effect`]s make a [`plant::Plant`], which the
//! [`integrator`] drives forward.

mod clearance;
pub mod dynamics;
pub mod effect;
pub mod energy;
pub mod fmi2;
pub mod formula;
pub mod geometry;
pub mod integrator;
pub mod inverse;
pub mod kinematics;
pub mod length_sensor;
pub mod model_file;
mod parameter;
pub mod parameters;
pub mod per_cable;
pub mod plant;
pub mod pose_sensor;
pub mod release;
pub mod scalar;
pub mod signal;
pub mod simulation;
pub mod statics;
pub mod winch;
