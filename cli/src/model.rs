//! The model that a command works on.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use cdpr::model_file::Model;

use crate::failure::BadInput;

/// The model file's text and model; of the default model without a file.
pub(crate) fn read(path: Option<&Path>) -> anyhow::Result<(String, Model)> {
    let Some(path) = path else {
        let model = Model::default();
        return Ok((model.to_toml(), model));
    };
    let text = fs::read_to_string(path).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => BadInput::in_file(path, "not a text, expected a model file in UTF-8"),
        _ => BadInput::in_file(path, error),
    })?;
    let model = Model::from_toml(&text).map_err(|error| BadInput::in_file(path, error))?;
    Ok((text, model))
}

/// Makes sure that a folder is there.
pub(crate) fn folder(path: &Path) -> Result<(), BadInput> {
    fs::create_dir_all(path).map_err(|error| BadInput::in_file(path, format!("the folder cannot be made: {error}")))
}
