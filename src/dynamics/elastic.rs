//! The elastic law of a cable, (32) and (33), with the effects that change it.

use num_dual::Dual64;

use crate::effect::EffectKind;
use crate::scalar::Real;

use super::CableData;

/// An elastic-law effect and where its states begin among the cable's effect states.
pub(crate) type Law = (EffectKind, usize);

/// Relative step of Newton's method in [`tension`] that is its last: it leaves an error of at most 1.5 times its square, where
/// the misfit is steepest (as `1/ε²` near zero).
const LAST_STEP: f64 = 1e-8;

/// Geometric strain `(L - l')/l'` where `l'` is the unstretched length as temperature leaves it and `L` the chord with
/// what the cable is longer than it, less inelastic strain.
#[inline]
fn elastic_strain<S: Real>(laws: &[Law], time: S, chord: S, unstretched: S, states: &[S]) -> S {
    let mut free = unstretched;
    let mut inelastic = S::from(0.0);
    let mut length = chord;
    for (law, at) in laws {
        free *= law.length_factor(time);
        inelastic += law.inelastic_strain(&states[*at..]);
        length += law.bowed_length(chord, &states[*at..]);
    }
    (length - free) / free - inelastic
}

/// Tension (N) at this elastic strain of a straight cable of this chord (m).
#[inline]
fn straight_tension<S: Real>(data: &CableData, laws: &[Law], strain: S, chord: S) -> S {
    let mut tension = strain * data.axial_stiffness;
    for (law, _) in laws {
        tension *= law.tension_factor(strain, chord, data.axial_stiffness);
    }
    tension
}

/// Strain of the chord by the cable's shape at this tension (N).
fn chord_strain<S: Real>(laws: &[Law], tension: S, chord: S) -> S {
    laws.iter().fold(S::from(0.0), |sum, (law, _)| sum + law.chord_strain(tension, chord))
}

/// Elastic tension (N), before it is cut off at zero: `EA (L - l)/l` and what effects make of it.
///
/// With a chord strain (sag) the law is implicit, strain as a function of tension; it is then solved for the elastic
/// strain, and tension is always positive.
#[inline]
pub(crate) fn tension<S: Real>(data: &CableData, laws: &[Law], time: S, chord: S, unstretched: S, states: &[S]) -> S {
    if laws.is_empty() {
        return (chord - unstretched) / unstretched * data.axial_stiffness;
    }
    let strain = elastic_strain(laws, time, chord, unstretched, states);
    if !laws.iter().any(|(law, _)| law.has_chord_strain()) {
        return straight_tension(data, laws, strain, chord);
    }
    // The misfit rises monotonically from minus infinity at zero and is hollow downwards: Newton from the left climbs
    // without overshoot, and from the right lands on the left, where a quarter of the last value bounds it away from
    // zero.
    let (strain_re, chord_re) = (strain.re(), chord.re());
    let at = |elastic: f64| misfit(data, laws, Dual64::new(elastic, 1.0), strain_re.into(), chord_re.into());
    let mut elastic = strain_re.max(1e-3 / data.axial_stiffness);
    for _ in 0..100 {
        let f = at(elastic);
        let next = (elastic - f.re / f.eps).max(0.25 * elastic);
        let done = (next - elastic).abs() <= LAST_STEP * elastic;
        elastic = next;
        if done {
            break;
        }
    }
    // Each Newton step in the given number type carries one more order of derivatives by the implicit function theorem.
    let mut refined = S::from(elastic);
    if S::NDERIV > 0 {
        let slope = at(elastic).eps;
        for _ in 0..S::NDERIV {
            refined -= misfit(data, laws, refined, strain, chord) / slope;
        }
    }
    straight_tension(data, laws, refined, chord)
}

/// Tension (N) of a cable with a mass at its winch end: spring and damper, nothing where it is slack.
#[inline]
pub(crate) fn carried<S: Real>(
    data: &CableData,
    laws: &[Law],
    time: S,
    [chord, speed]: [S; 2],
    [unstretched, rate]: [S; 2],
    states: &[S],
    slack: bool,
) -> S {
    if slack {
        return S::from(0.0);
    }
    tension(data, laws, time, chord, unstretched, states) + data.damper_force(chord, speed, unstretched, rate)
}

/// How far the strain at this elastic strain, with the chord strain of its tension, is from `strain`.
fn misfit<S: Real>(data: &CableData, laws: &[Law], elastic: S, strain: S, chord: S) -> S {
    elastic + chord_strain(laws, straight_tension(data, laws, elastic, chord), chord) - strain
}

/// The unstretched length (m) at which a cable at rest with this chord (m) carries `tension` (N); the inverse of
/// [`tension`]. At `tension <= 0` the cable lies unstretched.
pub(crate) fn unstretched_length<S: Real>(
    data: &CableData,
    laws: &[Law],
    time: S,
    chord: S,
    tension_wanted: S,
    states: &[S],
) -> S {
    let wanted = if tension_wanted.re() > 0.0 { tension_wanted } else { S::from(0.0) };
    let law = |elastic: f64| straight_tension(data, laws, Dual64::new(elastic, 1.0), chord.re().into());
    let mut elastic = wanted.re() / data.axial_stiffness;
    for _ in 0..100 {
        let tension = law(elastic);
        let step = (tension.re - wanted.re()) / tension.eps;
        elastic -= step;
        if step.abs() <= 1e-15 * elastic.abs() {
            break;
        }
    }
    let df = law(elastic).eps;
    let mut strain = S::from(elastic);
    for _ in 0..S::NDERIV {
        strain -= (straight_tension(data, laws, strain, chord) - wanted) / df;
    }
    if wanted.re() > 0.0 {
        strain += chord_strain(laws, wanted, chord);
    }
    let mut factor = S::from(1.0);
    let mut length = chord;
    for (law, at) in laws {
        strain += law.inelastic_strain(&states[*at..]);
        factor *= law.length_factor(time);
        length += law.bowed_length(chord, &states[*at..]);
    }
    length / (strain + 1.0) / factor
}
