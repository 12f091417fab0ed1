//! A small FMI 2.0 importer, independent of the code that exports: its own reading of the archive and of
//! `modelDescription.xml`, its own declarations of the C functions.
#![allow(unsafe_code, reason = "calls into a shared library are the point of this file")]

use std::collections::BTreeMap;
use std::ffi::{CString, c_char, c_double, c_int, c_uint, c_void};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::ptr;

use anyhow::{Context, bail, ensure};
use cdpr_fmu_build::temporary::TemporaryFolder;
use libloading::Library;
use zip::ZipArchive;

type Component = *mut c_void;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> Component;
type OfComponent = unsafe extern "C" fn(Component) -> c_int;
type Free = unsafe extern "C" fn(Component);
type SetupExperiment = unsafe extern "C" fn(Component, c_int, c_double, c_double, c_int, c_double) -> c_int;
type SetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *const c_double) -> c_int;
type SetInteger = unsafe extern "C" fn(Component, *const c_uint, usize, *const c_int) -> c_int;
type GetReal = unsafe extern "C" fn(Component, *const c_uint, usize, *mut c_double) -> c_int;
type DoStep = unsafe extern "C" fn(Component, c_double, c_double, c_int) -> c_int;

/// `fmi2CallbackFunctions`, with nothing to call back: all of it is optional for an FMU with its own memory.
#[repr(C)]
struct Callbacks {
    logger: *const c_void,
    allocate_memory: *const c_void,
    free_memory: *const c_void,
    step_finished: *const c_void,
    environment: *mut c_void,
}

const CALLBACKS: Callbacks = Callbacks {
    logger: ptr::null(),
    allocate_memory: ptr::null(),
    free_memory: ptr::null(),
    step_finished: ptr::null(),
    environment: ptr::null_mut(),
};

const CO_SIMULATION: c_int = 1;

/// An enumeration variable: its value reference, and the values by name.
struct Choice {
    reference: c_uint,
    items: BTreeMap<String, c_int>,
}

/// An FMU, unpacked and loaded.
pub(super) struct Fmu {
    // Before the folder, so that the library is unloaded before its file is deleted.
    library: Library,
    guid: CString,
    resources: CString,
    /// Value references of the real variables.
    reals: BTreeMap<String, c_uint>,
    choices: BTreeMap<String, Choice>,
    _folder: TemporaryFolder,
}

impl Fmu {
    /// Unpacks and loads the FMU.
    pub(super) fn open(path: &Path) -> anyhow::Result<Self> {
        let named = || format!("{}: not a usable FMU", path.display());
        let folder = TemporaryFolder::new()?;
        let mut archive = ZipArchive::new(File::open(path).with_context(named)?).with_context(named)?;
        archive.extract(folder.path()).with_context(named)?;
        let mut xml = String::new();
        File::open(folder.path().join("modelDescription.xml"))
            .and_then(|mut file| file.read_to_string(&mut xml))
            .with_context(named)?;
        let document = roxmltree::Document::parse(&xml).with_context(named)?;
        let root = document.root_element();
        let version = root.attribute("fmiVersion").unwrap_or_default();
        ensure!(version == "2.0", "{}: FMI version {version:?}, expected \"2.0\"", path.display());
        let co_simulation = root.children().find(|node| node.has_tag_name("CoSimulation"));
        let identifier = co_simulation.and_then(|node| node.attribute("modelIdentifier")).with_context(named)?;
        let guid = root.attribute("guid").with_context(named)?;
        let reals = root
            .descendants()
            .filter(|node| node.has_tag_name("ScalarVariable"))
            .filter(|node| node.children().any(|child| child.has_tag_name("Real")))
            .map(|node| Some((node.attribute("name")?.to_owned(), node.attribute("valueReference")?.parse().ok()?)))
            .collect::<Option<BTreeMap<String, c_uint>>>()
            .with_context(named)?;
        let (system, extension) = match std::env::consts::OS {
            "windows" => ("win64", "dll"),
            "macos" => ("darwin64", "dylib"),
            _ => ("linux64", "so"),
        };
        let binary = folder.path().join("binaries").join(system).join(format!("{identifier}.{extension}"));
        // SAFETY: the library is the FMU that this program packed and checked; loading it runs no code of its own
        // beyond Rust's run-time start.
        let library = unsafe { Library::new(&binary) }.with_context(named)?;
        let place = folder.path().join("resources");
        let place = place.to_str().context("the temporary folder's name is not UTF-8")?.replace('\\', "/");
        let separator = if place.starts_with('/') { "" } else { "/" };
        Ok(Self {
            library,
            guid: CString::new(guid)?,
            resources: CString::new(format!("file://{separator}{}", place.replace('%', "%25").replace(' ', "%20")))?,
            reals,
            choices: choices(root).with_context(named)?,
            _folder: folder,
        })
    }

