//! The plant's FMU, packed for real.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Cursor, Read};
use std::path::Path;

use cdpr::fmi2::CablePlatform;
use cdpr_fmu_build::{Binary, FUNCTIONS, Fmu, PackError, Platform, cable_platform};
use zip::ZipArchive;

fn binary() -> Binary {
    cable_platform::host_binary().unwrap()
}

fn default_fmu() -> Fmu {
    cable_platform::fmu("").unwrap().binary(binary()).unwrap()
}

/// The archive's files by path.
fn unpacked(bytes: &[u8]) -> BTreeMap<String, Vec<u8>> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    (0..archive.len())
        .map(|index| {
            let mut file = archive.by_index(index).unwrap();
            let mut content = Vec::new();
            file.read_to_end(&mut content).unwrap();
            (file.name().unwrap().into_owned(), content)
        })
        .collect()
}

#[test]
fn the_archive_holds_what_an_importer_and_a_reader_need() {
    let model = "platform_mass = 3000.0\n[[effect]]\nid = \"winch_coulomb_friction\"\ncable = 3\nforce = 250.0\n";
    let fmu = cable_platform::fmu(model).unwrap().binary(binary()).unwrap();
    let files = unpacked(&fmu.to_bytes().unwrap());
    let host = Platform::host().unwrap();
    let library = format!("binaries/{}/CablePlatform.{}", host.folder(), host.extension());
    let paths: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(
        paths,
        [
            library.as_str(),
            "documentation/index.html",
            "documentation/licenses/LICENSE-APACHE.txt",
            "documentation/licenses/LICENSE-MIT.txt",
            "documentation/licenses/third-party.txt",
            "model.png",
            "modelDescription.xml",
            "resources/model.toml",
        ]
    );
    assert_eq!(files[&library], binary().bytes());
    assert_eq!(files["resources/model.toml"], model.as_bytes());
    assert_eq!(files["modelDescription.xml"], fmu.xml().as_bytes());
    assert!(files["model.png"].starts_with(b"\x89PNG\r\n\x1a\n"));
    let page = String::from_utf8(files["documentation/index.html"].clone()).unwrap();
    for variable in &fmu.description().variables {
        assert!(page.contains(&format!("<code>{}</code>", variable.name)), "{}", variable.name);
    }
    assert!(page.contains("force = 250.0 N") && page.contains("cable 3"));
    let notices = String::from_utf8(files["documentation/licenses/third-party.txt"].clone()).unwrap();
    for library in ["nalgebra 0.", "serde 1.", "toml 1.", "Permission is hereby granted"] {
        assert!(notices.contains(library), "{library}");
    }
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let first = default_fmu().to_bytes().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(2100)); // zip counts time in steps of two seconds
    assert!(first == default_fmu().to_bytes().unwrap());
}

#[test]
fn no_folder_of_the_building_machine_is_in_the_binary() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let root = root.to_str().unwrap().as_bytes();
    assert!(!binary().bytes().windows(root.len()).any(|window| window == root));
}

/// Linked by the host it asked for glibc 2.35, and did not load on RHEL 9, Alma 8 or Ubuntu 20.04.
#[test]
fn a_binary_linked_for_an_old_glibc_asks_for_no_newer_one() {
    // What the build script linked for; nothing where zig was not there.
    let Some((major, minor)) = option_env!("CDPR_FMU_GLIBC").and_then(|text| text.split_once('.')) else { return };
    let asked = (major.parse().unwrap(), minor.parse().unwrap());
    assert!(binary().needed_glibc().unwrap() <= asked, "{:?}", binary().needed_glibc());
}

#[test]
fn the_page_tells_what_the_binary_needs() {
    let files = unpacked(&default_fmu().to_bytes().unwrap());
    let page = String::from_utf8(files["documentation/index.html"].clone()).unwrap();
    let host = Platform::host().unwrap().folder();
    let expected = match binary().needed_glibc() {
        Some((major, minor)) => format!("Binaries: {host} (glibc {major}.{minor} or newer)"),
        None => format!("Binaries: {host}"),
    };
    assert!(page.contains(&expected), "{expected}");
}

/// How to change the model, every value of an enumeration, the robot with its cables by number, a loop.
#[test]
fn the_page_answers_what_a_user_of_the_fmu_asks() {
    let files = unpacked(&default_fmu().to_bytes().unwrap());
    let page = String::from_utf8(files["documentation/index.html"].clone()).unwrap();
    for part in [
        "cdpr fmu --model model.toml -o Changed.fmu",
        "<code>rigid</code> (1)",
        "<code>massless_spring</code> (2)",
        "<code>reeled</code> (2)",
        "<code>static_equilibrium</code> (3)",
        "class=\"robot-number\"",
        "13 rad/s",
        "fmu.doStep(k * step, step)",
        "<code>cable_model</code> becomes <code>lumped_mass</code>",
    ] {
        assert!(page.contains(part), "{part} is missing");
    }
    assert!(!page.contains('`'), "Markdown is left");
    assert_eq!(page.matches("class=\"robot-number\"").count(), 4);
}

