//! The elastic law of a cable, (32) and (33), with the effects that change it.

use std::ops::Deref;

use num_dual::Dual64;

use crate::effect::LawPart;
use crate::plant::CableEffect;
use crate::scalar::Real;

use super::CableData;

/// The effects on the elastic law of one cable, each with the place of its states; and those that change each part of it, so that
/// no other is asked.
#[derive(Clone, Debug, Default)]
pub(crate) struct ElasticLaw {
    all: Vec<CableEffect>,
    parts: [Vec<CableEffect>; LawPart::COUNT],
}

impl ElasticLaw {
    /// Takes up an effect.
    pub(crate) fn push(&mut self, effect: CableEffect) {
        for part in effect.0.law_parts() {
            self.parts[*part as usize].push(effect.clone());
        }
        self.all.push(effect);
    }

    /// The effects that change this part.
    #[inline(always)]
    pub(crate) fn that_change(&self, part: LawPart) -> &[CableEffect] {
        &self.parts[part as usize]
    }
}

impl Deref for ElasticLaw {
    type Target = [CableEffect];

    fn deref(&self) -> &[CableEffect] {
        &self.all
    }
}

impl<'a> IntoIterator for &'a ElasticLaw {
    type Item = &'a CableEffect;
    type IntoIter = std::slice::Iter<'a, CableEffect>;

    fn into_iter(self) -> Self::IntoIter {
        self.all.iter()
    }
}

/// Relative step of Newton's method in [`tension`] that is its last: it leaves an error of at most 1.5 times its square, where
/// the misfit is steepest (as `1/ε²` near zero).
const LAST_STEP: f64 = 1e-8;

/// Unstretched length (m) as temperature leaves it.
#[inline]
fn free_length<S: Real>(law: &ElasticLaw, time: S, unstretched: S) -> S {
    law.that_change(LawPart::Length).iter().fold(unstretched, |length, (kind, _)| length * kind.length_factor(time))
}

/// Strain that carries no elastic force.
#[inline]
fn inelastic_strain<S: Real>(law: &ElasticLaw, states: &[S]) -> S {
    let strain = |sum, (kind, at): &CableEffect| sum + kind.inelastic_strain(&states[*at..]);
    law.that_change(LawPart::Inelastic).iter().fold(S::from(0.0), strain)
}

/// Length (m) of a cable with this chord (m).
#[inline]
fn bowed_length<S: Real>(law: &ElasticLaw, chord: S, states: &[S]) -> S {
    let longer = |sum, (kind, at): &CableEffect| sum + kind.bowed_length(chord, &states[*at..]);
    law.that_change(LawPart::Bow).iter().fold(chord, longer)
}

/// Geometric strain `(L - l')/l'` where `l'` is the free length and `L` the chord with what the cable is longer than it, less
/// inelastic strain.
#[inline]
fn elastic_strain<S: Real>(law: &ElasticLaw, chord: S, free: S, states: &[S]) -> S {
    (bowed_length(law, chord, states) - free) / free - inelastic_strain(law, states)
}

/// Tension (N) at this elastic strain of a straight cable of this chord (m).
#[inline]
fn straight_tension<S: Real>(data: &CableData, law: &ElasticLaw, strain: S, chord: S) -> S {
    let factor =
        |tension: S, (kind, _): &CableEffect| tension * kind.tension_factor(strain, chord, data.axial_stiffness);
    law.that_change(LawPart::Factor).iter().fold(strain * data.axial_stiffness, factor)
}

/// The same at plain numbers, and its derivative by the strain (N).
#[inline]
fn straight_tension_and_slope(data: &CableData, law: &ElasticLaw, strain: f64, chord: f64) -> [f64; 2] {
    if law.that_change(LawPart::Factor).is_empty() {
        return [strain * data.axial_stiffness, data.axial_stiffness];
    }
    let tension = straight_tension(data, law, Dual64::new(strain, 1.0), chord.into());
    [tension.re, tension.eps]
}

/// Strain of the chord by the cable's shape at this tension (N), chord and free length (m).
fn chord_strain<S: Real>(law: &ElasticLaw, tension: S, [chord, free]: [S; 2]) -> S {
    let strain = |sum, (kind, _): &CableEffect| sum + kind.chord_strain(tension, chord, free);
    law.that_change(LawPart::Shape).iter().fold(S::from(0.0), strain)
}

/// Elastic tension (N), before it is cut off at zero: `EA (L - l)/l` and what effects make of it, beside it what their states
/// hold.
#[inline]
pub(crate) fn tension<S: Real>(
    data: &CableData,
    law: &ElasticLaw,
    time: S,
    chord: S,
    unstretched: S,
    states: &[S],
) -> S {
    spring_tension(data, law, time, chord, unstretched, states) + held_tension(law, states)
}

