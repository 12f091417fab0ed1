//! Numbers as a person reads them.

/// Minus sign as printed.
const MINUS: &str = "\u{2212}";
/// Narrow space that does not break.
const THIN: char = '\u{202f}';
/// Space that does not break.
const NBSP: char = '\u{a0}';
/// Most digits of a number, however small its error.
const MOST_DIGITS: i32 = 9;

/// `value` to `digits` significant digits: `0.0341`, `−812`, `15 200 000`, `3.2×10⁻⁶`.
#[must_use]
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_of(value, digits);
    if !(-4..8).contains(&exponent) {
        return scientific(value, exponent, digits - 1);
    }
    decimals(value, digits - 1 - exponent)
}

/// `value` to four significant digits without zeros at the end: `5`, `0.5`, `31.5`.
pub(crate) fn plain(value: f64) -> String {
    trimmed(significant(value, 4))
}

/// `value` to the second digit of its `error`, without zeros at the end; like [`plain`] where it has none.
pub(super) fn rounded(value: f64, error: Option<f64>) -> String {
    match error.filter(|e| e.is_finite() && *e > 0.0) {
        Some(error) => {
            let last = exponent_of(error, 2) - 1;
            trimmed(significant(value, (exponent_of(value, 1) - last + 1).clamp(1, MOST_DIGITS)))
        }
        None => plain(value),
    }
}

/// Without zeros after the point at the end.
fn trimmed(text: String) -> String {
    match text.split_once('.') {
        Some((whole, fraction)) if fraction.chars().all(|c| c.is_ascii_digit()) => {
            match fraction.trim_end_matches('0') {
                "" => whole.to_owned(),
                rest => format!("{whole}.{rest}"),
            }
        }
        _ => text,
    }
}

/// `value ± error` with the error to two significant digits and both to the same place: `251.2 ± 1.9`.
pub(crate) fn with_error(value: f64, error: Option<f64>) -> String {
    let Some(error) = error.filter(|e| e.is_finite() && *e > 0.0) else {
        return significant(value, 4);
    };
    let last = exponent_of(error, 2) - 1; // power of ten of the last digit shown
    let lead = exponent_of(value.abs().max(error), 2);
    if !(-4..8).contains(&lead) {
        let scale = 10f64.powi(lead);
        let places = lead - last;
        return format!("({} ± {}){}", decimals(value / scale, places), decimals(error / scale, places), power(lead));
    }
    format!("{} ± {}", decimals(value, -last), decimals(error, -last))
}

/// A fitted number with its unit; a pure number called `factor` is a relative change and is shown in per cent.
#[must_use]
pub fn quantity(name: &str, value: f64, error: Option<f64>, unit: &str) -> String {
    match unit {
        "1" | "" if name == "factor" => {
            let text = with_error(100.0 * value, error.map(|e| 100.0 * e));
            // A bare value is a change; with an error bar the sign is there where it matters.
            format!("{text}{NBSP}%")
        }
        "1" | "" => with_error(value, error),
        unit => format!("{}{NBSP}{}", with_error(value, error), unit_text(unit)),
    }
}

/// A size to two digits with its unit; of a relative change in per cent.
pub(super) fn rough(name: &str, value: f64, unit: &str) -> String {
    match unit {
        "1" | "" if name == "factor" => format!("{}{NBSP}%", significant(100.0 * value, 2)),
        "1" | "" => significant(value, 2),
        unit => format!("{}{NBSP}{}", significant(value, 2), unit_text(unit)),
    }
}

/// The unit with spaces that do not break.
pub(super) fn unit_text(unit: &str) -> String {
    unit.replace(' ', &NBSP.to_string())
}

/// A share between 0 and 1 in per cent.
pub(super) fn percent(share: f64) -> String {
    let text = if share > 0.0 && share < 0.005 { "<1".to_owned() } else { decimals(100.0 * share, 0) };
    format!("{text}{NBSP}%")
}

/// A correlation: `0.86`, and nearer to 1 only where it is: `0.9994`, `> 0.9999`.
pub(super) fn correlation(value: f64) -> String {
    let off = 1.0 - value.abs();
    let sign = if value < 0.0 { MINUS } else { "" };
    match off {
        off if off < 1e-4 && value > 0.0 => format!(">{NBSP}0.9999"),
        off if off < 1e-4 => format!("<{NBSP}{MINUS}0.9999"),
        off if off < 5e-3 => format!("{sign}{:.4}", (1e4 * value.abs()).floor() / 1e4),
        _ => decimals(value, 2),
    }
}

/// A gap: `39.5`, `1.04`, `0.98`.
#[must_use]
pub fn gap(value: f64) -> String {
    if value.is_finite() && value.abs() < 10.0 { decimals(value, 2) } else { significant(value, 3) }
}

