//! Presliding: friction gives like a spring before it slides.

use super::{EffectSpec, ParameterInfo, SpecError, parameter};
use crate::scalar::Real;

/// The bristle of the LuGre model: it deflects by `z`, `ż = v - σ₀ z |v|/g(v)`, and pulls with `σ₀ z + σ₁(v) ż`, where
/// `g(v) > 0` is the level of the friction law, the force at which it slides at `v`.
///
/// At rest `ż = 0`: what the bristle holds it holds for ever. In steady sliding the pull is `g(v) sign(v)`, and without damping
/// this is Dahl's model. The damping `σ₁(v) = σ₁ e^(-(v/v_d)²)` fades with speed.
///
/// Passive for all values: with `w = σ₀ z sign(v)/g(v)` the work put in less what the bristle stores grows at
/// `|v| (g w² + σ₁(v) |v| (1 - w))`. That is negative only for `w > 1`, where the bristle holds more than the level, and
/// `|σ₀ z|` never exceeds the highest level, so `w` is at most the ratio `r` of the highest to the lowest. A level that is one
/// number in each direction (`r = 1`) is passive with any damping. Elsewhere the rate is positive if
/// `σ₁(v) |v| < g w²/(w - 1)` for all `w` from 1 to `r`, which is least at `w = min(r, 2)`: so the damping there is
/// `1/(1/σ₁(v) + |v|/limit)` with that `limit` at the lowest level.
///
/// Source: P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968); C. Canudas de Wit, H. Olsson, K. J. Åström,
/// P. Lischinsky, A new model for control of systems with friction, IEEE Trans. Automatic Control 40 (1995); the damping
/// that fades with speed: H. Olsson, Control systems with friction, thesis, Lund (1996); passivity: N. Barahanov, R. Ortega,
/// Necessary and sufficient conditions for passivity of the LuGre friction model, IEEE Trans. Automatic Control 45 (2000).
#[derive(Clone, Debug)]
pub(super) struct Presliding {
    stiffness: f64,
    damping: f64,
    damping_speed: f64,
    /// One over the largest damping force that is passive whatever the bristle holds (1/N).
    inverse_limit: f64,
}

/// The parameters of presliding and of unlike directions, at the end of those of a friction law.
pub(super) const PARAMETERS: [ParameterInfo; 4] = [
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
    parameter(
        "asymmetry",
        "1",
        "share a by which the force is larger when paying out, and smaller when winding in",
        (-0.5, 0.5),
    )
    .at_least(-0.8)
    .at_most(0.8)
    .or(0.0)
    .shape()
    .extension(),
];

/// The law of presliding with numbers, where there is one: the pull, and how the deflection follows, `F` being the law
/// without it.
pub(super) fn law(values: &[f64], number: &dyn Fn(f64) -> String) -> Option<[String; 2]> {
    let [.., stiffness, damping, damping_speed, _] = *values else { return None };
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
    Some([text, format!("ż = l̇ - {stiff} z |l̇|/F")])
}

impl Presliding {
    /// Of the last four of the effect's values; `None` without presliding. Then the lowest and the highest force of the law (N),
    /// the same for both directions, are not zero.
    pub(super) fn new(spec: &EffectSpec, [lowest, highest]: [f64; 2]) -> Result<Option<Self>, SpecError> {
        let [.., stiffness, damping, damping_speed, asymmetry] = spec.values[..] else { return Ok(None) };
        if stiffness == 0.0 {
            return Ok(None);
        }
        if lowest == 0.0 {
            return Err(SpecError::new(
                &spec.id,
                "the force is 0, expected greater than 0 with `presliding_stiffness`",
            ));
        }
        let held = (highest / lowest).min(2.0);
        let inverse_limit = (held - 1.0) / (held * held) / (lowest * (1.0 - asymmetry.abs()));
        Ok(Some(Self { stiffness, damping, damping_speed, inverse_limit }))
    }

    /// The pull (N) at this winch speed (m/s) and deflection (m), and the deflection's rate; `level` is `g(v)` (N).
    #[inline]
    pub(super) fn pull<S: Real>(&self, speed: S, level: S, deflection: S, rate: &mut S) -> S {
        let sliding = speed.abs();
        *rate = speed - deflection * sliding / level * self.stiffness;
        if self.damping == 0.0 {
            return deflection * self.stiffness;
        }
        let mut damping = S::from(self.damping);
        if self.damping_speed > 0.0 {
            let relative = speed / self.damping_speed;
            damping *= (-(relative * relative)).exp();
        }
        damping = damping / (damping * sliding * self.inverse_limit + 1.0);
        deflection * self.stiffness + damping * *rate
    }

    /// The deflection (m) at which the full `force` (N) is reached.
    pub(super) fn size(&self, force: f64) -> f64 {
        force / self.stiffness
    }
}

/// Friction that turns its sign as `sign` does, from -1 to 1: `1 + asymmetry` times as large when paying out, and
/// `1 - asymmetry` times when winding in.
#[inline]
pub(super) fn turned<S: Real>(sign: S, asymmetry: f64) -> S {
    if asymmetry == 0.0 { sign } else { sign * (sign * asymmetry + 1.0) }
}

/// The factor of the level in the direction of `speed`.
#[inline]
pub(super) fn in_direction<S: Real>(speed: S, asymmetry: f64) -> f64 {
    if speed.re() < 0.0 { 1.0 - asymmetry } else { 1.0 + asymmetry }
}

/// A law `force s` and what is `added` to it, `s` a smooth sign, with the numbers of its asymmetry.
pub(super) fn sliding([force, sign, added]: [&str; 3], values: &[f64], number: &dyn Fn(f64) -> String) -> String {
    match values.last() {
        Some(asymmetry) if *asymmetry != 0.0 => {
            format!("F = {force} s (1 {} s){added}, s = {sign}", super::signed(*asymmetry, number))
        }
        _ => format!("F = {force} {sign}{added}"),
    }
}

/// The level of friction `force` with the numbers of its asymmetry.
pub(super) fn level(force: &str, values: &[f64], number: &dyn Fn(f64) -> String) -> String {
    match values.last() {
        Some(asymmetry) if *asymmetry != 0.0 => format!("{force} (1 {} sign(l̇))", super::signed(*asymmetry, number)),
        _ => force.to_owned(),
    }
}
