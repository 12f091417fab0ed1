//! Files to be written: what their names promise, and that no two are the same.

use std::path::{Path, PathBuf};

use cdpr_fmu_build::whole_file;
use clap::builder::{PathBufValueParser, TypedValueParser};

use crate::failure::BadInput;

/// Endings that promise something else than a table with commas.
const NO_TABLE: [&str; 19] = [
    "fmu", "gif", "h5", "hdf5", "html", "jpeg", "jpg", "json", "mat", "ods", "parquet", "pdf", "png", "svg", "toml",
    "tsv", "xls", "xlsx", "zip",
];

/// A table, for `value_parser`: text, which goes by many endings.
pub(crate) fn table() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path: PathBuf| match ending(&path) {
        Some(found) if NO_TABLE.contains(&found.as_str()) => Err(refusal(&found, &["csv"])),
        _ => Ok(path),
    })
}

/// A picture.
pub(crate) fn picture() -> impl TypedValueParser<Value = PathBuf> {
    ending_in(&["svg", "png"])
}

/// A model file.
pub(crate) fn model() -> impl TypedValueParser<Value = PathBuf> {
    ending_in(&["toml"])
}

/// A JSON file.
pub(crate) fn json() -> impl TypedValueParser<Value = PathBuf> {
    ending_in(&["json"])
}

/// An FMU.
pub(crate) fn fmu() -> impl TypedValueParser<Value = PathBuf> {
    ending_in(&["fmu"])
}

/// A path whose ending, where it has one, is one of these: a file is what it is called.
fn ending_in(endings: &'static [&'static str]) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path: PathBuf| match ending(&path) {
        Some(found) if !endings.contains(&found.as_str()) => Err(refusal(&found, endings)),
        _ => Ok(path),
    })
}

fn refusal(found: &str, endings: &[&str]) -> String {
    let expected = endings.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
    format!("the name ends in .{found}, expected {expected}")
}

/// The ending of a file's name in small letters, without its dot.
pub(crate) fn ending(path: &Path) -> Option<String> {
    Some(path.extension()?.to_string_lossy().to_lowercase())
}

/// A picture as its name says: PNG, or SVG as it is.
pub(crate) fn drawn(svg: String, path: &Path) -> anyhow::Result<Vec<u8>> {
    match ending(path).as_deref() {
        Some("png") => cdpr_paper::png(&svg).map_err(|what| anyhow::anyhow!("{}: {what}", path.display())),
        _ => Ok(svg.into_bytes()),
    }
}

/// Makes sure that no file is written twice: one would replace the other.
pub(crate) fn distinct(outputs: &[(&str, Option<&PathBuf>)]) -> Result<(), BadInput> {
    let given: Vec<(&str, &PathBuf)> = outputs.iter().filter_map(|(name, path)| Some((*name, (*path)?))).collect();
    for (k, (name, path)) in given.iter().enumerate() {
        let place = whole_file::destination(path);
        if let Some((other, _)) = given[..k].iter().find(|(_, before)| whole_file::destination(before) == place) {
            let path = path.display();
            return Err(BadInput(format!("{other} and {name} are both {path}, expected two different files")));
        }
    }
    Ok(())
}
