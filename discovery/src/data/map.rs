//! Where our columns come from in a table from elsewhere.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use toml::{Spanned, Value};

use super::units::{Quantity, all_units, unit};
use super::{Channel, DataError, Lines};

/// Renames columns and converts units.
///
/// ```toml
/// time = { column = "t_ms", unit = "ms" }
/// x = { column = "pos_x", unit = "mm" }
/// "winch_force[1]" = { column = "F1", unit = "kN" }
/// "winch_force[2]" = { column = "I2", unit = "A", scale = 85.0 }
/// "tension[1]" = { column = "LC1", scale = 9.80665, offset = -12.0 }
/// y = "pos_y"
/// ```
///
/// The value used is `scale · theirs + offset`, in SI; `unit` stands for the scale that makes it SI. A unit of another
/// quantity (a current for a force) needs a `scale` as well: how much of ours one of it is.
#[derive(Clone, Debug, Default)]
pub struct ColumnMap(BTreeMap<String, Source>);

/// Where one of our columns comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Source {
    /// Their name of it.
    pub(crate) column: String,
    /// How much of ours one of theirs is.
    pub(crate) scale: f64,
    /// What is added then, in our unit.
    pub(crate) offset: f64,
}

const KEYS: [&str; 4] = ["column", "unit", "scale", "offset"];

/// Every column that a recording of a robot with so many cables may have.
pub(crate) fn known_columns(cables: usize) -> Vec<String> {
    let mut names = vec!["time".to_owned()];
    names.extend((1..=cables).map(|i| format!("winch_force[{i}]")));
    names.extend(["disturbance_force_x", "disturbance_force_y", "disturbance_torque"].map(str::to_owned));
    names.extend(Channel::all(cables).iter().map(|c| c.name()));
    names
}

impl ColumnMap {
    /// Reads a map file for recordings of a robot with so many cables.
    ///
    /// # Errors
    /// Syntax, unknown names, keys or units, with the line, what was found and expected.
    pub fn read(path: &Path, cables: usize) -> Result<Self, DataError> {
        let error = |line, message| DataError { path: path.to_owned(), line, message };
        let mut text = String::new();
        let read = Lines::open(path).and_then(|mut lines| lines.read_to_string(&mut text));
        read.map_err(|e| error(None, e.to_string()))?;
        Self::parse(&text, cables).map_err(|(line, message)| error(line, message))
    }

    /// As [`ColumnMap::read`], from text; an error has its line and message.
    fn parse(text: &str, cables: usize) -> Result<Self, (Option<u64>, String)> {
        let line = |at: usize| Some(text.as_bytes()[..at].iter().filter(|b| **b == b'\n').count() as u64 + 1);
        let entries: BTreeMap<String, Spanned<Value>> = toml::from_str(text).map_err(|e| {
            let at = e.span().map(|span| span.start.min(text.len()));
            let hint = if e.message().contains('[') { "; names with brackets stand in quotation marks" } else { "" };
            (at.and_then(line), format!("{}{hint}", e.message()))
        })?;
        let known = known_columns(cables);
        let mut map = Self::default();
        for (name, entry) in entries {
            let line = line(entry.span().start);
            if !known.contains(&name) {
                let message = format!("`{name}` is no column of ours, expected one of {}", known.join(", "));
                return Err((line, message));
            }
            let source = source(&name, entry.into_inner()).map_err(|message| (line, message))?;
            if let Some((other, _)) = map.0.iter().find(|(_, known)| known.column == source.column) {
                let message = format!(
                    "column `{}` is given for `{other}` and for `{name}`, expected a column for each",
                    source.column
                );
                return Err((line, message));
            }
            map.0.insert(name, source);
        }
        Ok(map)
    }

    /// Where one of our columns comes from.
    pub(crate) fn source(&self, name: &str) -> Source {
        let own = || Source { column: name.to_owned(), scale: 1.0, offset: 0.0 };
        self.0.get(name).cloned().unwrap_or_else(own)
    }

