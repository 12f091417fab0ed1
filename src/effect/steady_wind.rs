//! Steady wind: constant force and torque.

use super::{Effect, EffectInfo, EffectSpec, LookAlike, PlatformContext, Scope, Site, SpecError, Stage, parameter};
use crate::scalar::Real;

/// Steady wind: constant force and torque.
///
/// Shows in: constant force or torque on the platform.
///
/// Valid for: mean wind over the trial, small change of attitude.
///
/// Source: E. Simiu, R. H. Scanlan, Wind Effects on Structures, 3rd ed., 1996.
#[derive(Clone, Debug)]
pub struct SteadyWind {
    force_x: f64,
    force_y: f64,
    torque: f64,
}

impl Effect for SteadyWind {
    const INFO: EffectInfo = EffectInfo {
        id: "steady_wind",
        title: "Steady wind",
        equation: "constant force and torque",
        law: |v, n| format!("F = ({}, {}), τ = {}", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::Whole,
        site: Site::PlatformComponents,
        depends_on: &[],
        parameters: &[
            parameter("force_x", "N", "force along x", (-2e3, 2e3)).or(0.0),
            parameter("force_y", "N", "force along y", (-2e3, 2e3)).or(0.0),
            parameter("torque", "N.m", "torque about G", (-1e4, 1e4)).or(0.0),
        ],
        texts: &[],
        shows_in: "constant force or torque on the platform",
        source: "E. Simiu, R. H. Scanlan, Wind Effects on Structures, 3rd ed., 1996",
        validity: "mean wind over the trial, small change of attitude",
        look_alikes: &[
            LookAlike { id: "winch_force_bias", separate_by: "change the pose: the bias turns with the cable" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { force_x: spec.values[0], force_y: spec.values[1], torque: spec.values[2] })
    }

    fn stage(&self) -> Stage {
        Stage::PlatformWrench
    }

    fn wrench<S: Real>(&self, _context: &PlatformContext<'_, S>) -> [S; 3] {
        [S::from(self.force_x), S::from(self.force_y), S::from(self.torque)]
    }
}
