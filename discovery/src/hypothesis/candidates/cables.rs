//! Candidates of the cables.

use std::f64::consts::PI;

use super::library::{Library, SMALL, proportional};
use super::situation::Situation;
use crate::model::sizes::Sizes;

/// Laws of cables of a density (kg/m).
pub(super) fn cables(lib: &mut Library, situation: &Situation, sizes: &Sizes, density: f64) {
    lib.each_cable("cable_stiffness", &[vec![0.02]], 0, proportional(0.02));
    lib.each_cable("cable_damping", &[vec![0.5]], 0, proportional(0.5));
    for tau in [2.0, 10.0, 50.0] {
        // Creep strain is in proportion to 1/EA_c.
        let build = move |a: &[f64]| (a[0] > 0.0).then(|| vec![3e8 / a[0], tau]);
        lib.each_cable("cable_creep", &[vec![3e8, tau]], 1, build);
    }
    lib.each_cable("cable_stiffening", &[vec![2e4]], 0, proportional(2e4));
    let t = situation.mean_tension;
    let held = SMALL * t;
    for strain in [3e-5, 2e-4] {
        lib.each_cable("cable_hysteresis", &[vec![held, strain]], 1, move |a| {
            (a[0] > 0.0).then(|| vec![held * a[0], strain])
        });
    }
    // A weight that makes a cable sag by a hundredth of its length.
    let (w0, t1) = (0.1 * t / sizes.reach, 0.8 * t);
    let build = move |a: &[f64]| {
        // a0 w0²/T² + a1 w0² (1/T1² - 1/T²) = w²/T_ref² with w² = (a0 + a1) w0² carried by the two columns together.
        let square = a[0] + a[1];
        let reference = (a[0] / (t * t) + a[1] / (t1 * t1)) / square;
        (square > 0.0 && reference > 0.0).then(|| vec![w0 * square.sqrt(), 1.0 / reference.sqrt()])
    };
    lib.each_cable("cable_sag", &[vec![w0, t], vec![w0, t1]], 0, build);
    let mut period = situation.duration / 8.0;
    while period < 6.0 * situation.duration {
        let build = move |a: &[f64]| Some(vec![1e-5 * a[0].hypot(a[1]), period, a[1].atan2(a[0])]);
        lib.whole("cable_thermal_expansion", &[vec![1e-5, period, 0.0], vec![1e-5, period, PI / 2.0]], 1, build);
        period *= 2.0;
    }
    lib.each_cable("cable_drag", &[vec![0.01]], 0, proportional(0.01));
    // The amplitude says how well a cable of this density fits; the density itself is refined later.
    let build = move |a: &[f64]| (0.2..5.0).contains(&a[0]).then(|| vec![density, 0.02, 0.01]);
    lib.each_cable("cable_transverse_mode", &[vec![density, 0.02, 0.01]], 2, build);
    lib.each_cable("cable_axial_mass", &[vec![0.2]], 0, proportional(0.2));
}
