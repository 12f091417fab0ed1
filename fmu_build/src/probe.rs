//! Loads a binary for this machine, as an importer would, and makes one instance with it.
//!
//! The only module here with `unsafe`: calling a C library needs it.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::fs;
use std::path::Path;
use std::ptr;
use std::sync::Mutex;

use libloading::Library;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use crate::temporary::TemporaryFolder;
use crate::{Binary, FUNCTIONS, PackError};

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: c_int = 1;

/// What a `file:` URI may hold unescaped in a path.
const PATH: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'-').remove(b'.').remove(b'_').remove(b'~').remove(b':');

/// `fmi2CallbackFunctions`. The logger is variadic in C; this program's reads the fixed arguments only, which
/// come by the same registers.
#[repr(C)]
struct Callbacks {
    logger: extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char),
    allocate_memory: Option<extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<extern "C" fn(*mut c_void)>,
    step_finished: Option<extern "C" fn(*mut c_void, c_int)>,
    component_environment: *mut c_void,
}

type GetText = unsafe extern "C" fn() -> *const c_char;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> *mut c_void;
type FreeInstance = unsafe extern "C" fn(*mut c_void);

/// Loads the binary, looks every function up, asks for its version and makes one instance with the
/// description's GUID and the unpacked resources.
///
/// # Errors
/// [`PackError::MissingFunctions`], or [`PackError::DoesNotRun`] with the binary's own messages.
pub(crate) fn check(binary: &Binary, guid: &str, resources: &Path) -> Result<(), PackError> {
    let platform = binary.platform();
    let loaded = Loaded::of(binary)?;
    let does_not_run = |found: String| PackError::DoesNotRun { platform: platform.folder(), found };
    let library = loaded.library.as_ref().map_err(|error| {
        does_not_run(format!("it cannot be loaded from {}: {}", loaded.folder.path().display(), said(error)))
    })?;
    let missing: Vec<_> = FUNCTIONS
        .into_iter()
        // SAFETY: the address is looked up and not used.
        .filter(|name| unsafe { library.get::<*const c_void>(*name) }.is_err())
        .collect();
    if !missing.is_empty() {
        return Err(PackError::MissingFunctions { platform: platform.folder(), missing });
    }
    make_an_instance(library, guid, resources).map_err(does_not_run)
}

/// Loads a binary that is known to work and lets it go, to see whether temporary files can be loaded at all.
///
/// # Errors
/// [`PackError::TemporaryFolder`].
pub(crate) fn try_folder(binary: &Binary) -> Result<(), PackError> {
    Loaded::of(binary)?.library.map(drop).map_err(|error| PackError::TemporaryFolder {
        folder: std::env::temp_dir(),
        found: format!("a library cannot be loaded from there, as where it is mounted noexec: {}", said(&error)),
    })
}

/// What the system said of a library that was not loaded.
fn said(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}

/// A binary in a temporary folder, and the library loaded from there.
struct Loaded {
    // Before the folder, so that the library is unloaded before its file is deleted.
    library: Result<Library, libloading::Error>,
    folder: TemporaryFolder,
}

impl Loaded {
    fn of(binary: &Binary) -> Result<Self, PackError> {
        let folder = TemporaryFolder::new()?;
        let file = folder.path().join(format!("probe.{}", binary.platform().extension()));
        fs::write(&file, binary.bytes()).map_err(PackError::file(&file))?;
        // SAFETY: loading runs the library's initialisers. A packed binary is one that importers are to run, on
        // this machine too; whoever packs it trusts it that far.
        let library = unsafe { Library::new(&file) };
        Ok(Self { library, folder })
    }
}

fn make_an_instance(library: &Library, guid: &str, resources: &Path) -> Result<(), String> {
    for (name, expected) in [("fmi2GetVersion", "2.0"), ("fmi2GetTypesPlatform", "default")] {
        // SAFETY: FMI 2.0 declares both as `const char* f(void)`, with a static text as result.
        let found = unsafe {
            let function = library.get::<GetText>(name).map_err(|e| e.to_string())?;
            text(function())
        };
        if found != expected {
            return Err(format!("{name} answers `{found}`, expected `{expected}`"));
        }
    }
    // SAFETY: the types are those of FMI 2.0's header fmi2FunctionTypes.h.
    let (instantiate, free_instance) = unsafe {
        (
            library.get::<Instantiate>("fmi2Instantiate").map_err(|e| e.to_string())?,
            library.get::<FreeInstance>("fmi2FreeInstance").map_err(|e| e.to_string())?,
        )
    };
    let messages = Mutex::new(Vec::<String>::new());
    let callbacks = Callbacks {
        logger: keep_message,
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: ptr::from_ref(&messages).cast_mut().cast(),
    };
    let guid = CString::new(guid).map_err(|error| error.to_string())?;
    let location = CString::new(file_uri(resources)).map_err(|error| error.to_string())?;
    // SAFETY: all texts end with a zero and, like the callbacks and the list behind them, live until
    // after fmi2FreeInstance, which is called once and only with what fmi2Instantiate returned.
    let made = unsafe {
        let instance = instantiate(
            c"packing".as_ptr(),
            CO_SIMULATION,
            guid.as_ptr(),
            location.as_ptr(),
            &raw const callbacks,
            0,
            1,
        );
        if !instance.is_null() {
            free_instance(instance);
        }
        !instance.is_null()
    };
    if made {
        return Ok(());
    }
    let messages = messages.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    Err(if messages.is_empty() {
        "fmi2Instantiate returned null and logged nothing".into()
    } else {
        format!("fmi2Instantiate returned null: {}", messages.join("; "))
    })
}

/// The logger: appends the message to the list behind `environment`.
extern "C" fn keep_message(
    environment: *mut c_void,
    _instance: *const c_char,
    _status: c_int,
    _category: *const c_char,
    message: *const c_char,
) {
    if environment.is_null() {
        return;
    }
    // SAFETY: the environment is the address of the list in `make_an_instance`, alive while the binary can
    // call; FMI 2.0 passes a message that ends with a zero.
    let (messages, message) = unsafe {
        let messages = &*environment.cast_const().cast::<Mutex<Vec<String>>>();
        (messages, text(message))
    };
    if let Ok(mut messages) = messages.lock() {
        // The message is a printf format; a percent sign of its own comes doubled.
        messages.push(message.replace("%%", "%"));
    }
}

/// # Safety
/// `text` is null, or ends with a zero.
unsafe fn text(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: as this function demands.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

/// `file:///...`, percent-encoded.
fn file_uri(path: &Path) -> String {
    let path = path.to_string_lossy().replace('\\', "/");
    let rooted = if path.starts_with('/') { "" } else { "/" };
    format!("file://{rooted}{}", utf8_percent_encode(&path, PATH))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uri_is_encoded() {
        let uri = file_uri(Path::new("/tmp/a b/\u{fc}%"));
        assert_eq!(uri, "file:///tmp/a%20b/%C3%BC%25");
        assert_eq!(file_uri(Path::new("C:\\a")), "file:///C:/a");
    }
}
