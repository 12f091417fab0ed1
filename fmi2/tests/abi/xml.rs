//! The oscillator's XML, as a whole.

use std::path::Path;

use crate::oscillator::Oscillator;

/// `UPDATE_GOLDEN=1 cargo test` rewrites the file after an intended change.
#[test]
fn the_description_is_the_golden_file() {
    let table = Oscillator::table();
    table.validate().unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/abi/oscillator.xml");
    let xml = table.to_xml();
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&path, &xml).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    assert_eq!(xml, golden.replace("\r\n", "\n"));
}
