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
    list(text, "X,Y,PHI in m, m, rad")
}

/// An area by its lower left and upper right corner (m).
pub(crate) fn area(text: &str) -> Result<[[f64; 2]; 2], String> {
    let [left, bottom, right, top] = list(text, "X0,Y0,X1,Y1 in m")?;
    if left < right && bottom < top {
        Ok([[left, bottom], [right, top]])
    } else {
        Err(format!(
            "from ({left}, {bottom}) to ({right}, {top}) m, expected the lower left corner, then the upper right"
        ))
    }
}

/// Orientations (rad).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Orientations(pub(crate) Vec<f64>);

/// Equally spaced orientations `FROM,TO,COUNT` (rad, rad, 1).
pub(crate) fn orientations(text: &str) -> Result<Orientations, String> {
    let [from, to, count] = list(text, "FROM,TO,COUNT in rad, rad and a number of angles")?;
    if from >= to {
        return Err(format!("from {from} to {to} rad, expected the smaller angle first"));
    }
    if !(2.0..=1e4).contains(&count) || count.fract() != 0.0 {
        return Err(format!("{count} angles, expected 2 to 10000 of them"));
    }
    Ok(Orientations((0..count as u32).map(|k| from + (to - from) * f64::from(k) / (count - 1.0)).collect()))
}

fn list<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(finite).collect::<Result<Vec<f64>, String>>()?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| format!("{count} numbers, expected {expected}"))
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
    fn areas_and_orientations_go_upwards() {
        assert_eq!(area("-1,0,2,3"), Ok([[-1.0, 0.0], [2.0, 3.0]]));
        assert_eq!(orientations("-0.5,0.5,3"), Ok(Orientations(vec![-0.5, 0.0, 0.5])));
        for text in ["2,0,-1,3", "0,1,2,1", "0,1,2"] {
            assert!(area(text).is_err(), "{text}");
        }
        for text in ["0.5,-0.5,3", "0,1,1", "0,1,2.5", "0,1,1e9", "0,1"] {
            assert!(orientations(text).is_err(), "{text}");
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
