//! Presliding: friction gives like a spring before it slides.

use super::{EffectSpec, ParameterInfo, SpecError, parameter};
use crate::scalar::{Real, tanh};

/// The bristle of the LuGre model in front of a friction law `F(v)`: it deflects by `z`, `ż = v - σ₀ z v/F(v)`, and pulls
/// with `σ₀ z + σ₁ e^(-(v/v_d)²) ż`.
///
/// In steady sliding the pull is `F(v)`. With `F = F_c sign(v)` and without damping it is Dahl's model. As `σ₀` grows, what is
/// left is the law `F(v)` alone.
///
/// Source: P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968); C. Canudas de Wit, H. Olsson, K. J. Åström,
/// P. Lischinsky, A new model for control of systems with friction, IEEE Trans. Automatic Control 40 (1995); the damping
/// that fades with speed: H. Olsson, Control systems with friction, thesis, Lund (1996).
#[derive(Clone, Debug)]
pub(super) struct Presliding {
    stiffness: f64,
    damping: f64,
    damping_speed: f64,
}

/// The parameters of presliding, at the end of those of a friction law.
pub(super) const PARAMETERS: [ParameterInfo; 3] = [
    parameter(
        "presliding_stiffness",
        "N/m",
        "stiffness σ₀ with which it gives before it slides; 0 is no presliding",
        (1e3, 1e7),
    )
    .at_least(0.0)
    .or(0.0)
    .shape()
    .extension(),
    parameter("presliding_damping", "N.s/m", "damping σ₁ of that motion", (10.0, 1e5))
        .at_least(0.0)
        .or(0.0)
        .shape()
        .extension(),
    parameter("damping_speed", "m/s", "winch speed v_d at which that damping has faded; 0 is never", (1e-3, 1.0))
        .at_least(0.0)
        .or(0.0)
        .shape()
        .extension(),
];

/// The law of presliding with numbers, where there is one: the pull, and how the deflection follows, `F` being the law
/// without it.
pub(super) fn law(values: &[f64], number: &dyn Fn(f64) -> String) -> Option<[String; 2]> {
    let [.., stiffness, damping, damping_speed] = *values else { return None };
    if stiffness == 0.0 {
        return None;
    }
    let stiff = number(stiffness);
    let mut text = format!("{stiff} z");
    if damping != 0.0 {
        text.push_str(&format!(" + {}", number(damping)));
        if damping_speed != 0.0 {
            text.push_str(&format!(" exp(-(l̇/{})²)", number(damping_speed)));
        }
        text.push_str(" ż");
    }
    Some([text, format!("ż = l̇ - {stiff} z l̇/F")])
}

impl Presliding {
    /// Of the last three of the effect's values; `None` without presliding. `forces` are the law's, not zero then.
    pub(super) fn new(spec: &EffectSpec, forces: &[f64]) -> Result<Option<Self>, SpecError> {
        let [.., stiffness, damping, damping_speed] = spec.values[..] else { return Ok(None) };
        if stiffness == 0.0 {
            return Ok(None);
        }
        if forces.contains(&0.0) {
            return Err(SpecError::new(
                &spec.id,
                "the force is 0, expected greater than 0 with `presliding_stiffness`",
            ));
        }
        Ok(Some(Self { stiffness, damping, damping_speed }))
    }

    /// The pull (N) at this winch speed `v` (m/s) and deflection (m), and the deflection's rate; `slip` is `v/F(v)`.
    #[inline]
    pub(super) fn pull<S: Real>(&self, speed: S, slip: S, deflection: S, rate: &mut S) -> S {
        *rate = speed - deflection * slip * self.stiffness;
        let mut damping = *rate * self.damping;
        if self.damping_speed > 0.0 {
            let relative = speed / self.damping_speed;
            damping *= (-(relative * relative)).exp();
        }
        deflection * self.stiffness + damping
    }

    /// The deflection (m) at which the full `force` (N) is reached.
    pub(super) fn size(&self, force: f64) -> f64 {
        force / self.stiffness
    }
}

/// `x/s(x)` of a smooth sign `s` with slope 1 at zero, where `s` has no value to divide by; `curvature` is that of `x/s(x)`
/// there.
#[inline]
pub(super) fn over_sign<S: Real>(x: S, sign: S, curvature: f64) -> S {
    if x.re().abs() < 1e-4 { x * x * curvature + 1.0 } else { x / sign }
}

/// `x/tanh(x)`.
#[inline]
pub(super) fn over_tanh<S: Real>(x: S) -> S {
    over_sign(x, tanh(x), 1.0 / 3.0)
}
