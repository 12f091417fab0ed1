//! Numbers on the command line.

/// A finite number greater than 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match finite(text)? {
        number if number > 0.0 => Ok(number),
        number => Err(format!("{number} is not greater than 0")),
    }
}

/// A finite number.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(number) => Err(format!("{number} is not finite")),
        Err(_) => Err("expected a number".to_owned()),
    }
}

/// A pose `X,Y,PHI` (m, m, rad).
pub(crate) fn pose(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(finite).collect::<Result<Vec<f64>, String>>()?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| format!("{count} numbers, expected X,Y,PHI in m, m, rad"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_have_three_numbers() {
        assert_eq!(pose("1, -2.5,0.1"), Ok([1.0, -2.5, 0.1]));
        for text in ["1,2", "1,2,3,4", "1,2,", "1,2,x", "1,2,inf"] {
            assert!(pose(text).is_err(), "{text}");
        }
    }

    #[test]
    fn positive_numbers_are_positive() {
        assert_eq!(positive("1e-3"), Ok(1e-3));
        for text in ["0", "-1", "nan", "inf", "soon"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }
}
