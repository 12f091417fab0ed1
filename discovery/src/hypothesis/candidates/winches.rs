//! Candidates of the winches.

use cdpr::effect::EffectSpec;

use super::library::{Library, SMALL, possible, proportional};
use super::situation::Situation;
use crate::model::sizes::Sizes;

/// Shares of the commands that are beyond a limit of a winch's force: it may be reached often or hardly ever.
const REACHED: [f64; 4] = [0.4, 0.2, 0.07, 0.01];
/// Share of the platform's mass below which what swings at a winch is as good as without mass.
const LIGHT: f64 = 1e-3;

/// Time constants and dead times in sampling intervals: what is later by less than one is hardly seen, and signatures are good for a
/// few times more than they are taken at.
const LATE: [f64; 2] = [1.5, 10.0];

/// Laws of the winches.
pub(super) fn winches(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let force = SMALL * situation.mean_tension;
    for speed in [0.005, 0.02, 0.08, 0.3] {
        lib.each_cable("winch_coulomb_friction", &[vec![force, speed]], 1, move |a| Some(vec![force * a[0], speed]));
    }
    lib.each_cable("winch_viscous_friction", &[vec![force]], 0, proportional(force));
    let speed = 0.05;
    stribeck(lib, speed, force, move |a: &[f64]| {
        // Columns: Coulomb part, the peak above it, viscous part.
        (a[0] > 0.0 && a[0] + a[1] > 0.0)
            .then(|| vec![force * a[0], force * (a[0] + a[1]), speed, (force * a[2]).max(0.0)])
    });
    for speed in [0.005, 0.02, 0.08] {
        lib.each_cable("pulley_capstan_loss", &[vec![0.005, speed]], 1, move |a| Some(vec![0.005 * a[0], speed]));
    }
    lib.each_cable("winch_force_gain", &[vec![0.01]], 0, proportional(0.01));
    lib.each_cable("winch_force_bias", &[vec![force]], 0, proportional(force));
    for tau in LATE.map(|intervals| intervals * situation.interval) {
        lib.each_cable("winch_lag", &[vec![tau]], 1, move |a| (a[0] > 0.05).then(|| vec![tau * a[0].min(4.0)]));
        lib.each_cable("winch_delay", &[vec![tau]], 1, move |a| (a[0] > 0.05).then(|| vec![tau * a[0].min(4.0)]));
    }
    let drum = 0.2 * sizes.winch_mass.max(LIGHT * sizes.mass);
    lib.each_cable("winch_drum_inertia", &[vec![drum]], 0, proportional(drum));
    for cable in situation.cables_and_all() {
        let (low, high) = (situation.quantile(cable, 0.0), situation.quantile(cable, 1.0));
        let margin = 0.5 * (high - low).max(1e-4 * situation.mean_tension);
        for share in REACHED {
            let (lower, upper) = (situation.quantile(cable, share), situation.quantile(cable, 1.0 - share));
            saturation(lib, cable, low - margin, upper);
            saturation(lib, cable, lower, high + margin);
            // Recordings in which one limit is reached say nothing of the other one.
            saturation(lib, cable, lower, upper);
        }
    }
}

fn saturation(lib: &mut Library, cable: Option<usize>, lower: f64, upper: f64) {
    if upper <= lower || !possible("winch_saturation", cable, &[vec![lower, upper]]) {
        return;
    }
    let sim = lib.vary("winch_saturation", cable, &[lower, upper]);
    let column = lib.column(vec![(sim, 1.0)]);
    // The amplitude says how well the level fits; the level itself is refined later.
    let build = move |a: &[f64]| {
        (0.2..5.0).contains(&a[0]).then(|| EffectSpec::new("winch_saturation", cable, &[lower, upper]).ok()).flatten()
    };
    lib.candidate("winch_saturation", cable, vec![column], 1, Box::new(build));
}

/// Stribeck friction needs differences of variations: the Coulomb part alone, the peak, the viscous part.
fn stribeck(
    lib: &mut Library,
    speed: f64,
    force: f64,
    build: impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static,
) {
    const ID: &str = "winch_stribeck_friction";
    let mut all = [Vec::new(), Vec::new(), Vec::new()];
    for cable in 1..=lib.cables {
        let flat = lib.vary(ID, Some(cable), &[force, force, speed, 0.0]);
        let peak = lib.vary(ID, Some(cable), &[0.0, force, speed, 0.0]);
        let viscous = lib.vary(ID, Some(cable), &[0.0, 0.0, speed, force]);
        let sets = [vec![(flat, 1.0)], vec![(peak, 1.0)], vec![(viscous, 1.0)]];
        for (sum, set) in all.iter_mut().zip(&sets) {
            sum.extend_from_slice(set);
        }
        let columns = sets.into_iter().map(|set| lib.column(set)).collect();
        let b = build.clone();
        let make = move |a: &[f64]| b(a).and_then(|values| EffectSpec::new(ID, Some(cable), &values).ok());
        lib.candidate(ID, Some(cable), columns, 1, Box::new(make));
    }
    let columns = all.into_iter().map(|set| lib.column(set)).collect();
    let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(ID, None, &values).ok());
    lib.candidate(ID, None, columns, 1, Box::new(make));
}
