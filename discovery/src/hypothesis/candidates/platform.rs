//! Candidates of the platform.

use std::f64::consts::PI;

use cdpr::effect::EffectSpec;

use super::library::{Library, SMALL, proportional};
use super::situation::Situation;
use crate::model::sizes::Sizes;

/// Laws of the platform.
pub(super) fn platform(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let force = 0.4 * SMALL * situation.mean_tension;
    let (mass, inertia, offset) = (0.01 * sizes.mass, 0.01 * sizes.inertia, 0.005 * sizes.arm);
    lib.whole("platform_mass", &[vec![mass]], 0, proportional(mass));
    lib.whole("platform_inertia", &[vec![inertia]], 0, proportional(inertia));
    let sets = [vec![offset, 0.0], vec![0.0, offset]];
    lib.whole("platform_com_offset", &sets, 0, move |a| Some(vec![offset * a[0], offset * a[1]]));
    lib.whole("platform_linear_drag", &[vec![20.0]], 0, proportional(20.0));
    lib.whole("platform_quadratic_drag", &[vec![20.0, 0.0, 0.0]], 0, |a| Some(vec![20.0 * a[0], 0.0, 0.0]));
    for direction in 0..8 {
        drag_in_wind(lib, 6.0, f64::from(direction) * PI / 4.0);
    }
    lib.whole("platform_rotational_damping", &[vec![5e3]], 0, proportional(5e3));
    let torque = force * sizes.arm;
    let wind = [vec![force, 0.0, 0.0], vec![0.0, force, 0.0], vec![0.0, 0.0, torque]];
    lib.whole("steady_wind", &wind, 0, move |a| Some(vec![force * a[0], force * a[1], torque * a[2]]));
    for frequency in situation.peaks.clone() {
        let sets: Vec<Vec<f64>> = [(0.0, 0.0), (PI / 2.0, 0.0), (0.0, PI / 2.0), (PI / 2.0, PI / 2.0)]
            .iter()
            .map(|(phase, direction)| vec![force, frequency, *phase, *direction])
            .collect();
        lib.whole("periodic_gust", &sets, 1, move |a| Some(gust(a, force, frequency)));
    }
    let sets = [vec![10.0, 0.0, 0.0, 0.0], vec![0.0, 10.0, 0.0, 0.0]];
    let spring = lib.vary("umbilical", None, &sets[0]);
    let damper = lib.vary("umbilical", None, &sets[1]);
    let constant_x = lib.vary("steady_wind", None, &[force, 0.0, 0.0]);
    let constant_y = lib.vary("steady_wind", None, &[0.0, force, 0.0]);
    let columns = [spring, damper, constant_x, constant_y].map(|s| lib.column(vec![(s, 1.0)])).to_vec();
    let build = move |a: &[f64]| {
        let stiffness = 10.0 * a[0];
        let values = [stiffness, (10.0 * a[1]).max(0.0), force * a[2] / stiffness, force * a[3] / stiffness];
        (stiffness > 0.0).then(|| EffectSpec::new("umbilical", None, &values).ok()).flatten()
    };
    lib.candidate("umbilical", None, columns, 0, Box::new(build));
}

/// Amplitude, frequency, phase, direction of the straight oscillation nearest to sine and cosine amplitudes on x and y.
fn gust(a: &[f64], force: f64, frequency: f64) -> Vec<f64> {
    let m = nalgebra::Matrix2::new(a[0], a[1], a[2], a[3]) * force;
    let svd = m.svd(true, true);
    let k = svd.singular_values.imax();
    let (u, v) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
    let (direction, phase) = (u[(1, k)].atan2(u[(0, k)]), v[(k, 1)].atan2(v[(k, 0)]));
    vec![svd.singular_values[k], frequency, phase, direction]
}

/// Drag in a wind of a speed (m/s) and a direction (rad), and what changes with the wind, along it and across.
fn drag_in_wind(lib: &mut Library, speed: f64, angle: f64) {
    const ID: &str = "platform_quadratic_drag";
    const STEP: f64 = 1.5;
    let along = [angle.cos(), angle.sin()];
    let wind = move |more: f64, across: f64| {
        [(speed + more) * along[0] - across * along[1], (speed + more) * along[1] + across * along[0]]
    };
    let [still, stronger, turned] =
        [wind(0.0, 0.0), wind(STEP, 0.0), wind(0.0, STEP)].map(|w| lib.vary(ID, None, &[5.0, w[0], w[1]]));
    let columns = vec![
        lib.column(vec![(still, 1.0)]),
        lib.column(vec![(stronger, 1.0), (still, -1.0)]),
        lib.column(vec![(turned, 1.0), (still, -1.0)]),
    ];
    let build = move |a: &[f64]| {
        let [more, across] = [a[1], a[2]].map(|change| (STEP * change / a[0]).clamp(-0.8 * speed, 0.8 * speed));
        let w = wind(more, across);
        (a[0] > 0.0).then(|| EffectSpec::new(ID, None, &[5.0 * a[0], w[0], w[1]]).ok()).flatten()
    };
    lib.candidate(ID, None, columns, 0, Box::new(build));
}
