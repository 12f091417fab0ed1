//! The numbers of a term outside the catalogue, as parameters that can be estimated.
//!
//! The first number in a term's text is its size; the others (a frequency, a phase) give it its shape.

use std::f64::consts::{FRAC_PI_2, PI};

use cdpr::effect::{EffectSpec, SpecError};
use cdpr::formula::{self, Number};

/// Digits of a number in a term: far below any error.
const DIGITS: usize = 10;
/// Step in the shape of a term for differences, absolute and relative to the number: a phase is small, a frequency is
/// multiplied by a length of hundreds of metres.
const SHAPE_STEP: f64 = 1e-6;

/// The values that can be estimated: of an effect of the catalogue its parameters, of a term the numbers in its text.
pub(crate) fn values(spec: &EffectSpec) -> Vec<f64> {
    match &spec.expression {
        Some(text) => numbers(text).iter().map(|n| n.value).collect(),
        None => spec.values.clone(),
    }
}

/// The numbers of a term. A term of the model has been read before, so its text is a formula.
fn numbers(text: &str) -> Vec<Number> {
    formula::numbers(text).unwrap_or_default()
}

/// `spec` with one of its values changed.
pub(crate) fn with_value(spec: &EffectSpec, at: usize, value: f64) -> EffectSpec {
    let mut changed = spec.clone();
    match &mut changed.expression {
        Some(text) => *text = with_number(text, at, value),
        None => changed.values[at] = value,
    }
    changed
}

/// The text with another number in the place of number `at`; a minus goes into the sign before it.
fn with_number(text: &str, at: usize, value: f64) -> String {
    let Some(number) = numbers(text).into_iter().nth(at) else { return text.to_owned() };
    let chars: Vec<char> = text.chars().collect();
    let mut before: String = chars[..number.characters.start].iter().collect();
    let after: String = chars[number.characters.end..].iter().collect();
    if value < 0.0 {
        let kept = before.trim_end().len();
        let space = before.split_off(kept);
        let binary = before
            .strip_suffix(['+', '-'])
            .map(str::trim_end)
            .is_some_and(|left| !left.is_empty() && !left.ends_with(['(', '+', '-', '*', '/']));
        match before.pop() {
            Some('-') if binary => before.push('+'),
            Some('+') => before.push('-'),
            Some('-') => {}
            Some(other) => before.extend([other, '-']),
            None => before.push('-'),
        }
        before.push_str(&space);
    }
    format!("{before}{}{after}", literal(value.abs()))
}

/// A number as it stands in a term.
pub(crate) fn literal(value: f64) -> String {
    let short: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    if short == 0.0 || (1e-4..1e9).contains(&short.abs()) { format!("{short}") } else { format!("{short:e}") }
}

/// Whether a value only gives the law its shape.
pub(crate) fn is_shape(spec: &EffectSpec, at: usize) -> bool {
    match &spec.expression {
        Some(_) => at > 0,
        None => spec.info().is_ok_and(|info| info.parameters[at].shape),
    }
}

/// Step for differences in a number of a term.
pub(crate) fn step(spec: &EffectSpec, at: usize) -> f64 {
    let value = values(spec).get(at).map_or(0.0, |v| v.abs());
    if is_shape(spec, at) { SHAPE_STEP * value.max(1.0) } else { 1e-3 * value.max(1e-12) }
}

/// `sine·sin(number·(q - middle)) + cosine·cos(number·(q - middle))` of a coordinate `q` as one wave, its offsets in the
/// phase: a sine or a cosine, whichever has the smaller phase, within 45°.
pub(crate) fn wave(
    target: &str,
    coordinate: &str,
    [sine, cosine]: [f64; 2],
    number: f64,
    middle: f64,
) -> Result<EffectSpec, SpecError> {
    let number: f64 = literal(number).parse().unwrap_or(number);
    // amplitude·sin(number·q + phase)
    let amplitude = sine.hypot(cosine);
    let phase = (cosine.atan2(sine) - number * middle).rem_euclid(2.0 * PI);
    let quarter = (phase / FRAC_PI_2).round();
    let (function, sign) = [("sin", 1.0), ("cos", 1.0), ("sin", -1.0), ("cos", -1.0)][quarter as usize % 4];
    let rest = phase - quarter * FRAC_PI_2;
    let offset = match rest {
        0.0 => String::new(),
        _ => format!(" {} {}", if rest < 0.0 { '-' } else { '+' }, literal(rest.abs())),
    };
    let angle = format!("{}*{coordinate}{offset}", literal(number));
    EffectSpec::expression(target, &format!("{}*{function}({angle})", literal(sign * amplitude)))
}

