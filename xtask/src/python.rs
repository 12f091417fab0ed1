//! The Python environment of the tests: a virtual environment in the target folder with pinned packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::project::Project;
use crate::runner::run;

/// The oldest Python that the tests are written for.
const OLDEST: (u32, u32) = (3, 11);

/// A virtual environment that has what the requirement files name.
pub(crate) struct Environment {
    folder: PathBuf,
}

impl Environment {
    /// Makes the environment, or takes the one of an earlier run if neither Python nor the requirements changed.
    pub(crate) fn prepare(project: &Project) -> Result<Self> {
        let folder = project.target.join("venv");
        let environment = Self { folder };
        let host = host_python()?;
        let stamp = stamp(project, &host)?;
        let stamp_file = environment.folder.join("made-from.txt");
        if fs::read_to_string(&stamp_file).is_ok_and(|found| found == stamp) {
            println!("{} is up to date", environment.folder.display());
            return Ok(environment);
        }
        // Removed rather than brought up to date: packages that are no longer named must not linger.
        if environment.folder.exists() {
            fs::remove_dir_all(&environment.folder)
                .with_context(|| format!("cannot remove the old {}", environment.folder.display()))?;
        }
        run(Command::new(&host.program).args(["-m", "venv"]).arg(&environment.folder))
            .context("Python's venv module is needed; Debian and Ubuntu have it as python3-venv")?;
        let mut install = environment.python();
        // What is imported is compiled then: to compile all of it takes longer than to unpack it.
        install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile"]);
        for file in requirements(project)? {
            install.arg("--requirement").arg(file);
        }
        run(&mut install)?;
        fs::write(&stamp_file, stamp).with_context(|| format!("cannot write {}", stamp_file.display()))?;
        Ok(environment)
    }

    /// The environment's interpreter.
    pub(crate) fn interpreter(&self) -> PathBuf {
        if cfg!(windows) {
            self.folder.join("Scripts").join("python.exe")
        } else {
            self.folder.join("bin").join("python")
        }
    }

    /// The folder of the shared library libclang, out of the package of that name.
    pub(crate) fn libclang(&self) -> Result<PathBuf> {
        let output = self
            .python()
            .args(["-c", "import clang, pathlib; print(pathlib.Path(clang.__path__[0]) / 'native')"])
            .output()
            .context("cannot start the environment's Python")?;
        ensure!(output.status.success(), "the Python package libclang is not installed in {}", self.folder.display());
        Ok(String::from_utf8_lossy(&output.stdout).trim().into())
    }

    /// A command that runs the environment's interpreter.
    pub(crate) fn python(&self) -> Command {
        Command::new(self.interpreter())
    }
}

struct HostPython {
    program: String,
    version: String,
}

/// What the environment depends on: a run with the same text can reuse it.
fn stamp(project: &Project, host: &HostPython) -> Result<String> {
    let mut text = format!("Python {}\n", host.version);
    for path in requirements(project)? {
        let pinned = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        text += &format!("{}\n{pinned}", path.display());
    }
    Ok(text)
}

/// The files of pinned packages: those of `tests`, its folders, and the examples, which the tests run.
fn requirements(project: &Project) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for folder in ["tests", "examples"] {
        let folder = project.root.join(folder);
        let unreadable = || format!("cannot read the folder {}", folder.display());
        files.push(folder.join("requirements.txt"));
        for entry in fs::read_dir(&folder).with_context(unreadable)? {
            files.push(entry.with_context(unreadable)?.path().join("requirements.txt"));
        }
    }
    files.retain(|file| file.is_file());
    files.sort();
    Ok(files)
}

/// The interpreter named by `PYTHON`, else the first on the path that is new enough.
fn host_python() -> Result<HostPython> {
    let named = std::env::var("PYTHON").ok();
    let candidates = match &named {
        Some(program) => vec![program.as_str()],
        None => vec!["python3", "python"],
    };
    let mut seen = Vec::new();
    for program in candidates {
        match python_version(Path::new(program)) {
            Ok((version, true)) => {
                return Ok(HostPython { program: program.to_owned(), version });
            }
            Ok((version, false)) => seen.push(format!("{program} is {version}")),
            Err(error) => seen.push(format!("{program}: {error:#}")),
        }
    }
    bail!(
        "Python {}.{} or newer is needed for the tests (PYTHON may name it); found: {}",
        OLDEST.0,
        OLDEST.1,
        seen.join("; ")
    )
}

/// The version, and whether it is new enough.
fn python_version(program: &Path) -> Result<(String, bool)> {
    let output = Command::new(program)
        .args(["-c", "import sys; print('%d.%d.%d' % sys.version_info[:3])"])
        .output()
        .context("cannot be started")?;
    ensure!(output.status.success(), "cannot tell its version");
    let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let new_enough = is_new_enough(&version).with_context(|| format!("`{version}` is no version number"))?;
    Ok((version, new_enough))
}

fn is_new_enough(version: &str) -> Option<bool> {
    let mut numbers = version.split('.').map(|number| number.parse::<u32>().ok());
    Some((numbers.next()??, numbers.next()??) >= OLDEST)
}

#[cfg(test)]
mod tests {
    use super::is_new_enough;

    #[test]
    fn versions_are_compared_as_numbers() {
        assert_eq!(is_new_enough("3.9.18"), Some(false));
        assert_eq!(is_new_enough("3.11.0"), Some(true));
        assert_eq!(is_new_enough("3.14.2"), Some(true));
        assert_eq!(is_new_enough("4.0.0"), Some(true));
        assert_eq!(is_new_enough("three"), None);
    }
}