/// A function that is missing makes the binary unfit, whichever it is.
#[test]
fn a_binary_that_misses_a_function_is_refused() {
    for name in FUNCTIONS {
        let mut bytes = binary().bytes().to_vec();
        // Give the exported name another last letter, wherever it stands as a whole word.
        let mut word = vec![0];
        word.extend(name.bytes());
        word.push(0);
        let last = word.len() - 2;
        let mut changed = 0;
        for start in 0..bytes.len() - word.len() {
            if bytes[start..start + word.len()] == word[..] {
                bytes[start + last] = b'_';
                changed += 1;
            }
        }
        assert!(changed > 0, "{name} stands nowhere in the binary");
        let error = Binary::new(binary().platform(), bytes).unwrap_err();
        let PackError::MissingFunctions { missing, .. } = &error else { panic!("{error}") };
        assert_eq!(missing, &[name]);
    }
}

/// The plant's binary computes its interface from the resources; with another plant's description it refuses.
#[test]
fn a_binary_that_does_not_take_the_description_is_refused() {
    let fmu = Fmu::of::<other_model::Other>([("model.toml", "")]).unwrap().binary(binary()).unwrap();
    let error = fmu.to_bytes().unwrap_err();
    let PackError::DoesNotRun { found, .. } = &error else { panic!("{error}") };
    assert!(found.to_lowercase().contains("guid"), "{found}");
}

#[test]
fn an_fmu_without_a_binary_or_with_two_for_a_platform_is_refused() {
    let fmu = cable_platform::fmu("").unwrap();
    assert!(matches!(fmu.to_bytes(), Err(PackError::NoBinary)));
    let twice = fmu.binary(binary()).unwrap().binary(binary());
    assert!(matches!(twice, Err(PackError::TwoBinaries(_))));
}

#[test]
fn a_broken_model_is_named_and_nothing_is_written() {
    let error = cable_platform::fmu("platform_mass = -1.0").unwrap_err().to_string();
    assert!(error.contains("platform_mass") && error.contains("-1"), "{error}");
    let error = cable_platform::fmu("platform_masss = 1.0").unwrap_err().to_string();
    assert!(error.contains("platform_masss"), "{error}");
}

#[test]
fn a_resource_outside_its_folder_is_refused() {
    for path in ["../evil.toml", "/etc/model.toml", "a//b"] {
        let error = Fmu::of::<CablePlatform>([(path, "")]).unwrap_err();
        assert!(matches!(&error, PackError::Name(name) if name == path), "{error}");
    }
}

#[test]
fn a_written_file_is_whole_and_replaces_the_older_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("with space.fmu");
    fs::write(&path, "an older file").unwrap();
    let fmu = default_fmu();
    fmu.write(&path).unwrap();
    assert!(fs::read(&path).unwrap() == fmu.to_bytes().unwrap());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
    let nowhere = folder.path().join("missing").join("a.fmu");
    let error = fmu.write(&nowhere).unwrap_err().to_string();
    assert!(error.contains("a.fmu"), "{error}");
}

/// A model with the plant's identifier and another interface.
mod other_model {
    use std::path::Path;
    use std::sync::Arc;

    use fmi2_export::description::{ModelDescription, Variable};
    use fmi2_export::{Experiment, Model, ModelError, StepError, Value};

    pub(crate) struct Other(Arc<ModelDescription>);

    impl Model for Other {
        const MODEL_IDENTIFIER: &'static str = "CablePlatform";

        fn instantiate(_resources: Option<&Path>) -> Result<Self, ModelError> {
            let mut table = ModelDescription::new("CablePlatform", "CablePlatform");
            table.add(Variable::real("u", 0).input().start(0.0));
            Ok(Self(Arc::new(table)))
        }

        fn description(&self) -> &Arc<ModelDescription> {
            &self.0
        }

        fn get(&mut self, _index: usize) -> Result<Value, ModelError> {
            Ok(Value::Real(0.0))
        }

        fn set(&mut self, _index: usize, _value: Value) -> Result<(), ModelError> {
            Ok(())
        }

        fn initialise(&mut self, _experiment: Experiment) -> Result<(), ModelError> {
            Ok(())
        }

        fn step(&mut self, _time: f64, _step: f64) -> Result<(), StepError> {
            Ok(())
        }

        fn save(&self, _out: &mut Vec<u8>) {}

        fn restore(&mut self, _bytes: &[u8]) -> Result<(), ModelError> {
            Ok(())
        }

        fn reset(&mut self) {}
    }
}
