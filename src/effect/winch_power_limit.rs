//! Power limit of the drive: |u| ≤ P/|l̇| while it winds in.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::Real;

/// Power limit of the drive: |u| ≤ P/|l̇| while it winds in.
///
/// A drive that pulls the cable in gives the power `-u l̇`; beyond `P` its force falls with the speed. While the cable is paid out
/// the drive brakes, and nothing is limited.
///
/// Shows in: tension stays behind the winch force when winding in fast.
///
/// Valid for: a supply or a motor in field weakening with a power of its own; the losses come on top of it.
///
/// Source: W. Leonhard, Control of Electrical Drives, 3rd ed., 2001 (field weakening at constant power).
#[derive(Clone, Debug)]
pub struct WinchPowerLimit {
    power: f64,
}

impl Effect for WinchPowerLimit {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_power_limit",
        title: "Power limit of the winch",
        equation: "|u| ≤ P/|l̇| while winding in",
        law: |v, n| format!("|u| ≤ {}/|l̇| while winding in", n(v[0])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Input, DependsOn::Speed],
        parameters: &[
            parameter("power", "W", "power P that the drive can give", (1e2, 1e5)).at_least(1e-3).shape(),
        ],
        texts: &[],
        shows_in: "tension stays behind the winch force when winding in fast",
        source: "W. Leonhard, Control of Electrical Drives, 3rd ed., 2001 (field weakening at constant power)",
        validity: "a supply or a motor in field weakening with a power of its own; must be reached in the data to show",
        look_alikes: &[
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { power: spec.values[0] })
    }

    fn stage(&self) -> Stage {
        Stage::Command(6)
    }

    fn command<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], context: &WinchContext<S>) -> S {
        if (force * context.speed).re() < -self.power {
            // Of the same sign as the force, which is against the rate.
            -context.speed.recip() * self.power
        } else {
            force
        }
    }
}