    /// A new instance.
    pub(super) fn instantiate(&self, name: &str) -> anyhow::Result<Slave<'_>> {
        let name = CString::new(name)?;
        let create: Instantiate = self.function("fmi2Instantiate")?;
        // SAFETY: the strings and the callbacks outlive the call (the callbacks are static), and the signature is
        // the standard's.
        let component = unsafe {
            static ONE: Shared = Shared(CALLBACKS);
            create(name.as_ptr(), CO_SIMULATION, self.guid.as_ptr(), self.resources.as_ptr(), &ONE.0, 0, 0)
        };
        ensure!(!component.is_null(), "fmi2Instantiate gave no instance");
        let mut slave = Slave {
            fmu: self,
            component,
            free: self.function("fmi2FreeInstance")?,
            set_real: self.function("fmi2SetReal")?,
            get_real: self.function("fmi2GetReal")?,
            do_step: self.function("fmi2DoStep")?,
        };
        let setup: SetupExperiment = self.function("fmi2SetupExperiment")?;
        slave.check("fmi2SetupExperiment", |c| {
            // SAFETY: a live instance, plain numbers.
            unsafe { setup(c, 0, 0.0, 0.0, 0, 0.0) }
        })?;
        Ok(slave)
    }

    /// A function of the library.
    fn function<F: Copy>(&self, name: &str) -> anyhow::Result<F> {
        // SAFETY: `F` is the standard's signature for `name` at every call in this file; the pointer is used only
        // while `self` is alive.
        let symbol = unsafe { self.library.get::<F>(name.as_bytes()) };
        Ok(*symbol.with_context(|| format!("the FMU's binary lacks {name}"))?)
    }

    fn references(&self, names: &[String]) -> anyhow::Result<Vec<c_uint>> {
        let reference = |name: &String| {
            self.reals.get(name).copied().with_context(|| format!("the FMU has no real variable `{name}`"))
        };
        names.iter().map(reference).collect()
    }
}

/// The enumeration variables of a description; `None` where it is not as the standard says.
fn choices(root: roxmltree::Node<'_, '_>) -> Option<BTreeMap<String, Choice>> {
    let with_tag = |tag: &'static str| root.descendants().filter(move |node| node.has_tag_name(tag));
    let mut list = BTreeMap::new();
    for variable in with_tag("ScalarVariable") {
        let Some(declared) = variable.children().find(|child| child.has_tag_name("Enumeration")) else { continue };
        let name = declared.attribute("declaredType")?;
        let definition = with_tag("SimpleType").find(|node| node.attribute("name") == Some(name))?;
        let items = definition
            .descendants()
            .filter(|node| node.has_tag_name("Item"))
            .map(|item| Some((item.attribute("name")?.to_owned(), item.attribute("value")?.parse().ok()?)))
            .collect::<Option<_>>()?;
        let reference = variable.attribute("valueReference")?.parse().ok()?;
        list.insert(variable.attribute("name")?.to_owned(), Choice { reference, items });
    }
    Some(list)
}

struct Shared(Callbacks);

// SAFETY: every pointer in it is null and stays so.
unsafe impl Sync for Shared {}

/// One instance of an FMU.
pub(super) struct Slave<'a> {
    fmu: &'a Fmu,
    component: Component,
    free: Free,
    set_real: SetReal,
    get_real: GetReal,
    do_step: DoStep,
}

impl Slave<'_> {
    /// How many real variables the FMU has.
    pub(super) fn variables(&self) -> usize {
        self.fmu.reals.len()
    }

    /// Through initialisation mode, to step mode at time 0.
    pub(super) fn initialise(&mut self) -> anyhow::Result<()> {
        for name in ["fmi2EnterInitializationMode", "fmi2ExitInitializationMode"] {
            let call: OfComponent = self.fmu.function(name)?;
            self.check(name, |c| {
                // SAFETY: a live instance.
                unsafe { call(c) }
            })?;
        }
        Ok(())
    }

    /// Sets a real variable.
    pub(super) fn set_real(&mut self, name: &str, value: f64) -> anyhow::Result<()> {
        let reference = self.fmu.references(&[name.to_owned()])?;
        let set = self.set_real;
        self.check("fmi2SetReal", |c| {
            // SAFETY: a live instance; one reference and one value.
            unsafe { set(c, reference.as_ptr(), 1, &value) }
        })
    }

    /// Sets an enumeration variable to the item of this name.
    pub(super) fn set_choice(&mut self, name: &str, item: &str) -> anyhow::Result<()> {
        let choice = self.fmu.choices.get(name).with_context(|| format!("the FMU has no choice `{name}`"))?;
        let value = *choice.items.get(item).with_context(|| format!("`{name}` has no item `{item}`"))?;
        let (reference, set) = (choice.reference, self.fmu.function::<SetInteger>("fmi2SetInteger")?);
        self.check("fmi2SetInteger", |c| {
            // SAFETY: a live instance; one reference and one value.
            unsafe { set(c, &reference, 1, &value) }
        })
    }

    /// Reads real variables.
    pub(super) fn get_reals(&mut self, names: &[String]) -> anyhow::Result<Vec<f64>> {
        let references = self.fmu.references(names)?;
        let mut values = vec![0.0; names.len()];
        let get = self.get_real;
        self.check("fmi2GetReal", |c| {
            // SAFETY: a live instance; as many references as there is room for values.
            unsafe { get(c, references.as_ptr(), references.len(), values.as_mut_ptr()) }
        })?;
        Ok(values)
    }

    /// One communication step from `time`.
    pub(super) fn step(&mut self, time: f64, step: f64) -> anyhow::Result<()> {
        let go = self.do_step;
        self.check("fmi2DoStep", |c| {
            // SAFETY: a live instance, plain numbers.
            unsafe { go(c, time, step, 1) }
        })
    }

    /// Calls, and turns a status beyond a warning into an error.
    fn check(&mut self, name: &str, call: impl FnOnce(Component) -> c_int) -> anyhow::Result<()> {
        match call(self.component) {
            0 | 1 => Ok(()),
            2 => bail!("{name} discarded the step"),
            status => bail!("{name} failed with status {status}"),
        }
    }
}

impl Drop for Slave<'_> {
    fn drop(&mut self) {
        // SAFETY: the instance is live until here, and nobody uses it after.
        unsafe { (self.free)(self.component) }
    }
}
