//! The units of the table, with the dimension read off the name.

use fmi2_export::description::Unit;

/// Degrees in a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// The unit of this name: factors joined by `.`, at most one `/`, powers as trailing digits (`N.s2/m2`).
///
/// `None` where a symbol is not one of mechanics.
pub(super) fn unit(name: &str) -> Option<Unit> {
    let (above, below) = name.split_once('/').unwrap_or((name, "1"));
    let mut sum = [0; 4];
    for (side, sign) in [(above, 1), (below, -1)] {
        for factor in side.split('.') {
            let symbol = factor.trim_end_matches(|c: char| c.is_ascii_digit());
            let power: i32 = match &factor[symbol.len()..] {
                "" => 1,
                _ if symbol.is_empty() => 0,
                digits => digits.parse().ok()?,
            };
            let dimension = dimension(if symbol.is_empty() { factor } else { symbol })?;
            for (sum, exponent) in sum.iter_mut().zip(dimension) {
                *sum += sign * power * exponent;
            }
        }
    }
    let [kg, m, s, rad] = sum;
    let unit = Unit::mechanical(name, kg, m, s, rad);
    Some(match name {
        "rad" => unit.display("deg", DEGREES),
        "rad/s" => unit.display("deg/s", DEGREES),
        "N" => unit.display("kN", 1e-3),
        "Pa" => unit.display("GPa", 1e-9),
        "m2" => unit.display("cm2", 1e4),
        _ => unit,
    })
}

/// The unit that values are shown in where it differs from the unit itself.
pub(super) fn display(unit: &str) -> Option<&'static str> {
    match unit {
        "rad" => Some("deg"),
        "rad/s" => Some("deg/s"),
        _ => None,
    }
}

/// Exponents of kg, m, s, rad.
fn dimension(symbol: &str) -> Option<[i32; 4]> {
    Some(match symbol {
        "1" => [0; 4],
        "kg" => [1, 0, 0, 0],
        "m" => [0, 1, 0, 0],
        "s" => [0, 0, 1, 0],
        "rad" => [0, 0, 0, 1],
        "N" => [1, 1, -2, 0],
        "Pa" => [1, -1, -2, 0],
        "W" => [1, 2, -3, 0],
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_follow_from_the_name() {
        for (name, expected) in [
            ("1", [0, 0, 0, 0]),
            ("N.s2/m2", [1, -1, 0, 0]),
            ("kg.m2", [1, 2, 0, 0]),
            ("N.m.s", [1, 2, -1, 0]),
            ("W", [1, 2, -3, 0]),
            ("rad/s2", [0, 0, -2, 1]),
            ("1/s", [0, 0, -1, 0]),
        ] {
            let base = unit(name).unwrap().base.unwrap();
            assert_eq!([base.kg, base.m, base.s, base.rad], expected, "{name}");
        }
        assert!(unit("furlong").is_none());
    }

    #[test]
    fn every_unit_of_the_catalogue_is_known() {
        for effect in crate::effect::CATALOGUE {
            for parameter in effect.parameters {
                assert!(unit(parameter.unit).is_some(), "{} {}: {}", effect.id, parameter.name, parameter.unit);
            }
        }
    }
}
