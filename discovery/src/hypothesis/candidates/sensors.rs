//! Candidates of the geometry and the sensors.

use std::f64::consts::PI;

use cdpr::effect::EffectSpec;

use super::library::{Candidate, Library, SMALL, proportional};
use super::situation::Situation;
use crate::hypothesis::drum;
use crate::model::sizes::Sizes;

/// Errors of the geometry and of the sensors that there are.
pub(super) fn sensors(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let (anchor, attachment, late) = (5e-5 * sizes.reach, 2e-3 * sizes.arm, 0.03 * sizes.swing);
    let offset = |size: f64| move |a: &[f64]| Some(vec![size * a[0], size * a[1]]);
    lib.each_cable("anchor_offset", &[vec![anchor, 0.0], vec![0.0, anchor]], 0, offset(anchor));
    lib.each_cable("attachment_offset", &[vec![attachment, 0.0], vec![0.0, attachment]], 0, offset(attachment));
    for (channel, present) in [("unstretched_length", &situation.unstretched), ("cable_length", &situation.lengths)] {
        for cable in (1..=lib.cables).filter(|c| present[c - 1]) {
            let spec = move |bias: f64| {
                let mut spec = EffectSpec::new("length_sensor_bias", Some(cable), &[bias]).ok()?;
                spec.channel = Some(channel.to_owned());
                Some(spec)
            };
            if let Some(variation) = spec(0.02) {
                lib.variations.push(variation);
                let column = lib.column(vec![(lib.variations.len() - 1, 1.0)]);
                let build = move |a: &[f64]| spec(0.02 * a[0]);
                lib.candidate("length_sensor_bias", Some(cable), vec![column], 0, Box::new(build));
            }
        }
    }
    if situation.unstretched.iter().any(|p| *p) {
        lib.each_cable("length_sensor_scale", &[vec![1e-4]], 0, proportional(1e-4));
        for cable in situation.cables_and_all() {
            let seen = cable.map_or(situation.drums.1, |c| situation.drums.0.get(c - 1).copied().flatten());
            drum(lib, cable, sizes.drum_radius, 0);
            seen.into_iter().for_each(|radius| drum(lib, cable, radius, 1));
        }
    }
    if situation.tensions.iter().any(|p| *p) {
        let force = SMALL * situation.mean_tension;
        lib.each_cable("tension_sensor_gain", &[vec![0.01]], 0, proportional(0.01));
        lib.each_cable("tension_sensor_bias", &[vec![force]], 0, proportional(force));
        // A sensor that is not recorded shows nothing.
        let recorded = |c: &Candidate| c.cable.is_none_or(|cable| situation.tensions[cable - 1]);
        lib.candidates.retain(|c| !c.id.starts_with("tension_sensor") || recorded(c));
    }
    if situation.pose {
        let sets = [vec![0.02, 0.0, 0.0], vec![0.0, 0.02, 0.0], vec![0.0, 0.0, 0.002]];
        lib.whole("pose_sensor_bias", &sets, 0, |a| Some(vec![0.02 * a[0], 0.02 * a[1], 0.002 * a[2]]));
        let turned = 0.02 / sizes.reach;
        // The measured point's offset is, at orientations that change little, a bias of the position.
        lib.whole("pose_sensor_frame", &[vec![turned]], 0, proportional(turned));
        lib.whole("pose_sensor_scale", &[vec![turned]], 0, proportional(turned));
        lib.whole("pose_sensor_delay", &[vec![late]], 0, proportional(late));
    }
}

/// A drum of a radius (m) off its axis: the wave e (cos(l/r + ψ) - cos ψ) has two parts. The model's radius is one to look at,
/// but a wave of another radius is at right angles to it, so that what the data show is another.
fn drum(lib: &mut Library, cable: Option<usize>, radius: f64, tried: usize) {
    let off = 1e-3 * radius;
    let columns = [0.0, PI / 2.0].map(|phase| {
        let cables = cable.map_or(1..=lib.cables, |c| c..=c);
        let waves = cables.map(|c| (lib.vary(drum::ID, Some(c), &[off, radius, phase]), 1.0)).collect();
        lib.column(waves)
    });
    let build =
        move |a: &[f64]| EffectSpec::new(drum::ID, cable, &[off * a[0].hypot(a[1]), radius, a[1].atan2(a[0])]).ok();
    lib.candidate(drum::ID, cable, columns.to_vec(), tried, Box::new(build));
}
