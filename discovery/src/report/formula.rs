//! Terms as a person reads them.

use super::number::{plain, rounded, with_error};

/// A term as a person reads it, its numbers with their standard errors: `(900 ± 12)·sin((2.5000 ± 0.0012)·x)`.
#[must_use]
pub fn term(expression: &str, errors: &[f64]) -> String {
    let mut errors = errors.iter().copied();
    signs(&read(expression, |value| match errors.next().filter(|error| error.is_finite()) {
        Some(error) => format!("({})", with_error(value, Some(error))),
        None => plain(value),
    }))
}

/// The numbers of a term that have standard errors, with them.
pub(super) fn numbers(expression: &str, errors: &[f64]) -> Vec<String> {
    let mut list = Vec::new();
    read(expression, |value| {
        list.push(value);
        String::new()
    });
    let known = list.into_iter().zip(errors).filter(|(_, error)| error.is_finite());
    known.map(|(value, error)| with_error(value, Some(*error))).collect()
}

/// An expression as a person reads it: numbers to the digits that their errors allow, or four, a proper minus sign and
/// multiplication dot.
#[must_use]
pub fn printed(expression: &str, errors: &[f64]) -> String {
    let mut errors = errors.iter().copied();
    signs(&read(expression, |value| rounded(value, errors.next())))
}

/// With a proper minus sign and multiplication dot.
fn signs(expression: &str) -> String {
    expression.replace('-', "−").replace("**", "^").replace('*', "·")
}

/// The expression with every number that is no exponent as `number` writes it.
fn read(expression: &str, mut number: impl FnMut(f64) -> String) -> String {
    let mut text = String::with_capacity(expression.len());
    let mut rest = expression;
    while let Some(c) = rest.chars().next() {
        // Digits within a name or an index are none of a number.
        let inside = text.ends_with(|p: char| p.is_alphanumeric() || p == '_' || p == '[');
        let length = if c.is_ascii_digit() && !inside { number_at(rest) } else { 0 };
        let power = text.trim_end().ends_with('^');
        if power && length > 0 {
            text.push_str(&rest[..length]);
            rest = &rest[length..];
        } else if let Ok(value) = rest[..length].parse::<f64>() {
            text.push_str(&number(value));
            rest = &rest[length..];
        } else {
            text.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    text
}

/// Length of the number that `text` begins with, an exponent included.
fn number_at(text: &str) -> usize {
    let digits = |from: usize| from + text[from..].bytes().take_while(|b| b.is_ascii_digit() || *b == b'.').count();
    let end = digits(0);
    let exponent = text[end..].strip_prefix(['e', 'E']).map(|rest| {
        let sign = usize::from(rest.starts_with(['-', '+']));
        (end + 1 + sign, digits(end + 1 + sign))
    });
    match exponent {
        Some((first, last)) if last > first => last,
        _ => end,
    }
}