/// Tension (N) that the states of effects hold beside the spring.
#[inline]
fn held_tension<S: Real>(law: &ElasticLaw, states: &[S]) -> S {
    let held = |sum, (kind, at): &CableEffect| sum + kind.held_tension(&states[*at..]);
    law.that_change(LawPart::Held).iter().fold(S::from(0.0), held)
}

/// Tension (N) of the spring.
///
/// With a chord strain (sag) the law is implicit, strain as a function of tension; it is then solved for the elastic
/// strain, and tension is always positive.
#[inline]
fn spring_tension<S: Real>(data: &CableData, law: &ElasticLaw, time: S, chord: S, unstretched: S, states: &[S]) -> S {
    if law.is_empty() {
        return (chord - unstretched) / unstretched * data.axial_stiffness;
    }
    let free = free_length(law, time, unstretched);
    let strain = elastic_strain(law, chord, free, states);
    let shapes = law.that_change(LawPart::Shape);
    if shapes.is_empty() {
        return straight_tension(data, law, strain, chord);
    }
    // The misfit rises monotonically from below zero at no tension and is hollow downwards: Newton from the left climbs
    // without overshoot, and from the right lands on the left, where a quarter of the last value bounds it away from
    // zero.
    let (strain_re, chord_re, free_re) = (strain.re(), chord.re(), free.re());
    // The misfit and its slope.
    let at = |elastic: f64| {
        let [tension, stiffness] = straight_tension_and_slope(data, law, elastic, chord_re);
        let by_shape = shapes.iter().map(|(kind, _)| kind.chord_strain_and_slope(tension, chord_re, free_re));
        let [shape, slope] = by_shape.fold([0.0; 2], |sum, law| [sum[0] + law[0], sum[1] + law[1]]);
        [elastic + shape - strain_re, 1.0 + slope * stiffness]
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
            refined -= misfit(data, law, refined, strain, [chord, free]) / slope;
        }
    }
    straight_tension(data, law, refined, chord)
}

/// How far the strain at this elastic strain, with the chord strain of its tension, is from `strain`; at this chord and free
/// length (m).
fn misfit<S: Real>(data: &CableData, law: &ElasticLaw, elastic: S, strain: S, lengths: [S; 2]) -> S {
    elastic + chord_strain(law, straight_tension(data, law, elastic, lengths[0]), lengths) - strain
}

/// The unstretched length (m) at which a cable at rest with this chord (m) carries `tension` (N); the inverse of
/// [`tension`]. At `tension <= 0` the cable lies unstretched.
pub(crate) fn unstretched_length<S: Real>(
    data: &CableData,
    law: &ElasticLaw,
    time: S,
    chord: S,
    tension_wanted: S,
    states: &[S],
) -> S {
    let carried = if tension_wanted.re() > 0.0 { tension_wanted } else { S::from(0.0) };
    let wanted = carried - held_tension(law, states);
    let at = |elastic: f64| straight_tension_and_slope(data, law, elastic, chord.re());
    let mut elastic = wanted.re() / data.axial_stiffness;
    for _ in 0..100 {
        let [tension, slope] = at(elastic);
        let step = (tension - wanted.re()) / slope;
        elastic -= step;
        if step.abs() <= 1e-15 * elastic.abs() {
            break;
        }
    }
    let [_, slope] = at(elastic);
    let mut strain = S::from(elastic);
    for _ in 0..S::NDERIV {
        strain -= (straight_tension(data, law, strain, chord) - wanted) / slope;
    }
    strain += inelastic_strain(law, states);
    let length = bowed_length(law, chord, states);
    let mut free = length / (strain + 1.0);
    if wanted.re() > 0.0 && !law.that_change(LawPart::Shape).is_empty() {
        free = hanging_length(law, wanted, strain, [chord, length], free);
    }
    free / free_length(law, time, S::from(1.0))
}

/// The free length (m) that has this strain beside that of its shape under `tension` (N), `start` being that of a straight
/// cable. What is left, `l (1 + ε(l)) - L`, rises with `l` and is hollow downwards, so that Newton's method climbs to it from
/// the straight cable, which is too short.
fn hanging_length<S: Real>(law: &ElasticLaw, tension: S, strain: S, [chord, length]: [S; 2], start: S) -> S {
    let left = |free: Dual64| {
        let shape = chord_strain(law, tension.re().into(), [chord.re().into(), free]);
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
        let shape = chord_strain(law, tension, [chord, refined]);
        refined -= (refined * (shape + strain + 1.0) - length) / slope;
    }
    refined
}
