//! The straight cables of section III.A, under their weight.

use std::sync::Arc;

use cdpr::effect::EffectSpec;
use cdpr::kinematics;
use cdpr::parameters::CableModel;
use cdpr::plant::Plant;
use cdpr::statics::locked_model;

use super::{Claim, largest, only_if};
use crate::run::{Area, FORCE, hanging_release};
use crate::{CABLES, PaperError, Runs};

/// Acceleration by gravity (m/s²).
const GRAVITY: f64 = 9.81;
/// Sag, as part of the chord, below which a cable may be called straight.
const STRAIGHT: f64 = 0.02;
/// A tension at which it is.
const HIGH: f64 = 20e3;

pub(super) fn claim(runs: &Runs) -> Result<Claim, PaperError> {
    let parameters = Area::Physical.parameters(CableModel::LumpedMass);
    let weight = parameters.cable_density * GRAVITY;
    let catenary = EffectSpec::new("cable_catenary", None, &[weight]).map_err(PaperError::model)?;
    let printed = Area::Printed.parameters(CableModel::LumpedMass).axial_stiffness();
    let taut = parameters.axial_stiffness();
    let plant = Arc::new(Plant::new(parameters, vec![catenary]).map_err(PaperError::model)?);
    let chord = kinematics::cable_lengths(plant.geometry(), &[0.0; 3])[0];
    let sag = |force: f64| force / weight * ((weight * chord / (2.0 * force)).cosh() - 1.0);
    let length = plant.unstretched_length_for(0, 0.0, chord, FORCE, &[]);
    let step = 1e-3;
    let tension = |chord: f64| plant.tension_for(0, 0.0, chord, length, &[]);
    let stiffness = (tension(chord + step) - tension(chord - step)) / (2.0 * step);
    let locked = locked_model(&plant, 0.0, &[0.0; 3], &[FORCE; CABLES].into()).map_err(PaperError::model)?;
    let period = largest(locked.modes().map_err(PaperError::model)?.iter().map(|mode| mode.period()));
    let stop = runs.rigid.time.last().copied().unwrap_or_default();
    let apart = hanging_release(weight, stop)?.deviation(&runs.rigid);
    Ok(Claim {
        place: "III.A",
        statement: "the cables are in a straight line",
        found: format!(
            "under 1 kN a cable of {chord:.0} m weighs {:.2} of its tension, hangs through by {:.0} m, is {:.0} m longer than its \
             chord and gives as a spring of {stiffness:.1} N/m, against {:.0} N/m of a straight one and {:.0} N/m with the area as \
             printed; locked winches then hold the platform with a period of {period:.0} s, and the release of Fig. 8 deviates \
             from rigid cables by {apart:.2} (m, rad); under {:.0} kN it hangs through by {:.1} m",
            weight * chord / FORCE,
            sag(FORCE),
            length - chord,
            taut / chord,
            printed / chord,
            1e-3 * HIGH,
            sag(HIGH),
        ),
        verdict: only_if(
            sag(HIGH) < STRAIGHT * chord,
            sag(FORCE) < STRAIGHT * chord,
            "they are pulled by some 20 kN, or have no weight",
        ),
    })
}