/// `value` with a fixed number of decimals (negative rounds to tens, hundreds, ...), thousands set apart.
pub(super) fn decimals(value: f64, places: i32) -> String {
    let rounded = if places < 0 {
        let unit = 10f64.powi(-places);
        format!("{:.0}", (value / unit).round() * unit)
    } else {
        format!("{value:.*}", places as usize)
    };
    let (sign, digits) = match rounded.strip_prefix('-') {
        Some(rest) if rest.chars().any(|c| c.is_ascii_digit() && c != '0') => (MINUS, rest),
        Some(rest) => ("", rest),
        None => ("", rounded.as_str()),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mut text = sign.to_owned();
    for (i, digit) in whole.chars().enumerate() {
        let left = whole.len() - i;
        if i > 0 && left % 3 == 0 && whole.len() > 4 {
            text.push(THIN);
        }
        text.push(digit);
    }
    if !fraction.is_empty() {
        text.push('.');
        text.push_str(fraction);
    }
    text
}

/// Power of ten of the first digit after rounding to `digits` significant digits.
fn exponent_of(value: f64, digits: i32) -> i32 {
    if value == 0.0 {
        return 0;
    }
    let raw = value.abs().log10().floor() as i32;
    let places = digits - 1 - raw;
    let rounded = (value.abs() * 10f64.powi(places)).round() / 10f64.powi(places);
    rounded.log10().floor().max(f64::from(raw)) as i32
}

fn scientific(value: f64, exponent: i32, places: i32) -> String {
    format!("{}{}", decimals(value / 10f64.powi(exponent), places), power(exponent))
}

fn power(exponent: i32) -> String {
    let mut text = "×10".to_owned();
    for c in exponent.to_string().chars() {
        text.push(match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_errors_share_their_last_digit() {
        assert_eq!(with_error(251.234, Some(1.91)), "251.2 ± 1.9");
        assert_eq!(with_error(-0.03412, Some(0.0021)), "−0.0341 ± 0.0021");
        assert_eq!(with_error(251.234, Some(0.0999)), "251.23 ± 0.10");
        assert_eq!(with_error(15_213_000.0, Some(42_000.0)), "15\u{202f}213\u{202f}000 ± 42\u{202f}000");
        assert_eq!(with_error(3.21e-6, Some(1.2e-7)), "(3.21 ± 0.12)×10⁻⁶");
        assert_eq!(with_error(0.0, Some(0.5)), "0.00 ± 0.50");
        assert_eq!(with_error(2.5, None), "2.500");
    }

    #[test]
    fn a_number_in_a_law_has_the_digits_its_error_allows() {
        assert_eq!(rounded(899.876, Some(12.0)), "900");
        assert_eq!(rounded(2.499_961, Some(0.0012)), "2.5");
        assert_eq!(rounded(2.499_961, Some(1.2e-5)), "2.499961");
        assert_eq!(rounded(0.031_41, None), "0.03141");
        assert_eq!(rounded(-3.499e-7, Some(2e-9)), "−3.499×10⁻⁷");
        assert_eq!(rounded(0.004, Some(0.2)), "0.004");
    }

    #[test]
    fn significant_digits_and_signs() {
        assert_eq!(significant(-812.4, 3), "−812");
        assert_eq!(significant(0.00999, 2), "0.010");
        assert_eq!(significant(1.5e12, 2), "1.5×10¹²");
        assert_eq!(significant(f64::NAN, 3), "–");
        assert_eq!(plain(5.0), "5");
        assert_eq!(plain(31.5), "31.5");
        assert_eq!(plain(100.0), "100");
        assert_eq!(decimals(-0.04, 1), "0.0");
        assert_eq!(decimals(12_345.6, 0), "12\u{202f}346");
        assert_eq!(decimals(1234.0, -2), "1200");
    }

    #[test]
    fn factors_are_shown_in_per_cent() {
        assert_eq!(quantity("factor", -0.031, Some(0.002), "1"), "−3.10 ± 0.20\u{a0}%");
        assert_eq!(quantity("loss", 0.031, Some(0.002), "1"), "0.0310 ± 0.0020");
        assert_eq!(quantity("force", 1.0, Some(0.1), "N s"), "1.00 ± 0.10\u{a0}N\u{a0}s");
    }

    #[test]
    fn correlations_near_one_do_not_become_one() {
        assert_eq!(correlation(0.8612), "0.86");
        assert_eq!(correlation(-0.004), "0.00");
        assert_eq!(correlation(0.99937), "0.9993");
        assert_eq!(correlation(-0.999_85), "−0.9998");
        assert_eq!(correlation(0.999_95), ">\u{a0}0.9999");
        assert_eq!(correlation(-1.0), "<\u{a0}−0.9999");
    }

    #[test]
    fn gaps_near_the_noise_floor_keep_two_decimals() {
        assert_eq!(gap(1.0423), "1.04");
        assert_eq!(gap(39.51), "39.5");
        assert_eq!(percent(0.83), "83\u{a0}%");
        assert_eq!(percent(0.001), "<1\u{a0}%");
    }
}
