//! The conclusion's high forces at high frequencies.

use cdpr::parameters::CableModel;
use cdpr::statics::LinearModel;
use nalgebra::{Complex, DMatrix};

use super::{Claim, linear, only_if};
use crate::PaperError;
use crate::run::Area;

/// Where an input and an output of a linear model are.
struct Channel<'a> {
    model: &'a LinearModel,
    input: usize,
    output: usize,
}

impl<'a> Channel<'a> {
    fn new(model: &'a LinearModel, input: &str, output: &str) -> Result<Self, PaperError> {
        let find = |names: &[String], name: &str| {
            let place = names.iter().position(|n| n == name);
            place.ok_or_else(|| PaperError::model(format!("the linear model has no `{name}`")))
        };
        Ok(Self { model, input: find(&model.input_names, input)?, output: find(&model.output_names, output)? })
    }

    /// Amplitude of the output per amplitude of the input at `omega` (rad/s): `|C (jω - A)⁻¹ B + D|`.
    fn gain(&self, omega: f64) -> f64 {
        let m = self.model;
        let n = m.a.nrows();
        let shifted = DMatrix::from_fn(n, n, |r, c| Complex::new(-m.a[(r, c)], if r == c { omega } else { 0.0 }));
        let driven = m.b.column(self.input).map(|v| Complex::new(v, 0.0));
        let Some(states) = shifted.lu().solve(&driven) else { return f64::INFINITY };
        let output: Complex<f64> = (0..n).map(|k| states[k] * m.c[(self.output, k)]).sum();
        (output + m.d[(self.output, self.input)]).norm()
    }
}

/// Frequencies (rad/s): at and above the cable modes, then above the fast pole.
const FAST: f64 = 100.0;
const FASTEST: f64 = 10_000.0;

pub(super) fn claim() -> Result<Claim, PaperError> {
    let (_, model) = linear(Area::Physical, CableModel::LumpedMass)?;
    let channel = Channel::new(&model, "winch_force[1]", "tension[1]")?;
    let (peak, at) = (0..400)
        .map(|k| 5.0 + 0.05 * f64::from(k))
        .map(|omega| (channel.gain(omega), omega))
        .fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best });
    let beyond = channel.gain(FAST);
    // A winch that sets the paid-out length works on spring and damper alone: ΔT/Δl = -(EA/l) (L/l) - jω b.
    let parameters = Area::Physical.parameters(CableModel::LumpedMass);
    let length = parameters.anchor_radius.hypot(parameters.attachment_radius);
    let stiffness = |omega: f64| parameters.axial_stiffness().hypot(omega * parameters.cable_damping) / length;
    let (slow, fast) = (stiffness(0.0), stiffness(FASTEST));
    Ok(Claim {
        place: "IV",
        statement: "the fast pole shows as high forces at high frequencies",
        found: format!(
            "tension per winch force: {peak:.0} at {at:.1} rad/s, where the cable modes are, {beyond:.3} at {FAST} rad/s; \
             tension per paid-out length: {:.1} kN/m at rest, {:.0} kN/m at {FASTEST} rad/s, beyond the pole",
            1e-3 * slow,
            1e-3 * fast
        ),
        verdict: only_if(
            fast > 2.0 * slow,
            beyond > 2.0,
            "the winch sets the paid-out length; under winch forces what is beyond the cable modes dies away",
        ),
    })
}
