//! Resource locations in the forms that masters send; the oscillator reads its start from a file there.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::ptr;

use fmi2_export::description::ModelDescription;

use crate::harness::*;
use crate::oscillator::{Oscillator, index};

/// A folder with a start position in it, removed at the end.
struct Resources(PathBuf);

impl Resources {
    fn new(name: &str, start: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("start.txt"), start).unwrap();
        Self(folder)
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for Resources {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The description that belongs to a start position.
fn table_from(start: f64) -> ModelDescription {
    let mut table = Oscillator::table();
    table.variables[index::X] = table.variables[index::X].clone().start(start);
    table
}

/// The start position that an instance with this location has, or the messages.
fn start_from(location: Option<&str>, guid: &str) -> Result<(f64, Vec<Logged>), Vec<Logged>> {
    let log = new_log();
    let functions = callbacks(Some(log));
    let location = location.map(|l| CString::new(l).unwrap());
    let guid = CString::new(guid).unwrap();
    let taken = || std::mem::take(&mut *log.lock().unwrap());
    // SAFETY: sound pointers, or null for the location.
    unsafe {
        let c = fmi2Instantiate(
            c"located".as_ptr(),
            1,
            guid.as_ptr(),
            location.as_ref().map_or(ptr::null(), |l| l.as_ptr()),
            &raw const functions,
            0,
            1,
        );
        if c.is_null() {
            return Err(taken());
        }
        assert_eq!(OK, fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0));
        assert_eq!(OK, fmi2EnterInitializationMode(c));
        let mut value = f64::NAN;
        assert_eq!(OK, fmi2GetReal(c, &vr::X, 1, &raw mut value));
        fmi2FreeInstance(c);
        Ok((value, taken()))
    }
}

fn percent_encoded(path: &str) -> String {
    path.bytes()
        .map(|b| match b {
            b'/' | b'-' | b'_' | b'.' => char::from(b).to_string(),
            b if b.is_ascii_alphanumeric() => char::from(b).to_string(),
            b => format!("%{b:02X}"),
        })
        .collect()
}

#[test]
fn every_form_of_a_location_is_found() {
    let guid = table_from(0.625).guid();
    for name in ["plain", "with blanks", "größe-\u{65e5}\u{672c}", "100%41"] {
        let resources = Resources::new(name, "0.625\n");
        let (raw, encoded) = (resources.path(), percent_encoded(resources.path()));
        for location in [
            format!("file://{encoded}"),
            format!("file://{encoded}/"),
            format!("file:{encoded}"),
            format!("file:///{encoded}"),
            format!("file://localhost{encoded}"),
            format!("FILE://{encoded}"),
            format!("file://{raw}"),
            format!("file:{raw}/"),
            raw.to_owned(),
            format!("{raw}/"),
        ] {
            let (start, log) = start_from(Some(&location), &guid).expect(&location);
            assert_eq!((start, log), (0.625, vec![]), "{location}");
        }
    }
}

#[test]
fn without_a_location_the_defaults_serve() {
    let guid = Oscillator::table().guid();
    assert_eq!(start_from(None, &guid), Ok((1.0, vec![])));
    assert_eq!(start_from(Some(""), &guid), Ok((1.0, vec![])));
}

#[test]
fn a_location_that_leads_nowhere_is_told() {
    let guid = Oscillator::table().guid();
    for (location, expected, status) in [
        ("file:///no/such/folder", "no such folder", OK),
        ("https://a.example/resources", "`https:`", WARNING),
        ("file://elsewhere/share", "another host, `elsewhere`", WARNING),
    ] {
        let (start, log) = start_from(Some(location), &guid).unwrap();
        assert_eq!(start, 1.0);
        assert_eq!((log.len(), log[0].status), (1, status));
        assert!(log[0].text.contains(expected), "{}", log[0].text);
    }
}

#[test]
fn resources_that_do_not_fit_are_refused() {
    let broken = Resources::new("broken", "half past");
    let log = start_from(Some(broken.path()), &Oscillator::table().guid()).unwrap_err();
    assert!(log[0].text.contains("expected a number, found `half past`"), "{}", log[0].text);
    assert!(log[0].text.contains("start.txt"));

    let other = Resources::new("other", "0.5");
    let log = start_from(Some(other.path()), &Oscillator::table().guid()).unwrap_err();
    assert!(log[0].text.contains("does not match"), "{}", log[0].text);
    assert!(Path::new(other.path()).is_dir());
}

/// Whoever edits a file in `resources` meets the GUID check; the message says what to do, and where it looked.
#[test]
fn changed_resources_are_told_with_their_folder_and_the_way_out() {
    let changed = Resources::new("changed", "0.5");
    let log = start_from(Some(changed.path()), &Oscillator::table().guid()).unwrap_err();
    for part in [changed.path(), "where these were changed, pack the FMU anew"] {
        assert!(log[0].text.contains(part), "{part}: {}", log[0].text);
    }
    let log = start_from(None, "{00000000-0000-0000-0000-000000000000}").unwrap_err();
    assert!(log[0].text.contains("no usable fmuResourceLocation was given"), "{}", log[0].text);
}
