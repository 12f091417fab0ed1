//! The paper's programme: its simulations, figures and claims, each beside what the equations give.
//!
//! Y. B. Bedoustani, H. D. Taghirad, M. M. Aref: *Dynamics Analysis of a Redundant Parallel Manipulator Driven by Elastic
//! Cables* (planar 4RPR robot after the Large Adaptive Reflector). [`write()`] makes everything at once. What the paper prints
//! wrongly is in [`printed`] and [`mismatch`], apart from the plant.

mod claims;
mod figure;
mod figures;
pub mod mismatch;
mod ode;
pub mod printed;
mod run;
mod thin;

use std::path::{Path, PathBuf};

pub use claims::{Claim, Verdict};
pub use figure::png;
pub use ode::runge_kutta;

use cdpr::parameters::CableModel;
use run::{Area, Inverse, Series};

/// Cables of the paper's robot.
pub const CABLES: usize = 4;

/// Why the programme did not finish.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// A simulation failed.
    #[error("a simulation of the paper failed: {0}")]
    Model(String),
    /// A figure could not be drawn.
    #[error("figure {0}")]
    Figure(String),
    /// A file could not be written.
    #[error("{}: cannot be written: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
}

impl PaperError {
    fn model(error: impl std::fmt::Display) -> Self {
        Self::Model(error.to_string())
    }
}

/// Writes a file beside its place and renames it, so that it appears whole or not at all.
fn write_whole(path: &Path, content: &[u8]) -> Result<(), PaperError> {
    let failed = |error| PaperError::Write { path: path.to_owned(), error };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!(".{name}.part"));
    std::fs::write(&beside, content).map_err(failed)?;
    std::fs::rename(&beside, path).map_err(failed)
}

/// All runs.
struct Runs {
    /// Rigid cables, consistent signs.
    rigid: Series,
    massless: Series,
    lumped: Series,
    lumped_printed: Series,
    mismatch_rigid: Series,
    mismatch_lumped: Series,
    mismatch_printed: Series,
    pull_rigid: Series,
    pull_massless: Series,
    pull_lumped: Series,
    pull_lumped_printed: Series,
    mismatch_pull_rigid: Series,
    mismatch_pull_printed: Series,
    inverse_rigid: Inverse,
    inverse_lumped: Inverse,
    inverse_printed: Inverse,
    /// Deviation (m, rad) of rigid cables under forces computed with the sign mismatch.
    mismatch_inverse: f64,
}

/// Times that the simulations stop at (s).
const RELEASE_STOP: f64 = 120.0;
const MISMATCH_STOP: f64 = 350.0;
const PULL_STOP: f64 = 30.0;

impl Runs {
    fn new(progress: &mut dyn FnMut(&str)) -> Result<Self, PaperError> {
        use Area::{Physical, Printed};
        use CableModel::{LumpedMass, MasslessSpring, Rigid};
        let mut tell = |what: &str| progress(what);
        tell("release from [0.1, 0.1, 0.1]");
        let rigid = run::release(Physical, Rigid, RELEASE_STOP)?;
        let massless = run::release(Physical, MasslessSpring, RELEASE_STOP)?;
        let lumped = run::release(Physical, LumpedMass, RELEASE_STOP)?;
        let lumped_printed = run::release(Printed, LumpedMass, RELEASE_STOP)?;
        tell("the same with the sign mismatch");
        let mismatch_rigid = run::mismatched_release(Physical, Rigid, MISMATCH_STOP)?;
        let mismatch_lumped = run::mismatched_release(Physical, LumpedMass, MISMATCH_STOP)?;
        let mismatch_printed = run::mismatched_release(Printed, LumpedMass, MISMATCH_STOP)?;
        tell("two winches pulling");
        let pull_rigid = run::pull_one_way(Physical, Rigid, PULL_STOP)?;
        let pull_massless = run::pull_one_way(Physical, MasslessSpring, PULL_STOP)?;
        let pull_lumped = run::pull_one_way(Physical, LumpedMass, PULL_STOP)?;
        let pull_lumped_printed = run::pull_one_way(Printed, LumpedMass, PULL_STOP)?;
        let mismatch_pull_rigid = run::mismatched_pull(Physical, Rigid, PULL_STOP)?;
        let mismatch_pull_printed = run::mismatched_pull(Printed, LumpedMass, PULL_STOP)?;
        tell("inverse dynamics");
        let inverse_rigid = run::inverse(Physical, Rigid)?;
        let mismatch_inverse = run::mismatched_inverse(&inverse_rigid)?;
        Ok(Self {
            rigid,
            massless,
            lumped,
            lumped_printed,
            mismatch_rigid,
            mismatch_lumped,
            mismatch_printed,
            pull_rigid,
            pull_massless,
            pull_lumped,
            pull_lumped_printed,
            mismatch_pull_rigid,
            mismatch_pull_printed,
            inverse_rigid,
            mismatch_inverse,
            inverse_lumped: run::inverse(Physical, LumpedMass)?,
            inverse_printed: run::inverse(Printed, LumpedMass)?,
        })
    }
}

/// Runs the paper's simulations and writes figures (SVG, PNG), data (CSV) and `claims.md` into `folder`.
///
/// `progress` is told what comes next. Returns the claims.
///
/// # Errors
/// A simulation that fails, a file that cannot be written.
pub fn write(folder: &Path, mut progress: impl FnMut(&str)) -> Result<Vec<Claim>, PaperError> {
    std::fs::create_dir_all(folder).map_err(|error| PaperError::Write { path: folder.to_owned(), error })?;
    let runs = Runs::new(&mut progress)?;
    progress("figures and data");
    figures::write(folder, &runs)?;
    let claims = claims::evaluate(&runs)?;
    write_whole(&folder.join("claims.md"), claims::markdown(&claims).as_bytes())?;
    Ok(claims)
}