/// The term without the offset in its wave, where it is one with an offset.
pub(crate) fn without_phase(spec: &EffectSpec) -> Option<EffectSpec> {
    let text = spec.expression.as_deref()?;
    let [_, _, phase] = &numbers(text)[..] else { return None };
    let before: String = text.chars().take(phase.characters.start).collect();
    let after: String = text.chars().skip(phase.characters.end).collect();
    let wave = text.contains("sin(") || text.contains("cos(");
    let kept = before.trim_end().strip_suffix(['+', '-'])?.trim_end();
    (wave && after == ")").then(|| EffectSpec::expression(spec.target.as_deref()?, &format!("{kept}{after}")).ok())?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::filter::estimate::Fit;
    use crate::hypothesis::parameter::free_values;
    use crate::verdict::by_block::ByBlock;
    use crate::weigh::refine::refine_free;
    use cdpr::formula::{Formula, Variable};

    fn value_at(spec: &EffectSpec, x: f64) -> f64 {
        let formula = Formula::parse(spec.expression.as_deref().unwrap()).unwrap();
        formula.value(|variable| if variable == Variable::Pose(0) { x } else { f64::NAN })
    }

    #[test]
    fn two_waves_of_one_frequency_become_one_with_the_same_values() {
        for (sine, cosine, number, middle) in
            [(900.0, 0.0, 2.5, 0.0), (-3.0, 4.0, 0.7, 12.3), (0.1, -30.0, 1.3, -880.0), (-2.0, -2e-9, 1.0, 0.0)]
        {
            let spec = wave("platform.force_x", "x", [sine, cosine], number, middle).unwrap();
            let text = spec.expression.clone().unwrap();
            assert_eq!(text.matches("sin(").count() + text.matches("cos(").count(), 1, "{text}");
            for x in [-3.0, 0.4, 7.7] {
                let angle: f64 = number * (x - middle);
                let wanted = sine * angle.sin() + cosine * angle.cos();
                let size = sine.hypot(cosine);
                assert!((value_at(&spec, x) - wanted).abs() < 1e-6 * size, "{text} at {x}: {wanted}");
            }
        }
        let text = |sine, cosine| wave("winch[1]", "time", [sine, cosine], 2.5, 0.0).unwrap().expression.unwrap();
        assert_eq!(text(900.0, 0.0), "900*sin(2.5*time)");
        assert_eq!(text(0.0, -900.0), "-900*cos(2.5*time)");
    }

    #[test]
    fn a_number_of_a_term_is_exchanged_with_its_sign() {
        let exchanged = |text: &str, at, value| with_number(text, at, value);
        assert_eq!(exchanged("3*x", 0, 4.5), "4.5*x");
        assert_eq!(exchanged("3*x", 0, -4.5), "-4.5*x");
        assert_eq!(exchanged("-3*x", 0, -4.5), "4.5*x");
        assert_eq!(exchanged("3*sin(2*x + 0.1)", 2, -0.2), "3*sin(2*x - 0.2)");
        assert_eq!(exchanged("3*sin(2*x - 0.1)", 2, -0.2), "3*sin(2*x + 0.2)");
        assert_eq!(exchanged("3*sin(2*x)", 1, -2.0), "3*sin(-2*x)");
        assert_eq!(exchanged("3*sin(-2*x)", 1, -2.0), "3*sin(2*x)");
        assert_eq!(literal(1.5e-7), "1.5e-7");
    }

    #[test]
    fn only_the_offset_of_a_wave_is_left_out() {
        let plain = |text: &str| without_phase(&EffectSpec::expression("winch[2]", text).unwrap());
        assert_eq!(plain("3*sin(2*x + 0.1)").unwrap().expression.unwrap(), "3*sin(2*x)");
        assert!(plain("3*sin(2*x)").is_none());
        assert!(plain("3*x*(2 + 0.1)").is_none());
    }

    /// A wave along x that was taken up a little wrong, in amplitude, number and phase, comes out with its errors.
    #[test]
    fn the_numbers_of_a_term_have_errors_that_hold() {
        let truth = EffectSpec::expression("platform.force_x", "90*sin(1.5*x)").unwrap();
        let trials = [record(&[truth], 40.0, 8)];
        let rough = EffectSpec::expression("platform.force_x", "88*sin(1.503*x + 0.01)").unwrap();
        let mut fit: Fit = fitted(&[rough], &trials);
        let free = free_values(&fit.model, 0);
        assert_eq!(free.len(), 3);
        refine_free(&mut fit, &trials, &free, 10, None).unwrap();
        let errors = ByBlock::new(&fit, &trials, 0).standard_errors(&fit.model);
        let found = values(&fit.model.effects[0]);
        let text = fit.model.effects[0].expression.clone().unwrap();
        let phase = if text.contains(" - ") { -found[2] } else { found[2] };
        for ((value, (_, error)), true_value) in
            [found[0], found[1], phase].into_iter().zip(&errors).zip([90.0, 1.5, 0.0])
        {
            assert!(*error > 0.0 && (value - true_value).abs() < 4.0 * error, "{text}: {value} ± {error}");
        }
        assert!(errors[0].1 < 5.0, "{errors:?}");
    }
}
