//! Saturation of the winch force: min(max(u, lower), upper).

use super::{DependsOn, Effect, EffectInfo, EffectSpec, Scope, Site, SpecError, Stage, WinchContext, parameter};
use crate::scalar::Real;

/// Saturation of the winch force: min(max(u, lower), upper).
///
/// Shows in: tension stays behind the winch force beyond a level.
///
/// Valid for: hard limit of the drive; must be reached in the data to be found.
///
/// Source: H. K. Khalil, Nonlinear Systems, 3rd ed., 2002, sec. 1.2.
#[derive(Clone, Debug)]
pub struct WinchSaturation {
    lower: f64,
    upper: f64,
}

impl Effect for WinchSaturation {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_saturation",
        title: "Saturation of the winch force",
        equation: "min(max(u, lower), upper)",
        law: |v, n| format!("min(max(u, {}), {})", n(v[0]), n(v[1])),
        scope: Scope::EachCable,
        site: Site::Winch,
        depends_on: &[DependsOn::Tension],
        parameters: &[
            parameter("lower", "N", "smallest force", (0.0, 1e4)).shape(),
            parameter("upper", "N", "largest force", (1e3, 1e5)).shape(),
        ],
        texts: &[],
        shows_in: "tension stays behind the winch force beyond a level",
        source: "H. K. Khalil, Nonlinear Systems, 3rd ed., 2002, sec. 1.2",
        validity: "hard limit of the drive; must be reached in the data to be found",
        look_alikes: &[
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        Ok(Self { lower: spec.values[0], upper: spec.values[1] })
    }

    fn stage(&self) -> Stage {
        Stage::Command(1)
    }

    fn command<S: Real>(&self, force: S, _states: &[S], _rates: &mut [S], _context: &WinchContext<S>) -> S {
        if force < self.lower {
            S::from(self.lower)
        } else if force > self.upper {
            S::from(self.upper)
        } else {
            force
        }
    }
}
