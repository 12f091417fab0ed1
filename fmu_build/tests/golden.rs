//! `modelDescription/modelDescription.xml` is what the default model's FMU says of itself.
//!
//! After a wanted change of the interface: `UPDATE_GOLDEN=1 cargo test -p cdpr-fmu-build --test golden`.

use std::path::Path;
use std::{env, fs};

use cdpr_fmu_build::cable_platform;

#[test]
fn the_description_is_the_golden_file() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../modelDescription/modelDescription.xml");
    let written = cable_platform::fmu("").unwrap().xml();
    if env::var_os("UPDATE_GOLDEN").is_some() {
        fs::write(&file, &written).unwrap();
    }
    let golden = fs::read_to_string(&file).unwrap().replace("\r\n", "\n");
    for (number, (found, expected)) in written.lines().zip(golden.lines()).enumerate() {
        assert_eq!(found, expected, "line {} of {}", number + 1, file.display());
    }
    assert_eq!(written.lines().count(), golden.lines().count());
}