    /// Our names of the columns that the map gives.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

/// One entry, the column's name or a table.
fn source(name: &str, entry: Value) -> Result<Source, String> {
    let table = match entry {
        Value::String(column) => return Ok(Source { column, scale: 1.0, offset: 0.0 }),
        Value::Table(table) => table,
        other => {
            let kind = other.type_str();
            return Err(format!(
                "`{name}` is of type {kind}, expected a column's name or {{ column = \"...\", unit = \"...\" }}"
            ));
        }
    };
    if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
        return Err(format!("`{name}` has an unknown key `{key}`, expected {}", KEYS.join(", ")));
    }
    let text = |key: &str| match table.get(key) {
        None => Ok(None),
        Some(Value::String(text)) => Ok(Some(text.as_str())),
        Some(other) => Err(format!("`{key}` of `{name}` is {other}, expected text")),
    };
    let number = |key: &str| {
        let value = match table.get(key) {
            None => return Ok(None),
            Some(Value::Float(value)) => *value,
            Some(Value::Integer(value)) => *value as f64,
            Some(other) => return Err(format!("`{key}` of `{name}` is {other}, expected a number")),
        };
        if !value.is_finite() {
            return Err(format!("`{key}` of `{name}` is {value}, expected a finite number"));
        }
        Ok(Some(value))
    };
    let column = text("column")?.ok_or_else(|| format!("`{name}` has no `column`, expected the name of one"))?;
    let scale = number("scale")?;
    if scale == Some(0.0) {
        return Err(format!("`scale` of `{name}` is 0, expected another number"));
    }
    let quantity = Quantity::of(name);
    let factor = match text("unit")? {
        None => 1.0,
        Some(given) => match unit(given) {
            None => {
                return Err(format!("unit of `{name}` is {given:?}, expected one of {}", all_units()));
            }
            Some((found, factor)) if found == quantity || scale.is_some() => factor,
            Some(_) => {
                return Err(format!(
                    "unit of `{name}` is {given:?}, expected one of {}; or with it a `scale`: how many {} one {given} is",
                    quantity.units(),
                    quantity.si(),
                ));
            }
        },
    };
    let offset = number("offset")?.unwrap_or(0.0);
    Ok(Source { column: column.to_owned(), scale: factor * scale.unwrap_or(1.0), offset })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        let (line, message) = ColumnMap::parse(text, 4).unwrap_err();
        format!("{}: {message}", line.unwrap_or(0))
    }

    #[test]
    fn units_of_a_map_are_si_in_the_end() {
        let map = ColumnMap::parse(
            "x = \"pos\"\nphi = { column = \"a\", unit = \"degrees\" }\ntime = { column = \"t\", unit = \"ms\" }\n\
             \"winch_force[1]\" = { column = \"I1\", unit = \"A\", scale = 85, offset = -3 }\n",
            4,
        )
        .unwrap();
        assert_eq!(map.source("x"), Source { column: "pos".into(), scale: 1.0, offset: 0.0 });
        assert!((map.source("phi").scale * 180.0 - std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(map.source("time").scale, 1e-3);
        assert_eq!(map.source("winch_force[1]"), Source { column: "I1".into(), scale: 85.0, offset: -3.0 });
        assert_eq!(map.source("y").column, "y");
    }

    #[test]
    fn an_unknown_key_of_a_map_is_named_with_its_line() {
        let found = message("y = \"b\"\nx = { column = \"a\", units = \"mm\" }\n");
        assert_eq!(found, "2: `x` has an unknown key `units`, expected column, unit, scale, offset");
    }

    #[test]
    fn what_a_map_says_wrongly_is_said() {
        for (text, part) in [
            ("z = \"a\"", "1: `z` is no column of ours, expected one of time, winch_force[1]"),
            ("x = 3", "1: `x` is of type integer, expected a column's name"),
            ("x = { unit = \"mm\" }", "`x` has no `column`"),
            ("x = { column = \"a\", unit = \"furlong\" }", "is \"furlong\", expected one of s, ms"),
            ("x = { column = \"a\", unit = \"kN\" }", "is \"kN\", expected one of m, mm"),
            ("\"tension[1]\" = { column = \"a\", unit = \"A\" }", "or with it a `scale`: how many N one A is"),
            ("x = { column = \"a\", scale = 0 }", "`scale` of `x` is 0"),
            ("x = { column = \"a\", offset = nan }", "`offset` of `x` is NaN"),
            ("x = { column = \"a\", scale = \"2\" }", "`scale` of `x` is \"2\", expected a number"),
            ("x = \"a\"\ny = \"a\"", "2: column `a` is given for `x` and for `y`"),
            ("x = \"a\"\nwinch_force[1] = \"F\"", "2: "),
        ] {
            assert!(message(text).contains(part), "{text}: {}", message(text));
        }
    }
}
