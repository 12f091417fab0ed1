//! Terms outside the catalogue as candidates for regression.

use cdpr::effect::EffectSpec;

use super::library::Library;
use super::situation::{Situation, Wave};
use crate::hypothesis::term::{self, literal};

/// Force of a winch (N) by which terms in it are scaled.
const FORCE: f64 = 1e4;

/// The dictionary of terms outside the catalogue, for every axis of the platform and every winch.
pub(crate) fn dictionary(situation: &Situation) -> Library {
    let mut lib = Library::new(situation.cables());
    let terms = [
        "x",
        "y",
        "phi",
        "vx",
        "vy",
        "omega",
        "x*y",
        "x^2",
        "y^2",
        "x*phi",
        "y*phi",
        "x*abs(x)",
        "x*abs(y)",
        "y*abs(x)",
        "y*abs(y)",
        "x^3",
        "y^3",
        "x*y^2",
        "y*x^2",
        "vx*abs(vx)",
        "vy*abs(vy)",
        "vx*vy",
        "vx^2",
        "vy^2",
        "vx*abs(vy)",
        "vy*abs(vx)",
        "x*vx",
        "x*vy",
        "y*vx",
        "y*vy",
        "vx^3",
        "vy^3",
        "omega*abs(omega)",
        "vx*omega",
        "vy*omega",
        "time",
        "phi*abs(phi)",
        "phi^3",
        "phi*vx",
        "phi*vy",
        "x*omega",
        "y*omega",
    ];
    for (axis, (target, size)) in
        [("platform.force_x", 10.0), ("platform.force_y", 10.0), ("platform.torque", 100.0)].into_iter().enumerate()
    {
        for term in &terms {
            push_term(&mut lib, target, term, size);
        }
        for frequency in &situation.peaks {
            let half_range = 0.5 * situation.duration;
            let time =
                Wave { latent: axis, coordinate: "time".to_owned(), number: *frequency, middle: 0.0, half_range };
            push_wave(&mut lib, target, &time, size);
        }
        for wave in situation.waves.iter().filter(|w| w.latent == axis) {
            push_wave(&mut lib, target, wave, size);
        }
    }
    for cable in 1..=lib.cables {
        let target = &format!("winch[{cable}]");
        let rate = format!("unstretched_length_rate[{cable}]");
        let force = format!("winch_force[{cable}]");
        for term in [
            "x".to_owned(),
            "y".to_owned(),
            "phi".to_owned(),
            format!("{rate}*abs({rate})"),
            format!("{rate}^2"),
            format!("{rate}^3"),
            "time".to_owned(),
        ] {
            push_term(&mut lib, target, &term, 10.0);
        }
        // In units of a winch's usual force.
        push_term(&mut lib, target, &format!("{force}^2"), 10.0 / FORCE.powi(2));
        push_term(&mut lib, target, &format!("{force}^3"), 10.0 / FORCE.powi(3));
        push_term(&mut lib, target, &format!("{force}*{rate}"), 10.0 / FORCE);
        for other in (1..=situation.cables()).filter(|other| *other != cable) {
            push_term(&mut lib, target, &format!("winch_force[{other}]"), 10.0 / FORCE);
        }
        for wave in situation.waves.iter().filter(|w| w.latent == 2 + cable) {
            push_wave(&mut lib, target, wave, 10.0);
        }
    }
    lib
}

/// A wave: sine and cosine together, at a wave number that was searched for, and both once more in proportion to the
/// coordinate, by which the number is set right.
fn push_wave(lib: &mut Library, target: &str, wave: &Wave, size: f64) {
    let Wave { coordinate, number, middle, half_range, .. } = wave.clone();
    let from_middle = match middle {
        0.0 => coordinate.clone(),
        _ if middle > 0.0 => format!("({coordinate} - {middle})"),
        _ => format!("({coordinate} + {})", -middle),
    };
    let mut columns = Vec::new();
    for term in [
        format!("{size}*sin({number}*{from_middle})"),
        format!("{size}*cos({number}*{from_middle})"),
        format!("{}*{from_middle}*cos({number}*{from_middle})", size / half_range),
        format!("{}*{from_middle}*sin({number}*{from_middle})", size / half_range),
    ] {
        let Ok(spec) = EffectSpec::expression(target, &term) else { return };
        lib.variations.push(spec);
        columns.push(lib.column(vec![(lib.variations.len() - 1, 1.0)]));
    }
    let target = target.to_owned();
    let build = move |a: &[f64]| {
        // a sin θ + b cos θ with θ moved by δ q: δ q (a cos θ - b sin θ) more.
        let moved = (a[0] * a[2] - a[1] * a[3]) / (half_range * (a[0] * a[0] + a[1] * a[1]));
        let number = number + moved.clamp(-1.0 / half_range, 1.0 / half_range);
        term::wave(&target, &coordinate, [a[0] * size, a[1] * size], number, middle).ok()
    };
    lib.candidate("expression", None, columns, 0, Box::new(build));
}

fn push_term(lib: &mut Library, target: &str, term: &str, size: f64) {
    let Ok(spec) = EffectSpec::expression(target, &format!("{size}*{term}")) else { return };
    lib.variations.push(spec);
    let column = lib.column(vec![(lib.variations.len() - 1, 1.0)]);
    let (target, term) = (target.to_owned(), term.to_owned());
    let build = move |a: &[f64]| EffectSpec::expression(&target, &format!("{}*{term}", literal(a[0] * size))).ok();
    lib.candidate("expression", None, vec![column], 0, Box::new(build));
}
