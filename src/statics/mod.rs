//! Statics and linear analysis: equilibrium, stiffness, natural modes, workspace, linear model.
//!
//! Stiffness is that of the platform against displacement: `K = -∂w/∂X`, with `w` the wrench on the platform and
//! `X = [x, y, φ]`; the entries are in N/m, N/rad and N m/rad.

mod equilibrium;
mod linear;
mod modes;
mod stiffness;
pub mod workspace;

pub use crate::simulation::static_equilibrium;
pub use equilibrium::{LockedEquilibrium, locked_equilibrium};
pub use linear::LinearModel;
pub use modes::{LockedModel, Mode, force_controlled_modes, locked_model, modes_of};
pub use stiffness::{Stiffness, elastic_stiffness, geometric_stiffness, stiffness};

/// Why an analysis has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StaticsError {
    /// The cables are rigid where elasticity is needed.
    #[error("with rigid cables and locked winches the platform cannot move; choose an elastic `cable_model`")]
    Rigid,
    /// The search for a pose at rest failed.
    #[error(
        "no equilibrium found: {reason} (last pose [{:.6}, {:.6}, {:.6}], unbalanced [{:.3e}, {:.3e}] N, {:.3e} N m)",
        pose[0], pose[1], pose[2], unbalanced[0], unbalanced[1], unbalanced[2]
    )]
    NoEquilibrium {
        /// What stopped it.
        reason: &'static str,
        /// Last pose (m, rad).
        pose: [f64; 3],
        /// Wrench left there (N, N m).
        unbalanced: [f64; 3],
    },
    /// The eigenvalues were not found.
    #[error("the eigenvalues of the linear model were not found")]
    NoEigenvalues,
}

#[cfg(test)]
mod tests;
