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

/// Unstretched length (m) as temperature leaves it.
#[inline]
fn free_length<S: Real>(laws: &[Law], time: S, unstretched: S) -> S {
    laws.iter().fold(unstretched, |length, (law, _)| length * law.length_factor(time))
}

/// Geometric strain `(L - l')/l'` where `l'` is the free length and `L` the chord with what the cable is longer than it, less
/// inelastic strain.
#[inline]
fn elastic_strain<S: Real>(laws: &[Law], chord: S, free: S, states: &[S]) -> S {
    let mut inelastic = S::from(0.0);
    let mut length = chord;
    for (law, at) in laws {
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

/// Strain of the chord by the cable's shape at this tension (N), chord and free length (m).
fn chord_strain<S: Real>(laws: &[Law], tension: S, [chord, free]: [S; 2]) -> S {
    laws.iter().fold(S::from(0.0), |sum, (law, _)| sum + law.chord_strain(tension, chord, free))
}

fn have_chord_strain(laws: &[Law]) -> bool {
    laws.iter().any(|(law, _)| law.has_chord_strain())
}

/// Elastic tension (N), before it is cut off at zero: `EA (L - l)/l` and what effects make of it, beside it what their states
/// hold.
#[inline]
pub(crate) fn tension<S: Real>(data: &CableData, laws: &[Law], time: S, chord: S, unstretched: S, states: &[S]) -> S {
    spring_tension(data, laws, time, chord, unstretched, states) + held_tension(laws, states)
}

/// Tension (N) that the states of effects hold beside the spring.
#[inline]
fn held_tension<S: Real>(laws: &[Law], states: &[S]) -> S {
    laws.iter().fold(S::from(0.0), |sum, (law, at)| sum + law.held_tension(&states[*at..]))
}

/// Tension (N) of the spring.
///
/// With a chord strain (sag) the law is implicit, strain as a function of tension; it is then solved for the elastic
/// strain, and tension is always positive.
#[inline]
fn spring_tension<S: Real>(data: &CableData, laws: &[Law], time: S, chord: S, unstretched: S, states: &[S]) -> S {
    if laws.is_empty() {
        return (chord - unstretched) / unstretched * data.axial_stiffness;
    }
    let free = free_length(laws, time, unstretched);
    let strain = elastic_strain(laws, chord, free, states);
    if !have_chord_strain(laws) {
        return straight_tension(data, laws, strain, chord);
    }
    // The misfit rises monotonically from below zero at no tension and is hollow downwards: Newton from the left climbs
    // without overshoot, and from the right lands on the left, where a quarter of the last value bounds it away from
    // zero.
    let (strain_re, chord_re, free_re) = (strain.re(), chord.re(), free.re());
    // The misfit and its slope.
    let at = |elastic: f64| {
        let tension = straight_tension(data, laws, Dual64::new(elastic, 1.0), chord_re.into());
        let by_shape = laws.iter().map(|(law, _)| law.chord_strain_and_slope(tension.re, chord_re, free_re));
        let [shape, slope] = by_shape.fold([0.0; 2], |sum, law| [sum[0] + law[0], sum[1] + law[1]]);
        [elastic + shape - strain_re, 1.0 + slope * tension.eps]
    };
    let mut elastic = strain_re.max(1e-3 / data.axial_stiffness);
    for _ in 0..100 {
        let [left, slope] = at(elastic);
        let next = (elastic - left / slope).max(0.25 * elastic);
        let done = (next - elastic).abs() <= LAST_STEP * elastic;
        elastic = next;
        if done {
            break;
        }
    }
    // Each Newton step in the given number type carries one more order of derivatives by the implicit function theorem.
    let mut refined = S::from(elastic);
    if S::NDERIV > 0 {
        let [_, slope] = at(elastic);
        for _ in 0..S::NDERIV {
            refined -= misfit(data, laws, refined, strain, [chord, free]) / slope;
        }
    }
    straight_tension(data, laws, refined, chord)
}

/// How far the strain at this elastic strain, with the chord strain of its tension, is from `strain`; at this chord and free
/// length (m).
fn misfit<S: Real>(data: &CableData, laws: &[Law], elastic: S, strain: S, lengths: [S; 2]) -> S {
    elastic + chord_strain(laws, straight_tension(data, laws, elastic, lengths[0]), lengths) - strain
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
    let carried = if tension_wanted.re() > 0.0 { tension_wanted } else { S::from(0.0) };
    let wanted = carried - held_tension(laws, states);
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
    let mut factor = S::from(1.0);
    let mut length = chord;
    for (law, at) in laws {
        strain += law.inelastic_strain(&states[*at..]);
        factor *= law.length_factor(time);
        length += law.bowed_length(chord, &states[*at..]);
    }
    let mut free = length / (strain + 1.0);
    if wanted.re() > 0.0 && have_chord_strain(laws) {
        free = hanging_length(laws, wanted, strain, [chord, length], free);
    }
    free / factor
}

/// The free length (m) that has this strain beside that of its shape under `tension` (N), `start` being that of a straight
/// cable. What is left, `l (1 + ε(l)) - L`, rises with `l` and is hollow downwards, so that Newton's method climbs to it from
/// the straight cable, which is too short.
fn hanging_length<S: Real>(laws: &[Law], tension: S, strain: S, [chord, length]: [S; 2], start: S) -> S {
    let left = |free: Dual64| {
        let shape = chord_strain(laws, tension.re().into(), [chord.re().into(), free]);
        free * (shape + strain.re() + 1.0) - length.re()
    };
    let mut free = start.re();
    for _ in 0..100 {
        let f = left(Dual64::new(free, 1.0));
        let step = f.re / f.eps;
        free -= step;
        if step.abs() <= 1e-15 * free.abs() {
            break;
        }
    }
    let slope = left(Dual64::new(free, 1.0)).eps;
    let mut refined = S::from(free);
    for _ in 0..S::NDERIV {
        let shape = chord_strain(laws, tension, [chord, refined]);
        refined -= (refined * (shape + strain + 1.0) - length) / slope;
    }
    refined
}
