//! The parts of an FMU, and packing them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::archive::{self, Files, is_plain_path};
use crate::documentation::{self, Section};
use crate::temporary::TemporaryFolder;
use crate::{Binary, PackError, Platform, probe, whole_file, xml_check};
use fmi2_export::Model;
use fmi2_export::description::ModelDescription;

/// An FMU to be packed: a model's description and everything that goes into the file with it.
///
/// ```no_run
/// # fn pack<M: fmi2_export::Model>() -> Result<(), cdpr_fmu_build::PackError> {
/// use cdpr_fmu_build::{Binary, Fmu, Platform};
///
/// let library = Binary::read(Platform::Linux64, "target/release/libmodel.so".as_ref())?;
/// Fmu::of::<M>([("model.toml", "mass = 1.0")])?
///     .binary(library)?
///     .write("Model.fmu".as_ref())?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Fmu {
    description: ModelDescription,
    resources: Files,
    binaries: BTreeMap<Platform, Binary>,
    sections: Vec<Section>,
    licences: Files,
    icon: Option<Vec<u8>>,
}

impl Fmu {
    /// The FMU of a model with these files in `resources/`: path (relative, with `/`) and content.
    ///
    /// The model is made from those files once, as an importer would, to learn its description.
    ///
    /// # Errors
    /// [`PackError::Name`], [`PackError::Model`] or [`PackError::Description`].
    pub fn of<M: Model>(
        resources: impl IntoIterator<Item = (impl Into<String>, impl Into<Vec<u8>>)>,
    ) -> Result<Self, PackError> {
        let mut files = Files::new();
        for (path, content) in resources {
            insert(&mut files, path.into(), content.into())?;
        }
        let folder = unpacked(&files)?;
        let description = ModelDescription::clone(M::instantiate(Some(folder.path()))?.description());
        description.validate()?;
        Ok(Self {
            description,
            resources: files,
            binaries: BTreeMap::new(),
            sections: Vec::new(),
            licences: Files::new(),
            icon: None,
        })
    }

    /// Adds the binary for one platform.
    ///
    /// # Errors
    /// [`PackError::TwoBinaries`] if that platform has one.
    pub fn binary(mut self, binary: Binary) -> Result<Self, PackError> {
        let platform = binary.platform();
        if self.binaries.insert(platform, binary).is_some() {
            return Err(PackError::TwoBinaries(platform.folder()));
        }
        Ok(self)
    }

    /// Adds a section to the documentation, after those added before.
    #[must_use]
    pub fn section(mut self, title: &str, html: &str) -> Self {
        self.sections.push(Section { title: title.into(), html: html.into() });
        self
    }

    /// Adds a licence text, as `documentation/licenses/NAME`.
    ///
    /// # Errors
    /// [`PackError::Name`] if the name is taken or no file name.
    pub fn licence(mut self, name: &str, text: &str) -> Result<Self, PackError> {
        insert(&mut self.licences, name.into(), text.into())?;
        Ok(self)
    }

    /// Sets the picture that tools show for the FMU: a PNG file's content, square, 100 pixels or more.
    #[must_use]
    pub fn icon(mut self, png: &[u8]) -> Self {
        self.icon = Some(png.to_vec());
        self
    }

    /// The model's description.
    #[must_use]
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// The content of `modelDescription.xml`.
    #[must_use]
    pub fn xml(&self) -> String {
        self.description.to_xml()
    }

    /// Checks everything and packs it; see [`Fmu::write`].
    ///
    /// # Errors
    /// Whatever does not hold together.
    pub fn to_bytes(&self) -> Result<Vec<u8>, PackError> {
        let xml = self.xml();
        let identifier = &self.description.model_identifier;
        let problems = xml_check::problems(&xml, identifier);
        if !problems.is_empty() {
            return Err(PackError::Xml(problems));
        }
        if self.binaries.is_empty() {
            return Err(PackError::NoBinary);
        }
        let folder = unpacked(&self.resources)?;
        for binary in self.binaries.values().filter(|binary| binary.runs_here()) {
            probe::check(binary, &self.description.guid(), folder.path())?;
        }
        archive::to_bytes(&self.files(xml)?)
    }

    /// Checks everything and writes the `.fmu`, whole or not at all. An existing file is replaced.
    ///
    /// A binary that can run on this machine is loaded, and one instance is made with it.
    ///
    /// # Errors
    /// Whatever does not hold together, or [`PackError::File`] where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), PackError> {
        whole_file::write(path, &self.to_bytes()?).map_err(PackError::file(path))
    }

    /// Every file of the archive.
    fn files(&self, xml: String) -> Result<Files, PackError> {
        let identifier = &self.description.model_identifier;
        let licences: Vec<&str> = self.licences.keys().map(String::as_str).collect();
        let binaries: Vec<String> = self.binaries.values().map(Binary::label).collect();
        let page = documentation::index(&self.description, &self.sections, &binaries, &licences)?;
        let mut files = Files::new();
        files.insert("modelDescription.xml".into(), xml.into());
        files.insert("documentation/index.html".into(), page.into());
        for (name, text) in &self.licences {
            files.insert(format!("documentation/licenses/{name}"), text.clone());
        }
        for (platform, binary) in &self.binaries {
            let (folder, extension) = (platform.folder(), platform.extension());
            let path = format!("binaries/{folder}/{identifier}.{extension}");
            files.insert(path, binary.bytes().to_vec());
        }
        for (path, content) in &self.resources {
            files.insert(format!("resources/{path}"), content.clone());
        }
        if let Some(icon) = &self.icon {
            files.insert("model.png".into(), icon.clone());
        }
        Ok(files)
    }
}

fn insert(files: &mut Files, path: String, content: Vec<u8>) -> Result<(), PackError> {
    if !is_plain_path(&path) || files.contains_key(&path) {
        return Err(PackError::Name(path));
    }
    files.insert(path, content);
    Ok(())
}

/// The files in a temporary folder.
fn unpacked(files: &Files) -> Result<TemporaryFolder, PackError> {
    let folder = TemporaryFolder::new()?;
    for (path, content) in files {
        let file = folder.path().join(path);
        if let Some(above) = file.parent() {
            fs::create_dir_all(above).map_err(PackError::file(above))?;
        }
        fs::write(&file, content).map_err(PackError::file(&file))?;
    }
    Ok(folder)
}
